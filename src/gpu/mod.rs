//! The GPU backend: the passes as wgpu compute shaders (Vulkan, Metal, DX12), on its own device or
//! on a caller's. Never imports `kernel`, so that a GPU answer cannot come from the CPU.
//!
//! ```text
//! Media --upload--> GpuMedia --+--trace_threshold--> GpuMap ---------+
//! Frame --frame---> GpuFrame --+--trace_slices-----> GpuFragments ---+--march_view--> GpuImage
//!                              +--raster_slices----> GpuLists        |
//!                                   --sort_fragments--> GpuFragments +
//! ```
//!
//! All passes work on one beam of a scene. For each of [`Scene::beams`](crate::scene::Scene::beams):
//!
//! ```text
//! let frame = Frame::new(&beam, &settings)?;
//! let media = renderer.upload(&beam.media)?;      // not the scene's media, which may be coloured
//! let frame = renderer.frame(&frame, &media)?;
//! ```
//!
//! Then come a pass for the map and, for a picture, `march_view`. The picture of a scene is the sum
//! of its beams' pictures, with weights ([`Beam::add`](crate::scene::Beam::add)).
//!
//! A program that draws many frames prepares its passes once ([`Renderer::prepare_threshold`],
//! [`Renderer::prepare_slices`], [`Renderer::prepare_view`]). For each frame it updates the
//! parameters ([`Renderer::update`]) and records ([`Prepared::record`]) the view's pass and, if the
//! light has moved, the map's pass before it. [`crate::backend::Backend::stage`] does so for whole
//! scenes.

mod adapter;
mod bindings;
mod blocks;
mod field;
mod fragments;
mod link;
mod lists;
mod lookup;
mod media;
mod passes;
mod picture;
mod prepared;
mod programs;
mod readback;
mod renderer;
mod seen;
mod shadow;
mod stage;
mod surfaces;
mod tile;
mod tiles;

use std::sync::{Mutex, PoisonError};

use crate::backend::{Backend, Expected, Passes, Stage, check_host, check_surfaces};
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Casters, Media};
use crate::settings::{MapKind, Settings};
use crate::shadow::{FragmentMap, Links, Map, Runs, TexelMap};
use adapter::Watch;
pub use adapter::{AdapterChoice, adapters};
pub use blocks::NO_BLOCK;
pub use fragments::GpuFragments;
pub use link::{Imports, Linked, MediaKind, linked};
pub use lists::GpuLists;
pub use lookup::{PREFIX, shadow_wgsl};
pub use media::GpuMedia;
pub use passes::{PassSource, pass_sources};
use picture::{Shown, Subject};
pub use prepared::Prepared;
use programs::Variant;
pub use renderer::{GpuFrame, GpuImage, GpuMap, Renderer};
pub use seen::GpuLooks;
pub use shadow::GpuShadow;
pub use stage::GpuStage;
pub use surfaces::GpuSurfaces;
pub use tile::{INTERLEAVED, INTERLEAVED_STRIDE, Tile};

/// The largest number of bytes to reserve for what a picture's pixels see of surfaces.
const SEEN_BYTES: u64 = 1 << 30;

/// A renderer on a graphics adapter.
///
/// The media of the last pass stay on the device for the next passes, which keeps their volumes
/// alive.
#[derive(Debug)]
pub struct GpuBackend {
    renderer: Renderer,
    description: String,
    watch: Watch,
    uploaded: Mutex<Option<(Media, GpuMedia)>>,
}

impl GpuBackend {
    /// Opens a device of its own on an adapter that `choice` allows.
    ///
    /// # Errors
    /// If there is no such adapter, or if it does not open a device.
    pub fn open(choice: AdapterChoice) -> Result<Self> {
        let (device, queue, description, watch) = adapter::open(choice)?;
        let renderer = watch.over(|| Ok(Renderer::new(&device, &queue)))?;
        Ok(Self { renderer, description, watch, uploaded: Mutex::new(None) })
    }

    /// Works on another program's `device` and its `queue`, beside what that program does with them.
    /// The device needs no more than [`Renderer::new`] says, and [`GpuBackend::limits`] and
    /// [`GpuBackend::features`] are best. From now on this backend receives what
    /// [`wgpu::Device::on_uncaptured_error`] and [`wgpu::Device::set_device_lost_callback`] tell, and
    /// reports it as errors of its own work.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn on_device(
        adapter: &wgpu::AdapterInfo,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Self> {
        let watch = Watch::of(device);
        let renderer = watch.over(|| Ok(Renderer::new(device, queue)))?;
        let description = adapter::name(adapter);
        Ok(Self { renderer, description, watch, uploaded: Mutex::new(None) })
    }

