//! Writes OpenVDB files (format 224) that `file`, OpenVDB 10 and Houdini read. The caller stores
//! the bytes.
//!
//! In practice: first the names of all grids, then grid by grid, so that only one is in memory.
//!
//! ```
//! use deepshadow::io::vdb::{Compression, Metadata, NewGrid, TreeBuilder, VdbWriter};
//! use glam::{DMat4, IVec3};
//!
//! let mut tree = TreeBuilder::new(0.0_f32);
//! tree.set(IVec3::new(1, 2, 3), 0.5, true);
//! let grid = NewGrid::new(tree.finish().into(), &DMat4::IDENTITY).with_class("fog volume");
//! let mut writer = VdbWriter::new(&["density"], Compression::BLOSC, &Metadata::default());
//! writer.add(grid)?;
//! let bytes = writer.finish()?;
//! # assert!(deepshadow::io::vdb::VdbFile::recognizes(&bytes));
//! # Ok::<(), deepshadow::Error>(())
//! ```

use std::collections::{HashMap, HashSet};

use glam::DMat4;

use super::builder::TreeBuilder;
use super::compression::Compression;
use super::grid::{Grid, with_tree};
use super::grid_type::ValueType;
use super::header::{GridHeader, MAGIC, NAME_SEPARATOR};
use super::metadata::{MetaValue, Metadata, put_text};
use super::packed::PackedTree;
use super::parts::Parts;
use super::transform::Transform;
use super::tree::Tree;
use super::value::Value;
use super::value_block::Encoding;
use super::write_tree::{put_leaves, put_topology};
use crate::error::memory;
use crate::error::{Error, Result};

/// The version of the format, and that of the library whose files are equivalent.
const VERSION: u32 = 224;
const LIBRARY: [u32; 2] = [10, 0];
/// Metadata that the library reserves for itself.
const DELAYED_LOAD: &str = "file_delayed_load";

/// A grid to be written.
pub struct NewGrid {
    grid: Grid,
    metadata: Metadata,
    map_bytes: Vec<u8>,
    half: bool,
    mask: bool,
}

impl NewGrid {
    /// A grid without metadata.
    pub fn new(grid: Grid, world_from_index: &DMat4) -> Self {
        let map_bytes = Transform::map_bytes(world_from_index);
        Self { grid, metadata: Metadata::default(), map_bytes, half: false, mask: false }
    }

    /// The description of a grid that is written in another way ([`VdbWriter::add_packed`]),
    /// without metadata.
    pub fn described(world_from_index: &DMat4) -> Self {
        Self::new(Grid::Float(TreeBuilder::new(0.0).finish()), world_from_index)
    }

    /// A grid with the metadata and the transform of another one, whatever its map is; stored as
    /// half floats if that one is.
    pub fn like(header: &GridHeader, grid: Grid) -> Self {
        Self {
            grid,
            metadata: header.metadata.clone(),
            map_bytes: header.map_bytes.clone(),
            half: header.saved_as_half,
            mask: header.value_type == ValueType::Mask,
        }
    }

    /// The grid with another transform.
    #[must_use]
    pub fn placed(self, world_from_index: &DMat4) -> Self {
        Self { map_bytes: Transform::map_bytes(world_from_index), ..self }
    }

    /// The grid with this class: "level set", "fog volume", "staggered" or "unknown".
    #[must_use]
    pub fn with_class(mut self, class: &str) -> Self {
        self.metadata.set("class", MetaValue::String(class.to_owned()));
        self
    }

    /// The grid with its floating-point values stored as half floats, or at full width.
    #[must_use]
    pub fn with_half(self, half: bool) -> Self {
        Self { half, ..self }
    }

    /// The metadata, to be added to. What the file itself says of a grid (name, counts, bounds,
    /// compression) is set when it is written.
    pub fn metadata(&mut self) -> &mut Metadata {
        &mut self.metadata
    }
}

/// A file that is being written.
pub struct VdbWriter {
    out: Parts,
    unique_names: Vec<String>,
    /// Type strings of the grids added so far.
    type_names: Vec<String>,
    compression: Compression,
}

impl VdbWriter {
    /// A file of grids with these names (equal and empty ones are allowed), to be added in this
    /// order.
    pub fn new(names: &[&str], compression: Compression, metadata: &Metadata) -> Self {
        let mut out = Parts::default();
        let head = out.last();
        head.extend(MAGIC.to_le_bytes());
        for number in [VERSION, LIBRARY[0], LIBRARY[1]] {
            head.extend(number.to_le_bytes());
        }
        // Grids have offsets; then room for the file's identifier.
        head.push(1);
        head.extend([b'0'; UUID_LENGTH]);
        metadata.write(head);
        head.extend((names.len() as u32).to_le_bytes());
        Self { out, unique_names: unique_names(names), type_names: Vec::new(), compression }
    }

