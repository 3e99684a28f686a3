//! Fragment maps on a device: passes `trace_slices` and `link_neighbors`, and the way to the host
//! and back.

use wgpu::BindGroupEntry;

use super::bindings::{at, entry};
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::renderer::{GpuFrame, Renderer};
use super::tile::{INTERLEAVED, INTERLEAVED_STRIDE, Tile};
use crate::error::{ErrorKind, Result};
use crate::shadow::{Node, Runs};

/// A tile of a fragment map on a device; a map for lookups is a tile of all texels.
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
    /// For each texel of the tile its first node and their number.
    pub fn runs(&self) -> &wgpu::Buffer {
        &self.runs
    }

    /// Nodes: depth and optical depth, two f32.
    pub fn nodes(&self) -> &wgpu::Buffer {
        &self.nodes
    }

    /// Links of each node, two u16 in one u32; a few bytes of nothing without.
    pub fn links(&self) -> &wgpu::Buffer {
        &self.links
    }

    /// What pass `trace_slices` writes.
    pub(super) fn slices_entries(&self) -> [BindGroupEntry<'_>; 4] {
        [
            entry(at::RUNS, self.runs.as_entire_binding()),
            entry(at::NODES, self.nodes.as_entire_binding()),
            entry(at::TILE, self.tile_buffer.as_entire_binding()),
            entry(at::COUNTERS, self.counters.as_entire_binding()),
        ]
    }

    /// Whether it has links between neighbours.
    pub fn linked(&self) -> bool {
        self.linked
    }
}

impl Renderer {
    /// Room for the nodes of a tile, `tile.capacity` a texel, as `trace_slices` writes them.
    ///
    /// # Errors
    /// If it is more than the device binds at once.
    pub fn fragments(&self, tile: Tile) -> Result<GpuFragments> {
        let nodes = tile.block_texels() * u64::from(tile.capacity);
        self.fragments_with(tile, nodes)
    }

    /// Room for a number of nodes.
    pub(super) fn fragments_with(&self, tile: Tile, nodes: u64) -> Result<GpuFragments> {
        let bytes = nodes * size_of::<Node>() as u64;
        let limit = self.largest_binding();
        if bytes > limit {
            let needed = format!("{bytes} bytes");
            let limit = format!("{limit} (a tolerance, fewer steps or a smaller map take less)");
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

    /// Puts a map's nodes on the device, without links.
    ///
    /// # Errors
    /// If they are more than the device binds at once.
    pub fn upload_fragments(&self, runs: &Runs, size: u32) -> Result<GpuFragments> {
        let tile = Tile::rows(size, 0, size, 0);
        let fragments = self.fragments_with(tile, runs.nodes().len() as u64)?;
        let table: Vec<[u32; 2]> =
            runs.starts().windows(2).map(|pair| [pair[0], pair[1] - pair[0]]).collect();
        self.queue().write_buffer(&fragments.runs, 0, bytemuck::cast_slice(&table));
        self.queue().write_buffer(&fragments.nodes, 0, bytemuck::cast_slice(runs.nodes()));
        Ok(fragments)
    }

    /// Puts links on the device, one for each node of `fragments` in the buffer's order.
    pub fn upload_links(&self, fragments: GpuFragments, links: &[[u16; 2]]) -> GpuFragments {
        let links = if links.is_empty() { &[[0_u16; 2]; 4] } else { links };
        let links = self.buffer("links", bytemuck::cast_slice(links), wgpu::BufferUsages::STORAGE);
        GpuFragments { links, linked: true, ..fragments }
    }

    /// Records pass `trace_slices`: fills `fragments` for the light of `frame`.
    ///
    /// # Errors
    /// If the device refuses the shader.
    pub fn trace_slices(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        fragments: &GpuFragments,
    ) -> Result<()> {
        self.prepare_slices(media, frame, fragments).record(encoder)
    }

    /// Records pass `link_neighbors`, and gives the map with its links.
    ///
    /// # Errors
    /// If the device refuses the shader.
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

    /// Waits for a map's `trace_slices` and says how many nodes a texel has at most, if more than
    /// there was room for: then the map is cut short, and the pass has to run again with as many.
    ///
    /// # Errors
    /// If the device fails.
    pub fn nodes_missing(&self, fragments: &GpuFragments) -> Result<Option<u32>> {
        let counters: Vec<u32> = self.read_buffer(&fragments.counters, 8)?;
        Ok(Some(counters[0]).filter(|&needed| needed > fragments.tile.capacity))
    }

    /// Copies the nodes of a tile to the host, texel by texel.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read_fragments(&self, fragments: &GpuFragments) -> Result<Runs> {
        let table: Vec<[u32; 2]> =
            self.read_buffer(&fragments.runs, fragments.tile.texels() * 8)?;
        let nodes: Vec<Node> = self.read_buffer(&fragments.nodes, fragments.nodes.size())?;
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
