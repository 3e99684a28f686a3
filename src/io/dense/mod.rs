//! Files with a value at every voxel. Each format has a module that reads its header; this module
//! has what they share. Values, transform and metadata are returned as the file has them. Apart
//! from how a value becomes a density, nothing here concerns rendering.
//!
//! In practice: [`DenseFile::open`] reads headers only, except that PVM, VTK and NanoVDB files,
//! whose headers are interleaved with their voxels, are read completely. [`DenseFile::voxels`]
//! returns the voxels in their own type, and [`Voxels::density`] turns them into numbers to render.
//! [`DenseFile::volume`] makes a volume of those, where possible without holding both in memory.

mod den;
mod detached;
mod distances;
mod grid;
mod header;
mod header_lines;
mod input;
mod metaimage;
mod mitsuba;
mod nanovdb;
mod nanovdb_chunks;
mod nifti;
pub(super) mod npy;
mod nrrd;
mod payload;
mod pvm;
mod pvm_stream;
mod resample;
mod retype;
mod space;
mod stream_to_vdb;
mod target;
mod to_vdb;
mod voxels;
mod vti;
mod vti_data;
mod write;

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};
use ndarray::Array3;

use super::files::{self, Metadata};
use super::fog::{Class, DISTANCES, fog};
use super::format::Format;
use super::number::{decode, too_large};
use super::raw;
use super::sidecar::Sidecar;
use crate::error::memory;
use crate::error::{Error, ErrorKind, Result};
use crate::io::options::ReadOptions;
use crate::math::Aabb;
use crate::volume::{self, Axis, Levels, Volume};
pub use grid::DenseGrid;
pub use header::{DenseHeader, Lattice, Order, SparsePart};
use input::Input;
use payload::{PART, Packing, Payload};
pub use space::Space;
pub use stream_to_vdb::PackedGrid;
pub use target::DenseTarget;
pub use voxels::Voxels;
use voxels::{arranged, beyond_f32, densities};
pub use write::{DenseOutput, Written};

/// The largest number of bytes for a volume, unless the user sets another limit. Where addresses have
/// 32 bits, it is half of them, so that there is room for maps and pictures.
pub const DEFAULT_MAX_BYTES: u64 = if usize::BITS > 32 { 4 << 30 } else { 2 << 30 };

/// Number of bytes that are scanned at a time.
const SCANNED: usize = 1 << 20;

/// The largest number of components per voxel.
const MAX_COMPONENTS: usize = 16;

/// A file whose header has been read. Voxels are read on request.
#[derive(Debug)]
pub struct DenseFile {
    path: PathBuf,
    format: Format,
    header: DenseHeader,
    payload: Payload,
    files: Vec<PathBuf>,
    file_bytes: u64,
    max_bytes: u64,
}

impl DenseFile {
    /// Opens the file `path` of format `format` and reads its header. `options` describe raw
    /// voxels, select an array of a VTK file, and limit memory.
    ///
    /// # Errors
    /// If the file cannot be read, is not of this format, or holds something that a volume cannot
    /// represent.
    pub fn open(path: &Path, format: Format, options: &ReadOptions) -> Result<Self> {
        let max_bytes = options.max_bytes;
        let input = Input::open(path, max_bytes)?;
        let (mut header, payload) = match format {
            Format::Npy => npy::read(&input),
            Format::Nrrd => nrrd::read(&input),
            Format::MetaImage => metaimage::read(&input),
            Format::Pvm => pvm::read(&input),
            Format::Nifti => nifti::read(&input),
            Format::Vti => vti::read(&input, options.grid.as_deref()),
            Format::MitsubaVol => mitsuba::read(&input),
            Format::Den => den::read(&input),
            Format::NanoVdb => nanovdb::read(&input),
            Format::Raw => {
                let payload = Payload::bare(path, 0);
                raw::describe(path, input.size, options).map(|header| (header, payload))
            }
            other => Err(input.bad(match other.no_volume() {
                Some(what) => what.to_owned(),
                None => format!("{} is not a dense format", other.name()),
            })),
        }?;
        if !(1..=MAX_COMPONENTS).contains(&header.components) {
            let why =
                format!("{} numbers per voxel, expected 1 to {MAX_COMPONENTS}", header.components);
            return Err(input.bad(why));
        }
        if let Some(class) = options.class {
            header.class = Some(class.name().to_owned());
            if let Some(sparse) = &mut header.sparse {
                sparse.level_set = class == Class::LevelSet;
            }
        }
        if let Some(spacing) = options.spacing {
            header.world_from_index = respaced(header.world_from_index, spacing)?;
            if let Some(lattice) = &mut header.lattice {
                lattice.world_from_index = respaced(lattice.world_from_index, spacing)?;
                // The first voxel keeps its position.
                let moved = lattice.world_from_index.transform_vector3(lattice.origin.as_dvec3());
                let corner = header.world_from_index.w_axis.truncate() - moved;
                lattice.world_from_index.w_axis = corner.extend(1.0);
            }
        }
        let determinant = header.world_from_index.determinant();
        if !determinant.is_normal() || !header.world_from_index.is_finite() {
            let why = format!("its axes and spacing have no inverse (determinant {determinant})");
            return Err(input.bad(why));
        }
        header.notes.extend(payload.surplus(header.bytes()));
        let file_bytes = input.size;
        let mut files = vec![path.to_owned()];
        files.extend(payload.path().map(Path::to_owned));
        if let Format::Raw | Format::Npy = format {
            files.extend(Sidecar::beside(path)?.map(|(path, _)| path));
        }
        let payload = match header.crc32 {
            Some(crc32) => Payload::Checked(Box::new(payload), crc32),
            None => payload,
        };
        Ok(Self { path: path.to_owned(), format, header, payload, files, file_bytes, max_bytes })
    }

