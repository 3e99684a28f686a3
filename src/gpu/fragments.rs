//! Fragment maps on a device: passes `trace_slices` and `link_neighbors`, upload and readback.

use wgpu::BindGroupEntry;

use super::bindings::{at, entry};
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::renderer::{GpuFrame, Renderer};
use super::tile::{INTERLEAVED, INTERLEAVED_STRIDE, Tile};
use crate::error::{ErrorKind, Result};
use crate::shadow::{Node, Runs};

/// A tile of a fragment map on a device. A map for lookups is a tile with all texels.
#[derive(Clone, Debug)]
pub struct GpuFragments {
    pub(super) tile: Tile,
    pub(super) tile_buffer: wgpu::Buffer,
    runs: wgpu::Buffer,
    nodes: wgpu::Buffer,
    links: wgpu::Buffer,
    pub(super) counters: wgpu::Buffer,
    linked: bool,
}

impl GpuFragments {
    /// A storage buffer with two u32 for each texel of the tile: index of its first node, and
    /// number of nodes (with the flag [`super::INTERLEAVED`]).
    pub fn runs(&self) -> &wgpu::Buffer {
        &self.runs
    }

    /// A storage buffer of nodes, two f32 each: depth and optical depth.
    pub fn nodes(&self) -> &wgpu::Buffer {
        &self.nodes
    }

    /// A storage buffer with one u32 per node, which holds its two links as u16; a small
    /// placeholder if there are no links.
    pub fn links(&self) -> &wgpu::Buffer {
        &self.links
    }

    /// The buffers that lookups read.
    pub(super) fn lookup_entries(&self) -> [BindGroupEntry<'_>; 3] {
        [
            entry(at::RUNS, self.runs.as_entire_binding()),
            entry(at::NODES, self.nodes.as_entire_binding()),
            entry(at::LINKS, self.links.as_entire_binding()),
        ]
    }

    /// The buffers that pass `trace_slices` writes.
    pub(super) fn slices_entries(&self) -> [BindGroupEntry<'_>; 4] {
        [
            entry(at::RUNS, self.runs.as_entire_binding()),
            entry(at::NODES, self.nodes.as_entire_binding()),
            entry(at::TILE, self.tile_buffer.as_entire_binding()),
            entry(at::COUNTERS, self.counters.as_entire_binding()),
        ]
    }

    /// The same buffers, of which pass `trace_slices` fills the rows of a tile, with a counter of
    /// their own.
    pub(super) fn part(&self, gpu: &Renderer, tile: Tile) -> Self {
        let (tile_buffer, counters) = (gpu.tile_buffer(tile), gpu.storage("counters", 8));
        Self { tile, tile_buffer, counters, ..self.clone() }
    }

    /// The same texels, with another buffer of so many nodes.
    pub(super) fn with_nodes(&self, gpu: &Renderer, nodes: u64) -> Self {
        let nodes = gpu.storage("nodes", nodes * size_of::<Node>() as u64);
        Self { nodes, ..self.clone() }
    }

    /// Whether the map has links between neighbours.
    pub fn linked(&self) -> bool {
        self.linked
    }
}

impl Renderer {
    /// Allocates buffers for the nodes of a tile, `tile.capacity` per texel, for pass
    /// `trace_slices` to fill.
    ///
    /// # Errors
    /// If they exceed the device's largest buffer binding.
    pub fn fragments(&self, tile: Tile) -> Result<GpuFragments> {
        let nodes = tile.block_texels() * u64::from(tile.capacity);
        self.fragments_with(tile, nodes)
    }

    /// Allocates buffers for a number of nodes.
    pub(super) fn fragments_with(&self, tile: Tile, nodes: u64) -> Result<GpuFragments> {
        let bytes = nodes * size_of::<Node>() as u64;
        let (largest, limit) = (bytes.max(tile.texels() * 8), self.largest_binding());
        if largest > limit {
            let needed = format!("{largest} bytes");
            let limit =
                format!("{limit} bytes (a tolerance, fewer steps or a smaller map need less)");
            return Err(ErrorKind::Limit { what: "fragment map".to_owned(), needed, limit }.into());
        }
        Ok(GpuFragments {
            tile,
            tile_buffer: self.tile_buffer(tile),
            runs: self.storage("runs", tile.texels() * 8),
            nodes: self.storage("nodes", bytes),
            links: self.storage("links", 0),
            counters: self.storage("counters", 8),
            linked: false,
        })
    }

