//! NanoVDB files (`.nvdb`, version 32): the first grid of floats, as a dense box around its active
//! voxels with one voxel of its surroundings on every side. Bare, zipped and Blosc grids.
//!
//! ```text
//! file: mark, version, count, codec | for each grid 176 bytes and a name | the grids' chunks
//! grid: 672 bytes | tree: 64 bytes | root and its tiles | upper nodes | lower nodes | leaves
//! ```

use std::collections::HashSet;

use glam::{DMat3, DMat4, DVec3, IVec3};

use super::input::Input;
use super::nanovdb_chunks;
use super::payload::Payload;
use super::{DenseHeader, Lattice, SparsePart};
use crate::error::Result;
use crate::error::memory;
use crate::io::number::ValueType;
use crate::io::vdb::{IndexBox, Statistics};

/// Sizes in bytes of the file's header, of a grid's entry, of a grid before its tree, and of the
/// tree.
const FILE: usize = 16;
const ENTRY: usize = 176;
const GRID: usize = 672;
const TREE: usize = 64;
const FLOAT: u32 = 1;

/// Layout of an inner node: where its masks and its table are, and the base-2 logarithms of its
/// edge in slots and of a slot's edge in voxels.
struct Level {
    child_mask: usize,
    table: usize,
    bytes: usize,
    log: u32,
    slot_log: u32,
}

const UPPER: Level =
    Level { child_mask: 32 + 4096, table: 8256, bytes: 8256 + 8 * 32768, log: 5, slot_log: 7 };
const LOWER: Level =
    Level { child_mask: 32 + 512, table: 1088, bytes: 1088 + 8 * 4096, log: 4, slot_log: 3 };
const LEAF_BYTES: usize = 2144;
const LEAF_VALUES: usize = 96;
const LEAF_MASK: usize = 16;

/// The bytes of a grid, with access to little-endian numbers by position.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn array<const N: usize>(&self, at: usize) -> Result<[u8; N], String> {
        let bytes = at.checked_add(N).and_then(|end| self.0.get(at..end));
        bytes.and_then(|bytes| bytes.try_into().ok()).ok_or_else(|| {
            format!("its grid ends early: {N} bytes needed at byte {at} of {}", self.0.len())
        })
    }

    fn u32(&self, at: usize) -> Result<u32, String> {
        self.array(at).map(u32::from_le_bytes)
    }

    fn u64(&self, at: usize) -> Result<u64, String> {
        self.array(at).map(u64::from_le_bytes)
    }

    fn f32(&self, at: usize) -> Result<f32, String> {
        self.array(at).map(f32::from_le_bytes)
    }

    fn f64(&self, at: usize) -> Result<f64, String> {
        self.array(at).map(f64::from_le_bytes)
    }

    fn ivec3(&self, at: usize) -> Result<IVec3, String> {
        let part = |at| self.array(at).map(i32::from_le_bytes);
        Ok(IVec3::new(part(at)?, part(at + 4)?, part(at + 8)?))
    }

    fn bit(&self, mask: usize, slot: usize) -> Result<bool, String> {
        self.array::<1>(mask + slot / 8).map(|[byte]| byte >> (slot % 8) & 1 == 1)
    }

    /// The position at `offset` from another one.
    fn jump(&self, from: usize, offset: u64) -> Result<usize, String> {
        let place = usize::try_from(offset).ok().and_then(|offset| from.checked_add(offset));
        let place = place.filter(|&place| place < self.0.len());
        place.ok_or_else(|| {
            format!("an offset of {} from byte {from} points outside its grid", offset as i64)
        })
    }
}

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let whole = input.whole()?;
    let bytes = Bytes(&whole);
    let bad = |why: String| input.bad(why);
    let version = bytes.u32(8).map_err(bad)?;
    if version >> 21 != 32 {
        let (major, minor) = (version >> 21, version >> 10 & 0x7ff);
        return Err(input.bad(format!("NanoVDB version {major}.{minor}; only 32 is supported")));
    }
    let count = u16::from_le_bytes(bytes.array(12).map_err(bad)?);
    if count == 0 {
        return Err(input.bad("it has no grids"));
    }
    let size = bytes.u64(FILE).map_err(bad)?;
    let value_type = bytes.u32(FILE + 32).map_err(bad)?;
    if value_type != FLOAT {
        return Err(input.bad(format!("grid of type {value_type}; only 1 (float) is supported")));
    }
    let name_size = bytes.u32(FILE + 136).map_err(bad)? as usize;
    let codec = u16::from_le_bytes(bytes.array(FILE + 168).map_err(bad)?);
    // All entries and names precede the first grid.
    let mut at = FILE;
    for _ in 0..count {
        let name = bytes.u32(at.saturating_add(136)).map_err(bad)?;
        at = at.saturating_add(ENTRY).saturating_add(name as usize);
    }
    let name =
        whole.get(FILE + ENTRY..(FILE + ENTRY).saturating_add(name_size)).unwrap_or_default();
    let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
    let name = String::from_utf8_lossy(name).into_owned();

    if size > input.max_bytes {
        return Err(input.too_large("its grid", u128::from(size)));
    }
    let chunks = whole.get(at..).unwrap_or_default();
    let (grid, compression) =
        nanovdb_chunks::unpack(chunks, codec, memory::count(size)).map_err(bad)?;
    let (mut header, values) = densify(input, &Bytes(&grid))?;
    header.name = Some(name);
    header.compression = compression;
    if count > 1 {
        header.metadata.push(("other grids".to_owned(), (count - 1).to_string()));
    }
    Ok((header, Payload::Unpacked(values)))
}

