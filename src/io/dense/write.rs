//! Dense voxels as files: which files a format has, and what it cannot hold. How a header looks is
//! each format's own matter.

use std::hash::{DefaultHasher, Hasher};
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use flate2::write::{GzEncoder, ZlibEncoder};
use flate2::{Compression, Crc};
use glam::{DMat4, DVec3};

use super::grid::DenseGrid;
use super::{metaimage, npy, nrrd};
use crate::error::{Error, Result};
use crate::io::number::ValueType;
use crate::io::output::{Inputs, PendingFile, commit_then};
use crate::io::remap::Remap;
use crate::io::sidecar::{Background, Sidecar};

/// Packed voxels that are kept in memory; more of them in a file without a name.
const IN_MEMORY: usize = 1 << 24;

/// A format that dense voxels are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DenseTarget {
    /// NumPy, with a sidecar.
    Npy,
    /// Numbers only, with a sidecar.
    Raw,
    /// NRRD in one file, or as a header beside its voxels.
    Nrrd {
        /// Whether the voxels lie in a second file.
        detached: bool,
    },
    /// MetaImage in one file, or as a header beside its voxels.
    MetaImage {
        /// Whether the voxels lie in a second file.
        detached: bool,
    },
}

/// The files of a grid in a format, promised.
#[derive(Debug)]
pub struct DenseOutput {
    format: DenseTarget,
    packed: bool,
    main: PendingFile,
    /// A sidecar, or the voxels of a header.
    side: Option<PendingFile>,
    inputs: Inputs,
}

/// What became of a grid in a format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// All files; the first is the one that was asked for.
    pub paths: Vec<PathBuf>,
    /// What the format cannot hold, in words.
    pub lost: Vec<String>,
}

impl DenseTarget {
    /// The format that the ending of a name stands for.
    pub fn of_path(path: &Path) -> Option<Self> {
        Some(match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "npy" => Self::Npy,
            "raw" => Self::Raw,
            "nrrd" => Self::Nrrd { detached: false },
            "nhdr" => Self::Nrrd { detached: true },
            "mha" => Self::MetaImage { detached: false },
            "mhd" => Self::MetaImage { detached: true },
            _ => return None,
        })
    }

    /// The name of its compression; `None` where it has none.
    pub fn compression(self) -> Option<&'static str> {
        match self {
            Self::Npy | Self::Raw => None,
            Self::Nrrd { .. } => Some("gzip"),
            Self::MetaImage { .. } => Some("zlib"),
        }
    }

    /// Whether it holds half floats.
    pub fn has_half(self) -> bool {
        matches!(self, Self::Npy | Self::Raw)
    }

    /// Promises the files that a grid becomes at `path`, the voxels `packed` where the format can.
    ///
    /// # Errors
    /// As [`PendingFile::create`]; if there is something else where a sidecar belongs, or if a name
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
                // Its last name follows from the voxels.
                let name = self.voxels_name(place, 0, packed)?;
                Some(PendingFile::create(place.with_file_name(name), inputs)?)
            }
            _ => None,
        };
        Ok(DenseOutput { format: self, packed, main, side, inputs: inputs.clone() })
    }

    /// The name of the second file that holds the voxels, with a `hash` of them: what an older header
    /// names is not written over, and a header never finds voxels of another one.
    fn voxels_name(self, path: &Path, hash: u64, packed: bool) -> Result<String> {
        let ending = match (self, packed) {
            (_, false) => "raw",
            (Self::Nrrd { .. }, true) => "raw.gz",
            (_, true) => "zraw",
        };
        let name = path.file_name().and_then(|name| name.to_str());
        let plain = |name: &&str| name.trim() == *name && !name.contains(char::is_control);
        let name = name.filter(plain).ok_or_else(|| {
            Error::contents(path, "its header cannot hold a name that is no plain text")
        })?;
        Ok(format!("{name}.{hash:016x}.{ending}"))
    }

    fn losses(self, grid: &DenseGrid) -> Vec<String> {
        let mut lost = Vec::new();
        if grid.active.is_some() {
            let (active, all) = (grid.active_voxels(), grid.voxels());
            lost.push(format!("which voxels are active ({active} of {all})"));
        }
        let has_sidecar = matches!(self, Self::Npy | Self::Raw);
        if !has_sidecar {
            if let Some(background) = &grid.background {
                let numbers: Vec<String> = background.iter().map(ToString::to_string).collect();
                lost.push(format!("the background {}", numbers.join(",")));
            }
            if let Some(class) = grid.class.as_deref().filter(|&class| class != "unknown") {
                lost.push(format!("the class '{class}'"));
            }
            if grid.value_scale != [1.0, 0.0] {
                let [slope, intercept] = grid.value_scale;
                lost.push(format!("that values are numbers times {slope} plus {intercept}"));
            }
            if let Some(up) = grid.up {
                lost.push(format!("that {} points up", up.name()));
            }
        }
        if !(grid.metadata.is_empty() || matches!(self, Self::Nrrd { .. })) {
            let keys: Vec<&str> = grid.metadata.iter().map(|(key, _)| key.as_str()).collect();
            lost.push(format!("metadata ({})", keys.join(", ")));
        }
        if let Self::MetaImage { .. } = self
            && is_sheared(&grid.world_from_voxel())
        {
            lost.push(
                "that axes are not at right angles, for programs that expect them so".to_owned(),
            );
        }
        lost
    }
}

