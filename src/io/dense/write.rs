//! Dense voxels as files: which files a format has, and what it cannot hold. How a header looks is
//! each format's own matter.

use std::io::Write;
use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};

use super::grid::DenseGrid;
use super::packing::{Feed, gzipped, refused, zlibbed};
use super::{metaimage, npy, nrrd};
use crate::error::{Error, Result};
use crate::io::number::ValueType;
use crate::io::remap::Remap;
use crate::io::sidecar::{Background, Sidecar};

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

/// A file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFile {
    /// Where it belongs.
    pub path: PathBuf,
    /// Its bytes, in pieces that follow one another.
    pub parts: Vec<Vec<u8>>,
}

/// What becomes of a grid in a format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// All files; the first is the one that was asked for.
    pub files: Vec<OutputFile>,
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

    /// The files that a grid becomes at `path`; the first is `path` itself.
    pub fn paths(self, path: &Path, packed: bool) -> Vec<PathBuf> {
        let beside = match self {
            Self::Npy | Self::Raw => Sidecar::path_beside(path),
            Self::Nrrd { .. } | Self::MetaImage { .. } => {
                self.voxels_ending(packed).map(|ending| path.with_extension(ending))
            }
        };
        [Some(path.to_owned()), beside].into_iter().flatten().collect()
    }

    /// The ending of the second file that holds the voxels.
    fn voxels_ending(self, packed: bool) -> Option<&'static str> {
        match (self, packed) {
            (Self::Nrrd { detached: true } | Self::MetaImage { detached: true }, false) => {
                Some("raw")
            }
            (Self::Nrrd { detached: true }, true) => Some("raw.gz"),
            (Self::MetaImage { detached: true }, true) => Some("zraw"),
            _ => None,
        }
    }

    /// The contents of the files that a grid becomes at `path`, the voxels `packed` where the format can.
    ///
    /// # Errors
    /// If a name cannot be put into a header.
    pub fn encode(self, grid: DenseGrid, path: &Path, packed: bool) -> Result<Written> {
        self.encode_from(grid, path, packed, None)
    }

    /// The same; what is packed are the voxels that `feed` writes, if there is such, and not the grid's.
    pub(super) fn encode_from(
        self,
        grid: DenseGrid,
        path: &Path,
        packed: bool,
        feed: Option<&Feed>,
    ) -> Result<Written> {
        let mut lost = Vec::new();
        let grid = if grid.value_type == ValueType::F16 && !self.has_half() {
            lost.push("half floats (it has float, which holds all of them)".to_owned());
            grid.retyped(ValueType::F32, Remap::Cast)?
        } else {
            grid
        };
        lost.extend(self.losses(&grid));
        let packed = packed && self.compression().is_some();
        let (voxels_path, name) = self.voxels_place(path, packed)?;
        let name = name.as_deref();
        let sidecar = matches!(self, Self::Npy | Self::Raw).then(|| sidecar(&grid).text());
        let own = |out: &mut dyn Write| out.write_all(&grid.bytes).map_err(refused);
        let feed = feed.unwrap_or(&own);
        let voxels = match self {
            Self::Nrrd { .. } if packed => Some(gzipped(feed)?),
            Self::MetaImage { .. } if packed => Some(zlibbed(feed)?),
            _ => None,
        };
        let head = match self {
            Self::Npy => npy::head(&grid),
            Self::Raw => Vec::new(),
            Self::Nrrd { .. } => nrrd::head(&grid, packed, name).into_bytes(),
            Self::MetaImage { .. } => {
                let bytes = voxels.as_ref().map(|parts| parts.iter().map(Vec::len).sum());
                metaimage::head(&grid, bytes, name).into_bytes()
            }
        };
        let voxels = voxels.unwrap_or_else(|| vec![grid.bytes]);
        let mut files = match voxels_path {
            Some(other) => vec![
                OutputFile { path: path.to_owned(), parts: vec![head] },
                OutputFile { path: other, parts: voxels },
            ],
            None => {
                let parts = std::iter::once(head).chain(voxels).collect();
                vec![OutputFile { path: path.to_owned(), parts }]
            }
        };
        if let (Some(text), Some(path)) = (sidecar, Sidecar::path_beside(path)) {
            files.push(OutputFile { path, parts: vec![text.into_bytes()] });
        }
        Ok(Written { files, lost })
    }

    /// Where the voxels go if not behind the header, and what the header calls that file.
    fn voxels_place(self, path: &Path, packed: bool) -> Result<(Option<PathBuf>, Option<String>)> {
        let Some(ending) = self.voxels_ending(packed) else { return Ok((None, None)) };
        let other = path.with_extension(ending);
        let name = other.file_name().and_then(|name| name.to_str()).map(str::to_owned);
        let plain = |name: &String| name.trim() == name && !name.contains(char::is_control);
        let name = name.filter(plain).ok_or_else(|| {
            Error::contents(path, "its header cannot hold a name that is no plain text")
        })?;
        Ok((Some(other), Some(name)))
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

fn is_sheared(world_from_index: &DMat4) -> bool {
    let [x, y, z] = [0, 1, 2].map(|axis| world_from_index.col(axis).truncate().normalize_or_zero());
    [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cosine| cosine.abs() > 1e-9)
}

/// What stands beside numbers that have no header, or one that knows no places.
fn sidecar(grid: &DenseGrid) -> Sidecar {
    let rows = grid.world_from_index.transpose().to_cols_array_2d();
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
