//! The numbers of a glTF document: accessors, which are typed views of buffers. Every range is
//! checked before it is read.

use glam::Vec3;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Root, buffer};

use super::gltf_buffers::Buffers;
use super::input::{Input, f32_of, u32_of};
use crate::error::Result;
use crate::error::memory;

/// Reads accessors.
pub(super) struct Reader<'a, 'i, 'b> {
    pub(super) root: &'a Root,
    pub(super) input: &'a mut Input<'i>,
    pub(super) buffers: &'a mut Buffers<'b>,
}

/// Equally spaced items in a buffer.
struct Items {
    /// The accessor, for errors.
    accessor: usize,
    view: usize,
    offset: u64,
    count: u64,
    /// Bytes of an item.
    size: u64,
}

impl Reader<'_, '_, '_> {
    /// An accessor, its number of items and the type of their numbers.
    fn accessor(&self, index: usize, kind: Type) -> Result<(&Accessor, u64, ComponentType)> {
        let all = &self.root.accessors;
        let why = || self.input.bad(format!("accessor {index} of {}", all.len()));
        let accessor = all.get(index).ok_or_else(why)?;
        match (&accessor.type_, &accessor.component_type) {
            (Checked::Valid(found), Checked::Valid(component)) if *found == kind => {
                Ok((accessor, accessor.count.0, component.0))
            }
            _ => Err(self.input.bad(format!("accessor {index} is not of the type {kind:?}"))),
        }
    }

    /// Three numbers each. What is stored as integers is converted as the accessor says.
    pub(super) fn vectors(&mut self, index: usize) -> Result<Vec<Vec3>> {
        let (accessor, count, component) = self.accessor(index, Type::Vec3)?;
        let normalized = accessor.normalized;
        let (view, sparse) = (accessor.buffer_view, accessor.sparse.clone());
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let vector = move |bytes: &[u8]| {
            let number = |i: usize| real(&bytes[i * component.size()..], component, normalized);
            Vec3::new(number(0), number(1), number(2))
        };
        let size = 3 * component.size() as u64;
        let mut vectors = match view {
            Some(view) => {
                let items = Items { accessor: index, view: view.value(), offset, count, size };
                self.items(&items, "vertices", vector)?
            }
            None if sparse.is_some() => {
                self.input.take(count.saturating_mul(size_of::<Vec3>() as u64), "vertices")?;
                memory::filled(memory::count(count), Vec3::ZERO, "vertices")?
            }
            None => return Err(self.input.bad(format!("accessor {index} has no bytes"))),
        };
        let Some(sparse) = sparse else { return Ok(vectors) };
        let (count, at) = (sparse.count.0, sparse.indices);
        let Checked::Valid(component) = at.component_type else {
            return Err(self.input.bad(format!("accessor {index}: no type of sparse indices")));
        };
        let component = component.0;
        let (view, offset) = (at.buffer_view.value(), at.byte_offset.0);
        let width = component.size() as u64;
        let items = Items { accessor: index, view, offset, count, size: width };
        let places = self.items(&items, "indices", |bytes| whole(bytes, component))?;
        let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
        let items = Items { accessor: index, view, offset, count, size };
        for (place, value) in places.into_iter().zip(self.items(&items, "vertices", vector)?) {
            let all = vectors.len();
            match vectors.get_mut(place as usize) {
                Some(vector) => *vector = value,
                None => {
                    let why = format!("accessor {index}: sparse item {place} of {all}");
                    return Err(self.input.bad(why));
                }
            }
        }
        Ok(vectors)
    }

    /// Indices of vertices.
    pub(super) fn indices(&mut self, index: usize) -> Result<Vec<u32>> {
        let (accessor, count, component) = self.accessor(index, Type::Scalar)?;
        let (view, offset) = (accessor.buffer_view, accessor.byte_offset);
        let unsigned =
            matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        let (Some(view), true, None) = (view, unsigned, &accessor.sparse) else {
            let why = "indices that are not plain unsigned integers in a buffer";
            return Err(self.input.bad(format!("accessor {index}: {why}")));
        };
        let (view, offset) = (view.value(), offset.map_or(0, |offset| offset.0));
        let items = Items { accessor: index, view, offset, count, size: component.size() as u64 };
        self.items(&items, "indices", |bytes| whole(bytes, component))
    }

    /// What `decode` makes of each item.
    fn items<T>(
        &mut self,
        items: &Items,
        what: &str,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let Items { accessor, view, offset, count, size } = *items;
        let all = &self.root.buffer_views;
        let why = || self.input.bad(format!("accessor {accessor}: view {view} of {}", all.len()));
        let found: &buffer::View = all.get(view).ok_or_else(why)?;
        // Some programs write 0 for items that follow each other directly.
        let stride = found.byte_stride.filter(|stride| stride.0 > 0);
        let stride = stride.map_or(size, |stride| stride.0 as u64);
        if stride < size {
            let why = format!("accessor {accessor}: {size} bytes every {stride} bytes");
            return Err(self.input.bad(why));
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let (begin, length) = (found.byte_offset.map_or(0, |at| at.0), found.byte_length.0);
        let end =
            u128::from(offset) + u128::from(count - 1) * u128::from(stride) + u128::from(size);
        if end > u128::from(length) {
            let why = format!("accessor {accessor}: it ends at byte {end} of {length} in its view");
            return Err(self.input.bad(why));
        }
        self.input.take(count.saturating_mul(size_of::<T>() as u64), what)?;
        let buffer = self.buffers.bytes(self.input, found.buffer.value())?;
        let last = u128::from(begin) + u128::from(length);
        let view_bytes = (last <= buffer.len() as u128)
            .then(|| &buffer[begin as usize..last as usize])
            .and_then(|bytes| bytes.get(offset as usize..end as usize));
        let Some(bytes) = view_bytes else {
            let why = format!("view {view}: it ends at byte {last} of {}", buffer.len());
            return Err(self.input.bad(why));
        };
        memory::collected(bytes.chunks(memory::count(stride)).map(decode), what)
    }
}

/// An unsigned integer.
fn whole(bytes: &[u8], component: ComponentType) -> u32 {
    match (component, bytes) {
        (ComponentType::U8, [a, ..]) => u32::from(*a),
        (ComponentType::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
        _ => u32_of(bytes),
    }
}

/// A number; integers become -1..1 or 0..1 if `normalized`.
fn real(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let scaled = |value: f32, most: f32| if normalized { (value / most).max(-1.0) } else { value };
    match (component, bytes) {
        (ComponentType::I8, [a, ..]) => scaled(f32::from(*a as i8), 127.0),
        (ComponentType::U8, [a, ..]) => scaled(f32::from(*a), 255.0),
        (ComponentType::I16, [a, b, ..]) => {
            scaled(f32::from(i16::from_le_bytes([*a, *b])), 32767.0)
        }
        (ComponentType::U16, [a, b, ..]) => {
            scaled(f32::from(u16::from_le_bytes([*a, *b])), 65535.0)
        }
        (ComponentType::U32, _) => scaled(u32_of(bytes) as f32, u32::MAX as f32),
        _ => f32_of(bytes),
    }
}