impl DenseOutput {
    /// Writes `grid` and puts the files in their places, the one that was asked for last.
    ///
    /// # Errors
    /// If they cannot be written; then older ones are unchanged.
    pub fn write(mut self, grid: DenseGrid) -> Result<Written> {
        let format = self.format;
        let mut lost = Vec::new();
        let grid = if grid.value_type == ValueType::F16 && !format.has_half() {
            lost.push("half floats (it has float, which holds all of them)".to_owned());
            grid.retyped(ValueType::F32, Remap::Cast)
        } else {
            grid
        };
        lost.extend(format.losses(&grid));
        let voxels = &grid.bytes;
        let mut paths = vec![self.main.target().to_owned()];
        let mut first = None;
        let obsolete = match format {
            DenseTarget::Npy | DenseTarget::Raw => {
                if format == DenseTarget::Npy {
                    self.main.put(&npy::head(&grid))?;
                }
                self.main.put(voxels)?;
                if let Some(side) = &mut self.side {
                    let own = sidecar(&grid);
                    // First one of both voxels, the old and the new ones, then the new, then its own.
                    let older = Sidecar::beside(self.main.path()).ok().flatten();
                    let older = older.filter(|_| self.main.path().exists());
                    if let Some((_, older)) = older {
                        let mut both = PendingFile::create(side.target(), &self.inputs)?;
                        let older = Some(Box::new(older));
                        both.put(Sidecar { older, ..own.clone() }.text().as_bytes())?;
                        first = Some(both);
                    }
                    side.put(own.text().as_bytes())?;
                } else {
                    lost.push("what a sidecar says, where there is no place for one".to_owned());
                }
                None
            }
            DenseTarget::Nrrd { .. } | DenseTarget::MetaImage { .. } => match self.side.take() {
                Some(mut side) => {
                    let size = format.put_voxels(&mut side, voxels, self.packed)?;
                    let place = self.main.path();
                    let name = format.voxels_name(place, hash(voxels), self.packed)?;
                    self.side = Some(side.renamed(&name)?);
                    let head = format.head(&grid, self.packed.then_some(size), Some(&name));
                    let obsolete = Obsolete { header: place.to_owned(), kept: name };
                    self.main.put(head.as_bytes())?;
                    Some(obsolete)
                }
                None if format == (DenseTarget::Nrrd { detached: false }) || !self.packed => {
                    let head = format.head(&grid, self.packed.then_some(0), None);
                    self.main.put(head.as_bytes())?;
                    format.put_voxels(&mut self.main, voxels, self.packed)?;
                    None
                }
                None => {
                    // Its header says how long the packed voxels behind it are.
                    let mut packed = tempfile::SpooledTempFile::new(IN_MEMORY);
                    let failed = |error| Error::file(&paths[0], error);
                    let size = pack(format, &mut packed, voxels).map_err(failed)?;
                    self.main.put(format.head(&grid, Some(size), None).as_bytes())?;
                    packed.rewind().map_err(failed)?;
                    std::io::copy(&mut packed, &mut self.main).map_err(failed)?;
                    None
                }
            },
        };
        paths.extend(self.side.as_ref().map(|side| side.target().to_owned()));
        let files = match first {
            Some(first) => [Some(first), Some(self.main), self.side],
            None => [self.side, Some(self.main), None],
        };
        let files = files.into_iter().flatten().collect();
        commit_then(files, || {
            if let Some(obsolete) = obsolete {
                obsolete.remove();
            }
        })?;
        Ok(Written { paths, lost })
    }
}