    /// Writes the next grid. Constant regions become tiles; counts and bounds are added to its
    /// metadata.
    ///
    /// # Errors
    /// If there are more grids than names.
    pub fn add(&mut self, grid: NewGrid) -> Result<()> {
        let NewGrid { grid, metadata, map_bytes, half, mask } = grid;
        let (grid, half) = match grid {
            // Half grids exist only from format 225 on.
            Grid::Half(tree) => (Grid::Float(tree.map(f32::from)), true),
            other => (other, half),
        };
        let value_type = match (&grid, mask) {
            (Grid::Bool(_), true) => ValueType::Mask,
            (grid, _) => grid.value_type(),
        };
        with_tree!(grid, tree => self.add_tree(tree, &value_type, metadata, &map_bytes, half))
    }

    /// Writes the next grid, whose leaves are already packed, with the metadata, the class and the
    /// transform of `like`.
    ///
    /// # Errors
    /// If there are more grids than names, or if it was packed for another compression.
    pub fn add_packed<T: Value>(&mut self, like: NewGrid, packed: PackedTree<T>) -> Result<()> {
        let PackedTree { tree, encoding, value_type, leaves } = packed;
        if encoding.compression != self.compression {
            return Err(Error::value("compression", "the leaves were packed with a different one"));
        }
        let bytes = tree.memory_bytes() + (512 * size_of::<T>() * leaves.len()) as u64;
        let (metadata, map_bytes) = (like.metadata, like.map_bytes);
        self.put_grid(&tree, bytes, (&encoding, &value_type), metadata, &map_bytes, |out| {
            for leaf in leaves {
                out.push(leaf.into_vec());
            }
        })
    }

    fn add_tree<T: Value>(
        &mut self,
        tree: Tree<T>,
        value_type: &ValueType,
        metadata: Metadata,
        map_bytes: &[u8],
        half: bool,
    ) -> Result<()> {
        let half = half && T::HALF_BYTES.is_some();
        let tree = if half { tree.map(T::through_half) } else { tree };
        let tree = tree.pruned();
        let (compression, background) = (self.compression, tree.background());
        let encoding = Encoding { compression, half, background };
        let how = (&encoding, value_type);
        self.put_grid(&tree, tree.memory_bytes(), how, metadata, map_bytes, |out| {
            put_leaves(&tree, value_type, &encoding, |part| out.push(part));
        })
    }

    /// Writes a grid whose leaves are written by `put`; once read, it takes `memory` bytes.
    fn put_grid<T: Value>(
        &mut self,
        tree: &Tree<T>,
        memory: u64,
        (encoding, value_type): (&Encoding<T>, &ValueType),
        mut metadata: Metadata,
        map_bytes: &[u8],
        put: impl FnOnce(&mut Parts),
    ) -> Result<()> {
        Self::describe(tree, memory, encoding.half, &mut metadata);
        let suffix = if encoding.half { "_HalfFloat" } else { "" };
        let type_name = format!("Tree_{}_5_4_3{suffix}", value_type.name());
        let offsets = self.put_descriptor(&type_name, "", &mut metadata)?;
        let grid_start = self.out.len();
        self.put_grid_header(&metadata, map_bytes);
        // Reserved for the masks of leaves and branches: a vector that doubles would hold them
        // three times.
        let topology = tree.topology();
        let masks = 64 * topology.leaf_origins.len()
            + 2048 * topology.lowers.len()
            + 16384 * topology.uppers.len();
        memory::reserve(self.out.last(), masks, "a tree")?;
        put_topology(tree, encoding, self.out.last());
        let blocks_start = self.out.len();
        put(&mut self.out);
        let end = self.out.len();
        self.put_offsets(offsets, [grid_start, blocks_start, end]);
        Ok(())
    }

    /// Writes the next grid as an instance: it shares the voxels of grid number `parent`, and has
    /// the metadata and the transform of `header`.
    ///
    /// # Errors
    /// If there are more grids than names, or if `parent` has not been added before.
    pub fn add_instance(&mut self, header: &GridHeader, parent: usize) -> Result<()> {
        let (Some(name), Some(type_name)) =
            (self.unique_names.get(parent).cloned(), self.type_names.get(parent).cloned())
        else {
            return Err(Error::value("instance", "its parent must come before it in the file"));
        };
        let mut metadata = header.metadata.clone();
        let offsets = self.put_descriptor(&type_name, &name, &mut metadata)?;
        let grid_start = self.out.len();
        self.put_grid_header(&metadata, &header.map_bytes);
        let end = self.out.len();
        self.put_offsets(offsets, [grid_start, 0, end]);
        Ok(())
    }

    /// The bytes of the file, which are the same for the same grids.
    ///
    /// # Errors
    /// If there are fewer grids than names.
    pub fn finish(self) -> Result<Vec<u8>> {
        let parts = self.finish_parts()?;
        let mut all = memory::room(parts.iter().map(Vec::len).sum(), "an OpenVDB file")?;
        for part in &parts {
            all.extend_from_slice(part);
        }
        Ok(all)
    }

