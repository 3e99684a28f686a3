//! Pictures one after another on a device, where media, maps and the beams' pictures stay: there is
//! one readback per picture. Surfaces are uploaded for each.

use super::fragments::GpuFragments;
use super::lists::ELEMENT_BYTES;
use super::media::GpuMedia;
use super::passes::{passes, passes_of_surfaces};
use super::picture::{Shown, Subject};
use super::programs::Variant;
use super::renderer::{GpuImage, GpuMap, Renderer};
use super::shadow::GpuShadow;
use super::tile::Tile;
use super::tiles::{Room, most_nodes, usual_nodes};
use super::{GpuBackend, uploaded};
use crate::backend::{Backend, Cause, Stage, check_surfaces};
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Scene};
use crate::settings::{MapKind, Settings, Slices};
use crate::shadow::Map;

/// A GPU's [`Stage`], which can leave its pictures on the device ([`GpuBackend::gpu_stage`]).
pub struct GpuStage<'a> {
    backend: &'a GpuBackend,
    /// The maps of the last picture's beams, as far as there is room for them.
    lit: Vec<Option<Lit>>,
    image: Option<GpuImage>,
    /// The least capacity, in nodes per texel, of raw lists and of fitted lists.
    room: [u32; 2],
    /// The most fragments of surfaces that a map was found to need room for.
    drawn: u64,
    /// The lists made for this picture, with their capacity and their counter of nodes.
    counted: Vec<Counted>,
}

/// Lists that may have been truncated.
struct Counted {
    fitted: bool,
    /// Their capacity in nodes per texel.
    room: u32,
    counters: wgpu::Buffer,
}

/// A beam's map on the device, and what it depends on.
struct Lit {
    cause: Cause,
    shadow: Shadow,
}

/// A map on the device.
enum Shadow {
    Threshold(GpuMap),
    Fragments(GpuFragments),
}

impl Shadow {
    fn bound(&self) -> GpuShadow<'_> {
        match self {
            Self::Threshold(map) => GpuShadow::Threshold(map),
            Self::Fragments(map) => GpuShadow::Fragments(map),
        }
    }

    /// Bytes on the device.
    fn bytes(&self) -> u64 {
        match self {
            // Four numbers, and the curve that they define.
            Self::Threshold(map) => 96 * u64::from(map.texture().width()).pow(2),
            Self::Fragments(map) => map.nodes().size() + map.runs().size() + map.links().size(),
        }
    }

    fn linked(&self) -> bool {
        matches!(self, Self::Fragments(map) if map.linked())
    }
}

impl<'a> GpuStage<'a> {
    pub(super) fn new(backend: &'a GpuBackend) -> Self {
        let (lit, counted) = (Vec::new(), Vec::new());
        Self { backend, lit, image: None, room: [0; 2], drawn: 0, counted }
    }

