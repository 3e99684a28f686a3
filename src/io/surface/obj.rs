//! Wavefront `.obj`: vertices, and faces of the materials that other files hold. Polygons become
//! fans of triangles. Everything but `v`, `vn`, `f`, `s`, `usemtl` and `mtllib` is skipped. Without
//! normals, edges are smooth up to an angle, unless the file turns smoothing off.

use glam::Vec3;

use super::input::Input;
use super::mtl::{Materials, number, split, words};
use super::{counted, name_of, without_unused};
use crate::error::Result;
use crate::error::memory;
use crate::surface::Mesh;

/// First words of lines.
const WORDS: [&[u8]; 27] = [
    b"v",
    b"vn",
    b"vt",
    b"vp",
    b"f",
    b"fo",
    b"l",
    b"p",
    b"o",
    b"g",
    b"s",
    b"mg",
    b"mtllib",
    b"usemtl",
    b"usemap",
    b"maplib",
    b"shadow_obj",
    b"trace_obj",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"cstype",
    b"deg",
    b"curv",
    b"surf",
    b"end",
];

/// The largest angle in degrees between triangles whose edge is smooth, in files without normals.
const CREASE_DEGREES: f64 = 40.0;

/// In a corner: it has no normal.
const NO_NORMAL: u32 = u32::MAX;

/// Lines that a file is recognised by.
const FIRST_LINES: usize = 3;

/// Whether a file that begins with `start` is one: text, and its first lines that are no comments
/// begin with known words.
pub(super) fn recognizes(start: &[u8]) -> bool {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    let lines = start.split(|&byte| byte == b'\n').map(|line| split(line).0);
    let mut words = lines.filter(|word| !word.is_empty() && !word.starts_with(b"#")).peekable();
    let is_text = !start.contains(&0) && words.peek().is_some();
    is_text && words.take(FIRST_LINES).all(|word| WORDS.contains(&word))
}

/// What has been read.
#[derive(Default)]
struct Faces {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    /// The normals of the triangles' corners.
    normals_of: Vec<[u32; 3]>,
    /// Whether smoothing is turned off, and nowhere on.
    is_flat: Option<bool>,
    material_of: Vec<u32>,
    material: Option<u32>,
    /// The largest vertex that did not exist when it was named, and the line that names it.
    farthest: Option<(u32, usize)>,
    /// Faces of fewer than three vertices.
    short: usize,
    /// Lines, points and curved surfaces.
    others: usize,
}

pub(super) fn read(input: &mut Input) -> Result<Mesh> {
    let bytes = input.whole(input.path)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let mut materials = Materials::of(input, bytes)?;
    let mut faces = Faces::default();
    let mut joined: Vec<u8> = Vec::new();
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let line = line.trim_ascii();
        let comment = line.starts_with(b"#") && joined.is_empty();
        let part = line.strip_suffix(b"\\").filter(|_| !comment);
        if part.is_none() && joined.is_empty() {
            faces.line(input, &mut materials, line, index + 1)?;
            continue;
        }
        memory::grow(&mut joined, line.len() + 1, "a line")?;
        joined.extend_from_slice(part.unwrap_or(line));
        joined.push(b' ');
        if part.is_none() {
            faces.line(input, &mut materials, &joined, index + 1)?;
            joined.clear();
        }
    }
    if !joined.is_empty() {
        let last = bytes.split(|&byte| byte == b'\n').count();
        faces.line(input, &mut materials, &joined, last)?;
    }
    let normals = faces.corner_normals(input)?;
    let is_flat = faces.is_flat == Some(true);
    let Faces { positions, mut triangles, material_of, farthest, short, others, .. } = faces;
    if let Some((vertex, line)) = farthest.filter(|(last, _)| *last as usize >= positions.len()) {
        let (vertex, count) = (u64::from(vertex) + 1, positions.len());
        return Err(input.bad(format!("line {line}: vertex {vertex} of {count}")));
    }
    if short > 0 {
        let count = counted(short, "face");
        input.notes.push(format!("{count} of fewer than three vertices and left out"));
    }
    if others > 0 {
        let count = counted(others, "element");
        input.notes.push(format!("{count} left out: lines, points or curved surfaces"));
    }
    materials.note(&mut input.notes);
    input.take(4 * positions.len() as u64, "vertices")?;
    let positions = without_unused(positions, &mut triangles)?;
    let mut smooths = normals.is_none() && !is_flat;
    // Of each corner its place, its neighbours and its normal.
    if smooths && input.take(512 * triangles.len() as u64, "normals").is_err() {
        input.notes.push("its edges are not smoothed, which would take too much memory".to_owned());
        smooths = false;
    }
    let name = name_of(input.path);
    let mesh = Mesh::new(name, positions, triangles, materials.list, material_of, normals)
        .map_err(|error| input.bad(error.to_string()))?;
    Ok(if smooths { mesh.smoothed(CREASE_DEGREES) } else { mesh })
}

