//! Voxels of a box in their own type, on their way from one format to another. It knows no format:
//! readers and OpenVDB's grids produce them, writers consume them.

use glam::{DMat4, IVec3};

use super::{DenseFile, DenseHeader, Order, Space};
use crate::error::memory;
use crate::error::{Error, Result};
use crate::io::number::{CHUNK, Endian, ValueType, transformed};
use crate::io::vdb::{AnyValue, Grid, IndexBox};
use crate::parallel;
use crate::volume::Axis;

/// All voxels of a box, with what is known about them.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseGrid {
    /// The grid's name; empty if unknown.
    pub name: String,
    /// OpenVDB's class, if known.
    pub class: Option<String>,
    /// Voxel counts along x, y, z.
    pub dims: [usize; 3],
    /// Numbers per voxel, stored next to each other.
    pub components: usize,
    /// Number type of `bytes`.
    pub value_type: ValueType,
    /// The numbers, little endian: components, then x, then y, then z.
    pub bytes: Vec<u8>,
    /// Whether each voxel is active; `None` if all are.
    pub active: Option<Vec<bool>>,
    /// The value outside of the box, one number per component, if known.
    pub background: Option<Vec<f64>>,
    /// Transform from indices to the world.
    pub world_from_index: DMat4,
    /// Index of the first voxel.
    pub origin: IVec3,
    /// Slope and intercept: a value is the stored number times the first plus the second.
    pub value_scale: [f64; 2],
    /// The coordinate system of the world, if known.
    pub space: Option<Space>,
    /// The axis that points up, if known.
    pub up: Option<Axis>,
    /// All other metadata as (key, value).
    pub metadata: Vec<(String, String)>,
}

/// Keys whose values readers put into other fields, or that describe a file's layout.
const UNDERSTOOD: [&str; 34] = [
    "AnatomicalOrientation",
    "BinaryDataByteOrderMSB",
    "CompressedData",
    "CompressedDataSize",
    "ElementByteOrderMSB",
    "ElementDataFile",
    "ElementNumberOfChannels",
    "ElementSize",
    "ElementSpacing",
    "HeaderSize",
    "Name",
    "ObjectType",
    "Offset",
    "Orientation",
    "Origin",
    "Position",
    "Rotation",
    "TransformMatrix",
    "axis maxs",
    "axis mins",
    "byte skip",
    "byteskip",
    "centerings",
    "content",
    "data file",
    "datafile",
    "kinds",
    "line skip",
    "lineskip",
    "space",
    "space dimension",
    "space origin",
    "spacings",
    "CenterOfRotation",
];

impl DenseGrid {
    /// Reads the voxels of a file. If the file scales its numbers, the result holds the scaled
    /// values, as `f32` or, where `f32` has fewer digits than the numbers, `f64`.
    ///
    /// # Errors
    /// As [`DenseFile::voxels`].
    pub fn read(file: &DenseFile) -> Result<Self> {
        let voxels = file.voxels()?;
        let (value_type, bytes) = plain(file.header(), voxels.into_bytes())?;
        let grid = Self { value_type, bytes, ..Self::without_voxels(file) };
        match &file.header().sparse {
            Some(sparse) => grid.cropped(sparse.active_bounds),
            None => Ok(grid),
        }
    }

    /// Everything about a file's grid except its voxels.
    pub(super) fn without_voxels(file: &DenseFile) -> Self {
        let header = file.header();
        let DenseHeader { dims, components, value_type, .. } = *header;
        let lattice = header.lattice.map(|lattice| (lattice.world_from_index, lattice.origin));
        let (world_from_index, origin) = lattice.unwrap_or((header.world_from_index, IVec3::ZERO));
        let level_set = header.sparse.as_ref().is_some_and(|sparse| sparse.level_set);
        let known = header.background.as_ref().filter(|values| values.len() == components);
        let mut metadata = header.metadata.clone();
        metadata.retain(|(key, _)| !UNDERSTOOD.contains(&key.as_str()));
        Self {
            name: header.name.clone().unwrap_or_default(),
            class: header.class.clone().or_else(|| level_set.then(|| "level set".to_owned())),
            dims,
            components,
            value_type,
            bytes: Vec::new(),
            active: None,
            background: known.cloned(),
            world_from_index,
            origin,
            value_scale: [1.0, 0.0],
            space: header.space,
            up: header.up,
            metadata,
        }
    }

    /// Everything about the grid except its voxels.
    #[must_use]
    pub fn without_bytes(&self) -> Self {
        Self {
            name: self.name.clone(),
            class: self.class.clone(),
            bytes: Vec::new(),
            active: None,
            background: self.background.clone(),
            metadata: self.metadata.clone(),
            ..*self
        }
    }

    /// The voxels in `bounds` of an OpenVDB grid; booleans become bytes of 0 and 1.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if they take more than `max_bytes`.
    pub fn of_vdb(
        grid: &Grid,
        bounds: IndexBox,
        world_from_index: DMat4,
        max_bytes: u64,
    ) -> Result<Self> {
        let bytes = grid.dense_bytes(bounds, max_bytes)?;
        let active = grid.dense_activity(bounds, max_bytes)?;
        let (value_type, background) = match grid.background() {
            AnyValue::Float(value) => (ValueType::F32, vec![f64::from(value)]),
            AnyValue::Double(value) => (ValueType::F64, vec![value]),
            AnyValue::Half(value) => (ValueType::F16, vec![f64::from(value)]),
            AnyValue::Int32(value) => (ValueType::I32, vec![f64::from(value)]),
            AnyValue::Int64(value) => (ValueType::I64, vec![value as f64]),
            AnyValue::Bool(value) => (ValueType::U8, vec![f64::from(u8::from(value))]),
            AnyValue::Vec3s(values) => (ValueType::F32, values.map(f64::from).to_vec()),
            AnyValue::Vec3d(values) => (ValueType::F64, values.to_vec()),
            AnyValue::Vec3i(values) => (ValueType::I32, values.map(f64::from).to_vec()),
        };
        Ok(Self {
            name: String::new(),
            class: None,
            dims: bounds.dims().map(|length| length as usize),
            components: background.len(),
            value_type,
            bytes,
            active: active.contains(&false).then_some(active),
            background: Some(background),
            world_from_index,
            origin: bounds.min,
            value_scale: [1.0, 0.0],
            space: None,
            up: None,
            metadata: Vec::new(),
        })
    }

