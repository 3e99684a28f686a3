//! Numbers as files store them: types, byte orders, and numbers as text. Knows no format.

use half::f16;

use crate::error::memory;
use crate::error::{Error, Result};
use crate::parallel;

/// Whether a number is finite but too large for f32, in which volumes are stored.
pub fn is_beyond_f32(number: f64) -> bool {
    number.is_finite() && number as f32 == f32::INFINITY
}

/// The error message for a number that [`is_beyond_f32`].
pub fn too_large(number: f64) -> String {
    format!(
        "a voxel holds {number:e}, above the largest f32 ({:.1e}): store it in a larger unit",
        f32::MAX
    )
}

/// Runs the expression with `$type` as an alias of the number type.
macro_rules! for_type {
    ($value_type:expr, $type:ident => $result:expr) => {
        for_type!(@ $value_type, $type => $result;
            U8: u8, I8: i8, U16: u16, I16: i16, U32: u32, I32: i32, U64: u64, I64: i64,
            F16: f16, F32: f32, F64: f64)
    };
    (@ $value_type:expr, $type:ident => $result:expr; $($variant:ident: $number:ty),*) => {
        match $value_type {
            $(ValueType::$variant => {
                type $type = $number;
                $result
            })*
        }
    };
}

/// Number types of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ValueType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

const VALUE_TYPES: [(&str, ValueType, usize); 11] = [
    ("u8", ValueType::U8, 1),
    ("i8", ValueType::I8, 1),
    ("u16", ValueType::U16, 2),
    ("i16", ValueType::I16, 2),
    ("u32", ValueType::U32, 4),
    ("i32", ValueType::I32, 4),
    ("u64", ValueType::U64, 8),
    ("i64", ValueType::I64, 8),
    ("f16", ValueType::F16, 2),
    ("f32", ValueType::F32, 4),
    ("f64", ValueType::F64, 8),
];

impl ValueType {
    /// Bytes of one value.
    pub fn size(self) -> usize {
        VALUE_TYPES.iter().find(|(_, one, _)| *one == self).map_or(1, |(_, _, size)| *size)
    }

    /// The type of this name, or of another that is in use for it: `uint8`, `uchar`, `float32`.
    fn named(text: &str) -> Option<Self> {
        let text = text.to_ascii_lowercase();
        let text = match text.as_str() {
            "uchar" => "u8",
            "char" | "schar" => "i8",
            "ushort" => "u16",
            "short" => "i16",
            "half" => "f16",
            "float" => "f32",
            "double" => "f64",
            other => other,
        };
        let short = ["uint", "int", "float"].into_iter().find_map(|long| {
            let bits = text.strip_prefix(long).filter(|bits| !bits.is_empty())?;
            Some(format!("{}{bits}", &long[..1]))
        });
        let name = short.as_deref().unwrap_or(text);
        VALUE_TYPES.iter().find(|(one, ..)| *one == name).map(|(_, one, _)| *one)
    }

    /// The type's name, such as `u8` or `f32`.
    pub fn name(self) -> &'static str {
        VALUE_TYPES.iter().find(|(_, one, _)| *one == self).map_or("", |(name, ..)| name)
    }
}

impl ValueType {
    /// Smallest and largest number of an integer type; `None` for floating-point numbers.
    pub fn limits(self) -> Option<[f64; 2]> {
        Some(match self {
            Self::U8 => [0.0, u8::MAX.into()],
            Self::I8 => [i8::MIN.into(), i8::MAX.into()],
            Self::U16 => [0.0, u16::MAX.into()],
            Self::I16 => [i16::MIN.into(), i16::MAX.into()],
            Self::U32 => [0.0, u32::MAX.into()],
            Self::I32 => [i32::MIN.into(), i32::MAX.into()],
            Self::U64 => [0.0, u64::MAX as f64],
            Self::I64 => [i64::MIN as f64, i64::MAX as f64],
            Self::F16 | Self::F32 | Self::F64 => return None,
        })
    }

    /// Appends to `bytes` the numbers of this type that are nearest to `values`, little endian. NaN
    /// becomes 0 in integer types.
    pub fn encode(self, values: &[f64], bytes: &mut Vec<u8>) {
        for_type!(self, N => {
            bytes.extend(values.iter().flat_map(|&value| N::of_f64(value).to_le_bytes()));
        });
    }

    /// The numbers of this type in `bytes`; what does not fill a number at the end is left out.
    pub fn decode(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        if endian == Endian::Big && self.size() > 1 {
            let mut turned = bytes.to_vec();
            turned.chunks_exact_mut(self.size()).for_each(<[u8]>::reverse);
            return self.decode(&turned, Endian::Little);
        }
        for_type!(self, N => numbers::<N>(bytes).map(Number::to_f64).collect())
    }
}

impl std::str::FromStr for ValueType {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::named(text).ok_or_else(|| {
            let names = VALUE_TYPES.map(|(name, ..)| name).join(", ");
            Error::value("type", format!("'{text}' is not one of {names}"))
        })
    }
}

/// Byte orders of numbers.
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
            _ => Err(Error::value("endian", format!("'{text}' is not one of little, big"))),
        }
    }
}

/// Numbers that a thread takes at once.
pub(super) const CHUNK: usize = 1 << 13;

/// What the types have in common; wide enough for all but the last digits of 64-bit integers.
trait Number: Copy + std::str::FromStr {
    fn to_f64(self) -> f64;
    /// The nearest number; integers saturate at their limits.
    fn of_f64(value: f64) -> Self;
    /// The number itself if it is an integer, else `None`.
    fn to_i128(self) -> Option<i128>;
    /// The nearest number.
    fn of_i128(value: i128) -> Self;
    /// The number from its little-endian bytes, of which there are as many as it has.
    fn of_le_bytes(bytes: &[u8]) -> Self;
}

