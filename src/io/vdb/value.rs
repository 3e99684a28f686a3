//! The types that a voxel can have, their encoding in the file, and their conversion to numbers.
//! Knows nothing of trees or compression.

use std::fmt::Debug;

use half::f16;

/// A voxel's type. Implemented for `f32`, `f64`, `f16`, `i32`, `i64`, `bool` and arrays of three
/// `f32`, `f64` or `i32`; sealed.
pub trait Value: Stored + Copy + Default + Debug + PartialEq + Send + Sync + 'static {
    /// Numbers in a value: 1 or 3.
    const COMPONENTS: usize;

    /// The number at `component`, which is below [`Value::COMPONENTS`] (larger ones mean the last).
    /// It is exact except for `i64` beyond 2^53. Booleans are 0 and 1.
    fn component(self, component: usize) -> f64;

    /// One number for rendering: the value itself, the length of a vector, 0 or 1 for a boolean.
    fn to_f32(self) -> f32;

    /// The value as an [`AnyValue`].
    fn any(self) -> AnyValue;
}

/// The encoding of a value in the file.
pub trait Stored: Sized {
    /// Bytes of a value at full precision.
    #[doc(hidden)]
    const BYTES: usize;
    /// Bytes of a value stored as half floats; `None` for types without that form.
    #[doc(hidden)]
    const HALF_BYTES: Option<usize>;
    /// Fills `values` from as many values at full precision.
    #[doc(hidden)]
    fn decode(bytes: &[u8], values: &mut [Self]);
    /// Fills `values` from as many values stored as half floats.
    #[doc(hidden)]
    fn decode_half(bytes: &[u8], values: &mut [Self]);
    /// Bytes of one number of a value at full precision.
    #[doc(hidden)]
    const PART_BYTES: usize;
    /// Appends the values at full precision.
    #[doc(hidden)]
    fn encode(values: &[Self], bytes: &mut Vec<u8>);
    /// Appends the values as half floats; nothing for types without that form.
    #[doc(hidden)]
    fn encode_half(values: &[Self], bytes: &mut Vec<u8>);
    /// The value after rounding to half floats.
    #[doc(hidden)]
    fn through_half(self) -> Self;
    /// The negated value; for a boolean its opposite.
    #[doc(hidden)]
    fn negated(self) -> Self;
    /// Whether both have the same bits; so -0 differs from 0, and NaN equals itself.
    #[doc(hidden)]
    fn same_bits(self, other: Self) -> bool;
}

/// One value of any type that a grid can have.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)] // The variants are the file's own type names.
pub enum AnyValue {
    Float(f32),
    Double(f64),
    Half(f16),
    Int32(i32),
    Int64(i64),
    Bool(bool),
    Vec3s([f32; 3]),
    Vec3d([f64; 3]),
    Vec3i([i32; 3]),
}