    /// The bytes of the file as a sequence of pieces.
    ///
    /// # Errors
    /// If there are fewer grids than names.
    pub fn finish_parts(mut self) -> Result<Vec<Vec<u8>>> {
        let added = self.type_names.len();
        if added < self.unique_names.len() {
            let why = format!("only {added} of {} were added", self.unique_names.len());
            return Err(Error::value("grids", why));
        }
        let uuid = uuid(self.out.iter());
        self.out.put(UUID_START, uuid.as_bytes());
        Ok(self.out.into_parts())
    }

    /// Adds counts and bounds to the metadata.
    fn describe<T: Value>(tree: &Tree<T>, memory: u64, half: bool, metadata: &mut Metadata) {
        let nothing = ([i32::MAX; 3], [i32::MIN; 3]);
        let bounds = tree.active_bounds();
        let (min, max) = bounds.map_or(nothing, |b| (b.min.to_array(), b.max.to_array()));
        let number = |count: u64| MetaValue::Int64(i64::try_from(count).unwrap_or(i64::MAX));
        metadata.set("file_bbox_min", MetaValue::Vec3i(min));
        metadata.set("file_bbox_max", MetaValue::Vec3i(max));
        metadata.set("file_voxel_count", number(tree.active_voxel_count()));
        metadata.set("file_mem_bytes", number(memory));
        metadata.set("is_saved_as_half_float", MetaValue::Bool(half));
    }

    /// Writes the descriptor of the next grid and completes its metadata. Returns the position of
    /// the descriptor's offsets.
    fn put_descriptor(
        &mut self,
        type_name: &str,
        parent: &str,
        metadata: &mut Metadata,
    ) -> Result<usize> {
        let Some(unique_name) = self.unique_names.get(self.type_names.len()) else {
            let why = format!("more than the {} that were named", self.unique_names.len());
            return Err(Error::value("grids", why));
        };
        self.type_names.push(type_name.to_owned());
        let name = unique_name.split(NAME_SEPARATOR).next().unwrap_or_default();
        metadata.set("name", MetaValue::String(name.to_owned()));
        metadata.set("file_compression", MetaValue::String(self.compression.to_string()));
        if metadata.get("class").is_none() {
            metadata.set("class", MetaValue::String("unknown".to_owned()));
        }
        metadata.remove(DELAYED_LOAD);
        let out = self.out.last();
        put_text(out, unique_name);
        put_text(out, type_name);
        put_text(out, parent);
        let offsets = self.out.len();
        self.out.last().extend([0; 24]);
        Ok(offsets)
    }

    fn put_grid_header(&mut self, metadata: &Metadata, map_bytes: &[u8]) {
        let out = self.out.last();
        out.extend(self.compression.flags().to_le_bytes());
        metadata.write(out);
        out.extend_from_slice(map_bytes);
    }

    fn put_offsets(&mut self, at: usize, offsets: [usize; 3]) {
        let bytes: Vec<u8> = offsets.into_iter().flat_map(|o| (o as i64).to_le_bytes()).collect();
        self.out.put(at, &bytes);
    }
}

/// The unique names of the grids in the file: empty and repeated names get a number.
fn unique_names(names: &[&str]) -> Vec<String> {
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for &name in names {
        *counts.entry(name).or_default() += 1;
    }
    let mut taken: HashSet<String> = HashSet::new();
    let mut numbers: HashMap<&str, usize> = HashMap::new();
    let unique = names.iter().map(|&name| {
        if !name.is_empty() && counts.get(name) == Some(&1) && taken.insert(name.to_owned()) {
            return name.to_owned();
        }
        let number = numbers.entry(name).or_default();
        loop {
            let unique = format!("{name}{NAME_SEPARATOR}{number}");
            *number += 1;
            if taken.insert(unique.clone()) {
                return unique;
            }
        }
    });
    unique.collect()
}

/// Offset of the file's identifier.
const UUID_START: usize = 21;
const UUID_LENGTH: usize = 36;

/// A file identifier computed from the contents, in the form of a UUID of version 8.
fn uuid<'a>(parts: impl Iterator<Item = &'a [u8]>) -> String {
    // FNV-1a over words, with two different initial states.
    let mut state = [0xcbf2_9ce4_8422_2325_u64, 0x6c62_272e_07bb_0142];
    let mut mix = |word: [u8; 8]| {
        let word = u64::from_le_bytes(word);
        for hash in &mut state {
            let mixed = (*hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
            *hash = mixed ^ mixed >> 29;
        }
    };
    // Words continue across the borders of parts.
    let (mut word, mut filled) = ([0; 8], 0);
    for mut part in parts {
        while !part.is_empty() {
            let count = part.len().min(8 - filled);
            let (own, rest) = part.split_at(count);
            word[filled..filled + count].copy_from_slice(own);
            (part, filled) = (rest, filled + count);
            if filled == 8 {
                mix(word);
                (word, filled) = ([0; 8], 0);
            }
        }
    }
    if filled > 0 {
        mix(word);
    }
    let [high, low] = state;
    format!(
        "{:08x}-{:04x}-8{:03x}-{:04x}-{:012x}",
        high >> 32,
        high >> 16 & 0xffff,
        high & 0xfff,
        low >> 48 & 0x3fff | 0x8000,
        low & 0xffff_ffff_ffff,
    )
}