fn densify(input: &Input, grid: &Bytes) -> Result<(DenseHeader, Vec<u8>)> {
    let bad = |why: String| input.bad(why);
    let root = grid.u64(GRID + 24).and_then(|offset| grid.jump(GRID, offset)).map_err(bad)?;
    if root < GRID + TREE {
        return Err(
            input.bad(format!("its root is at byte {root} of its grid, inside the headers"))
        );
    }
    let (min, max) = (grid.ivec3(root).map_err(bad)?, grid.ivec3(root + 12).map_err(bad)?);
    if min.cmpgt(max).any() {
        return Err(input.bad("it has no active voxels"));
    }
    let active = IndexBox { min, max };
    let bounds = active.padded(1);
    let dims = input.dims(bounds.dims().map(|n| n as i64))?;
    let voxels = dims.iter().map(|&n| n as u128).product::<u128>();
    if 4 * voxels > u128::from(input.max_bytes) {
        return Err(input.too_large("its voxels", 4 * voxels));
    }
    let background = grid.f32(root + 28).map_err(bad)?;
    let mut dense = Dense {
        grid,
        bounds,
        dims,
        values: memory::filled(memory::count(voxels), background, "a dense grid")?,
        sum: 0.0,
        range: [f64::INFINITY, f64::NEG_INFINITY],
        counts: [0; 2],
        nodes: [0; 3],
    };
    dense.root(root).map_err(bad)?;

    let mut header = DenseHeader::new(dims, ValueType::F32);
    let lattice = Lattice { world_from_index: transform(grid).map_err(bad)?, origin: bounds.min };
    header.world_from_index =
        lattice.world_from_index * DMat4::from_translation(bounds.min.as_dvec3());
    header.lattice = Some(lattice);
    header.background = Some(vec![f64::from(background)]);
    let [known, nan_count] = dense.counts;
    let nothing = f64::NAN;
    let [low, high] = if known > 0 { dense.range } else { [nothing; 2] };
    let mean = dense.sum / known as f64;
    header.sparse = Some(SparsePart {
        active_bounds: active,
        active_voxels: known + nan_count,
        background,
        level_set: grid.u32(GRID - 40).map_err(bad)? == 1,
        statistics: Statistics { min: low, max: high, mean, nan_count },
    });
    Ok((header, dense.values.iter().flat_map(|value| value.to_le_bytes()).collect()))
}

/// The grid's transform: a matrix of doubles, for column vectors, and a translation.
fn transform(grid: &Bytes) -> Result<DMat4, String> {
    const MATRIX: usize = 296 + 88;
    let mut numbers = [0.0; 9];
    for (index, number) in numbers.iter_mut().enumerate() {
        *number = grid.f64(MATRIX + 8 * index)?;
    }
    let mut translation = [0.0; 3];
    for (index, number) in translation.iter_mut().enumerate() {
        *number = grid.f64(MATRIX + 144 + 8 * index)?;
    }
    let matrix = DMat4::from_mat3(DMat3::from_cols_array(&numbers).transpose());
    Ok(DMat4::from_translation(DVec3::from(translation)) * matrix)
}

