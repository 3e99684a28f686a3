//! Writes dense voxels to files. Each format has its own module for its header.

use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use flate2::write::{GzEncoder, ZlibEncoder};
use flate2::{Compression, Crc};
use glam::DVec3;

use super::grid::DenseGrid;
use super::{DenseTarget, detached, npy};
use crate::error::{Error, Result};
use crate::io::files;
use crate::io::number::ValueType;
use crate::io::output::{Inputs, PendingFile, commit, commit_then};
use crate::io::remap::Remap;
use crate::io::sidecar::{Background, Sidecar};

/// Packed voxels are kept in memory up to this many bytes; more go to an unnamed file.
const IN_MEMORY: usize = 1 << 24;

/// The prepared output files of a grid in one format.
#[derive(Debug)]
pub struct DenseOutput {
    format: DenseTarget,
    packed: bool,
    main: PendingFile,
    /// The sidecar, or the file with a header's voxels.
    side: Option<PendingFile>,
    inputs: Inputs,
}

/// The result of writing a grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// All files; the first is the one that was requested.
    pub paths: Vec<PathBuf>,
    /// What the format cannot store, as text.
    pub lost: Vec<String>,
}

impl DenseTarget {
    /// Prepares the files for a grid at `path`; voxels are compressed if `packed` and the format
    /// can.
    ///
    /// # Errors
    /// As [`PendingFile::create`]. If something else lies in a sidecar's place, or if the name
    /// cannot be put into a header.
    pub fn promise(self, path: &Path, packed: bool, inputs: &Inputs) -> Result<DenseOutput> {
        let packed = packed && self.compression().is_some();
        let main = PendingFile::create(path, inputs)?;
        let place = main.path();
        let side = match self {
            Self::Npy | Self::Raw if main.is_stream() => None,
            Self::Npy | Self::Raw => {
                Sidecar::refuse_other_beside(place)?;
                Some(PendingFile::create(Sidecar::path_beside(place), inputs)?)
            }
            Self::Nrrd { detached: true } | Self::MetaImage { detached: true } => {
                if main.is_stream() {
                    let why = "a pipe or a device holds one file; name it .nrrd or .mha";
                    return Err(Error::contents(path, why));
                }
                // The final name depends on the voxels.
                let name = detached::name(self, place, &[], packed)?;
                Some(PendingFile::create(place.with_file_name(name), inputs)?)
            }
            _ => None,
        };
        Ok(DenseOutput { format: self, packed, main, side, inputs: inputs.clone() })
    }
}

impl DenseOutput {
    /// Writes `grid` and moves the files to their destinations, the requested one last.
    ///
    /// # Errors
    /// If they cannot be written; then older files are unchanged.
    pub fn write(mut self, grid: DenseGrid) -> Result<Written> {
        let mut lost = Vec::new();
        let grid = if grid.value_type == ValueType::F16 && !self.format.has_half() {
            lost.push("half floats (stored as float, which holds them all)".to_owned());
            grid.retyped(ValueType::F32, Remap::Cast)?
        } else {
            grid
        };
        lost.extend(self.format.losses(&grid));
        let (main, side) = (self.main.target().to_owned(), self.side.take());
        let side = match (self.format, side) {
            (DenseTarget::Npy | DenseTarget::Raw, None) => {
                lost.push("what a sidecar would say (there is no place for one)".to_owned());
                self.write_numbers(&grid)?;
                None
            }
            (DenseTarget::Npy | DenseTarget::Raw, Some(side)) => {
                Some(self.write_with_sidecar(side, &grid)?)
            }
            (_, Some(voxels)) => Some(self.write_detached(voxels, &grid)?),
            (_, None) => {
                self.write_attached(&grid)?;
                None
            }
        };
        Ok(Written { paths: [main].into_iter().chain(side).collect(), lost })
    }

    /// Writes the numbers only.
    fn put_numbers(&mut self, grid: &DenseGrid) -> Result<()> {
        if self.format == DenseTarget::Npy {
            self.main.put(&npy::head(grid))?;
        }
        self.main.put(&grid.bytes)
    }

    fn write_numbers(mut self, grid: &DenseGrid) -> Result<()> {
        self.put_numbers(grid)?;
        commit(vec![self.main])
    }

    /// Writes the numbers and the sidecar, and returns the sidecar's path.
    fn write_with_sidecar(mut self, mut side: PendingFile, grid: &DenseGrid) -> Result<PathBuf> {
        self.put_numbers(grid)?;
        let own = sidecar(grid);
        let mut files = Vec::new();
        // First a sidecar that describes both the old and the new voxels, then the new voxels, then
        // their own sidecar.
        if files::exists(self.main.path())
            && let Ok(Some((_, older))) = Sidecar::beside(self.main.path())
        {
            let mut both = PendingFile::create(side.target(), &self.inputs)?;
            let older = Some(Box::new(older));
            both.put(Sidecar { older, ..own.clone() }.text().as_bytes())?;
            files.push(both);
        }
        side.put(own.text().as_bytes())?;
        let path = side.target().to_owned();
        if files.is_empty() {
            files.extend([side, self.main]);
        } else {
            files.extend([self.main, side]);
        }
        commit_then(files, || ())?;
        Ok(path)
    }