impl DenseTarget {
    /// Writes voxels, packed or not; how many bytes they became.
    fn put_voxels(self, file: &mut PendingFile, voxels: &[u8], packed: bool) -> Result<usize> {
        if !packed {
            return file.put(voxels).map(|()| voxels.len());
        }
        let target = file.target().to_owned();
        pack(self, file, voxels).map_err(|error| Error::file(target, error))
    }

    /// The header, whose voxels take `packed` bytes or are not packed, in the file `name` or behind it.
    fn head(self, grid: &DenseGrid, packed: Option<usize>, name: Option<&str>) -> String {
        match self {
            Self::MetaImage { .. } => metaimage::head(grid, packed, name),
            _ => nrrd::head(grid, packed.is_some(), name),
        }
    }
}

/// Packs `voxels` as the format does; how many bytes they became.
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

/// Counts what goes through.
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

/// Voxels of earlier headers of the same name.
struct Obsolete {
    header: PathBuf,
    kept: String,
}

impl Obsolete {
    /// Removes them: files that are named as [`DenseTarget::voxels_name`] names them.
    fn remove(&self) {
        let Some(name) = self.header.file_name().and_then(|name| name.to_str()) else { return };
        let folder = match self.header.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let other = entry.file_name();
            let Some(other) = other.to_str() else { continue };
            let hashed = other.strip_prefix(name).and_then(|rest| rest.strip_prefix('.'));
            let is_ours =
                hashed.and_then(|rest| rest.split_once('.')).is_some_and(|(hash, ending)| {
                    let hex = hash.bytes().all(|byte| byte.is_ascii_hexdigit());
                    hash.len() == 16 && hex && ["raw", "raw.gz", "zraw"].contains(&ending)
                });
            if is_ours && other != self.kept {
                // One that stays is a waste of room and no harm.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// A number that differs where voxels differ.
fn hash(voxels: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(voxels);
    hasher.finish()
}

fn is_sheared(world_from_index: &DMat4) -> bool {
    let [x, y, z] = [0, 1, 2].map(|axis| world_from_index.col(axis).truncate().normalize_or_zero());
    [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cosine| cosine.abs() > 1e-9)
}

/// What stands beside numbers that have no header, or one that knows no places.
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
        up: grid.up.map(|up| up.name().to_owned()),
        name: (!grid.name.is_empty()).then(|| grid.name.clone()),
        class: grid.class.clone(),
        crc32: Some(format!("{:08x}", crc.sum())),
        older: None,
    }
}

/// Numbers with `separator` between them, each with all its digits.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>, separator: &str) -> String {
    let words: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
    words.join(separator)
}

/// Text for one line of a header.
pub(super) fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ").trim().to_owned()
}

/// The steps from voxel to voxel and the first voxel's centre.
pub(super) fn steps(grid: &DenseGrid) -> ([DVec3; 3], DVec3) {
    let world_from_voxel = grid.world_from_voxel();
    let steps = [0, 1, 2].map(|axis| world_from_voxel.col(axis).truncate());
    (steps, world_from_voxel.w_axis.truncate())
}