    /// Prepares media, programs and map of a beam, which is the `index`th of its scene.
    fn light(
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
            MapKind::Threshold => Some(self.threshold(&media, &frame, progress)?),
            MapKind::Fragments => self.fragments(beam, &media, &frame, settings, progress)?,
            _ => None,
        };
        let shadow = match shadow {
            Some(shadow) => shadow,
            None => self.by_way_of_the_host(beam, settings, progress)?,
        };
        self.lit.push(Some(Lit { cause, shadow }));
        Ok(())
    }

    fn threshold(
        &self,
        media: &GpuMedia,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Shadow> {
        let gpu = &self.backend.renderer;
        let map = gpu.map(frame.map.size)?;
        let frame = gpu.frame(frame, media)?;
        progress.begin("shadow map", 1);
        gpu.submit(|encoder| gpu.trace_threshold(encoder, media, &frame, &map))?;
        progress.advance(1);
        Ok(Shadow::Threshold(map))
    }

    /// The beam's lists, if all of them together fit the allowed memory and the device's largest
    /// binding, and if they are made by marching.
    fn fragments(
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
                let lists = surfaces.listed(gpu, &frame, tile, most, &mut room)?;
                if lists.tile().extent != tile.extent {
                    return Ok(None);
                }
                self.drawn = room.elements;
                Some(lists)
            }
            None => None,
        };
        let mut made = None;
        gpu.submit(|encoder| {
            gpu.trace_casters(encoder, media, lists.as_ref(), &frame, &fragments)?;
            let wide = settings.map.fragments.links && settings.map.filter.window().0 > 1;
            made = Some(if wide { gpu.link_neighbors(encoder, fragments)? } else { fragments });
            Ok(())
        })?;
        progress.advance(1);
        if let Some(map) = &made {
            self.counted.push(Counted { fitted, room: capacity, counters: map.counters.clone() });
        }
        Ok(made.map(Shadow::Fragments))
    }

    /// Maps that are too large to be made in one pass are assembled by the host.
    fn by_way_of_the_host(
        &self,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Shadow> {
        match self.backend.map(beam, settings, progress)? {
            Map::Fragments(map) => Ok(Shadow::Fragments(uploaded(&self.backend.renderer, &map)?)),
            _ => Err(Error::gpu("only the CPU can march through this kind of map")),
        }
    }

    /// The picture of a beam, which is the `index`th of its scene.
    fn view(
        &mut self,
        index: usize,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<GpuImage> {
        self.light(index, beam, settings, progress)?;
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
        gpu.picture(&Subject { media, shadow: shadow.bound(), surfaces }, &frame, &image)?;
        progress.advance(1);
        let kept: u64 = self.lit.iter().flatten().map(|lit| lit.shadow.bytes()).sum();
        if kept > settings.map.fragments.memory {
            self.lit[index] = None;
        }
        Ok(image)
    }

    /// The sum of the beams' pictures.
    fn pictures(
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
            let image = self.view(index, beam, settings, progress)?;
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
            gpu.submit(|encoder| add.record(encoder))?;
            sum = Some(output);
        }
        sum.ok_or_else(|| Error::value("light", "a scene needs one"))
    }
}

impl GpuStage<'_> {
    /// The picture of `scene` in linear radiance, as [`Stage::render`] makes it, on the device: what
    /// is read back is no more than a few counters, where a map was made. The next picture may be
    /// made in the same texture. Radiances that do not fit f32 are not noticed.
    ///
    /// # Errors
    /// As [`Stage::render`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<GpuImage> {
        let count = |gpu: &Renderer, _: &GpuImage, counters: &[wgpu::Buffer]| {
            let read = |counter| gpu.read_buffer::<u32>(counter, 4);
            let counts: Result<Vec<_>> = counters.iter().map(read).collect();
            Ok(((), counts?.concat()))
        };
        self.made(scene, settings, progress, count).map(|(image, ())| image)
    }

    /// Makes a picture, again if lists turn out to have been truncated. `read` reads it, and the
    /// counters of the lists.
    fn made<T>(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
        read: impl Fn(&Renderer, &GpuImage, &[wgpu::Buffer]) -> Result<(T, Vec<u32>)>,
    ) -> Result<(GpuImage, T)> {
        settings.check()?;
        check_surfaces(self.backend, &scene.surfaces, settings.map.kind.unwrap_or_default())?;
        let beams = scene.beams_for(settings)?;
        let watch = &self.backend.watch;
        loop {
            self.counted.clear();
            let made = watch.over(|| {
                let picture = self.pictures(&beams, settings, progress)?;
                let counters: Vec<_> =
                    self.counted.iter().map(|lists| lists.counters.clone()).collect();
                let read = read(&self.backend.renderer, &picture, &counters)?;
                Ok((picture, read))
            });
            let (picture, (read, counts)) = match made {
                Ok(made) => made,
                Err(error) => {
                    // Nothing is kept that may be truncated or was never made.
                    let cancelled = matches!(error.kind(), ErrorKind::Cancelled);
                    if !(cancelled && self.counters().is_ok_and(|counts| self.are_whole(counts))) {
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

    /// The lengths of the longest lists of the maps that were made for this picture.
    fn counters(&self) -> Result<Vec<u32>> {
        let gpu = &self.backend.renderer;
        let read = |lists: &Counted| gpu.read_buffer::<u32>(&lists.counters, 4);
        let counts: Result<Vec<_>> = self.counted.iter().map(read).collect();
        Ok(counts?.concat())
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

impl Stage for GpuStage<'_> {
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let read = |gpu: &Renderer, image: &GpuImage, counters: &[wgpu::Buffer]| {
            gpu.read_with(image.texture(), counters)
        };
        let (_, pixels) = self.made(scene, settings, progress, read)?;
        let [width, height] = settings.image.size;
        let image = Image { width, height, pixels };
        scene.check_radiance(&image)?;
        Ok(image)
    }
}
