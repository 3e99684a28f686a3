//! What a file says about itself and its grids in front of any voxel: header, descriptors,
//! metadata, transforms. Knows nothing of trees.

use super::compression::Compression;
use super::fault::{Fault, Parsed};
use super::grid_type::{GridType, TreeShape, ValueType};
use super::metadata::Metadata;
use super::source::{Bytes, Reader};
use super::transform::{self, Transform};
use super::value::AnyValue;

/// The first eight bytes of every file.
pub(super) const MAGIC: i64 = 0x5644_4220;
/// Supported file versions. In older ones nodes were laid out differently; newer ones do not exist.
const VERSIONS: std::ops::RangeInclusive<u32> = 222..=225;
/// Separates the name from a number in a unique name.
pub(super) const NAME_SEPARATOR: char = '\u{1e}';

/// The file's contents in front of the first grid.
pub(super) struct FileHeader {
    pub(super) version: u32,
    pub(super) library_version: [u32; 2],
    /// Whether descriptors have the offsets of their grids; false in a stream.
    pub(super) has_offsets: bool,
    pub(super) uuid: String,
    pub(super) metadata: Metadata,
    pub(super) grid_count: u32,
}

/// What a file says about one grid.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GridHeader {
    /// The plain name, which may be empty and need not be unique.
    pub name: String,
    /// The name that is unique in the file: the plain name, followed by U+001E and a number if the
    /// plain one is empty or not unique.
    pub unique_name: String,
    /// The type string in the file, such as `Tree_float_5_4_3_HalfFloat`.
    pub type_name: String,
    /// The type of the values.
    pub value_type: ValueType,
    /// Whether the floating-point values are stored as half floats.
    pub saved_as_half: bool,
    /// How the values are compressed.
    pub compression: Compression,
    /// All metadata, in the order of the file.
    pub metadata: Metadata,
    /// The name of the transform's map in the file, such as `UniformScaleMap`.
    pub map_name: String,
    /// The grid's transform from index to world space.
    pub transform: Transform,
    /// The value outside of the tree; `None` if the voxels cannot be read.
    pub background: Option<AnyValue>,
    /// The unique name of the grid that holds this one's voxels, if this is an instance.
    pub instance_of: Option<String>,
    /// Why the voxels cannot be read (points, strings, ...); `None` if they can.
    pub refused: Option<String>,
    /// Bytes of the grid in the file, without its descriptor.
    pub file_bytes: u64,
    pub(super) place: Place,
    /// The transform's map as encoded in the file.
    pub(super) map_bytes: Vec<u8>,
}

/// The position of a grid in the file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    pub(super) grid: u64,
    pub(super) topology: u64,
    pub(super) blocks: u64,
    pub(super) end: u64,
    /// The tree's shape, if it is supported.
    pub(super) shape: Option<TreeShape>,
    /// Index of the grid that holds the voxels: another one for an instance.
    pub(super) voxels_of: usize,
}

impl GridHeader {
    /// The grid's class: "level set", "fog volume", "staggered" or "unknown".
    pub fn class(&self) -> &str {
        self.metadata.text("class").unwrap_or("unknown")
    }
}

/// Reads up to the first descriptor.
pub(super) fn read_file_header(reader: &mut Reader) -> Parsed<FileHeader> {
    let (version, library_version, has_offsets, uuid) = reader.parse(|bytes| {
        if bytes.i64()? != MAGIC {
            return Err(Fault::bad(
                0,
                "not an OpenVDB file: it does not begin with the format's magic number",
            ));
        }
        let version = bytes.u32()?;
        if !VERSIONS.contains(&version) {
            let (first, last) = (VERSIONS.start(), VERSIONS.end());
            let why =
                format!("OpenVDB file version {version}; only {first} to {last} are supported");
            return Err(Fault::bad(8, why));
        }
        let library = bytes.each(Bytes::u32)?;
        let has_offsets = bytes.u8()? != 0;
        let uuid = String::from_utf8_lossy(bytes.take(36)?).into_owned();
        Ok((version, library, has_offsets, uuid))
    })?;
    let metadata = Metadata::read(reader)?;
    let grid_count = reader.parse(|bytes| {
        let at = bytes.position();
        let count = bytes.i32()?;
        u32::try_from(count).map_err(|_| Fault::bad(at, format!("the number of grids is {count}")))
    })?;
    Ok(FileHeader { version, library_version, has_offsets, uuid, metadata, grid_count })
}

