//! Pictures one after another on a device, where media, maps and the beams' pictures stay: there is
//! one readback per picture, but for maps that are made in parts. Surfaces are uploaded for each.

use super::GpuBackend;
use super::lit::{Counted, Lit};
use super::picture::{Shown, Subject};
use super::renderer::{GpuImage, Renderer};
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::image::{Image, Tone};
use crate::progress::Progress;
use crate::scene::{Beam, Scene};
use crate::settings::Settings;

/// A GPU's [`Stage`](crate::backend::Stage), which can leave its pictures on the device ([`GpuBackend::gpu_stage`]).
pub struct GpuStage<'a> {
    pub(super) backend: &'a GpuBackend,
    /// The maps of the last picture's beams, as far as there is room for them.
    pub(super) lit: Vec<Option<Lit>>,
    image: Option<GpuImage>,
    /// The least capacity, in nodes per texel, of raw lists and of fitted lists.
    pub(super) room: [u32; 2],
    /// The fragments of surfaces that the last map, or its last part, was found to need room for.
    pub(super) drawn: u64,
    /// The lists made for this picture, with their capacity and their counter of nodes.
    pub(super) counted: Vec<Counted>,
    /// Whether a picture was begun whose future may have been dropped before its end.
    begun: bool,
}

impl<'a> GpuStage<'a> {
    pub(super) fn new(backend: &'a GpuBackend) -> Self {
        let (lit, counted) = (Vec::new(), Vec::new());
        Self { backend, lit, image: None, room: [0; 2], drawn: 0, counted, begun: false }
    }

