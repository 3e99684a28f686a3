//! The CPU backend: the passes on all cores. It is the default on machines without a GPU, and the
//! reference for other backends.

mod bins;
#[cfg(test)]
mod bounds;
#[cfg(test)]
mod counts;
mod deep_view;
mod ground;
mod layers;
mod lazy_fragments;
mod link_neighbors;
mod march_colours;
mod march_view;
mod raster_slices;
mod raster_surfaces;
mod raster_view;
mod refine_view;
mod shade_view;
mod sort_fragments;
mod tiles;
mod trace_coded;
mod trace_grid;
mod trace_slices;
mod trace_threshold;
mod trace_visibility;

use crate::backend::{Backend, Passes};
use crate::error::Result;
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Casters, Media};
use crate::settings::MapKind;
use crate::shadow::{Codec, Links, Map, Runs, Shadow, VisibilityPoint};
pub use deep_view::{DeepSample, DeepView};
pub use lazy_fragments::LazyFragments;

/// Renders on rayon's current thread pool.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend;

impl CpuBackend {
    /// A picture lit through anything that implements [`Shadow`]: pass `march_view` for maps that
    /// are not a [`Map`].
    ///
    /// # Errors
    /// If surfaces take too much memory.
    pub fn march_view_through<'a>(
        self,
        casters: impl Into<Casters<'a>>,
        frame: &Frame,
        map: &dyn Shadow,
        progress: &dyn Progress,
    ) -> Result<Image> {
        march_view::march_view(casters.into(), frame, map, progress)
    }

    /// Some pixels, each (x, y), of that picture.
    ///
    /// # Errors
    /// As [`Self::march_view_through`].
    pub fn march_pixels<'a>(
        self,
        casters: impl Into<Casters<'a>>,
        frame: &Frame,
        map: &dyn Shadow,
        pixels: &[[u32; 2]],
    ) -> Result<Vec<[f32; 4]>> {
        march_view::march_pixels(casters.into(), frame, map, pixels)
    }
}

impl Backend for CpuBackend {
    fn description(&self) -> String {
        format!("cpu, {} threads", rayon::current_num_threads())
    }

    fn builds(&self, _kind: MapKind) -> bool {
        true
    }

    fn draws_surfaces(&self, _kind: MapKind) -> bool {
        true
    }

    fn passes(&self) -> &dyn Passes {
        self
    }
}

impl Passes for CpuBackend {
    fn trace_threshold(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        trace_threshold::trace_threshold(casters, frame, progress)
    }

    /// Allocates no more than the nodes that it returns, so `memory` is never reached.
    fn trace_slices(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        _memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        trace_slices::trace_slices(casters, frame, progress)
    }

    /// Tiles are pieces of rows of texels, whose lists are small, so `memory` is never reached.
    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        _memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        raster_slices::raster_slices(media, frame, progress)
    }

    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links> {
        Ok(link_neighbors::link_neighbors(runs, size))
    }

    fn trace_coded(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        codec: &dyn Codec,
        progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        trace_coded::trace_coded(casters, frame, codec, progress)
    }

    fn trace_visibility(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        tolerance: f32,
        progress: &dyn Progress,
    ) -> Result<Runs<VisibilityPoint>> {
        trace_visibility::trace_visibility(casters, frame, tolerance, progress)
    }

    fn trace_grid(
        &self,
        media: &Media,
        frame: &Frame,
        shape: [usize; 3],
        progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        trace_grid::trace_grid(media, frame, shape, progress)
    }

    fn march_view(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        march_view::march_view(casters, frame, map, progress)
    }

    fn march_pixels(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        pixels: &[[u32; 2]],
    ) -> Result<Option<Vec<[f32; 4]>>> {
        march_view::march_pixels(casters, frame, map, pixels).map(Some)
    }
}
