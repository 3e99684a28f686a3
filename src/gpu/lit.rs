//! The maps of a stage's beams: made on the device, kept there, and made anew when what they depend
//! on changes.

use super::fragments::GpuFragments;
use super::lists::ELEMENT_BYTES;
use super::media::GpuMedia;
use super::nested::{GpuNested, frame_of_nested};
use super::packed::Packed;
use super::passes::{NESTED, passes, passes_of_surfaces};
use super::programs::Variant;
use super::renderer::{GpuFrame, GpuMap, Renderer};
use super::shadow::GpuShadow;
use super::surfaces::GpuSurfaces;
use super::tile::Tile;
use super::tiles::{BLOCK_ROWS, Room, most_nodes, nodes_to_code, usual_nodes};
use super::{GpuStage, uploaded};
use crate::backend::Cause;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::progress::Progress;
use crate::scene::{Beam, Media};
use crate::settings::{MapKind, Settings, Slices};
use crate::shadow::Map;

/// Lists that may have been truncated.
pub(super) struct Counted {
    pub(super) fitted: bool,
    /// Their capacity in nodes per texel.
    pub(super) room: u32,
    pub(super) counters: wgpu::Buffer,
}

/// How far lists were filled.
enum Filled {
    Whole(Box<GpuFragments>),
    /// A texel needs so many nodes.
    Short(u32),
    /// There is no room for the lists, or for what surfaces leave in a few rows.
    NoRoom,
}

/// Where a map's lists are made.
struct Lists {
    /// Those of as many rows as there is room for at once.
    made: GpuFragments,
    /// Those of all rows, if these are not all.
    packed: Option<Packed>,
}

impl Lists {
    /// Room for the lists of all rows of `map`, packed if they take too much memory; `None` if there
    /// is none on the device. With surfaces, half of the memory is too much already: a list that
    /// outgrows its room then costs its own rows alone.
    fn of(gpu: &Renderer, map: Tile, memory: u64, with_surfaces: bool) -> Option<Self> {
        let whole = memory.min(gpu.largest_binding()) / if with_surfaces { 2 } else { 1 };
        if map.node_bytes() <= whole {
            return Some(Self { made: gpu.fragments(map).ok()?, packed: None });
        }
        // If the device has too little memory, the host may have enough.
        let room = gpu.scopes.scoped(Error::gpu, || {
            let made = gpu.part_of(map, memory)?;
            Ok(Self { made, packed: Some(gpu.packed(map, memory)?) })
        });
        room.and_then(|lists: Result<Self>| lists).ok()
    }
}

/// A beam's map on the device, and what it depends on.
pub(super) struct Lit {
    cause: Cause,
    pub(super) shadow: Shadow,
}

/// A map on the device.
pub(super) enum Shadow {
    Threshold(GpuMap),
    Fragments(GpuFragments),
    Nested(GpuNested),
}

impl Shadow {
    pub(super) fn bound(&self) -> GpuShadow<'_> {
        match self {
            Self::Threshold(map) => GpuShadow::Threshold(map),
            Self::Fragments(map) => GpuShadow::Fragments(map),
            Self::Nested(map) => GpuShadow::Nested(map),
        }
    }

    /// Bytes on the device.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            // Four numbers, and the curve that they define.
            Self::Threshold(map) => 96 * u64::from(map.texture().width()).pow(2),
            Self::Fragments(map) => map.nodes().size() + map.runs().size() + map.links().size(),
            Self::Nested(map) => map.bytes(),
        }
    }

    pub(super) fn linked(&self) -> bool {
        matches!(self, Self::Fragments(map) if map.linked())
    }
}