    /// A stage, as [`Backend::stage`] gives it, that can also leave its pictures on the device.
    pub fn gpu_stage(&self) -> GpuStage<'_> {
        GpuStage::new(self)
    }

    /// The limits that are best for a device on `adapter`: all that it has.
    pub fn limits(adapter: &wgpu::Adapter) -> wgpu::Limits {
        adapter.limits()
    }

    /// The features that are used if `adapter` has them.
    pub fn features(adapter: &wgpu::Adapter) -> wgpu::Features {
        adapter.features() & adapter::wanted_features()
    }

    /// Uploads media, or returns those of the last pass if they are the same.
    fn upload(&self, media: &Media) -> Result<GpuMedia> {
        // A thread that panicked left the value complete or empty. The lock is not held while
        // uploading: a thread of the pool may take up other work then, which may call this
        // function.
        let known = || self.uploaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((held, uploaded)) = &*known()
            && same_on_the_device(held, media)
        {
            return Ok(uploaded.clone());
        }
        // Avoids holding both on the device at once.
        *known() = None;
        let held = self.renderer.upload(media)?;
        *known() = Some((media.clone(), held.clone()));
        Ok(held)
    }

    /// The picture of pass `march_view`.
    fn marched(&self, casters: Casters<'_>, frame: &Frame, map: &Map) -> Result<Image> {
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
        let march = |shadow: GpuShadow<'_>| {
            gpu.picture(&Subject { media: &gpu_media, shadow, surfaces }, &frame, &image)
        };
        match map {
            Map::Threshold(map) => {
                let gpu_map = gpu.map(map.size())?;
                gpu.write(&gpu_map, map.texels());
                let frame_buffer = gpu.frame(&frame, &gpu_media)?;
                gpu.submit(|encoder| gpu.fit_curves(encoder, &frame_buffer, &gpu_map))?;
                march(GpuShadow::Threshold(&gpu_map))?;
            }
            Map::Fragments(map) => march(GpuShadow::Fragments(&uploaded(gpu, map)?))?,
            Map::Coded(_) | Map::Visibility(_) | Map::Grid(_) => {
                return Err(Error::gpu("only the CPU can march through this kind of map"));
            }
        }
        Ok(Image { width, height, pixels: gpu.read(image.texture())? })
    }

    /// The renderer behind the backend, which works on textures of the device.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }
}

impl Backend for GpuBackend {
    fn description(&self) -> String {
        self.description.clone()
    }

    fn draws_surfaces(&self, kind: MapKind) -> bool {
        kind == MapKind::Fragments
    }

    /// Compiles the passes in advance.
    fn expect(&self, kind: Option<MapKind>, expected: Expected) {
        let media = match expected {
            Expected::Plain => MediaKind::Plain,
            Expected::Function => MediaKind::OneField,
        };
        let passes = passes::passes(kind.unwrap_or_default());
        // An error occurs again, and is reported, when the pass is needed.
        let _ = self.renderer.programs.compile(&passes, media, Variant::USUAL);
    }

    fn check_room(&self, settings: &Settings) -> Result<()> {
        check_host(settings)?;
        self.watch.over(|| {
            let [width, height] = settings.image.size;
            self.renderer.image(width, height)?;
            match settings.map.kind.unwrap_or_default() {
                MapKind::Threshold => self.renderer.map(settings.map.size).map(drop),
                // Lists are built in tiles.
                _ => self.renderer.check_size("map", [settings.map.size; 2]),
            }
        })
    }

    fn passes(&self) -> &dyn Passes {
        self
    }

    fn stage(&self) -> Box<dyn Stage + '_> {
        Box::new(self.gpu_stage())
    }
}

impl Passes for GpuBackend {
    fn trace_threshold(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        check_surfaces(self, &casters.surfaces.casting(), MapKind::Threshold)?;
        progress.begin("shadow map", 1);
        let gpu = &self.renderer;
        let texels = self.watch.over(|| {
            let gpu_media = self.upload(casters.media)?;
            let frame_buffer = gpu.frame(frame, &gpu_media)?;
            let map = gpu.map(frame.map.size)?;
            gpu.submit(|encoder| gpu.trace_threshold(encoder, &gpu_media, &frame_buffer, &map))?;
            gpu.read(map.texture())
        })?;
        progress.advance(1);
        Ok(texels)
    }

    fn trace_slices(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        self.watch.over(|| {
            let media = self.upload(casters.media)?;
            tiles::trace_slices(&self.renderer, casters, &media, frame, memory, progress)
        })
    }

    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        self.watch.over(|| {
            let media = self.upload(media)?;
            tiles::raster_slices(&self.renderer, &media, frame, memory, progress)
        })
    }

    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links> {
        let gpu = &self.renderer;
        let mut links: Vec<[u16; 2]> = self.watch.over(|| {
            let fragments = gpu.upload_fragments(runs, size)?;
            let mut linked = None;
            gpu.submit(|encoder| {
                linked = Some(gpu.link_neighbors(encoder, fragments)?);
                Ok(())
            })?;
            let linked = linked.ok_or_else(|| Error::gpu("nothing was recorded"))?;
            gpu.read_buffer(linked.links(), linked.links().size())
        })?;
        links.truncate(runs.nodes().len());
        Ok(Links::new(runs, links))
    }

    fn march_view(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let kind =
            if matches!(map, Map::Threshold(_)) { MapKind::Threshold } else { MapKind::Fragments };
        check_surfaces(self, casters.surfaces, kind)?;
        progress.begin("picture", 1);
        let image = self.watch.over(|| self.marched(casters, frame, map))?;
        progress.advance(1);
        Ok(image)
    }
}

fn uploaded(gpu: &Renderer, map: &FragmentMap) -> Result<GpuFragments> {
    let fragments = gpu.upload_fragments(map.runs(), map.size())?;
    Ok(match map.links() {
        Some(links) => gpu.upload_links(fragments, links.links()),
        None => fragments,
    })
}

/// Whether two media are the same on the device, where plain media consist of their volume only.
fn same_on_the_device(held: &Media, media: &Media) -> bool {
    match (held.plain(), media.plain()) {
        (Some(held), Some(volume)) => std::ptr::eq(held, volume),
        _ => held.same(media),
    }
}
