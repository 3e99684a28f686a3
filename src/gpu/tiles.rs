//! Fragment maps of any size, and what is coded from them: built in tiles of whole rows that fit the
//! allowed memory and the device's largest binding. If a tile's buffers were too small, it is built
//! again with larger ones, so no fragment is ever lost.

use super::lists::{ELEMENT_BYTES, GpuLists};
use super::media::GpuMedia;
use super::nested::GpuNested;
use super::renderer::Renderer;
use super::tile::Tile;
use crate::error::{ErrorKind, Result};
use crate::frame::{Frame, SLABS_PER_VOXEL};
use crate::progress::Progress;
use crate::scene::{Casters, Media};
use crate::shadow::{Node, Runs};

/// Initial capacity of fitted lists, in nodes per texel: no preset's fit at the default tolerance
/// needs more.
const FITTED_NODES: u32 = 32;
/// Initial capacity of drawn lists, in fragments per texel.
const DRAWN_FRAGMENTS: u64 = 64;
/// Rows of texels in a block.
pub(super) const BLOCK_ROWS: u32 = 8;

/// Runs pass `trace_slices` over all tiles, and first those that draw surfaces.
pub(super) async fn trace_slices(
    gpu: &Renderer,
    casters: Casters<'_>,
    gpu_media: &GpuMedia,
    frame: &Frame,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Runs> {
    let size = frame.map.size;
    progress.begin("shadow map", u64::from(size));
    let budget = memory.min(gpu.largest_binding());
    let frame_buffer = gpu.frame(frame, gpu_media)?;
    let surfaces = gpu.casting(casters)?;
    let fitted = frame.map.tolerance > 0.0;
    let mut capacity = if fitted { usual_nodes(frame) } else { most_nodes(casters.media, frame) };
    let mut room = Room { rows: size, elements: 0 };
    let mut all = Runs::default();
    let mut first = 0;
    while first < size {
        let tile = next_tile(size, first, capacity, budget);
        let (tile, lists) = match &surfaces {
            Some(surfaces) => {
                let most = budget / ELEMENT_BYTES;
                let lists = surfaces.listed(gpu, &frame_buffer, tile, most, &mut room).await?;
                (Tile { extent: lists.tile().extent, ..tile }, Some(lists))
            }
            None => (tile, None),
        };
        let fragments = gpu.fragments(tile)?;
        gpu.submit_async(|encoder| {
            gpu.trace_casters(encoder, gpu_media, lists.as_ref(), &frame_buffer, &fragments)
        })
        .await?;
        if let Some(needed) = gpu.nodes_missing_async(&fragments).await? {
            capacity = needed;
            continue;
        }
        all.append(&gpu.read_fragments_async(&fragments).await?)?;
        first += tile.extent[1];
        progress.advance(u64::from(tile.extent[1]));
    }
    Ok(all)
}

/// Runs passes `trace_slices` and `code_nested` over all tiles of `map`.
pub(super) async fn code_nested(
    gpu: &Renderer,
    (media, gpu_media): (&Media, &GpuMedia),
    frame: &Frame,
    map: &GpuNested,
    memory: u64,
    progress: &dyn Progress,
) -> Result<()> {
    let size = frame.map.size;
    progress.begin("shadow map", u64::from(size));
    let budget = memory.min(gpu.largest_binding());
    let frame_buffer = gpu.frame(frame, gpu_media)?;
    let (mut capacity, mut first) = (nodes_to_code(media, frame), 0);
    while first < size {
        let tile = next_tile(size, first, capacity, budget);
        let lists = gpu.fragments(tile)?;
        gpu.submit_async(|encoder| {
            gpu.trace_slices(encoder, gpu_media, &frame_buffer, &lists)?;
            gpu.prepare_nested(&frame_buffer, &lists, map).record(encoder)
        })
        .await?;
        if let Some(needed) = gpu.nodes_missing_async(&lists).await? {
            capacity = needed;
            continue;
        }
        first += tile.extent[1];
        progress.advance(u64::from(tile.extent[1]));
    }
    Ok(())
}

/// The rows of a map from `first` on, in whole blocks, whose lists fit `budget` bytes with room for
/// `capacity` nodes a texel.
fn next_tile(size: u32, first: u32, capacity: u32, budget: u64) -> Tile {
    let block = Tile::rows(size, 0, BLOCK_ROWS, capacity).block_texels();
    let blocks = budget / (block * u64::from(capacity) * size_of::<Node>() as u64).max(1);
    let rows = u32::try_from(blocks * u64::from(BLOCK_ROWS)).unwrap_or(size).max(BLOCK_ROWS);
    Tile::rows(size, first, rows.min(size - first), capacity)
}

/// What drawing surfaces has needed so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// The most rows of texels of which all elements found room.
    pub rows: u32,
    /// The elements that a tile left.
    pub elements: u64,
}

