//! Maps and pictures one by one, with input and output in the host's memory.

use super::passes::NESTED;
use super::picture::{Shown, Subject};
use super::shadow::GpuShadow;
use super::{GpuBackend, tiles, uploaded};
use crate::backend;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Casters, Media};
use crate::settings::{Coding, MapKind, Settings, Slices};
use crate::shadow::{CodedMap, FragmentMap, Links, Map, Runs, TexelMap, ThresholdMap};

/// The largest number of bytes to reserve for what a picture's pixels see of surfaces.
const SEEN_BYTES: u64 = 1 << 30;

impl GpuBackend {
    /// Builds the shadow map of `beam`, of the kind in `settings`, and transfers it to the host.
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if a GPU does not build maps of the
    /// kind, or if the device fails or runs out of memory.
    pub async fn map_async(
        &self,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Map> {
        let frame = Frame::new(beam, settings)?;
        let (view, casters) = (beam.view, beam.casters());
        let kind = settings.map.kind.unwrap_or_default();
        if !beam.surfaces.casting().is_empty() {
            backend::check_kind(kind, settings)?;
        }
        match kind {
            MapKind::Threshold => {
                let texels = self.threshold(casters, &frame, progress).await?;
                let around = frame.around(casters);
                Ok(Map::Threshold(ThresholdMap::new(texels, settings, view, &around)))
            }
            MapKind::Fragments => {
                let memory = settings.map.fragments.memory;
                let runs = match settings.map.fragments.slices {
                    Slices::Raster => {
                        self.rastered(casters.media, &frame, memory, progress).await?
                    }
                    Slices::Auto | Slices::Ray | Slices::Planes => {
                        self.traced(casters, &frame, memory, progress).await?
                    }
                };
                let links = if settings.map.follows_links(false) {
                    Some(self.links(&runs, settings.map.size).await?)
                } else {
                    None
                };
                let map = FragmentMap::new(runs, view, &frame);
                Ok(Map::Fragments(match links {
                    Some(links) => map.with_links(links),
                    None => map,
                }))
            }
            NESTED => {
                let bytes = self.coded(casters, &frame, settings, progress).await?;
                Ok(Map::Coded(CodedMap::new(bytes, Coding::Nested, view, &frame)))
            }
            _ => Err(backend::unbuilt(&self.description)),
        }
    }

    /// The picture of `beam`, lit through a map on the host, in linear radiance.
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if a GPU does not march through such
    /// maps, or if the device fails or runs out of memory.
    pub async fn view_async(
        &self,
        beam: &Beam,
        settings: &Settings,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let frame = Frame::new(beam, settings)?;
        self.marched(beam.casters(), &frame, map, progress).await
    }

    /// Pass `trace_threshold`.
    pub(super) async fn threshold(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        self.check_kind(&casters.surfaces.casting(), MapKind::Threshold)?;
        progress.begin("shadow map", 1);
        let gpu = &self.renderer;
        let texels = self.over(async {
            let gpu_media = self.upload(casters.media)?;
            let frame_buffer = gpu.frame(frame, &gpu_media)?;
            let map = gpu.map(frame.map.size)?;
            gpu.submit_async(|encoder| {
                gpu.trace_threshold(encoder, &gpu_media, &frame_buffer, &map)
            })
            .await?;
            gpu.read_async(map.texture()).await
        });
        let texels = texels.await?;
        progress.advance(1);
        Ok(texels)
    }

    /// Pass `trace_slices`.
    pub(super) async fn traced(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        let runs = self.over(async {
            let media = self.upload(casters.media)?;
            tiles::trace_slices(&self.renderer, casters, &media, frame, memory, progress).await
        });
        runs.await
    }

    /// Passes `trace_slices` and `code_nested`.
    async fn coded(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        self.check_kind(&casters.surfaces.casting(), NESTED)?;
        let gpu = &self.renderer;
        let bytes = self.over(async {
            let media = self.upload(casters.media)?;
            let memory = settings.map.fragments.memory;
            let map = gpu.coded((casters.media, &media), frame, memory, progress).await?;
            gpu.read_buffer(map.words(), map.words().size()).await
        });
        bytes.await
    }

    /// Passes `raster_slices` and `sort_fragments`.
    pub(super) async fn rastered(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        let runs = self.over(async {
            let media = self.upload(media)?;
            tiles::raster_slices(&self.renderer, &media, frame, memory, progress).await
        });
        runs.await
    }

    /// Pass `link_neighbors`.
    pub(super) async fn links(&self, runs: &Runs, size: u32) -> Result<Links> {
        let gpu = &self.renderer;
        let links = self.over(async {
            let fragments = gpu.upload_fragments(runs, size)?;
            let mut linked = None;
            gpu.submit_async(|encoder| {
                linked = Some(gpu.link_neighbors(encoder, fragments)?);
                Ok(())
            })
            .await?;
            let linked = linked.ok_or_else(|| Error::gpu("nothing was recorded"))?;
            gpu.read_buffer(linked.links(), linked.links().size()).await
        });
        let mut links: Vec<[u16; 2]> = links.await?;
        links.truncate(runs.nodes().len());
        Ok(Links::new(runs, links))
    }

    /// Pass `march_view`.
    pub(super) async fn marched(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let kind = match map {
            Map::Threshold(_) => MapKind::Threshold,
            Map::Coded(map) => map.kind(),
            _ => MapKind::Fragments,
        };
        self.check_kind(casters.surfaces, kind)?;
        progress.begin("picture", 1);
        let image = self.over(self.picture(casters, frame, map)).await?;
        progress.advance(1);
        Ok(image)
    }

    /// The picture of pass `march_view`.
    async fn picture(&self, casters: Casters<'_>, frame: &Frame, map: &Map) -> Result<Image> {
        let (gpu, media) = (&self.renderer, casters.media);
        let mut frame = *frame;
        frame.map.follows_links =
            u32::from(map.as_fragments().is_some_and(|map| map.links().is_some()));
        let [width, height] = [frame.view.width, frame.view.height];
        // Allocated first: a picture that is too large should fail before anything slow happens.
        let image = gpu.image(width, height)?;
        let gpu_media = self.upload(media)?;
        let looks = gpu.looks(casters, &frame)?;
        let surfaces = looks.as_ref().map(|looks| Shown { looks, memory: SEEN_BYTES });
        let (gpu_map, fragments, nested);
        let shadow = match map {
            Map::Threshold(map) => {
                gpu_map = gpu.map(map.size())?;
                gpu.write(&gpu_map, map.texels());
                let frame_buffer = gpu.frame(&frame, &gpu_media)?;
                gpu.submit_async(|encoder| gpu.fit_curves(encoder, &frame_buffer, &gpu_map))
                    .await?;
                GpuShadow::Threshold(&gpu_map)
            }
            Map::Fragments(map) => {
                fragments = uploaded(gpu, map)?;
                GpuShadow::Fragments(&fragments)
            }
            Map::Coded(map) if map.kind() == NESTED => {
                nested = gpu.upload_nested(map)?;
                GpuShadow::Nested(&nested)
            }
            Map::Coded(_) | Map::Visibility(_) | Map::Grid(_) => {
                return Err(Error::gpu("only the CPU can march through this kind of map"));
            }
        };
        let subject = Subject { media: &gpu_media, shadow, surfaces };
        gpu.picture(&subject, &frame, &image).await?;
        Ok(Image { width, height, pixels: gpu.read_async(image.texture()).await? })
    }
}
