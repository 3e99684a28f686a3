//! The maps of a stage's beams: made on the device, kept there, and made anew when what they depend
//! on changes.

use super::fragments::GpuFragments;
use super::lists::ELEMENT_BYTES;
use super::media::GpuMedia;
use super::passes::{passes, passes_of_surfaces};
use super::programs::Variant;
use super::renderer::GpuMap;
use super::shadow::GpuShadow;
use super::tile::Tile;
use super::tiles::{Room, most_nodes, usual_nodes};
use super::{GpuStage, uploaded};
use crate::backend::Cause;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::progress::Progress;
use crate::scene::Beam;
use crate::settings::{MapKind, Settings, Slices};
use crate::shadow::Map;

/// Lists that may have been truncated.
pub(super) struct Counted {
    pub(super) fitted: bool,
    /// Their capacity in nodes per texel.
    pub(super) room: u32,
    pub(super) counters: wgpu::Buffer,
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
}

impl Shadow {
    pub(super) fn bound(&self) -> GpuShadow<'_> {
        match self {
            Self::Threshold(map) => GpuShadow::Threshold(map),
            Self::Fragments(map) => GpuShadow::Fragments(map),
        }
    }

    /// Bytes on the device.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            // Four numbers, and the curve that they define.
            Self::Threshold(map) => 96 * u64::from(map.texture().width()).pow(2),
            Self::Fragments(map) => map.nodes().size() + map.runs().size() + map.links().size(),
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
            passes(kind).to_vec()
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
        let capacity = self.room[usize::from(fitted)].max(least);
        let tile = Tile::rows(size, 0, size, capacity);
        if settings.map.fragments.slices == Slices::Raster
            || tile.node_bytes() > settings.map.fragments.memory
        {
            return Ok(None);
        }
        let Ok(fragments) = gpu.fragments(tile) else { return Ok(None) };
        let frame = gpu.frame(frame, media)?;
        progress.begin("shadow map", 1);
        let lists = match gpu.casting(beam.casters())? {
            Some(surfaces) => {
                let memory = settings.map.fragments.memory - tile.node_bytes();
                let most = memory.min(gpu.largest_binding()) / ELEMENT_BYTES;
                let mut room = Room { rows: size, elements: self.drawn };
                let lists = surfaces.listed(gpu, &frame, tile, most, &mut room).await?;
                if lists.tile().extent != tile.extent {
                    return Ok(None);
                }
                self.drawn = room.elements;
                Some(lists)
            }
            None => None,
        };
        let mut made = None;
        gpu.submit_async(|encoder| {
            gpu.trace_casters(encoder, media, lists.as_ref(), &frame, &fragments)?;
            let wide = settings.map.filter.window().0 > 1;
            let links = wide && settings.map.fragments.links == Some(true);
            made = Some(if links { gpu.link_neighbors(encoder, fragments)? } else { fragments });
            Ok(())
        })
        .await?;
        progress.advance(1);
        if let Some(map) = &made {
            self.counted.push(Counted { fitted, room: capacity, counters: map.counters.clone() });
        }
        Ok(made.map(Shadow::Fragments))
    }

    /// Maps that are too large to be made in one pass are assembled by the host.
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