/// Fills lists for the first rows of a tile whose elements all find room: at most `most` at a time,
/// unless a single row has more, and at first as many of each texel as `first` says. An element has
/// `bytes` bytes. `make` allocates lists, and `draw` records what fills them.
pub(super) async fn filled(
    gpu: &Renderer,
    (tile, first, bytes): (Tile, u64, u64),
    most: u64,
    room: &mut Room,
    make: impl Fn(Tile) -> GpuLists,
    draw: impl Fn(&mut wgpu::CommandEncoder, &GpuLists) -> Result<()>,
) -> Result<GpuLists> {
    let limit = (gpu.largest_binding() / bytes).min(u64::from(u32::MAX / 2));
    let most = most.min(limit);
    let mut tile = Tile { extent: [tile.extent[0], tile.extent[1].min(room.rows)], ..tile };
    loop {
        tile.capacity = (tile.texels() * first).min(most).max(room.elements) as u32;
        let lists = make(tile);
        gpu.submit_async(|encoder| draw(encoder, &lists)).await?;
        let drawn = gpu.fragments_drawn_async(&lists).await?;
        if drawn <= u64::from(tile.capacity) {
            return Ok(lists);
        }
        let is_row = tile.extent[1] == 1;
        if is_row && drawn > limit {
            let (needed, limit) = (format!("{drawn} fragments"), format!("{limit} fragments"));
            let what = "hair or meshes over a row of a map or a picture".to_owned();
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        }
        room.elements = drawn;
        if drawn > most && !is_row {
            room.rows = tile.extent[1].div_ceil(2);
            tile.extent[1] = room.rows;
            room.elements = 0;
        }
    }
}

/// Nodes per texel for which fitted lists get room at first. Polylines take nodes in proportion to
/// the root of one over the tolerance, which channels of different extinction divide by their ratio.
pub(super) fn usual_nodes(frame: &Frame) -> u32 {
    (FITTED_NODES as f32 * frame.media.ratios.max_element().sqrt()).ceil() as u32
}

/// Nodes per texel for which lists that are coded get room at first: a quarter of the usual tolerance
/// takes a little more than twice as many.
pub(super) fn nodes_to_code(media: &Media, frame: &Frame) -> u32 {
    if frame.map.tolerance > 0.0 { 5 * usual_nodes(frame) / 2 } else { most_nodes(media, frame) }
}

/// An upper bound for the number of nodes that slabs leave in a texel's raw list: one more than they
/// are. (A gap between two stretches of slabs costs a node, but it also leaves out a slab.) Without
/// media, nodes for which lists of surfaces get room at first.
pub(super) fn most_nodes(media: &Media, frame: &Frame) -> u32 {
    if media.bodies().is_empty() {
        return FITTED_NODES;
    }
    if frame.map.planes > 0 {
        return frame.map.planes + 1;
    }
    let voxels = media.domain().size().length() as f32;
    let slabs = (voxels * frame.map.slabs.per_voxel.max(SLABS_PER_VOXEL)).ceil() as u32 + 1;
    // The last batch of four may have shorter slabs.
    slabs.clamp(frame.map.slabs.least, frame.map.slabs.most) + 5
}

/// Runs passes `raster_slices` and `sort_fragments` over all tiles.
pub(super) async fn raster_slices(
    gpu: &Renderer,
    gpu_media: &GpuMedia,
    frame: &Frame,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Runs> {
    let size = frame.map.size;
    let planes = frame.map.planes;
    progress.begin("shadow map", u64::from(size));
    // Nodes take as many bytes as elements.
    let most = memory.min(gpu.largest_binding()) / ELEMENT_BYTES;
    let most = most.min(u64::from(u32::MAX - 1));
    let frame_buffer = gpu.frame(frame, gpu_media)?;
    let mut all = Runs::default();
    // The counter of fragments has 32 bits.
    let countable = u64::from(u32::MAX) / (u64::from(size) * u64::from(planes)).max(1);
    let mut rows = u64::from(size).min(countable).max(1) as u32;
    let (mut first, mut capacity) = (0, 0);
    while first < size {
        rows = rows.min(size - first);
        let guess = u64::from(rows) * u64::from(size) * DRAWN_FRAGMENTS;
        let tile = Tile::rows(size, first, rows, guess.max(capacity).min(most) as u32);
        let lists = gpu.lists(tile);
        gpu.submit_async(|encoder| {
            gpu.raster_slices(encoder, gpu_media, &frame_buffer, planes, &lists)
        })
        .await?;
        let drawn = gpu.fragments_drawn_async(&lists).await?;
        if drawn > most {
            if rows == 1 {
                let (needed, limit) = (format!("{drawn} fragments"), format!("{most} fragments"));
                let what = "a row of fragment lists".to_owned();
                return Err(ErrorKind::Limit { what, needed, limit }.into());
            }
            rows = rows.div_ceil(2);
            continue;
        }
        if drawn > u64::from(tile.capacity) {
            capacity = drawn;
            continue;
        }
        let mut sorted = None;
        gpu.submit_async(|encoder| {
            sorted = Some(gpu.sort_fragments(encoder, &frame_buffer, &lists, drawn as u32)?);
            Ok(())
        })
        .await?;
        if let Some(fragments) = sorted {
            all.append(&gpu.read_fragments_async(&fragments).await?)?;
        }
        first += rows;
        progress.advance(u64::from(rows));
    }
    Ok(all)
}