macro_rules! number {
    ($type:ty, $variant:ident, $half:expr, $from_half:expr, $to_half:expr, $negated:expr) => {
        impl Value for $type {
            const COMPONENTS: usize = 1;
            fn component(self, _: usize) -> f64 {
                self as f64
            }
            fn to_f32(self) -> f32 {
                self as f32
            }
            fn any(self) -> AnyValue {
                AnyValue::$variant(self)
            }
        }

        impl Stored for $type {
            const BYTES: usize = size_of::<$type>();
            const HALF_BYTES: Option<usize> = $half;
            fn decode(bytes: &[u8], values: &mut [Self]) {
                for (value, bytes) in values.iter_mut().zip(bytes.as_chunks().0) {
                    *value = Self::from_le_bytes(*bytes);
                }
            }
            fn decode_half(bytes: &[u8], values: &mut [Self]) {
                for (value, bytes) in values.iter_mut().zip(bytes.as_chunks().0) {
                    *value = $from_half(f16::from_le_bytes(*bytes));
                }
            }
            const PART_BYTES: usize = size_of::<$type>();
            fn encode(values: &[Self], bytes: &mut Vec<u8>) {
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            fn encode_half(values: &[Self], bytes: &mut Vec<u8>) {
                let halves = values.iter().filter_map($to_half);
                bytes.extend(halves.flat_map(f16::to_le_bytes));
            }
            fn through_half(self) -> Self {
                $to_half(&self).map_or(self, $from_half)
            }
            fn negated(self) -> Self {
                $negated(self)
            }
            fn same_bits(self, other: Self) -> bool {
                self.to_le_bytes() == other.to_le_bytes()
            }
        }
    };
}

number!(f32, Float, Some(2), f16::to_f32, |&value: &f32| Some(f16::from_f32(value)), |v: f32| -v);
number!(f64, Double, Some(2), f16::to_f64, |&value: &f64| Some(f16::from_f64(value)), |v: f64| -v);
// Integers are never stored as half floats.
number!(i32, Int32, None, |half: f16| half.to_f32() as i32, |_: &i32| None, i32::wrapping_neg);
number!(i64, Int64, None, |half: f16| half.to_f32() as i64, |_: &i64| None, i64::wrapping_neg);

macro_rules! vector {
    ($type:ty, $variant:ident) => {
        impl Value for [$type; 3] {
            const COMPONENTS: usize = 3;
            fn component(self, component: usize) -> f64 {
                self[component.min(2)] as f64
            }
            fn to_f32(self) -> f32 {
                self.map(|part| part as f64 * part as f64).iter().sum::<f64>().sqrt() as f32
            }
            fn any(self) -> AnyValue {
                AnyValue::$variant(self)
            }
        }

        impl Stored for [$type; 3] {
            const BYTES: usize = 3 * <$type>::BYTES;
            const HALF_BYTES: Option<usize> = match <$type>::HALF_BYTES {
                Some(bytes) => Some(3 * bytes),
                None => None,
            };
            fn decode(bytes: &[u8], values: &mut [Self]) {
                <$type>::decode(bytes, values.as_flattened_mut());
            }
            fn decode_half(bytes: &[u8], values: &mut [Self]) {
                <$type>::decode_half(bytes, values.as_flattened_mut());
            }
            const PART_BYTES: usize = <$type>::PART_BYTES;
            fn encode(values: &[Self], bytes: &mut Vec<u8>) {
                <$type>::encode(values.as_flattened(), bytes);
            }
            fn encode_half(values: &[Self], bytes: &mut Vec<u8>) {
                <$type>::encode_half(values.as_flattened(), bytes);
            }
            fn through_half(self) -> Self {
                self.map(Stored::through_half)
            }
            fn negated(self) -> Self {
                self.map(Stored::negated)
            }
            fn same_bits(self, other: Self) -> bool {
                (0..3).all(|part| self[part].same_bits(other[part]))
            }
        }
    };
}

vector!(f32, Vec3s);
vector!(f64, Vec3d);
vector!(i32, Vec3i);

impl Value for f16 {
    const COMPONENTS: usize = 1;
    fn component(self, _: usize) -> f64 {
        self.to_f64()
    }
    fn to_f32(self) -> f32 {
        self.to_f32()
    }
    fn any(self) -> AnyValue {
        AnyValue::Half(self)
    }
}

impl Stored for f16 {
    const BYTES: usize = 2;
    const HALF_BYTES: Option<usize> = Some(2);
    fn decode(bytes: &[u8], values: &mut [Self]) {
        for (value, bytes) in values.iter_mut().zip(bytes.as_chunks().0) {
            *value = Self::from_le_bytes(*bytes);
        }
    }
    fn decode_half(bytes: &[u8], values: &mut [Self]) {
        Self::decode(bytes, values);
    }
    const PART_BYTES: usize = 2;
    fn encode(values: &[Self], bytes: &mut Vec<u8>) {
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    fn encode_half(values: &[Self], bytes: &mut Vec<u8>) {
        Self::encode(values, bytes);
    }
    fn through_half(self) -> Self {
        self
    }
    fn negated(self) -> Self {
        -self
    }
    fn same_bits(self, other: Self) -> bool {
        self.to_bits() == other.to_bits()
    }
}

impl Value for bool {
    const COMPONENTS: usize = 1;
    fn component(self, _: usize) -> f64 {
        f64::from(u8::from(self))
    }
    fn to_f32(self) -> f32 {
        f32::from(u8::from(self))
    }
    fn any(self) -> AnyValue {
        AnyValue::Bool(self)
    }
}

impl Stored for bool {
    const BYTES: usize = 1;
    const HALF_BYTES: Option<usize> = None;
    fn decode(bytes: &[u8], values: &mut [Self]) {
        for (value, &byte) in values.iter_mut().zip(bytes) {
            *value = byte != 0;
        }
    }
    fn decode_half(_: &[u8], _: &mut [Self]) {}
    const PART_BYTES: usize = 1;
    fn encode(values: &[Self], bytes: &mut Vec<u8>) {
        bytes.extend(values.iter().map(|&value| u8::from(value)));
    }
    fn encode_half(_: &[Self], _: &mut Vec<u8>) {}
    fn through_half(self) -> Self {
        self
    }
    fn negated(self) -> Self {
        !self
    }
    fn same_bits(self, other: Self) -> bool {
        self == other
    }
}