    /// All files from which the voxels are read: the file itself, one that holds its voxels, a
    /// sidecar.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The file's format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The header's contents.
    pub fn header(&self) -> &DenseHeader {
        &self.header
    }

    /// Bytes of the file, without a second file that holds the voxels.
    pub fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    /// The volume's name: that in the file, or else the file's own name.
    pub fn name(&self) -> String {
        let named = self.header.name.clone().filter(|name| !name.is_empty());
        named.unwrap_or_else(|| {
            let stem =
                self.path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into());
            stem.strip_suffix(".nii").map(str::to_owned).unwrap_or(stem)
        })
    }

    /// Reads the voxels.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if they take more memory than allowed. If they cannot be read, or are
    /// fewer than the header says.
    pub fn voxels(&self) -> Result<Voxels> {
        self.check_memory(self.header.bytes() + self.header.memory_bytes())?;
        let bytes = self.payload.read(&self.path, self.header.bytes() as usize)?;
        Ok(Voxels::new(self.header.clone(), bytes))
    }

    /// The voxels as numbers to render, shape (z, y, x). The file's own bytes are not held at the
    /// same time, unless they are text or were unpacked with the header.
    fn density(&self) -> Result<Array3<f32>> {
        let header = &self.header;
        let mut needed = header.memory_bytes();
        if !self.payload.comes_in_parts() {
            needed += header.bytes();
        } else if header.bytes() > isize::MAX as u128 {
            // More than can be counted.
            needed = needed.max(header.bytes());
        }
        if header.order == Order::ZFastest {
            // Reordering the axes needs a second array.
            needed += header.memory_bytes();
        }
        self.check_memory(needed)?;
        let row = header.components * header.value_type.size() * header.dims[0];
        let rows = (PART / row).max(1) * row;
        let mut values = Vec::new();
        self.payload.read_parts(&self.path, header.bytes() as usize, rows, &mut |part| {
            if values.is_empty() && part.len() == rows {
                // The full size is reserved once a first part has arrived.
                memory::reserve(&mut values, header.dims.iter().product(), "voxels")?;
            }
            let own = densities(header, &part);
            if let Some(value) = beyond_f32(header, &part, &own) {
                return Err(Error::contents(&self.path, too_large(value)));
            }
            memory::reserve(&mut values, own.len(), "voxels")?;
            values.extend(own);
            Ok(())
        })?;
        arranged(header, values)
    }

    /// Scans the voxels without keeping them. `each` receives some rows at a time: all numbers, one
    /// per component, and the densities that a renderer would use.
    ///
    /// # Errors
    /// As [`DenseFile::voxels`].
    pub fn scan(&self, mut each: impl FnMut(&[f64], &[f32])) -> Result<()> {
        let header = &self.header;
        self.check_memory(header.bytes())?;
        let row = header.components * header.value_type.size() * header.dims[0];
        let rows = (SCANNED / row).max(1) * row;
        self.payload.read_parts(&self.path, header.bytes() as usize, rows, &mut |part| {
            let numbers = decode(&part, header.value_type, header.endian, header.scale);
            each(&numbers, &densities(header, &part));
            Ok(())
        })
    }

    /// # Errors
    /// [`ErrorKind::Limit`] if `needed` bytes are more than allowed.
    fn check_memory(&self, needed: u128) -> Result<()> {
        let most = self.max_bytes.min(isize::MAX as u64);
        if needed <= u128::from(most) {
            return Ok(());
        }
        let [x, y, z] = self.header.dims;
        let what = format!("{}: {x} x {y} x {z} voxels", self.path.display());
        let (needed, limit) = (format!("{needed} bytes"), format!("{most} bytes"));
        Err(ErrorKind::Limit { what, needed, limit }.into())
    }

    /// The volume to render. The file's axis `up` (`None`: that in the file, else y) points along
    /// the world's y; the stored values of `window` are mapped to 0..1.
    ///
    /// # Errors
    /// As [`DenseFile::voxels`], and if the window is empty.
    pub fn volume(&self, up: Option<Axis>, window: Option<[f32; 2]>) -> Result<Volume> {
        self.volume_noted(up, window.into(), &mut Vec::new())
    }

    /// Like [`DenseFile::volume`] with densities by `levels`. Adds remarks about the values to
    /// `notes`.
    pub(super) fn volume_noted(
        &self,
        up: Option<Axis>,
        levels: Levels,
        notes: &mut Vec<String>,
    ) -> Result<Volume> {
        let mut values = self.density()?;
        let up = up.or(self.header.up).unwrap_or_default();
        let world_from_file = DMat4::from_mat3(up.world_from_file());
        let placed = world_from_file * self.header.world_from_index;
        // As for OpenVDB's grids: fog inside of surfaces, and a medium that ends at the background.
        let class = self.header.class.as_deref();
        let sparse = self.header.sparse.as_ref();
        let level_set = class == Some("level set") || sparse.is_some_and(|s| s.level_set);
        let steps = [DVec3::X, DVec3::Y, DVec3::Z]
            .map(|axis| self.header.world_from_index.transform_vector3(axis).length());
        let slope = if sparse.is_none() && (level_set || class.is_none()) {
            distances::slope_of_distances(&values.view(), steps)
        } else {
            None
        };
        if level_set {
            // Distances need not have the same unit as the voxels' lengths.
            let voxel = (steps[0] * slope.unwrap_or(1.0)) as f32;
            values.mapv_inplace(|distance| fog(distance, voxel));
        } else if slope.is_some() && self.header.components == 1 {
            notes.push(format!("'{}' {DISTANCES}", self.name()));
        }
        let values = volume::Voxels::Dense(values);
        let volume = Volume::with_levels(self.name(), values, placed, levels)?;
        if self.header.sparse.is_none() {
            return Ok(volume);
        }
        let last = DVec3::from(self.header.dims.map(|n| n as f64 - 1.0));
        Ok(volume.with_domain(Aabb { min: DVec3::ZERO, max: last }))
    }
}

