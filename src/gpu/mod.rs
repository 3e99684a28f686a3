//! The GPU backend: the passes as wgpu compute shaders (Vulkan, Metal, DX12, or WebGPU in a
//! browser), on its own device or on a caller's. Never imports `kernel`, so that a GPU answer cannot come from the CPU.
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
//! light has moved, the map's pass before it. A [`GpuStage`] does so for whole scenes.
//!
//! What may take time is a future, and its name ends in `_async`, because a browser must never be
//! waited for. Elsewhere the futures are ready at once, and functions of the same names without the
//! ending wait for them, as do [`Backend`](crate::backend::Backend) and
//! [`Stage`](crate::backend::Stage), which do not exist for a GPU in a browser.

mod adapter;
mod bindings;
mod blocks;
mod field;
mod fragments;
mod link;
mod lists;
mod lit;
mod lookup;
mod maps;
mod media;
mod nested;
mod packed;
mod passes;
mod picture;
mod prepared;
mod programs;
mod readback;
mod renderer;
mod seen;
mod shadow;
mod source;
mod stage;
mod surfaces;
mod tile;
mod tiles;
#[cfg(not(target_family = "wasm"))]
mod waited;
mod waiting;

use std::sync::{Mutex, PoisonError};

use crate::backend;
use crate::error::{Error, Result};
use crate::scene::{Media, Surfaces};
use crate::settings::MapKind;
use crate::shadow::{FragmentMap, TexelMap};
use adapter::Watch;
pub use adapter::{AdapterChoice, adapters_async};
pub use blocks::NO_BLOCK;
pub use fragments::GpuFragments;
pub use link::{Imports, Linked, MediaKind, linked};
pub use lists::GpuLists;
pub use lookup::{PREFIX, shadow_wgsl};
pub use media::GpuMedia;
pub use nested::{GpuNested, frame_of_nested};
use passes::NESTED;
pub use passes::{PassSource, pass_sources};
pub use prepared::Prepared;
pub use renderer::{GpuFrame, GpuImage, GpuMap, Renderer};
pub use seen::GpuLooks;
pub use shadow::GpuShadow;
pub use stage::GpuStage;
pub use surfaces::GpuSurfaces;
pub use tile::{INTERLEAVED, INTERLEAVED_STRIDE, Tile};
#[cfg(not(target_family = "wasm"))]
pub use waited::adapters;

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
    /// Opens a device of its own on an adapter that `choice` allows. In a browser that is the
    /// adapter which the browser takes for heavy work, and it counts as hardware unless the browser
    /// tells otherwise.
    ///
    /// # Errors
    /// If there is no such adapter, or if it does not open a device.
    pub async fn request(choice: AdapterChoice) -> Result<Self> {
        let (device, queue, description, watch) = adapter::open(choice).await?;
        Self::new(&device, &queue, description, watch)
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
        Self::new(device, queue, adapter::name(adapter), Watch::of(device))
    }

    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        description: String,
        watch: Watch,
    ) -> Result<Self> {
        watch.alive()?;
        let renderer = watch.over(Ok(Renderer::new(device, queue)))?;
        Ok(Self { renderer, description, watch, uploaded: Mutex::new(None) })
    }

    /// The result of `work`; an error if the device is lost, or if it reported an error that `work`
    /// did not notice.
    async fn over<T>(&self, work: impl Future<Output = Result<T>>) -> Result<T> {
        let scopes = &self.renderer.scopes;
        // The verdict on work that was given up halfway says nothing about this work.
        let _ = scopes.settled().await;
        self.watch.alive()?;
        let found = work.await;
        let settled = scopes.settled().await;
        let found = found.and_then(|found| settled.map(|()| found));
        if cfg!(target_family = "wasm") && found.is_err() {
            // Browsers tell what no scope has caught after all verdicts: what follows from this
            // error shall not become one of the next work.
            let _ = scopes.scoped(Error::gpu, || ());
            let _ = scopes.settled().await;
        }
        let found = self.watch.over(found);
        if scopes.were_bad() {
            // Something is kept that turned out to be invalid.
            *self.uploaded.lock().unwrap_or_else(PoisonError::into_inner) = None;
            self.renderer.programs.forget();
        }
        found
    }

    /// Description for people of the graphics adapter.
    pub fn description(&self) -> String {
        self.description.clone()
    }

    /// Checks that maps of `kind` can be made of what `surfaces` there are.
    fn check_kind(&self, surfaces: &Surfaces, kind: MapKind) -> Result<()> {
        if surfaces.is_empty() || self.draws_surfaces(kind) {
            return Ok(());
        }
        Err(backend::draws_no_surfaces(&self.description, kind))
    }

    /// Whether it builds maps of `kind` and marches through them.
    pub fn builds(&self, kind: MapKind) -> bool {
        matches!(kind, MapKind::Threshold | MapKind::Fragments | NESTED)
    }

    /// Whether it builds maps of `kind` of surfaces, and pictures of them through such.
    pub fn draws_surfaces(&self, kind: MapKind) -> bool {
        kind == MapKind::Fragments
    }

    /// A stage that can also leave its pictures on the device, and makes them in futures.
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

    /// The renderer behind the backend, which works on textures of the device.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
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
