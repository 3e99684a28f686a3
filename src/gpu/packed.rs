//! Fragment maps whose lists get no more room than they need: pass `pack_lists`. They are made in
//! parts of rows, each with room for the longest list in every texel, and packed one after another.

use super::bindings::{at, entry};
use super::fragments::GpuFragments;
use super::link::MediaKind;
use super::passes::Pass;
use super::renderer::Renderer;
use super::tile::{INTERLEAVED_STRIDE, Tile};
use super::tiles::BLOCK_ROWS;
use crate::error::Result;
use crate::shadow::Node;

/// The share of the allowed memory that a part may take.
const PART: u64 = 4;
/// Bytes of nodes that can be counted.
const MOST: u64 = 1 << 34;

/// The lists of a map, as far as they are packed.
pub(super) struct Packed {
    /// All texels, with the number of nodes for which there is room as capacity.
    lists: GpuFragments,
    /// The number of nodes so far.
    nodes: u32,
}

impl Renderer {
    /// Room for a part of the rows of a map with so many nodes for each texel, within some memory.
    ///
    /// # Errors
    /// If a row of blocks exceeds the device's largest buffer binding.
    pub(super) fn part_of(&self, map: Tile, memory: u64) -> Result<GpuFragments> {
        let [size, rows] = map.extent;
        let row = Tile::rows(size, 0, BLOCK_ROWS, map.capacity).node_bytes();
        let most = memory.min(self.largest_binding()) / PART / row.max(1);
        let most = u32::try_from(most).unwrap_or(u32::MAX).max(1).saturating_mul(BLOCK_ROWS);
        self.fragments(Tile::rows(size, 0, rows.min(most), map.capacity))
    }

    /// Room for the packed lists of all rows of `map`: all of some memory. There are none yet.
    ///
    /// # Errors
    /// If the table of lists exceeds the device's largest buffer binding.
    pub(super) fn packed(&self, map: Tile, memory: u64) -> Result<Packed> {
        // With its table of lists and a placeholder for links, it must not be too large to be kept.
        let memory = memory.saturating_sub(8 * map.texels() + 16);
        let bytes = memory.min(self.largest_binding()).min(MOST);
        let capacity = u32::try_from(bytes / size_of::<Node>() as u64).unwrap_or(u32::MAX);
        let lists = self.fragments_with(Tile { capacity, ..map }, capacity.into())?;
        Ok(Packed { lists, nodes: 0 })
    }
}

impl Packed {
    /// Runs pass `pack_lists`: adds lists, which are those of the rows from `first` on. Returns
    /// whether there was room for them.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) async fn add(
        &mut self,
        gpu: &Renderer,
        part: &GpuFragments,
        first: u32,
    ) -> Result<bool> {
        let tile = Tile { rows_before: first, capacity: self.lists.tile.capacity, ..part.tile };
        let tile_buffer = gpu.tile_buffer(tile);
        let entries = vec![
            entry(at::RUNS, part.runs().as_entire_binding()),
            entry(at::NODES, part.nodes().as_entire_binding()),
            entry(at::TILE, tile_buffer.as_entire_binding()),
            entry(at::COUNTERS, self.lists.counters.as_entire_binding()),
            entry(at::PACKED_RUNS, self.lists.runs().as_entire_binding()),
            entry(at::PACKED_NODES, self.lists.nodes().as_entire_binding()),
        ];
        let pack = gpu.prepare(Pass::PackLists, MediaKind::Plain, None, entries, tile.extent);
        gpu.submit_async(|encoder| pack.record(encoder)).await?;
        let counters: Vec<u32> = gpu.read_buffer(&self.lists.counters, 4).await?;
        self.nodes = counters[0];
        Ok(self.nodes <= tile.capacity)
    }

    /// The map, in a buffer of the size of its lists if that is at most half of the memory.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) async fn finished(self, gpu: &Renderer) -> Result<GpuFragments> {
        if self.nodes > self.lists.tile.capacity / 2 {
            return Ok(self.lists);
        }
        // Lookups bind a buffer even if it holds nothing.
        let map = self.lists.with_nodes(gpu, self.nodes.max(INTERLEAVED_STRIDE).into());
        gpu.submit_async(|encoder| {
            let bytes = map.nodes().size().min(self.lists.nodes().size());
            encoder.copy_buffer_to_buffer(self.lists.nodes(), 0, map.nodes(), 0, bytes);
            Ok(())
        })
        .await?;
        Ok(map)
    }
}