    /// Number of voxels.
    pub fn voxels(&self) -> usize {
        self.dims.iter().product()
    }

    /// Number of active voxels.
    pub fn active_voxels(&self) -> usize {
        match &self.active {
            Some(active) => active.iter().filter(|&&active| active).count(),
            None => self.voxels(),
        }
    }

    /// Bytes per voxel.
    pub fn voxel_bytes(&self) -> usize {
        self.components * self.value_type.size()
    }

    /// The box of voxel indices.
    ///
    /// # Errors
    /// If an index does not fit 32 bits.
    pub fn bounds(&self) -> Result<IndexBox> {
        let last = self.dims.map(|length| i32::try_from(length).unwrap_or(i32::MAX) - 1);
        let max = self.origin.checked_add(IVec3::from_array(last));
        let max = max.ok_or_else(|| {
            Error::value("index", format!("the box from {} does not fit in 32 bits", self.origin))
        })?;
        Ok(IndexBox { min: self.origin, max })
    }

    /// Transform from the index within the box, which is 0 for the first voxel, to the world.
    pub fn world_from_voxel(&self) -> DMat4 {
        self.world_from_index * DMat4::from_translation(self.origin.as_dvec3())
    }

    /// A voxel with these numbers, encoded as in `bytes`.
    pub(super) fn encoded(&self, values: &[f64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.value_type.encode(values, &mut bytes);
        bytes
    }

    /// The grid without the voxels outside of `bounds`.
    ///
    /// # Errors
    /// If no voxel is in `bounds`.
    pub fn cropped(self, bounds: IndexBox) -> Result<Self> {
        let own = self.bounds()?;
        let Some(part) = own.intersection(&bounds) else {
            let why = format!(
                "{} .. {} does not overlap {} .. {}",
                bounds.min, bounds.max, own.min, own.max
            );
            return Err(Error::value("crop", why));
        };
        if part == own {
            return Ok(self);
        }
        let dims = part.dims().map(|length| length as usize);
        let offset = (part.min - own.min).to_array().map(|n| n as usize);
        let size = self.voxel_bytes();
        let bytes = rows(&self.bytes, self.dims, offset, dims, size)?;
        let active = self.active.map(|active| rows(&active, self.dims, offset, dims, 1));
        let active = active.transpose()?;
        Ok(Self { dims, bytes, active, origin: part.min, ..self })
    }
}

/// A part of a box of `size` voxels with `width` items each: the `dims` voxels from `offset` on.
fn rows<T: Copy>(
    items: &[T],
    size: [usize; 3],
    offset: [usize; 3],
    dims: [usize; 3],
    width: usize,
) -> Result<Vec<T>> {
    let mut part = memory::room(dims.iter().product::<usize>() * width, "a part of the voxels")?;
    for z in offset[2]..offset[2] + dims[2] {
        for y in offset[1]..offset[1] + dims[1] {
            let start = ((z * size[1] + y) * size[0] + offset[0]) * width;
            part.extend_from_slice(&items[start..start + dims[0] * width]);
        }
    }
    Ok(part)
}

/// Numbers in the form that [`DenseGrid`] has: little endian, x fastest, with the file's scale
/// applied.
fn plain(header: &DenseHeader, mut bytes: Vec<u8>) -> Result<(ValueType, Vec<u8>)> {
    let (mut value_type, [slope, intercept]) = (header.value_type, header.scale);
    let size = value_type.size();
    if header.endian == Endian::Big {
        let parts = bytes.chunks_mut(CHUNK * size);
        parallel::for_each(parts, |part| {
            part.chunks_exact_mut(size).for_each(<[u8]>::reverse);
        });
    }
    if header.scale != [1.0, 0.0] {
        use ValueType::{F16, F32, I8, I16, U8, U16};
        let narrow = matches!(value_type, U8 | I8 | U16 | I16 | F16 | F32);
        let to = if narrow { F32 } else { ValueType::F64 };
        bytes = transformed(&bytes, [size, to.size()], |chunk| {
            let mut values = value_type.decode(chunk, Endian::Little);
            for value in &mut values {
                *value = *value * slope + intercept;
            }
            let mut scaled = Vec::new();
            to.encode(&values, &mut scaled);
            scaled
        })?;
        value_type = to;
    }
    if header.order == Order::ZFastest {
        let [nx, ny, nz] = header.dims;
        let size = value_type.size();
        let mut turned = memory::filled(bytes.len(), 0, "voxels")?;
        parallel::for_each(turned.chunks_mut(nx * ny * size).enumerate(), |(z, plane)| {
            for (i, voxel) in plane.chunks_exact_mut(size).enumerate() {
                let from = ((i % nx * ny + i / nx) * nz + z) * size;
                voxel.copy_from_slice(&bytes[from..from + size]);
            }
        });
        bytes = turned;
    }
    Ok((value_type, bytes))
}
