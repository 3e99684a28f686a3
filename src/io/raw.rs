//! Raw voxels: numbers and nothing else, x fastest, described by options or by a sidecar.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DMat4;
use half::f16;
use ndarray::Array3;
use rayon::prelude::*;
use serde::Deserialize;

use crate::error::{Error, ErrorKind, Result};
use crate::volume::MAX_DIM;

/// The number types of raw voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ValueType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F16,
    F32,
    F64,
}

const VALUE_TYPES: [(&str, ValueType, usize); 9] = [
    ("u8", ValueType::U8, 1),
    ("i8", ValueType::I8, 1),
    ("u16", ValueType::U16, 2),
    ("i16", ValueType::I16, 2),
    ("u32", ValueType::U32, 4),
    ("i32", ValueType::I32, 4),
    ("f16", ValueType::F16, 2),
    ("f32", ValueType::F32, 4),
    ("f64", ValueType::F64, 8),
];

impl ValueType {
    /// Bytes of one value.
    pub fn size(self) -> usize {
        VALUE_TYPES.iter().find(|(_, one, _)| *one == self).map_or(1, |(_, _, size)| *size)
    }
}

impl std::str::FromStr for ValueType {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let found = VALUE_TYPES.iter().find(|(name, ..)| *name == text).map(|(_, one, _)| *one);
        found.ok_or_else(|| {
            let names = VALUE_TYPES.map(|(name, ..)| name).join(", ");
            Error::value("type", format!("'{text}' is none of {names}"))
        })
    }
}

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Endian {
    #[default]
    Little,
    Big,
}

impl std::str::FromStr for Endian {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "little" => Ok(Self::Little),
            "big" => Ok(Self::Big),
            _ => Err(Error::value("endian", format!("'{text}' is none of little, big"))),
        }
    }
}

/// What a raw file does not say itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Voxels along x, y, z; x is fastest.
    pub dims: [usize; 3],
    /// Number type.
    pub value_type: ValueType,
    /// Byte order.
    pub endian: Endian,
}

/// A sidecar, `NAME.toml` beside `NAME.raw`; every key is optional.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Sidecar {
    pub dims: Option<[usize; 3]>,
    #[serde(rename = "type")]
    pub value_type: Option<String>,
    pub endian: Option<String>,
    pub spacing: Option<[f64; 3]>,
    /// Rows, for column vectors.
    pub world_from_index: Option<[[f64; 4]; 4]>,
    pub index_origin: Option<[f64; 3]>,
    pub background: Option<f64>,
    pub up: Option<String>,
}

impl Sidecar {
    /// The sidecar of the raw file `path`, if there is one, and its own path.
    ///
    /// # Errors
    /// If there is one that cannot be read.
    pub fn beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        let beside = path.with_extension("toml");
        if beside == path || !beside.is_file() {
            return Ok(None);
        }
        let text = fs::read_to_string(&beside).map_err(|error| Error::file(&beside, error))?;
        let sidecar = toml::from_str(&text)
            .map_err(|error| Error::contents(&beside, error.message().replace('\n', " ")))?;
        Ok(Some((beside, sidecar)))
    }

    /// From voxel index to the file's own world; `None` if the sidecar does not say.
    pub fn world_from_index(&self) -> Option<DMat4> {
        let origin = glam::DVec3::from(self.index_origin.unwrap_or_default());
        let placed = match (self.world_from_index, self.spacing) {
            (Some(rows), _) => DMat4::from_cols_array_2d(&rows).transpose(),
            (None, Some(spacing)) => DMat4::from_scale(spacing.into()),
            (None, None) if self.index_origin.is_some() => DMat4::IDENTITY,
            (None, None) => return None,
        };
        Some(placed * DMat4::from_translation(origin))
    }
}

/// Reads the voxels of a raw file, shape (z, y, x), as f32; integers keep their values (above 2^24
/// to f32's precision).
///
/// # Errors
/// If the file cannot be read or does not have exactly the size that `layout` says.
pub fn read(path: &Path, layout: &RawLayout) -> Result<Array3<f32>> {
    let [nx, ny, nz] = layout.dims;
    if layout.dims.iter().any(|&n| n == 0 || n > MAX_DIM) {
        let why = format!("{nx},{ny},{nz} must each be 1 to {MAX_DIM}");
        return Err(Error::value("dims", why));
    }
    // Three factors of at most 2^20 and a few bytes each fit u128 and mostly u64.
    let expected = nx as u128 * ny as u128 * nz as u128 * layout.value_type.size() as u128;
    let failed = |error| Error::file(path, error);
    let size = fs::metadata(path).map_err(failed)?.len();
    if u128::from(size) != expected {
        let why = format!("{size} bytes, but dims {nx},{ny},{nz} of this type take {expected}");
        return Err(Error::contents(path, why));
    }
    let bytes = fs::read(path).map_err(failed)?;
    let values = decode(&bytes, layout.value_type, layout.endian);
    Array3::from_shape_vec((nz, ny, nx), values).map_err(|error| {
        // The file changed between asking for its size and reading it.
        Error::contents(path, error.to_string())
    })
}

fn decode(bytes: &[u8], value_type: ValueType, endian: Endian) -> Vec<f32> {
    macro_rules! numbers {
        ($type:ty, $to_f32:expr) => {
            bytes
                .par_chunks_exact(size_of::<$type>())
                .with_min_len(1 << 14)
                .map(|chunk| {
                    let mut number = [0; size_of::<$type>()];
                    number.copy_from_slice(chunk);
                    let number = match endian {
                        Endian::Little => <$type>::from_le_bytes(number),
                        Endian::Big => <$type>::from_be_bytes(number),
                    };
                    $to_f32(number)
                })
                .collect()
        };
    }
    match value_type {
        ValueType::U8 => numbers!(u8, f32::from),
        ValueType::I8 => numbers!(i8, f32::from),
        ValueType::U16 => numbers!(u16, f32::from),
        ValueType::I16 => numbers!(i16, f32::from),
        ValueType::U32 => numbers!(u32, |n| n as f32),
        ValueType::I32 => numbers!(i32, |n| n as f32),
        ValueType::F16 => numbers!(f16, f16::to_f32),
        ValueType::F32 => numbers!(f32, |n| n),
        ValueType::F64 => numbers!(f64, |n| n as f32),
    }
}

/// An error for a raw file that nothing describes.
pub fn undescribed(path: &Path, missing: &str) -> Error {
    ErrorKind::Contents {
        path: path.to_owned(),
        why: format!(
            "no format that this program reads; raw voxels need {missing} (or a sidecar {})",
            path.with_extension("toml").display()
        ),
    }
    .into()
}