impl Faces {
    fn line(
        &mut self,
        input: &mut Input,
        materials: &mut Materials,
        line: &[u8],
        at: usize,
    ) -> Result<()> {
        let (word, rest) = split(line);
        match word {
            b"v" => self.vertex(input, rest, at),
            b"vn" => self.normal(input, rest),
            b"s" => {
                let off = matches!(rest.trim_ascii(), b"off" | b"0");
                self.is_flat = Some(off && self.is_flat != Some(false));
                Ok(())
            }
            b"f" | b"fo" => self.face(input, materials, rest, at),
            b"usemtl" => {
                self.material = Some(materials.index(input, rest.trim_ascii_end())?);
                Ok(())
            }
            b"l" | b"p" | b"curv" | b"surf" => {
                self.others += 1;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Three numbers. A weight or a colour may follow.
    fn vertex(&mut self, input: &mut Input, rest: &[u8], at: usize) -> Result<()> {
        let mut numbers = words(rest);
        let mut next = || numbers.next().and_then(number::<f32>);
        let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
            return Err(input.bad(format!("line {at}: '{}' is not three numbers", shown(rest))));
        };
        if u32::try_from(self.positions.len()).is_err() {
            return Err(input.bad(format!("line {at}: its vertices exceed 32 bits")));
        }
        input.take(size_of::<Vec3>() as u64, "vertices")?;
        memory::grow(&mut self.positions, 1, "vertices")?;
        self.positions.push(Vec3::new(x, y, z));
        Ok(())
    }

    /// Three numbers. What is none has no direction, and its triangles keep their own.
    fn normal(&mut self, input: &mut Input, rest: &[u8]) -> Result<()> {
        let mut numbers = words(rest);
        let mut next = || numbers.next().and_then(number::<f32>).unwrap_or(0.0);
        let normal = Vec3::new(next(), next(), next());
        input.take(size_of::<Vec3>() as u64, "normals")?;
        memory::grow(&mut self.normals, 1, "normals")?;
        self.normals.push(normal);
        Ok(())
    }

    /// The normals at the corners of all triangles; `None` if there are none.
    fn corner_normals(&self, input: &mut Input) -> Result<Option<Vec<[Vec3; 3]>>> {
        if self.normals.is_empty() || self.normals_of.iter().flatten().all(|&i| i == NO_NORMAL) {
            return Ok(None);
        }
        input.take(self.triangles.len() as u64 * size_of::<[Vec3; 3]>() as u64, "normals")?;
        let of = |index: u32| self.normals.get(index as usize).copied().unwrap_or_default();
        let all = self.normals_of.iter().map(|corners| corners.map(of));
        memory::collected(all, "normals").map(Some)
    }

    fn face(
        &mut self,
        input: &mut Input,
        materials: &mut Materials,
        rest: &[u8],
        at: usize,
    ) -> Result<()> {
        let mut first = None;
        let mut last = None;
        let mut corners = 0_usize;
        for word in words(rest) {
            let corner = (self.corner(input, word, at)?, self.normal_at(word));
            corners += 1;
            if let (Some(first), Some(last)) = (first, last) {
                let material = match self.material {
                    Some(material) => material,
                    None => materials.index(input, b"")?,
                };
                self.material = Some(material);
                input.take(size_of::<[u32; 7]>() as u64, "triangles")?;
                memory::grow(&mut self.triangles, 1, "triangles")?;
                memory::grow(&mut self.material_of, 1, "triangles")?;
                memory::grow(&mut self.normals_of, 1, "triangles")?;
                let corners: [(u32, u32); 3] = [first, last, corner];
                self.triangles.push(corners.map(|(vertex, _)| vertex));
                self.normals_of.push(corners.map(|(_, normal)| normal));
                self.material_of.push(material);
            }
            match first {
                None => first = Some(corner),
                Some(_) => last = Some(corner),
            }
        }
        self.short += usize::from(corners < 3);
        Ok(())
    }

    /// The index of the normal in a word such as `7//3` or `7/2/-1`.
    fn normal_at(&self, word: &[u8]) -> u32 {
        let own = word.split(|&byte| byte == b'/').nth(2).and_then(number::<i64>);
        let index = own.and_then(|said| match said {
            0 => None,
            1.. => said.checked_sub(1),
            _ => said.checked_add(self.normals.len() as i64),
        });
        index.and_then(|index| u32::try_from(index).ok()).unwrap_or(NO_NORMAL)
    }

    /// The index of the vertex in a word such as `7`, `7/2`, `7//3` or `-1`: from 1, or backwards
    /// from the latest vertex.
    fn corner(&mut self, input: &Input, word: &[u8], at: usize) -> Result<u32> {
        let own = word.split(|&byte| byte == b'/').next().unwrap_or_default();
        let Some(said) = number::<i64>(own) else {
            return Err(input.bad(format!("line {at}: '{}' is not a vertex", shown(word))));
        };
        let count = self.positions.len();
        let index = if said < 0 { said.checked_add(count as i64) } else { said.checked_sub(1) };
        // The largest index is kept free.
        let index = index.and_then(|index| u32::try_from(index).ok()).filter(|i| *i < u32::MAX);
        let Some(index) = index else {
            return Err(input.bad(format!("line {at}: vertex {said} of {count}")));
        };
        if index as usize >= count && self.farthest.is_none_or(|(known, _)| index > known) {
            self.farthest = Some((index, at));
        }
        Ok(index)
    }
}

/// A part of a line, as an error quotes it.
fn shown(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).chars().take(60).collect()
}
