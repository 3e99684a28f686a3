//! Files with surfaces: hair (`.hair`, `.tfx`) and meshes (`.obj`, `.gltf`, `.glb`). Each format
//! has a module that reads it, and two have one that writes it; this one has what they share. Positions are those of the file, in
//! its own unit and axes. Knows nothing of rendering.
//!
//! Whatever the bytes are, memory is bounded by a limit, and by the bytes of the file before they
//! are believed.

mod gltf;
mod gltf_accessor;
mod gltf_buffers;
mod gltf_scene;
mod gltf_write;
mod hair;
mod hair_write;
mod input;
mod mtl;
mod obj;
mod tfx;

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::dense::DEFAULT_MAX_BYTES;
use super::files;
use super::format::Format;
use super::options::ReadOptions;
use crate::error::memory;
use crate::error::{Error, Result};
use crate::surface::{Mesh, Strands};
use crate::volume::Axis;
pub use gltf_write::encode_gltf;
pub use hair_write::encode_hair;
use input::Input;

/// What a file of a surface holds.
#[derive(Clone, Debug)]
pub enum SurfaceFile {
    /// Triangles.
    Mesh(Mesh),
    /// Strands, such as hair.
    Strands(Strands),
}

/// Reads the hair or the mesh in the file `path`, in the format that its contents tell, with notes
/// for people, one line each: what was left out or assumed. The file and what is made of it take at
/// most `max_bytes` of memory.
///
/// Numbers of opacity and colour that are not in 0..1 are clamped. What a format does not hold gets
/// a default, and a note where it matters. Textures are not read.
///
/// # Errors
/// If the file, or one that it cannot do without, cannot be read; if it is neither hair nor a mesh,
/// contradicts itself, or holds no strand or no triangle; if it takes too much memory.
pub fn read_surface(path: &Path, max_bytes: u64) -> Result<(SurfaceFile, Vec<String>)> {
    read_surface_as(path, ReadOptions::default().format_of(path)?, max_bytes)
}

/// Like [`read_surface`], in a format that is known, whatever the contents seem to be.
///
/// # Errors
/// As [`read_surface`].
pub fn read_surface_as(
    path: &Path,
    format: Format,
    max_bytes: u64,
) -> Result<(SurfaceFile, Vec<String>)> {
    let mut input = Input::new(path, max_bytes)?;
    let surface = match format {
        Format::Hair => SurfaceFile::Strands(hair::read(&mut input)?),
        Format::TressFx => SurfaceFile::Strands(tfx::read(&mut input)?),
        Format::Obj => SurfaceFile::Mesh(obj::read(&mut input)?),
        Format::Gltf => SurfaceFile::Mesh(gltf::read(&mut input)?),
        other => return Err(no_surface(path, other)),
    };
    let mut notes = input.notes;
    match &surface {
        SurfaceFile::Mesh(mesh) if mesh.skipped() > 0 => {
            let count = counted(mesh.skipped(), "triangle");
            notes.push(format!("{count} left out, with vertices that are not finite"));
        }
        SurfaceFile::Strands(strands) if strands.skipped() > 0 => {
            let count = counted(strands.skipped(), "strand");
            let why = "fewer than two points or with numbers that are not finite";
            notes.push(format!("{count} left out, of {why}"));
        }
        _ => {}
    }
    Ok((surface, notes))
}

/// All files from which the surface in the file `path` is read: the file itself, material files of
/// an `.obj`, buffers of a `.gltf`.
///
/// # Errors
/// As [`read_surface`], as far as the names are concerned.
pub fn surface_files(path: &Path) -> Result<Vec<PathBuf>> {
    let format = ReadOptions::default().format_of(path)?;
    // A file that may be larger than usual makes no exception for what a small one unfolds to.
    let size = files::metadata(path).map_err(|error| Error::file(path, error))?.len();
    let mut input = Input::new(path, DEFAULT_MAX_BYTES.max(size.saturating_mul(2)))?;
    let mut files = vec![path.to_owned()];
    match format {
        Format::Hair | Format::TressFx => {}
        Format::Obj => {
            let bytes = input.whole(path)?;
            let named = mtl::libraries(&input, &bytes)?;
            files.extend(named.into_iter().flatten().filter(|file| files::exists(file)));
        }
        Format::Gltf => files.extend(gltf::files(&mut input)?),
        other => return Err(no_surface(path, other)),
    }
    Ok(files)
}

/// The axis of the file that points up: z in `.hair`, y in all other formats of surfaces.
pub fn surface_up(format: Format) -> Axis {
    if format == Format::Hair { Axis::Z } else { Axis::Y }
}

/// Turns vectors so that what pointed up by the axis `from` does so by the axis `to`.
fn turn(vectors: &mut [Vec3], from: Axis, to: Axis) {
    if from != to {
        let turn = (to.world_from_file().transpose() * from.world_from_file()).as_mat3();
        for vector in vectors {
            *vector = turn * *vector;
        }
    }
}

/// The format of a surface in a file of `size` bytes that begins with `start`.
pub(super) fn recognized(start: &[u8], size: u64) -> Option<Format> {
    if start.starts_with(hair::MAGIC) {
        Some(Format::Hair)
    } else if gltf::recognizes(start) {
        Some(Format::Gltf)
    } else if tfx::recognizes(start, size) {
        Some(Format::TressFx)
    } else {
        obj::recognizes(start).then_some(Format::Obj)
    }
}

fn no_surface(path: &Path, format: Format) -> Error {
    let is_empty = files::metadata(path).is_ok_and(|found| found.len() == 0);
    let why = match format {
        Format::Raw if is_empty => "it is empty".to_owned(),
        Format::Raw => "neither hair nor a mesh that this program can read".to_owned(),
        other => format!("{}, which is neither hair nor a mesh", other.name()),
    };
    Error::contents(path, why)
}

/// A surface's name: the file's stem.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into());
    stem.strip_suffix(".hair").map(str::to_owned).unwrap_or(stem)
}

/// A number of things and the verb behind them, as in `1 strand is`.
fn counted(count: usize, what: &str) -> String {
    let (s, are) = if count == 1 { ("", "is") } else { ("s", "are") };
    format!("{count} {what}{s} {are}")
}

/// The same triangles between only those positions that they use.
fn without_unused(positions: Vec<Vec3>, triangles: &mut [[u32; 3]]) -> Result<Vec<Vec3>> {
    const UNUSED: u32 = u32::MAX;
    let mut new = memory::filled(positions.len(), UNUSED, "vertices")?;
    let used = |index: u32| new.get(index as usize).is_some();
    if !triangles.iter().flatten().all(|&index| used(index)) {
        // The mesh will say which.
        return Ok(positions);
    }
    for &index in triangles.iter().flatten() {
        new[index as usize] = 0;
    }
    if !new.contains(&UNUSED) {
        return Ok(positions);
    }
    let mut kept = Vec::new();
    memory::reserve(&mut kept, new.iter().filter(|&&one| one != UNUSED).count(), "vertices")?;
    for (new, position) in new.iter_mut().zip(positions) {
        if *new != UNUSED {
            *new = kept.len() as u32;
            kept.push(position);
        }
    }
    for index in triangles.iter_mut().flatten() {
        *index = new[*index as usize];
    }
    Ok(kept)
}