    /// The picture of a beam, which is the `index`th of its scene.
    async fn view(
        &mut self,
        index: usize,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<GpuImage> {
        Box::pin(self.light(index, beam, settings, progress)).await?;
        if progress.cancelled() {
            return Err(ErrorKind::Cancelled.into());
        }
        let gpu = &self.backend.renderer;
        let media = &self.backend.upload(&beam.media)?;
        let Some(Some(Lit { shadow, .. })) = self.lit.get(index) else {
            return Err(Error::gpu("a beam has no light"));
        };
        progress.begin("picture", 1);
        let mut frame = Frame::new(beam, settings)?;
        frame.map.follows_links = u32::from(shadow.linked());
        let [width, height] = settings.image.size;
        let image = match &self.image {
            // Only for the first beam: others are added to it.
            Some(image) if index == 0 && image.size() == [width, height] => image.clone(),
            _ => gpu.image(width, height)?,
        };
        let looks = gpu.looks(beam.casters(), &frame)?;
        let memory = settings.map.fragments.memory;
        let surfaces = looks.as_ref().map(|looks| Shown { looks, memory });
        let subject = Subject { media, shadow: shadow.bound(), surfaces };
        // On the heap, because futures hold frames, and futures hold futures.
        Box::pin(gpu.picture(&subject, &frame, &image)).await?;
        progress.advance(1);
        let kept: u64 = self.lit.iter().flatten().map(|lit| lit.shadow.bytes()).sum();
        if kept > settings.map.fragments.memory {
            self.lit[index] = None;
        }
        Ok(image)
    }

    /// The sum of the beams' pictures.
    async fn pictures(
        &mut self,
        beams: &[Beam],
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<GpuImage> {
        let backend = self.backend;
        let gpu = &backend.renderer;
        let [width, height] = settings.image.size;
        let mut sum: Option<GpuImage> = None;
        for (index, beam) in beams.iter().enumerate() {
            let image = self.view(index, beam, settings, progress).await?;
            let weights = beam.weights;
            if index == 0 {
                self.image = Some(image.clone());
            }
            if index == 0 && weights == glam::Vec4::ONE {
                sum = Some(image);
                continue;
            }
            let before = match sum.take() {
                Some(before) => before,
                None => gpu.image(width, height)?,
            };
            let output = gpu.image(width, height)?;
            let add = gpu.prepare_sum([&before, &image, &output], weights);
            gpu.submit_async(|encoder| add.record(encoder)).await?;
            sum = Some(output);
        }
        sum.ok_or_else(|| Error::value("light", "a scene needs one"))
    }
}

impl GpuStage<'_> {
    /// The picture of `scene` in linear radiance, as [`Stage::render`] makes it, in a future that
    /// browsers can run.
    ///
    /// If the future is dropped before its end, the stage makes its maps anew for the next picture.
    ///
    /// # Errors
    /// As [`Stage::render`].
    ///
    /// [`Stage::render`]: crate::backend::Stage::render
    pub async fn render_async(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let read = async |gpu: &Renderer, image: &GpuImage, counters: &[wgpu::Buffer]| {
            gpu.read_with(image.texture(), counters).await
        };
        let (_, pixels) = self.made(scene, settings, progress, read).await?;
        let [width, height] = settings.image.size;
        let image = Image { width, height, pixels };
        scene.check_radiance(&image)?;
        Ok(image)
    }

    /// The same picture on the device: what is read back is no more than a few counters, where a
    /// map was made. The next picture may be made in the same texture. Radiances that do not fit f32
    /// are not noticed.
    ///
    /// # Errors
    /// As [`GpuStage::render_async`].
    pub async fn draw_async(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<GpuImage> {
        let count = async |gpu: &Renderer, _: &GpuImage, counters: &[wgpu::Buffer]| {
            Ok(((), gpu.first_numbers(counters).await?))
        };
        self.made(scene, settings, progress, count).await.map(|(image, ())| image)
    }

    /// What a screen shows of a picture that [`GpuStage::draw_async`] made: four bytes a pixel, as
    /// [`Renderer::shown_async`] reads them.
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub async fn show_async(&self, image: &GpuImage, tone: Tone) -> Result<Vec<u8>> {
        let backend = self.backend;
        backend.over(backend.renderer.shown_async(image, tone)).await
    }

    /// Makes a picture. `read` reads it, and the counters of the lists.
    async fn made<T>(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
        read: impl AsyncFn(&Renderer, &GpuImage, &[wgpu::Buffer]) -> Result<(T, Vec<u32>)>,
    ) -> Result<(GpuImage, T)> {
        settings.check()?;
        self.backend.check_kind(&scene.surfaces, settings.map.kind.unwrap_or_default())?;
        let beams = scene.beams_for(settings)?;
        if std::mem::replace(&mut self.begun, true) {
            // Nobody has looked whether these are whole.
            self.lit.clear();
        }
        let made = self.whole(&beams, settings, progress, read).await;
        self.begun = false;
        made
    }

    /// Makes a picture, again if lists turn out to have been truncated.
    async fn whole<T>(
        &mut self,
        beams: &[Beam],
        settings: &Settings,
        progress: &dyn Progress,
        read: impl AsyncFn(&Renderer, &GpuImage, &[wgpu::Buffer]) -> Result<(T, Vec<u32>)>,
    ) -> Result<(GpuImage, T)> {
        let backend = self.backend;
        loop {
            self.counted.clear();
            let made = backend.over(async {
                let picture = self.pictures(beams, settings, progress).await?;
                let read = read(&backend.renderer, &picture, &self.counters()).await?;
                Ok((picture, read))
            });
            let (picture, (read, counts)) = match made.await {
                Ok(made) => made,
                Err(error) => {
                    // Nothing is kept that may be truncated or was never made.
                    let cancelled = matches!(error.kind(), ErrorKind::Cancelled);
                    if !(cancelled && self.were_whole().await) {
                        self.lit.clear();
                    }
                    return Err(error);
                }
            };
            if self.are_whole(counts) {
                return Ok((picture, read));
            }
            // Repeat everything with room for the longest list.
            self.lit.clear();
        }
    }

    /// The counters of the lists that were made for this picture.
    fn counters(&self) -> Vec<wgpu::Buffer> {
        self.counted.iter().map(|lists| lists.counters.clone()).collect()
    }

    /// Whether no list that was made for this picture was truncated, as far as the device tells.
    async fn were_whole(&mut self) -> bool {
        let counts = self.backend.renderer.first_numbers(&self.counters()).await;
        counts.is_ok_and(|counts| self.are_whole(counts))
    }

    /// Whether no list was truncated, given the lengths of the longest ones; else there will be room
    /// for them.
    fn are_whole(&mut self, counts: Vec<u32>) -> bool {
        let mut whole = true;
        for (lists, count) in self.counted.iter().zip(counts) {
            if count > lists.room {
                let room = &mut self.room[usize::from(lists.fitted)];
                *room = count.max(*room);
                whole = false;
            }
        }
        whole
    }
}
