//! The typed key-value pairs of a file and of each of its grids. Knows nothing of grids.

use std::collections::BTreeMap;
use std::fmt;

use super::fault::Parsed;
use super::source::{Bytes, Reader};

/// A metadata value, in the type that the file gives it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)] // The variants are the file's own type names.
pub enum MetaValue {
    Bool(bool),
    Int32(i32),
    Int64(i64),
    Float(f32),
    Double(f64),
    String(String),
    Vec2i([i32; 2]),
    Vec2s([f32; 2]),
    Vec2d([f64; 2]),
    Vec3i([i32; 3]),
    Vec3s([f32; 3]),
    Vec3d([f64; 3]),
    Vec4i([i32; 4]),
    Vec4s([f32; 4]),
    Vec4d([f64; 4]),
    /// Sixteen numbers in the file's order.
    Mat4s([f32; 16]),
    /// Sixteen numbers in the file's order.
    Mat4d([f64; 16]),
    /// The bytes of a value that cannot be interpreted: of an unknown type, with a size that does
    /// not fit the type, or a string that is not UTF-8.
    Other {
        type_name: String,
        bytes: Vec<u8>,
    },
}

impl MetaValue {
    /// The type's name in the file.
    pub fn type_name(&self) -> &str {
        match self {
            Self::Bool(_) => "bool",
            Self::Int32(_) => "int32",
            Self::Int64(_) => "int64",
            Self::Float(_) => "float",
            Self::Double(_) => "double",
            Self::String(_) => "string",
            Self::Vec2i(_) => "vec2i",
            Self::Vec2s(_) => "vec2s",
            Self::Vec2d(_) => "vec2d",
            Self::Vec3i(_) => "vec3i",
            Self::Vec3s(_) => "vec3s",
            Self::Vec3d(_) => "vec3d",
            Self::Vec4i(_) => "vec4i",
            Self::Vec4s(_) => "vec4s",
            Self::Vec4d(_) => "vec4d",
            Self::Mat4s(_) => "mat4s",
            Self::Mat4d(_) => "mat4d",
            Self::Other { type_name, .. } => type_name,
        }
    }

    /// The value's bytes in the file.
    fn bytes(&self) -> Vec<u8> {
        fn all<const N: usize>(parts: impl IntoIterator<Item = [u8; N]>) -> Vec<u8> {
            parts.into_iter().flatten().collect()
        }
        match self {
            Self::Bool(value) => vec![u8::from(*value)],
            Self::Int32(value) => value.to_le_bytes().to_vec(),
            Self::Int64(value) => value.to_le_bytes().to_vec(),
            Self::Float(value) => value.to_le_bytes().to_vec(),
            Self::Double(value) => value.to_le_bytes().to_vec(),
            Self::String(text) => text.as_bytes().to_vec(),
            Self::Vec2i(values) => all(values.map(i32::to_le_bytes)),
            Self::Vec2s(values) => all(values.map(f32::to_le_bytes)),
            Self::Vec2d(values) => all(values.map(f64::to_le_bytes)),
            Self::Vec3i(values) => all(values.map(i32::to_le_bytes)),
            Self::Vec3s(values) => all(values.map(f32::to_le_bytes)),
            Self::Vec3d(values) => all(values.map(f64::to_le_bytes)),
            Self::Vec4i(values) => all(values.map(i32::to_le_bytes)),
            Self::Vec4s(values) => all(values.map(f32::to_le_bytes)),
            Self::Vec4d(values) => all(values.map(f64::to_le_bytes)),
            Self::Mat4s(values) => all(values.map(f32::to_le_bytes)),
            Self::Mat4d(values) => all(values.map(f64::to_le_bytes)),
            Self::Other { bytes, .. } => bytes.clone(),
        }
    }

    fn parse(type_name: &str, data: &[u8], start: u64) -> Self {
        let mut bytes = Bytes::new(data, start);
        let value = Self::parse_known(type_name, &mut bytes);
        match value {
            Ok(Some(value)) if bytes.rest().is_empty() => value,
            _ => Self::Other { type_name: type_name.to_owned(), bytes: data.to_owned() },
        }
    }