    /// Writes a header and its voxels in a second file, and returns the second file's path.
    fn write_detached(mut self, mut side: PendingFile, grid: &DenseGrid) -> Result<PathBuf> {
        let size = self.format.put_voxels(&mut side, &grid.bytes, self.packed)?;
        let header = self.main.path().to_owned();
        let name = detached::name(self.format, &header, &grid.bytes, self.packed)?;
        let side = side.renamed(&name)?;
        let head = self.format.head(grid, self.packed.then_some(size), Some(&name));
        self.main.put(head.as_bytes())?;
        let path = side.target().to_owned();
        commit_then(vec![side, self.main], || detached::remove_older(&header, &name))?;
        Ok(path)
    }

    /// Writes a header with its voxels behind it.
    fn write_attached(mut self, grid: &DenseGrid) -> Result<()> {
        let format = self.format;
        if self.packed
            && let DenseTarget::MetaImage { .. } = format
        {
            // The header states how long the packed voxels behind it are.
            let mut packed = tempfile::SpooledTempFile::new(IN_MEMORY);
            let target = self.main.target().to_owned();
            let failed = |error| Error::file(&target, error);
            let size = pack(format, &mut packed, &grid.bytes).map_err(failed)?;
            self.main.put(format.head(grid, Some(size), None).as_bytes())?;
            packed.rewind().map_err(failed)?;
            std::io::copy(&mut packed, &mut self.main).map_err(failed)?;
        } else {
            self.main.put(format.head(grid, self.packed.then_some(0), None).as_bytes())?;
            format.put_voxels(&mut self.main, &grid.bytes, self.packed)?;
        }
        commit(vec![self.main])
    }
}

impl DenseTarget {
    /// The bytes of a file of `grid`: of the format's header and the voxels behind it, as they are.
    /// For formats of one file that say everything themselves: NRRD and MetaImage.
    pub fn encode(self, grid: &DenseGrid) -> Vec<u8> {
        let mut bytes = self.head(grid, None, None).into_bytes();
        bytes.extend_from_slice(&grid.bytes);
        bytes
    }

    /// Writes voxels, packed or not, and returns their size in the file.
    fn put_voxels(self, file: &mut PendingFile, voxels: &[u8], packed: bool) -> Result<usize> {
        if !packed {
            return file.put(voxels).map(|()| voxels.len());
        }
        let target = file.target().to_owned();
        pack(self, file, voxels).map_err(|error| Error::file(target, error))
    }
}

/// Packs `voxels` with the format's compression, and returns their packed size.
fn pack(format: DenseTarget, out: &mut dyn Write, voxels: &[u8]) -> std::io::Result<usize> {
    let (level, mut counted) = (Compression::default(), Counted { out, count: 0 });
    if let DenseTarget::MetaImage { .. } = format {
        let mut encoder = ZlibEncoder::new(&mut counted, level);
        encoder.write_all(voxels)?;
        encoder.finish()?;
    } else {
        let mut encoder = GzEncoder::new(&mut counted, level);
        encoder.write_all(voxels)?;
        encoder.finish()?;
    }
    Ok(counted.count)
}

/// Counts the bytes that pass through.
struct Counted<'a> {
    out: &'a mut dyn Write,
    count: usize,
}

impl Write for Counted<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.count += written;
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// The sidecar of numbers without a header, or with one that has no transform.
fn sidecar(grid: &DenseGrid) -> Sidecar {
    let rows = grid.world_from_index.transpose().to_cols_array_2d();
    let mut crc = Crc::new();
    crc.update(&grid.bytes);
    Sidecar {
        dims: Some(grid.dims),
        value_type: Some(grid.value_type.name().to_owned()),
        components: (grid.components > 1).then_some(grid.components),
        endian: Some("little".to_owned()),
        spacing: None,
        world_from_index: Some(rows),
        index_origin: Some(grid.origin.as_dvec3().to_array()),
        background: grid.background.as_deref().map(|values| match values {
            [single] => Background::Number(*single),
            several => Background::Vector(several.to_vec()),
        }),
        value_scale: (grid.value_scale != [1.0, 0.0]).then_some(grid.value_scale),
        space: grid.space.map(|space| space.name().to_owned()),
        up: grid.up.map(|up| up.name().to_owned()),
        name: (!grid.name.is_empty()).then(|| grid.name.clone()),
        class: grid.class.clone(),
        crc32: Some(format!("{:08x}", crc.sum())),
        older: None,
    }
}

/// Numbers, separated by `separator`, each with all its digits.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>, separator: &str) -> String {
    let words: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
    words.join(separator)
}

/// Text as a single line, for a header.
pub(super) fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ").trim().to_owned()
}

/// The steps from voxel to voxel and the first voxel's centre.
pub(super) fn steps(grid: &DenseGrid) -> ([DVec3; 3], DVec3) {
    let world_from_voxel = grid.world_from_voxel();
    let steps = [0, 1, 2].map(|axis| world_from_voxel.col(axis).truncate());
    (steps, world_from_voxel.w_axis.truncate())
}
