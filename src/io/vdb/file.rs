//! An opened file: its list of grids, and loading of single grids. Knows nothing of how voxels are
//! stored.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use super::fault::{Fault, Parsed};
use super::grid::Grid;
use super::header::{self, Descriptor, FileHeader, GridHeader, Place};
use super::metadata::Metadata;
use super::source::{Reader, Source};
use super::voxels::{self, Survey, SurveyDepth};
use crate::error::{Error, Result};
use crate::io::files::{self, File};

/// Number of bytes to read at a time: headers are small, and the next one may be far away.
const CHUNK: usize = 8 << 10;

/// An OpenVDB file whose headers have been read. Voxels are read on request, grid by grid.
pub struct VdbFile {
    path: PathBuf,
    source: Source,
    header: FileHeader,
    grids: Vec<GridHeader>,
    unreachable: Option<String>,
}

impl VdbFile {
    /// Whether a file that starts with these bytes (eight or more) is an OpenVDB file.
    pub fn recognizes(start: &[u8]) -> bool {
        start.starts_with(&header::MAGIC.to_le_bytes())
    }

    /// Opens a file and reads its headers. The file stays open, so it may be replaced meanwhile.
    /// Only a stream without offsets is read to its end, because nothing else tells where its grids
    /// lie.
    ///
    /// # Errors
    /// `File` if the system refuses. `Contents` if this is not an OpenVDB file of format 222 to
    /// 225, or if its headers are broken. A single grid that cannot be used (points, an unknown
    /// transform) is not an error: [`GridHeader::refused`] says why.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = files::open(path).map_err(|error| Error::file(path, error))?;
        Self::from_stream(path, file)
    }

    /// Reads headers from bytes in memory; `path` stands for them in errors.
    ///
    /// # Errors
    /// As [`VdbFile::open`].
    pub fn from_bytes(path: impl AsRef<Path>, bytes: Vec<u8>) -> Result<Self> {
        Self::from_stream(path.as_ref(), Box::new(Cursor::new(bytes)))
    }

    fn from_stream(path: &Path, stream: File) -> Result<Self> {
        let named = |what: String| move |fault: Fault| fault.in_file(path, &what);
        let source = Source::new(stream).map_err(named("header".to_owned()))?;
        let mut reader = Reader::new(&source, 0, source.length(), CHUNK);
        let header = header::read_file_header(&mut reader).map_err(named("header".to_owned()))?;

        let mut grids = Vec::new();
        let mut unreachable = None;
        for index in 0..header.grid_count {
            let what = format!("grid {index} of {}", header.grid_count);
            let descriptor = Descriptor::read(&mut reader).map_err(named(what.clone()))?;
            let what = format!("grid {:?}", descriptor.unique_name);
            let grid = if header.has_offsets {
                read_placed(&source, &mut reader, descriptor)
            } else {
                read_streamed(&mut reader, descriptor)
            };
            let grid = grid.map_err(named(what.clone()))?;
            let lost = header.grid_count - index - 1;
            let ends_here = !header.has_offsets && grid.refused.is_some() && lost > 0;
            if let (true, Some(why)) = (ends_here, &grid.refused) {
                unreachable = Some(format!("{lost} grids after {what} cannot be found: {why}"));
            }
            grids.push(grid);
            if ends_here {
                break;
            }
        }
        resolve_instances(&mut grids);
        Ok(Self { path: path.to_owned(), source, header, grids, unreachable })
    }

    /// The file's path as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The format's version, 222 to 225.
    pub fn version(&self) -> u32 {
        self.header.version
    }

    /// Major and minor version of the library that wrote the file.
    pub fn library_version(&self) -> [u32; 2] {
        self.header.library_version
    }

    /// Whether the file was written as a stream, without offsets.
    pub fn is_stream(&self) -> bool {
        !self.header.has_offsets
    }

    /// The file's unique identifier of 36 characters.
    pub fn uuid(&self) -> &str {
        &self.header.uuid
    }

    /// Metadata of the whole file.
    pub fn metadata(&self) -> &Metadata {
        &self.header.metadata
    }

    /// All grids, in the order of the file.
    pub fn grids(&self) -> &[GridHeader] {
        &self.grids
    }

    /// Why [`VdbFile::grids`] may be incomplete. In a stream, the end of a grid that cannot be read
    /// is unknown, and so are all grids behind it. `None` if it is complete.
    pub fn unreachable(&self) -> Option<&str> {
        self.unreachable.as_deref()
    }

    /// Index of the first grid called `name`; `name[2]` means the third grid of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        let nth = |name: &str, nth: usize| {
            let named = self.grids.iter().enumerate().filter(|(_, grid)| grid.name == name);
            named.map(|(index, _)| index).nth(nth)
        };
        nth(name, 0).or_else(|| {
            let (name, number) = name.strip_suffix(']')?.rsplit_once('[')?;
            nth(name, number.parse().ok()?)
        })
    }

    /// Loads the voxels of the grid at `index`.
    ///
    /// # Errors
    /// `Value` if there is no such grid, `Contents` if its voxels are broken or of an unsupported
    /// kind ([`GridHeader::refused`]), `File` if the system fails to read.
    pub fn load(&self, index: usize) -> Result<Grid> {
        let grid = self.voxel_grid(index)?;
        voxels::load(&self.source, grid).map_err(|fault| self.fault_in(grid, fault))
    }

    /// Measures the grid at `index` without keeping its voxels.
    ///
    /// # Errors
    /// As [`VdbFile::load`].
    pub fn survey(&self, index: usize, depth: SurveyDepth) -> Result<Survey> {
        let grid = self.voxel_grid(index)?;
        voxels::survey(&self.source, grid, depth).map_err(|fault| self.fault_in(grid, fault))
    }

    /// The grid that holds the voxels of the grid at `index`.
    fn voxel_grid(&self, index: usize) -> Result<&GridHeader> {
        let Some(grid) = self.grids.get(index) else {
            let count = self.grids.len();
            let what = self.path.display().to_string();
            return Err(Error::value(what, format!("no grid {index}; there are {count}")));
        };
        if let Some(why) = &grid.refused {
            return Err(Error::contents(&self.path, format!("grid {:?}: {why}", grid.name)));
        }
        Ok(&self.grids[grid.place.voxels_of])
    }

    fn fault_in(&self, grid: &GridHeader, fault: Fault) -> Error {
        fault.in_file(&self.path, &format!("grid {:?}", grid.name))
    }
}