    fn parse_known(type_name: &str, bytes: &mut Bytes) -> Parsed<Option<Self>> {
        Ok(Some(match type_name {
            "bool" => Self::Bool(bytes.u8()? != 0),
            "int32" => Self::Int32(bytes.i32()?),
            "int64" => Self::Int64(bytes.i64()?),
            "float" => Self::Float(bytes.f32()?),
            "double" => Self::Double(bytes.f64()?),
            "string" => {
                let text = bytes.take(bytes.rest().len())?;
                let Ok(text) = std::str::from_utf8(text) else { return Ok(None) };
                Self::String(text.to_owned())
            }
            "vec2i" => Self::Vec2i(bytes.each(Bytes::i32)?),
            "vec2s" => Self::Vec2s(bytes.each(Bytes::f32)?),
            "vec2d" => Self::Vec2d(bytes.each(Bytes::f64)?),
            "vec3i" => Self::Vec3i(bytes.each(Bytes::i32)?),
            "vec3s" => Self::Vec3s(bytes.each(Bytes::f32)?),
            "vec3d" => Self::Vec3d(bytes.each(Bytes::f64)?),
            "vec4i" => Self::Vec4i(bytes.each(Bytes::i32)?),
            "vec4s" => Self::Vec4s(bytes.each(Bytes::f32)?),
            "vec4d" => Self::Vec4d(bytes.each(Bytes::f64)?),
            "mat4s" => Self::Mat4s(bytes.each(Bytes::f32)?),
            "mat4d" => Self::Mat4d(bytes.each(Bytes::f64)?),
            _ => return Ok(None),
        }))
    }
}

/// For people: numbers separated by commas, text unchanged.
impl fmt::Display for MetaValue {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        fn list<T: ToString>(values: &[T]) -> String {
            values.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
        }
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Int32(value) => write!(f, "{value}"),
            Self::Int64(value) => write!(f, "{value}"),
            Self::Float(value) => write!(f, "{value}"),
            Self::Double(value) => write!(f, "{value}"),
            Self::String(text) => f.write_str(text),
            Self::Vec2i(values) => f.write_str(&list(values)),
            Self::Vec2s(values) => f.write_str(&list(values)),
            Self::Vec2d(values) => f.write_str(&list(values)),
            Self::Vec3i(values) => f.write_str(&list(values)),
            Self::Vec3s(values) => f.write_str(&list(values)),
            Self::Vec3d(values) => f.write_str(&list(values)),
            Self::Vec4i(values) => f.write_str(&list(values)),
            Self::Vec4s(values) => f.write_str(&list(values)),
            Self::Vec4d(values) => f.write_str(&list(values)),
            Self::Mat4s(values) => f.write_str(&list(values)),
            Self::Mat4d(values) => f.write_str(&list(values)),
            Self::Other { type_name, bytes } => {
                write!(f, "{} bytes of type {type_name}", bytes.len())
            }
        }
    }
}

/// Metadata in the order of the file. If a broken file repeats a key, the last value counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    entries: Vec<(String, MetaValue)>,
}

impl Metadata {
    /// The value under `key`.
    pub fn get(&self, key: &str) -> Option<&MetaValue> {
        self.entries.iter().rev().find(|(name, _)| name == key).map(|(_, value)| value)
    }

    /// The value under `key`, if it is a string.
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.get(key) {
            Some(MetaValue::String(text)) => Some(text),
            _ => None,
        }
    }

    /// All keys and values, in the order of the file.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&str, &MetaValue)> {
        self.entries.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Sets the value under `key`, replacing an existing one.
    pub fn set(&mut self, key: &str, value: MetaValue) {
        self.remove(key);
        self.entries.push((key.to_owned(), value));
    }

    /// Removes the value under `key`.
    pub fn remove(&mut self, key: &str) {
        self.entries.retain(|(name, _)| name != key);
    }

    /// Appends the entries in the file's encoding, each key once and sorted by key, as OpenVDB
    /// does.
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        let sorted: BTreeMap<&str, &MetaValue> = self.iter().collect();
        out.extend((sorted.len() as u32).to_le_bytes());
        for (key, value) in sorted {
            put_text(out, key);
            put_text(out, value.type_name());
            let bytes = value.bytes();
            out.extend((bytes.len() as u32).to_le_bytes());
            out.extend(bytes);
        }
    }

    /// Reads the entries one by one, so that a wrong count stops at the end of the bytes.
    pub(super) fn read(reader: &mut Reader) -> Parsed<Self> {
        let count = reader.u32()?;
        let mut entries = Vec::new();
        for _ in 0..count {
            entries.push(reader.parse(|bytes| {
                let key = bytes.string()?;
                let type_name = bytes.string()?;
                let start = bytes.position();
                let value = MetaValue::parse(&type_name, bytes.counted()?, start);
                Ok((key, value))
            })?);
        }
        Ok(Self { entries })
    }
}

/// Appends a string, preceded by its length.
pub(super) fn put_text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}