    /// Uploads a map's nodes to the device, without links.
    ///
    /// # Errors
    /// If they exceed the device's largest buffer binding.
    pub fn upload_fragments(&self, runs: &Runs, size: u32) -> Result<GpuFragments> {
        let tile = Tile::rows(size, 0, size, 0);
        let fragments = self.fragments_with(tile, runs.nodes().len() as u64)?;
        let table: Vec<[u32; 2]> =
            runs.starts().windows(2).map(|pair| [pair[0], pair[1] - pair[0]]).collect();
        self.queue().write_buffer(&fragments.runs, 0, bytemuck::cast_slice(&table));
        self.queue().write_buffer(&fragments.nodes, 0, bytemuck::cast_slice(runs.nodes()));
        Ok(fragments)
    }

    /// Uploads links to the device, one entry for each node of `fragments` in the buffer's order.
    pub fn upload_links(&self, fragments: GpuFragments, links: &[[u16; 2]]) -> GpuFragments {
        let links = if links.is_empty() { &[[0_u16; 2]; 4] } else { links };
        let links = self.buffer("links", bytemuck::cast_slice(links), wgpu::BufferUsages::STORAGE);
        GpuFragments { links, linked: true, ..fragments }
    }

    /// Records pass `trace_slices`, which fills `fragments` for the light of `frame`.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn trace_slices(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        fragments: &GpuFragments,
    ) -> Result<()> {
        self.prepare_slices(media, frame, fragments).record(encoder)
    }

    /// Records pass `link_neighbors`, and returns the map with its links.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn link_neighbors(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        fragments: GpuFragments,
    ) -> Result<GpuFragments> {
        let links = self.storage("links", fragments.nodes.size() / 2);
        let entries = vec![
            entry(at::RUNS, fragments.runs.as_entire_binding()),
            entry(at::NODES, fragments.nodes.as_entire_binding()),
            entry(at::LINKS, links.as_entire_binding()),
            entry(at::TILE, fragments.tile_buffer.as_entire_binding()),
        ];
        let extent = fragments.tile.extent;
        self.prepare(Pass::LinkNeighbors, MediaKind::Plain, None, entries, extent)
            .record(encoder)?;
        Ok(GpuFragments { links, linked: true, ..fragments })
    }

    /// Waits for a map's pass `trace_slices` and checks its capacity. If some texel needed more
    /// nodes than there was room for, the map is truncated, and the result is the largest number
    /// needed: the pass must run again with that capacity. Else `None`.
    ///
    /// # Errors
    /// If the device fails.
    pub async fn nodes_missing_async(&self, fragments: &GpuFragments) -> Result<Option<u32>> {
        let counters: Vec<u32> = self.read_buffer(&fragments.counters, 8).await?;
        Ok(Some(counters[0]).filter(|&needed| needed > fragments.tile.capacity))
    }

    /// Copies the nodes of a tile to the host, texel by texel.
    ///
    /// # Errors
    /// If the device fails.
    pub async fn read_fragments_async(&self, fragments: &GpuFragments) -> Result<Runs> {
        let table: Vec<[u32; 2]> =
            self.read_buffer(&fragments.runs, fragments.tile.texels() * 8).await?;
        let nodes: Vec<Node> = self.read_buffer(&fragments.nodes, fragments.nodes.size()).await?;
        let mut runs = Runs::default();
        let mut texel = Vec::new();
        for [first, count] in table {
            let stride = if count & INTERLEAVED == 0 { 1 } else { INTERLEAVED_STRIDE as usize };
            let own = nodes.get(first as usize..).unwrap_or_default();
            texel.clear();
            texel.extend(own.iter().step_by(stride).take((count & !INTERLEAVED) as usize));
            runs.push(&texel)?;
        }
        Ok(runs)
    }
}