/// A box that is filled from a tree.
struct Dense<'a> {
    grid: &'a Bytes<'a>,
    bounds: IndexBox,
    dims: [usize; 3],
    values: Vec<f32>,
    /// Sum of the active values that are not NaN.
    sum: f64,
    range: [f64; 2],
    /// Number of active voxels that are not NaN, and of those that are.
    counts: [u64; 2],
    /// Numbers of upper nodes, lower nodes and leaves that were visited; a tree has each node once.
    nodes: [usize; 3],
}

impl Dense<'_> {
    fn root(&mut self, root: usize) -> Result<(), String> {
        let count = self.grid.u32(root + 24)? as usize;
        let mut seen = HashSet::new();
        for tile in 0..count {
            let at = root + 64 + 32 * tile;
            let key = self.grid.u64(at)?;
            if !seen.insert(key) {
                return Err(format!("two root tiles with key {key}"));
            }
            // 21 bits each for x, y, z in units of 4096 voxels.
            let part = |shift: u32| ((key >> shift & 0xf_ffff) as i32) << 12;
            let origin = IVec3::new(part(42), part(21), part(0));
            match self.grid.u64(at + 8)? {
                0 => {
                    let (value, active) = (self.grid.f32(at + 20)?, self.grid.u32(at + 16)? != 0);
                    self.fill(origin, 12, value, active);
                }
                child => {
                    let node = self.grid.jump(root, child)?;
                    self.inner(node, origin, &UPPER)?;
                }
            }
        }
        Ok(())
    }

    /// Counts a node of `bytes` bytes; there cannot be more than fit the grid.
    fn meet(&mut self, kind: usize, bytes: usize) -> Result<(), String> {
        self.nodes[kind] += 1;
        let room = self.grid.0.len() / bytes;
        if self.nodes[kind] > room {
            return Err(format!("its tree has more than {room} nodes of {bytes} bytes"));
        }
        Ok(())
    }

    fn inner(&mut self, node: usize, origin: IVec3, level: &Level) -> Result<(), String> {
        self.meet(usize::from(level.log == LOWER.log), level.bytes)?;
        let (log, slot_log) = (level.log, level.slot_log);
        for slot in 0..1_usize << (3 * log) {
            let part = |shift: u32| ((slot >> shift & ((1 << log) - 1)) << slot_log) as i32;
            let at = origin.saturating_add(IVec3::new(part(2 * log), part(log), part(0)));
            let entry = node + level.table + 8 * slot;
            if !self.grid.bit(node + level.child_mask, slot)? {
                let active = self.grid.bit(node + 32, slot)?;
                self.fill(at, slot_log, self.grid.f32(entry)?, active);
                continue;
            }
            let child = self.grid.jump(node, self.grid.u64(entry)?)?;
            if level.log == UPPER.log {
                self.inner(child, at, &LOWER)?;
            } else {
                self.leaf(child, at)?;
            }
        }
        Ok(())
    }

    fn leaf(&mut self, node: usize, origin: IVec3) -> Result<(), String> {
        self.meet(2, LEAF_BYTES)?;
        for voxel in 0..512_usize {
            let part = |shift: u32| (voxel >> shift & 7) as i32;
            let at = origin + IVec3::new(part(6), part(3), part(0));
            let value = self.grid.f32(node + LEAF_VALUES + 4 * voxel)?;
            self.fill(at, 0, value, self.grid.bit(node + LEAF_MASK, voxel)?);
        }
        Ok(())
    }

    /// Fills the part of a cube that lies in the box.
    fn fill(&mut self, origin: IVec3, log: u32, value: f32, active: bool) {
        let cube =
            IndexBox { min: origin, max: origin.saturating_add(IVec3::splat((1 << log) - 1)) };
        let Some(part) = cube.intersection(&self.bounds) else { return };
        if active {
            let wide = f64::from(value);
            self.counts[usize::from(value.is_nan())] += part.voxels();
            if !value.is_nan() {
                self.sum += wide * part.voxels() as f64;
                self.range = [self.range[0].min(wide), self.range[1].max(wide)];
            }
        }
        let [nx, ny, _] = self.dims;
        let first = part.min.saturating_sub(self.bounds.min).as_usizevec3();
        let length = part.dims()[0] as usize;
        for z in 0..part.dims()[2] as usize {
            for y in 0..part.dims()[1] as usize {
                let start = ((first.z + z) * ny + first.y + y) * nx + first.x;
                self.values[start..start + length].fill(value);
            }
        }
    }
}