/// Reads a grid at its descriptor's offsets; the reader then moves to the next descriptor.
fn read_placed<'a>(
    source: &'a Source,
    reader: &mut Reader<'a>,
    descriptor: Descriptor,
) -> Parsed<GridHeader> {
    let place = descriptor.place(reader.position(), source.length())?;
    let mut grid_reader = Reader::new(source, place.grid, place.end, CHUNK);
    let mut grid = header::read_grid_header(&mut grid_reader, descriptor, place)?;
    if grid.refused.is_none() && grid.instance_of.is_none() {
        grid.background = Some(voxels::background(&mut grid_reader, &grid)?);
    }
    reader.jump(place.end);
    Ok(grid)
}

/// Reads a grid of a stream and skips its voxels.
fn read_streamed(reader: &mut Reader, descriptor: Descriptor) -> Parsed<GridHeader> {
    let start = reader.position();
    let place = Place { grid: start, end: start, ..Place::default() };
    let mut grid = header::read_grid_header(reader, descriptor, place)?;
    if grid.refused.is_none() && grid.instance_of.is_none() {
        let (blocks, background) = voxels::step_over(reader, &grid)?;
        (grid.place.blocks, grid.background) = (blocks, Some(background));
    }
    grid.place.end = reader.position();
    grid.file_bytes = grid.place.end - start;
    Ok(grid)
}

/// Sets for each grid which one holds its voxels: itself, or the parent of an instance.
fn resolve_instances(grids: &mut [GridHeader]) {
    let mut by_name = HashMap::new();
    for (index, grid) in grids.iter().enumerate() {
        by_name.entry(grid.unique_name.clone()).or_insert(index);
    }
    for index in 0..grids.len() {
        grids[index].place.voxels_of = index;
        let Some(parent_name) = grids[index].instance_of.clone() else { continue };
        let Some(&parent_index) = by_name.get(&parent_name) else {
            grids[index].refuse(format!("an instance of {parent_name:?}, which is missing"));
            continue;
        };
        let parent = &grids[parent_index];
        let problem = if parent.instance_of.is_some() {
            Some("it is an instance itself".to_owned())
        } else if parent.type_name != grids[index].type_name {
            Some(format!("it is a {}", parent.type_name))
        } else {
            parent.refused.clone()
        };
        let background = parent.background;
        if let Some(why) = problem {
            grids[index].refuse(format!("an instance of {parent_name:?}: {why}"));
        } else {
            grids[index].background = background;
            grids[index].place.voxels_of = parent_index;
        }
    }
}