impl GpuStage<'_> {
    /// Prepares media, programs and map of a beam, which is the `index`th of its scene.
    pub(super) async fn light(
        &mut self,
        index: usize,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<()> {
        let backend = self.backend;
        let gpu = &backend.renderer;
        let kind = settings.map.kind.unwrap_or_default();
        let cause = Cause::of(beam, settings);
        if let Some(Some(known)) = self.lit.get(index)
            && known.cause.same(&cause)
        {
            return Ok(());
        }
        // Avoids holding both on the device at once.
        self.lit.truncate(index);
        let frame = Frame::new(beam, settings)?;
        let media_kind = GpuMedia::kind_of(gpu.device(), &beam.media);
        let passes = if beam.surfaces.is_empty() {
            passes(kind)
        } else {
            let refines = frame.view.samples > 1 && frame.view.tolerance > 0.0;
            passes_of_surfaces(!beam.surfaces.casting().is_empty(), refines)
        };
        // Drivers take as long to compile as the upload of a volume takes.
        let (compiled, media) = rayon::join(
            || gpu.programs.compile(&passes, media_kind, Variant::of(&frame)),
            || backend.upload(&beam.media),
        );
        compiled?;
        let media = media?;
        let shadow = match kind {
            MapKind::Threshold => Some(self.threshold(&media, &frame, progress).await?),
            MapKind::Fragments => self.fragments(beam, &media, &frame, settings, progress).await?,
            NESTED if beam.surfaces.is_empty() => {
                let memory = settings.map.fragments.memory;
                Some(self.nested((&beam.media, &media), &frame, memory, progress).await?)
            }
            _ => None,
        };
        let shadow = match shadow {
            Some(shadow) => shadow,
            None => self.by_way_of_the_host(beam, settings, progress).await?,
        };
        self.lit.push(Some(Lit { cause, shadow }));
        Ok(())
    }

    async fn threshold(
        &self,
        media: &GpuMedia,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Shadow> {
        let gpu = &self.backend.renderer;
        let map = gpu.map(frame.map.size)?;
        let frame = gpu.frame(frame, media)?;
        progress.begin("shadow map", 1);
        gpu.submit_async(|encoder| gpu.trace_threshold(encoder, media, &frame, &map)).await?;
        progress.advance(1);
        Ok(Shadow::Threshold(map))
    }

    /// Codes of lists, which may have been truncated if all of them fit the allowed memory at once.
    async fn nested(
        &mut self,
        (media, gpu_media): (&Media, &GpuMedia),
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Shadow> {
        let gpu = &self.backend.renderer;
        let size = frame.map.size;
        let coded = frame_of_nested(frame);
        let fitted = coded.map.tolerance > 0.0;
        let least = nodes_to_code(media, &coded);
        let tile = Tile::rows(size, 0, size, self.room[usize::from(fitted)].max(least));
        if tile.node_bytes() > memory.min(gpu.largest_binding()) {
            let media = (media, gpu_media);
            return Ok(Shadow::Nested(gpu.coded(media, frame, memory, progress).await?));
        }
        progress.begin("shadow map", 1);
        let (map, lists) = (gpu.nested(size)?, gpu.fragments(tile)?);
        let on_device = gpu.frame(&coded, gpu_media)?;
        gpu.submit_async(|encoder| {
            gpu.trace_slices(encoder, gpu_media, &on_device, &lists)?;
            gpu.prepare_nested(&on_device, &lists, &map).record(encoder)
        })
        .await?;
        let counters = lists.counters.clone();
        self.counted.push(Counted { fitted, room: tile.capacity, counters });
        progress.advance(1);
        Ok(Shadow::Nested(map))
    }

    /// The beam's lists, if all of them together fit the allowed memory and the device's largest
    /// binding, and if they are made by marching.
    async fn fragments(
        &mut self,
        beam: &Beam,
        media: &GpuMedia,
        frame: &Frame,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Option<Shadow>> {
        let backend = self.backend;
        let gpu = &backend.renderer;
        let size = frame.map.size;
        let fitted = frame.map.tolerance > 0.0;
        let least = if fitted { usual_nodes(frame) } else { most_nodes(&beam.media, frame) };
        let memory = settings.map.fragments.memory;
        if settings.map.fragments.slices == Slices::Raster {
            return Ok(None);
        }
        let on_device = gpu.frame(frame, media)?;
        let surfaces = gpu.casting(beam.casters())?;
        let casters = (media, surfaces.as_ref());
        let fragments = loop {
            let map = Tile::rows(size, 0, size, self.room[usize::from(fitted)].max(least));
            let Some(lists) = Lists::of(gpu, map, memory, surfaces.is_some()) else {
                return Ok(None);
            };
            progress.begin("shadow map", u64::from(size));
            match self.fill(casters, &on_device, (lists, fitted), memory, progress).await? {
                Filled::Whole(fragments) => break *fragments,
                Filled::Short(needed) => {
                    // Other rows may need a little more.
                    self.room[usize::from(fitted)] = needed.next_multiple_of(8);
                }
                Filled::NoRoom => return Ok(None),
            }
        };
        if !settings.map.follows_links(false) {
            return Ok(Some(Shadow::Fragments(fragments)));
        }
        let mut linked = None;
        gpu.submit_async(|encoder| {
            linked = Some(gpu.link_neighbors(encoder, fragments)?);
            Ok(())
        })
        .await?;
        Ok(linked.map(Shadow::Fragments))
    }

    /// Fills the lists of a map, with at most so much memory for what surfaces leave: if that is
    /// little, part of the rows by part.
    async fn fill(
        &mut self,
        (media, surfaces): (&GpuMedia, Option<&GpuSurfaces>),
        frame: &GpuFrame,
        (mut lists, fitted): (Lists, bool),
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Filled> {
        let gpu = &self.backend.renderer;
        let size = lists.made.tile.extent[0];
        let most = memory.min(gpu.largest_binding()) / ELEMENT_BYTES;
        let mut room = Room { rows: size, elements: self.drawn };
        let mut first = 0;
        while first < size {
            let Tile { extent: [_, at_once], capacity, .. } = lists.made.tile;
            let rows = Tile::rows(size, first, at_once.min(size - first), capacity);
            let rows_before = if lists.packed.is_some() { 0 } else { first };
            let mut tile = Tile { rows_before, ..rows };
            let mut left = None;
            if let Some(surfaces) = surfaces {
                let own = surfaces.listed(gpu, frame, tile, most, &mut room).await?;
                self.drawn = room.elements;
                let rows = own.tile().extent[1];
                if first + rows < size {
                    tile.extent[1] = rows - rows % BLOCK_ROWS;
                }
                left = Some(own);
            }
            if tile.extent[1] == 0 {
                return Ok(Filled::NoRoom);
            }
            let part = lists.made.part(gpu, tile);
            gpu.submit_async(|encoder| {
                gpu.trace_casters(encoder, media, left.as_ref(), frame, &part)
            })
            .await?;
            // With surfaces the host has waited already, and to begin again is dear.
            if surfaces.is_none() && lists.packed.is_none() {
                let counters = part.counters.clone();
                self.counted.push(Counted { fitted, room: capacity, counters });
            } else if let Some(needed) = gpu.nodes_missing_async(&part).await? {
                if lists.packed.is_none() {
                    return Ok(Filled::Short(needed));
                }
                // Rows that are packed stay.
                let longest = needed.next_multiple_of(8);
                self.room[usize::from(fitted)] = longest;
                match gpu.part_of(Tile::rows(size, 0, size, longest), memory) {
                    Ok(made) => lists.made = made,
                    Err(_) => return Ok(Filled::NoRoom),
                }
                continue;
            }
            if let Some(packed) = &mut lists.packed
                && !packed.add(gpu, &part, first).await?
            {
                return Ok(Filled::NoRoom);
            }
            first += tile.extent[1];
            progress.advance(u64::from(tile.extent[1]));
        }
        let Lists { made, packed } = lists;
        let whole = match packed {
            Some(packed) => {
                drop(made);
                packed.finished(gpu).await?
            }
            None => made,
        };
        Ok(Filled::Whole(whole.into()))
    }

    /// Maps that are drawn, or find no room on the device, are assembled by the host.
    async fn by_way_of_the_host(
        &self,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Shadow> {
        match self.backend.map_async(beam, settings, progress).await? {
            Map::Fragments(map) => Ok(Shadow::Fragments(uploaded(&self.backend.renderer, &map)?)),
            _ => Err(Error::gpu("only the CPU can march through this kind of map")),
        }
    }
}