/// A grid's descriptor, without its three offsets.
pub(super) struct Descriptor {
    pub(super) unique_name: String,
    pub(super) type_name: String,
    pub(super) parent: String,
    /// Offsets of the grid, its blocks and its end as in the file; zeros in a stream.
    pub(super) offsets: [i64; 3],
}

impl Descriptor {
    pub(super) fn read(reader: &mut Reader) -> Parsed<Self> {
        reader.parse(|bytes| {
            Ok(Self {
                unique_name: bytes.string()?,
                type_name: bytes.string()?,
                parent: bytes.string()?,
                offsets: bytes.each(Bytes::i64)?,
            })
        })
    }

    /// The position from the offsets, which must be in order between the descriptor's end and the
    /// file's end.
    pub(super) fn place(&self, descriptor_end: u64, file_end: u64) -> Parsed<Place> {
        let [grid, blocks, end] = self.offsets;
        // An instance has no blocks.
        let blocks = if self.parent.is_empty() { blocks } else { grid };
        let order = [descriptor_end as i64, grid, blocks, end, file_end as i64];
        if !order.is_sorted() {
            if order[..4].is_sorted() && end > file_end as i64 {
                let why =
                    format!("the file is cut short: it ends at {file_end}, this grid at {end}");
                return Err(Fault::bad(descriptor_end, why));
            }
            let why = format!(
                "offsets {grid}, {blocks}, {end} are not in order between {descriptor_end} and \
                 the file's end at {file_end}"
            );
            return Err(Fault::bad(descriptor_end, why));
        }
        let [grid, blocks, end] = [grid, blocks, end].map(|offset| offset as u64);
        Ok(Place { grid, blocks, end, ..Place::default() })
    }
}

/// Reads a grid from its flags to its transform; the reader is then at the topology.
pub(super) fn read_grid_header(
    reader: &mut Reader,
    descriptor: Descriptor,
    place: Place,
) -> Parsed<GridHeader> {
    let Descriptor { unique_name, type_name, parent, .. } = descriptor;
    let grid_type = GridType::parse(&type_name);
    let flags = reader.u32()?;
    let metadata = Metadata::read(reader)?;
    let plain = unique_name.split(NAME_SEPARATOR).next().unwrap_or_default();
    let mut header = GridHeader {
        name: plain.to_owned(),
        unique_name,
        value_type: grid_type.value,
        saved_as_half: grid_type.half,
        compression: Compression::default(),
        metadata,
        map_name: String::new(),
        transform: Transform::Refused(String::new()),
        background: None,
        instance_of: (!parent.is_empty()).then_some(parent),
        refused: None,
        file_bytes: place.end - place.grid,
        place,
        map_bytes: Vec::new(),
        type_name,
    };
    header.place.shape = grid_type.shape;
    match Compression::from_flags(flags) {
        Some(compression) => header.compression = compression,
        None => header.refuse(format!("unknown compression flags {flags:#x}")),
    }
    match reader.parse(transform::read) {
        Ok(named) => {
            (header.map_name, header.transform) = (named.map, named.transform);
            header.map_bytes = named.bytes;
        }
        // Without the length of the map, what follows cannot be found.
        Err(Fault::Bad { why, .. }) => {
            header.refuse(why.clone());
            header.transform = Transform::Refused(why);
        }
        Err(fault) => return Err(fault),
    }
    if let ValueType::Unsupported(name) = &header.value_type {
        header.refuse(format!("voxels of type {name:?} are not supported"));
    } else if grid_type.shape.is_none() {
        header.refuse(format!("unknown tree {:?}", header.type_name));
    }
    header.place.topology = reader.position();
    Ok(header)
}

impl GridHeader {
    /// Records why the voxels cannot be read; the first reason is kept.
    pub(super) fn refuse(&mut self, why: String) {
        self.refused.get_or_insert(why);
    }
}