macro_rules! integers {
    ($($number:ty),*) => {
        $(impl Number for $number {
            fn to_f64(self) -> f64 {
                self as f64
            }
            fn of_f64(value: f64) -> Self {
                value.round() as Self
            }
            fn to_i128(self) -> Option<i128> {
                Some(self.into())
            }
            fn of_i128(value: i128) -> Self {
                value.clamp(Self::MIN.into(), Self::MAX.into()) as Self
            }
            fn of_le_bytes(bytes: &[u8]) -> Self {
                let mut number = [0; size_of::<Self>()];
                number.copy_from_slice(bytes);
                Self::from_le_bytes(number)
            }
        })*
    };
}
integers!(u8, i8, u16, i16, u32, i32, u64, i64);

macro_rules! floats {
    ($($number:ty),*) => {
        $(impl Number for $number {
            fn to_f64(self) -> f64 {
                self as f64
            }
            fn of_f64(value: f64) -> Self {
                value as Self
            }
            fn to_i128(self) -> Option<i128> {
                None
            }
            fn of_i128(value: i128) -> Self {
                value as Self
            }
            fn of_le_bytes(bytes: &[u8]) -> Self {
                let mut number = [0; size_of::<Self>()];
                number.copy_from_slice(bytes);
                Self::from_le_bytes(number)
            }
        })*
    };
}
floats!(f32, f64);

impl Number for f16 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    fn of_f64(value: f64) -> Self {
        Self::from_f64(value)
    }
    fn to_i128(self) -> Option<i128> {
        None
    }
    fn of_i128(value: i128) -> Self {
        Self::from_f64(value as f64)
    }
    fn of_le_bytes(bytes: &[u8]) -> Self {
        let mut number = [0; size_of::<Self>()];
        number.copy_from_slice(bytes);
        Self::from_le_bytes(number)
    }
}

/// The numbers in `bytes`, each times the slope plus the intercept, by all threads.
pub fn decode(
    bytes: &[u8],
    value_type: ValueType,
    endian: Endian,
    [slope, intercept]: [f64; 2],
) -> Vec<f64> {
    let mut numbers = vec![0.0; bytes.len() / value_type.size()];
    let parts = numbers.chunks_mut(CHUNK).zip(bytes.chunks(CHUNK * value_type.size()));
    parallel::for_each(parts, |(numbers, bytes)| {
        for (number, stored) in numbers.iter_mut().zip(value_type.decode(bytes, endian)) {
            *number = stored * slope + intercept;
        }
    });
    numbers
}

/// Converts little-endian numbers from one type to another, each to the nearest number; integers
/// keep all their digits.
///
/// # Errors
/// If there is not enough memory.
pub fn cast(bytes: &[u8], from: ValueType, to: ValueType) -> Result<Vec<u8>> {
    transformed(bytes, [from.size(), to.size()], |chunk| {
        let mut bytes = Vec::new();
        if from.limits().is_none() {
            to.encode(&from.decode(chunk, Endian::Little), &mut bytes);
            return bytes;
        }
        let whole: Vec<i128> =
            for_type!(from, N => numbers::<N>(chunk).filter_map(Number::to_i128).collect());
        for_type!(to, N => {
            bytes.extend(whole.into_iter().flat_map(|value| N::of_i128(value).to_le_bytes()));
        });
        bytes
    })
}

/// Converts items of `from` bytes into items of `to` bytes with `change`, which is called with
/// several items at a time. All threads work on one part at a time, so little more memory is used
/// than for the result.
///
/// # Errors
/// If there is not enough memory for the result.
pub(super) fn transformed(
    bytes: &[u8],
    [from, to]: [usize; 2],
    change: impl Fn(&[u8]) -> Vec<u8> + Sync,
) -> Result<Vec<u8>> {
    const AT_ONCE: usize = 64;
    let mut all = memory::room(bytes.len() / from * to, "numbers of another type")?;
    for part in bytes.chunks(AT_ONCE * CHUNK * from) {
        for part in parallel::map(part.chunks(CHUNK * from), &change) {
            all.extend_from_slice(&part);
        }
    }
    Ok(all)
}

/// Iterates over the little-endian numbers in `bytes`.
fn numbers<N: Number>(bytes: &[u8]) -> impl Iterator<Item = N> {
    bytes.chunks_exact(size_of::<N>()).map(N::of_le_bytes)
}

/// Parses at most `count` numbers, separated by white space, from a text into little-endian bytes.
///
/// # Errors
/// If a word is not a number of this type; the error names the first such word.
pub fn encode_text(text: &[u8], value_type: ValueType, count: usize) -> Result<Vec<u8>, String> {
    let text = std::str::from_utf8(text).map_err(|error| format!("not text: {error}"))?;
    // An upper bound: each number has a digit at least, and a blank behind it.
    let most = count.min(text.len() / 2 + 1).saturating_mul(value_type.size());
    let mut bytes = memory::room(most, "voxels").map_err(|error| error.to_string())?;
    for word in text.split_ascii_whitespace().take(count) {
        for_type!(value_type, N => {
            let number: N = word.parse().map_err(|_| {
                let word: String = word.chars().take(24).collect();
                format!("'{word}' is not a valid {}", value_type.name())
            })?;
            bytes.extend(number.to_le_bytes());
        });
    }
    Ok(bytes)
}
