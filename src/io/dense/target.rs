//! The formats that dense voxels are written in: their features, and what each cannot store.

use std::path::Path;

use glam::DMat4;

use super::grid::DenseGrid;
use super::{Space, metaimage, nrrd};

/// A format that dense voxels are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DenseTarget {
    /// NumPy, with a sidecar.
    Npy,
    /// Numbers without a header, with a sidecar.
    Raw,
    /// NRRD as one file, or as a header beside its voxels.
    Nrrd {
        /// Whether the voxels are in a second file.
        detached: bool,
    },
    /// MetaImage as one file, or as a header beside its voxels.
    MetaImage {
        /// Whether the voxels are in a second file.
        detached: bool,
    },
}

impl DenseTarget {
    /// The format for the ending of a file name; `None` if it is none of these.
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

    /// The name of the format's compression; `None` if it has none.
    pub fn compression(self) -> Option<&'static str> {
        match self {
            Self::Npy | Self::Raw => None,
            Self::Nrrd { .. } => Some("gzip"),
            Self::MetaImage { .. } => Some("zlib"),
        }
    }

    /// Whether the format can store half floats.
    pub fn has_half(self) -> bool {
        matches!(self, Self::Npy | Self::Raw)
    }

    /// The header for the voxels of `grid`. They are packed to `packed` bytes or not, and lie in
    /// the file `name` or directly behind the header.
    pub(super) fn head(
        self,
        grid: &DenseGrid,
        packed: Option<usize>,
        name: Option<&str>,
    ) -> String {
        match self {
            Self::MetaImage { .. } => metaimage::head(grid, packed, name),
            _ => nrrd::head(grid, packed.is_some(), name),
        }
    }

    /// What the format cannot store of a grid, as text.
    pub(super) fn losses(self, grid: &DenseGrid) -> Vec<String> {
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
                "that axes are not at right angles, for programs that expect them to be".to_owned(),
            );
        }
        if let (Self::MetaImage { .. }, Some(space)) = (self, grid.space)
            && space != Space::Lps
        {
            let consequence = "programs will take it for LPS, the space of a patient";
            lost.push(format!("the space '{}' ({consequence})", space.name()));
        }
        lost
    }
}

/// Cosines between axes below this are rounding errors: headers have single precision, or text of
/// six digits.
const RIGHT_ANGLE: f64 = 1e-5;

pub(super) fn is_sheared(world_from_index: &DMat4) -> bool {
    let [x, y, z] = [0, 1, 2].map(|axis| world_from_index.col(axis).truncate().normalize_or_zero());
    [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cosine| cosine.abs() > RIGHT_ANGLE)
}
