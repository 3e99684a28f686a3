//! The passes one by one, from and to memory of the host.

use super::Backend;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Media};
use crate::settings::{MapKind, Settings, Slices};
use crate::shadow::{
    Codec, CodedMap, FragmentMap, GridMap, Links, Map, Runs, ThresholdMap, VisibilityMap,
    VisibilityPoint, codec, grid_shape,
};

/// The passes of a renderer, by the names that they have in every backend and in `shaders/`, for
/// who looks at what each of them makes. All work on one of a scene's beams ([`Beam`]).
pub trait Passes: Backend {
    /// Pass `trace_threshold`: marches from the light through every texel of a map. Texels are
    /// `size * size`, row 0 at v = 0.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn trace_threshold(
        &self,
        media: &Media,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>>;

    /// Pass `trace_slices`: integrates every slab of every texel's ray, in order, into nodes: all
    /// of them, or as few as keep the frame's tolerance. Texels row by row, row 0 at v = 0.
    /// `memory`: bytes that may be taken at a time, as far as a backend reserves any; more are made
    /// in tiles.
    ///
    /// # Errors
    /// If the device fails or runs out of memory, or if there are more nodes than 32 bits count.
    fn trace_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs>;

    /// Passes `raster_slices` and `sort_fragments`: draws planes through the volume into linked
    /// lists of fragments, which are sorted and turned into nodes. `memory` as for `trace_slices`.
    ///
    /// # Errors
    /// As [`Passes::trace_slices`].
    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs>;

    /// Pass `link_neighbors`: links from every node of a map of `size` squared texels to the
    /// nearest in depth of the texels to the right and above.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links>;

    /// Pass `trace_coded`: integrates every slab of every texel's ray, in order, and codes each ray
    /// with `codec`. Texels row by row, row 0 at v = 0; `frame` asks for all nodes of a ray.
    ///
    /// # Errors
    /// If this backend does not build such maps.
    fn trace_coded(
        &self,
        _media: &Media,
        _frame: &Frame,
        _codec: &dyn Codec,
        _progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        Err(unbuilt(&self.description()))
    }

    /// Pass `trace_visibility`: integrates every slab of every texel's ray, in order, into as few
    /// points of transmittance as keep `tolerance`. Texels row by row, row 0 at v = 0; `frame` asks
    /// for all nodes of a ray.
    ///
    /// # Errors
    /// If this backend does not build such maps, or if there are more points than 32 bits count.
    fn trace_visibility(
        &self,
        _media: &Media,
        _frame: &Frame,
        _tolerance: f32,
        _progress: &dyn Progress,
    ) -> Result<Runs<VisibilityPoint>> {
        Err(unbuilt(&self.description()))
    }

    /// Pass `trace_grid`: marches from each point of a grid of `shape` (x, y, z) to the light.
    /// Transmittance times 255, x fastest.
    ///
    /// # Errors
    /// If this backend does not build such maps.
    fn trace_grid(
        &self,
        _media: &Media,
        _frame: &Frame,
        _shape: [usize; 3],
        _progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        Err(unbuilt(&self.description()))
    }

    /// Pass `march_view`: marches every camera ray through the volume, lit through `map`.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn march_view(
        &self,
        media: &Media,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image>;
}

/// The shadow map of `beam`, of the kind that `settings` ask for, by the passes.
///
/// # Errors
/// As [`Backend::map`].
pub(super) fn build_map(
    passes: &dyn Passes,
    beam: &Beam,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Map> {
    let frame = Frame::new(beam, settings)?;
    let (media, view) = (&beam.media, beam.view);
    match settings.map.kind.unwrap_or(passes.default_map()) {
        MapKind::Threshold => {
            let texels = passes.trace_threshold(media, &frame, progress)?;
            Ok(Map::Threshold(ThresholdMap::new(texels, settings, view, &frame)))
        }
        MapKind::Coded(coding) => {
            let bytes =
                passes.trace_coded(media, &frame.with_all_slabs(), &*codec(coding), progress)?;
            Ok(Map::Coded(CodedMap::new(bytes, coding, view, &frame)))
        }
        MapKind::Visibility => {
            let tolerance = settings.finer(settings.map.fragments.tolerance) as f32;
            let lists =
                passes.trace_visibility(media, &frame.with_all_slabs(), tolerance, progress)?;
            Ok(Map::Visibility(VisibilityMap::new(lists, tolerance, view, &frame)))
        }
        MapKind::Grid(count) => {
            let shape = grid_shape(media.dims(), count);
            let values = passes.trace_grid(media, &frame, shape, progress)?;
            Ok(Map::Grid(GridMap::new(values, shape, view, &frame)))
        }
        MapKind::Fragments => {
            let runs = runs(passes, media, &frame, settings, progress)?;
            let wide = settings.map.filter.window().0 > 1;
            let links = if settings.map.fragments.links && wide {
                Some(passes.link_neighbors(&runs, settings.map.size)?)
            } else {
                None
            };
            let map = FragmentMap::new(runs, view, &frame);
            Ok(Map::Fragments(match links {
                Some(links) => map.with_links(links),
                None => map,
            }))
        }
    }
}

/// The nodes of a fragment map, by the passes that `settings` ask for.
fn runs(
    passes: &dyn Passes,
    media: &Media,
    frame: &Frame,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Runs> {
    match settings.map.fragments.slices {
        Slices::Raster => {
            passes.raster_slices(media, frame, settings.map.fragments.memory, progress)
        }
        Slices::Auto | Slices::Ray | Slices::Planes => {
            passes.trace_slices(media, frame, settings.map.fragments.memory, progress)
        }
    }
}

/// The picture of `beam`, lit through `map`, by pass `march_view`.
///
/// # Errors
/// As [`Backend::view`].
pub(super) fn view_through(
    passes: &dyn Passes,
    beam: &Beam,
    settings: &Settings,
    map: &Map,
    progress: &dyn Progress,
) -> Result<Image> {
    let frame = Frame::new(beam, settings)?;
    passes.march_view(&beam.media, &frame, map, progress)
}

fn unbuilt(backend: &str) -> Error {
    Error::value("map", format!("{backend} does not build such maps"))
}