impl Payload {
    /// A remark on bytes in the file behind the `due` bytes of the voxels, if there are any.
    fn surplus(&self, due: u128) -> Option<String> {
        let Self::Stored { path, offset, packing: Packing::Bare, .. } = self else { return None };
        let size = files::metadata(path).ok().filter(Metadata::is_file)?.len();
        let more = u128::from(size.saturating_sub(*offset)).checked_sub(due).filter(|&n| n > 0)?;
        Some(format!("{}: {more} bytes after the voxels are ignored", path.display()))
    }

    /// Unpacked voxels from byte `offset` of `path` on.
    fn bare(path: &Path, offset: u64) -> Self {
        Self::Stored { path: path.to_owned(), offset, packing: Packing::Bare, skip: 0 }
    }
}

/// The path of the file `name` to which the header `path` refers. It lies beside the header or, if
/// the header is a link and nothing lies beside it, beside the link's target.
fn named_by(path: &Path, name: &str) -> PathBuf {
    let beside = path.with_file_name("").join(name);
    let led_to = || files::canonicalize(path).ok().map(|path| path.with_file_name("").join(name));
    if files::exists(&beside) {
        return beside;
    }
    led_to().filter(|path| files::exists(path)).unwrap_or(beside)
}

/// The same transform with other distances between voxels.
fn respaced(world_from_index: DMat4, spacing: [f64; 3]) -> Result<DMat4> {
    let spacing = DVec3::from(spacing);
    if !(spacing.is_finite() && spacing.min_element() > 0.0) {
        return Err(Error::value("spacing", format!("{spacing} is not above 0 on every axis")));
    }
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let step = world_from_index.col(axis);
        step.normalize_or_zero() * spacing[axis]
    });
    Ok(DMat4::from_cols(x, y, z, world_from_index.w_axis))
}

/// The transform with the first voxel's centre at `origin` and the given steps from voxel to voxel.
fn placed(origin: DVec3, steps: [DVec3; 3]) -> DMat4 {
    let [x, y, z] = steps.map(|step| step.extend(0.0));
    DMat4::from_cols(x, y, z, origin.extend(1.0))
}
