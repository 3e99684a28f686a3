//! `.tfx`, the format of AMD's TressFX 4: a header of 160 bytes with the places of arrays. All
//! strands have the same number of points.

use glam::{DVec3, Vec3};

use super::input::{Clamp, Input, f32_of, u32_of, vectors};
use super::name_of;
use crate::error::Result;
use crate::error::memory;
use crate::surface::{Strands, Varying};

const HEADER: usize = 160;
const VERSION: f32 = 4.0;

/// The opacity of a crossing, which the format does not hold.
const OPACITY: f32 = 0.5;

/// The reflectance of strands without colours.
const ALBEDO: Vec3 = Vec3::splat(0.7);

/// The largest thickness that is chosen, in diagonals of the strands' box.
const THICKEST: f64 = 1.0 / 200.0;

struct Header {
    strands: u64,
    /// Vertices of each strand.
    vertices: u64,
    /// Offsets of the arrays; 0 for those that are not there.
    offsets: [u64; 5],
}

/// The arrays: whether they have an item for each vertex, not for each strand, and the bytes of one.
/// Positions, texture coordinates of strands and of vertices, thicknesses, colours.
const ARRAYS: [(bool, u64); 5] = [(true, 16), (false, 8), (true, 8), (false, 4), (true, 16)];
const POSITIONS: usize = 0;
const THICKNESS: usize = 3;
const COLOR: usize = 4;

impl Header {
    /// `None` if `start` is too short or has another version.
    fn of(start: &[u8]) -> Option<Self> {
        let start = start.get(..HEADER)?;
        if f32_of(start) != VERSION {
            return None;
        }
        let number = |index: usize| u64::from(u32_of(&start[4 * index..]));
        let offsets = [3, 4, 5, 6, 7].map(number);
        Some(Self { strands: number(1), vertices: number(2), offsets })
    }

    fn points(&self) -> u64 {
        self.strands * self.vertices
    }

    /// Bytes of an array.
    fn bytes(&self, array: usize) -> u128 {
        let (per_vertex, size) = ARRAYS[array];
        let count = if per_vertex { self.points() } else { self.strands };
        u128::from(count) * u128::from(size)
    }

    /// Where the last array ends.
    fn end(&self) -> u128 {
        let arrays = (0..ARRAYS.len()).filter(|&array| self.offsets[array] != 0);
        arrays.map(|array| u128::from(self.offsets[array]) + self.bytes(array)).max().unwrap_or(0)
    }
}

/// Whether a file of `size` bytes that begins with `start` is one: there is no magic number, but the
/// version, and counts that agree with the size or else a header without anything unexpected.
pub(super) fn recognizes(start: &[u8], size: u64) -> bool {
    let Some(header) = Header::of(start) else { return false };
    let places = header.offsets[POSITIONS] >= HEADER as u64 && header.points() > 0;
    let reserved = start[32..HEADER].iter().all(|&byte| byte == 0);
    let usual = header.offsets[POSITIONS] == HEADER as u64 && reserved;
    places && (header.end() == u128::from(size) || usual)
}

pub(super) fn read(input: &mut Input) -> Result<Strands> {
    // The file, and the arrays that are made of it.
    input.take(input.size, "hair")?;
    let bytes = input.whole(input.path)?;
    let Some(header) = Header::of(&bytes) else {
        return Err(input.bad("it has no header of TressFX 4"));
    };
    if let Some(offset) = header.offsets.iter().find(|&&at| at != 0 && at < HEADER as u64) {
        return Err(input.bad(format!("an array at byte {offset}, within the header")));
    }
    let Header { strands, vertices, .. } = header;
    if header.offsets[POSITIONS] == 0 || header.points() == 0 {
        return Err(input.bad(format!("{strands} strands of {vertices} vertices, or no positions")));
    }
    if header.end() != bytes.len() as u128 {
        let (due, size) = (header.end(), bytes.len());
        let why =
            format!("{strands} strands of {vertices} vertices take {due} bytes, but it has {size}");
        return Err(input.bad(why));
    }
    let array = |array: usize| {
        let begin = header.offsets[array] as usize;
        (begin != 0).then(|| &bytes[begin..begin + header.bytes(array) as usize])
    };
    let points = vectors(array(POSITIONS).unwrap_or_default(), 16, "points")?;
    let thickness = match array(THICKNESS) {
        Some(numbers) => {
            let mut all = memory::room(points.len(), "thicknesses")?;
            for number in numbers.chunks_exact(4) {
                all.extend((0..vertices).map(|_| f32_of(number)));
            }
            Varying::PerPoint(all)
        }
        None => {
            let thickness = chosen_thickness(&points, vertices as usize);
            input.notes.push(format!(
                "its strands have no thickness; {thickness} is assumed, set `hair.thickness`"
            ));
            Varying::Same(thickness)
        }
    };
    let mut outside = Clamp::default();
    let albedo = match array(COLOR) {
        Some(colors) => {
            let mut colors = vectors(colors, 16, "colours")?;
            outside.colors(&mut colors);
            Varying::PerPoint(colors)
        }
        None => Varying::Same(ALBEDO),
    };
    outside.note("colours", &mut input.notes);
    let note = format!("its strands have no opacity; {OPACITY} is assumed, set `hair.opacity`");
    input.notes.push(note);
    let counts = memory::filled(strands as usize, vertices as u32, "strands")?;
    let opacity = Varying::Same(OPACITY);
    Strands::new(name_of(input.path), points, &counts, thickness, opacity, albedo)
        .map_err(|error| input.bad(error.to_string()))
}

/// A thickness for strands of so many points each: a ray through their box meets one strand on
/// average, but a strand is at most 1/200 as thick as the box's diagonal is long.
///
/// Seen from all directions, a box shows a quarter of its surface on average, and a thin cylinder a
/// quarter of its own, pi times thickness times length (Cauchy's formula).
fn chosen_thickness(points: &[Vec3], each: usize) -> f32 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut length = 0.0;
    for strand in points.chunks_exact(each.max(1)) {
        if strand.iter().all(|point| point.is_finite()) {
            for point in strand {
                (min, max) = (min.min(point.as_dvec3()), max.max(point.as_dvec3()));
            }
            let pairs = strand.windows(2);
            length += pairs.map(|p| p[0].as_dvec3().distance(p[1].as_dvec3())).sum::<f64>();
        }
    }
    let size = (max - min).max(DVec3::ZERO);
    let surface = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    let thickest = THICKEST * size.length();
    let even = surface / (std::f64::consts::PI * length);
    // A box without surface has no better measure than its diagonal.
    let thickness = if even > 0.0 { even.min(thickest) } else { thickest };
    if thickness.is_finite() { thickness as f32 } else { 0.0 }
}
