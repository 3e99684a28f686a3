//! Attributes: named values in a file's header, and their bytes. Knows no particular attribute.

use glam::{DMat4, DVec3};

use super::cursor::Cursor;

/// The value of an attribute. Types that are not listed keep their bytes.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)] // The variants are the format's own types.
pub enum Attribute {
    Int(i32),
    Float(f32),
    Double(f64),
    /// `string`
    Text(String),
    IntVec2([i32; 2]),
    IntVec3([i32; 3]),
    FloatVec2([f32; 2]),
    FloatVec3([f32; 3]),
    /// Row by row.
    Matrix3x3([f32; 9]),
    /// Row by row; the matrices that this crate writes are for column vectors.
    Matrix4x4([f32; 16]),
    /// The lowest x, y and the highest x, y, both included.
    IntBox2([i32; 4]),
    FloatBox2([f32; 4]),
    Other {
        type_name: String,
        bytes: Vec<u8>,
    },
}

impl From<&str> for Attribute {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<i32> for Attribute {
    fn from(value: i32) -> Self {
        Self::Int(value)
    }
}

impl From<f32> for Attribute {
    fn from(value: f32) -> Self {
        Self::Float(value)
    }
}

impl From<DVec3> for Attribute {
    fn from(vector: DVec3) -> Self {
        Self::FloatVec3(vector.as_vec3().to_array())
    }
}

/// Row by row, for column vectors, like the matrices in the maps of [`crate::io::exr`].
impl From<&DMat4> for Attribute {
    fn from(matrix: &DMat4) -> Self {
        Self::Matrix4x4(matrix.transpose().to_cols_array().map(|x| x as f32))
    }
}

impl Attribute {
    /// The type's name in a file.
    pub fn type_name(&self) -> &str {
        match self {
            Self::Int(_) => "int",
            Self::Float(_) => "float",
            Self::Double(_) => "double",
            Self::Text(_) => "string",
            Self::IntVec2(_) => "v2i",
            Self::IntVec3(_) => "v3i",
            Self::FloatVec2(_) => "v2f",
            Self::FloatVec3(_) => "v3f",
            Self::Matrix3x3(_) => "m33f",
            Self::Matrix4x4(_) => "m44f",
            Self::IntBox2(_) => "box2i",
            Self::FloatBox2(_) => "box2f",
            Self::Other { type_name, .. } => type_name,
        }
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let ints = |values: &[i32]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
        match self {
            Self::Int(value) => ints(&[*value]),
            Self::Float(value) => floats(&[*value]),
            Self::Double(value) => value.to_le_bytes().to_vec(),
            Self::Text(text) => text.as_bytes().to_vec(),
            Self::IntVec2(values) => ints(values),
            Self::IntVec3(values) => ints(values),
            Self::FloatVec2(values) => floats(values),
            Self::FloatVec3(values) => floats(values),
            Self::Matrix3x3(values) => floats(values),
            Self::Matrix4x4(values) => floats(values),
            Self::IntBox2(values) => ints(values),
            Self::FloatBox2(values) => floats(values),
            Self::Other { bytes, .. } => bytes.clone(),
        }
    }

    /// The value in `bytes`; if the size does not fit a known type, the bytes are kept.
    pub(super) fn from_bytes(type_name: &str, bytes: &[u8]) -> Self {
        let mut cursor = Cursor::new(bytes);
        let known = match type_name {
            "int" => cursor.i32().map(Self::Int),
            "float" => cursor.f32().map(Self::Float),
            "double" => cursor.array().map(|bytes| Self::Double(f64::from_le_bytes(bytes))),
            "string" => {
                let text = cursor.rest();
                Ok(Self::Text(String::from_utf8_lossy(text).into_owned()))
            }
            "v2i" => cursor.each(Cursor::i32).map(Self::IntVec2),
            "v3i" => cursor.each(Cursor::i32).map(Self::IntVec3),
            "v2f" => cursor.each(Cursor::f32).map(Self::FloatVec2),
            "v3f" => cursor.each(Cursor::f32).map(Self::FloatVec3),
            "m33f" => cursor.each(Cursor::f32).map(Self::Matrix3x3),
            "m44f" => cursor.each(Cursor::f32).map(Self::Matrix4x4),
            "box2i" => cursor.each(Cursor::i32).map(Self::IntBox2),
            "box2f" => cursor.each(Cursor::f32).map(Self::FloatBox2),
            _ => Err(String::new()),
        };
        match known {
            Ok(value) if cursor.is_empty() => value,
            _ => Self::Other { type_name: type_name.to_owned(), bytes: bytes.to_vec() },
        }
    }
}
