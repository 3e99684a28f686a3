//! The passes one by one, with input and output in the host's memory.

use super::Backend;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Casters, Media};
use crate::settings::{MapKind, Settings, Slices};
use crate::shadow::{
    Codec, CodedMap, FragmentMap, GridMap, Links, Map, Runs, ThresholdMap, VisibilityMap,
    VisibilityPoint, codec, grid_shape,
};

/// The passes of a renderer, with the names that they have in every backend and in `shaders/`, for
/// callers that examine their results separately. All of them work on one of a scene's beams
/// ([`Beam`]).
pub trait Passes: Backend {
    /// Pass `trace_threshold`: marches from the light through every texel of a map. Returns
    /// `size * size` texels, row 0 at v = 0: depths of three opacities and the largest opacity.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn trace_threshold(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>>;

    /// Pass `trace_slices`: integrates the slabs of every texel's ray, in order, adds what surfaces
    /// leave on it, and turns both into nodes: all of them, or as few as keep the frame's tolerance.
    /// Returns the texels row by row, row 0 at v = 0. `memory` is the largest number of bytes to
    /// reserve at a time, for backends that do; larger maps are built in tiles.
    ///
    /// # Errors
    /// If the device fails or runs out of memory, or if the number of nodes exceeds 32 bits.
    fn trace_slices(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs>;

    /// Passes `raster_slices` and `sort_fragments`: draws planes through the volume into linked
    /// lists of fragments, sorts them and turns them into nodes. `memory` as for `trace_slices`.
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

    /// Pass `link_neighbors`: links every node of a map of `size` squared texels to the
    /// depth-nearest nodes of the texels to the right and above.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links>;

    /// Pass `trace_coded`: integrates the slabs of every texel's ray, in order, and encodes each
    /// ray with `codec`. Returns the texels row by row, row 0 at v = 0. `frame` must ask for all
    /// nodes of a ray ([`Frame::with_all_slabs`]).
    ///
    /// # Errors
    /// If this backend does not build such maps.
    fn trace_coded(
        &self,
        _casters: Casters<'_>,
        _frame: &Frame,
        _codec: &dyn Codec,
        _progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        Err(unbuilt(&self.description()))
    }

    /// Pass `trace_visibility`: integrates the slabs of every texel's ray, in order, and keeps as
    /// few points of transmittance as `tolerance` allows. Returns the texels row by row, row 0 at v
    /// = 0. `frame` must ask for all nodes of a ray ([`Frame::with_all_slabs`]).
    ///
    /// # Errors
    /// If this backend does not build such maps, or if the number of points exceeds 32 bits.
    fn trace_visibility(
        &self,
        _casters: Casters<'_>,
        _frame: &Frame,
        _tolerance: f32,
        _progress: &dyn Progress,
    ) -> Result<Runs<VisibilityPoint>> {
        Err(unbuilt(&self.description()))
    }

    /// Pass `trace_grid`: marches from each point of a grid of `shape` (x, y, z) to the light.
    /// Returns transmittance times 255, x fastest.
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

    /// Pass `march_view`: marches every camera ray through the volume and between surfaces (passes
    /// `raster_view` and `shade_view`), lit through `map`. Returns linear radiance and opacity.
    ///
    /// # Errors
    /// If the device fails or runs out of memory, or if this backend does not draw surfaces, and
    /// there are some.
    fn march_view(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image>;

    /// Pixels (x, y) of that picture, each with all of its rays, where the picture may have got
    /// fewer, or none of its own; `None` from a backend that cannot tell.
    ///
    /// # Errors
    /// As [`Passes::march_view`].
    fn march_pixels(
        &self,
        _casters: Casters<'_>,
        _frame: &Frame,
        _map: &Map,
        _pixels: &[[u32; 2]],
    ) -> Result<Option<Vec<[f32; 4]>>> {
        Ok(None)
    }
}

/// Builds the shadow map of `beam`, of the kind in `settings`, with the passes.
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
    let (media, view, casters) = (&beam.media, beam.view, beam.casters());
    let around = frame.around(casters);
    let kind = settings.map.kind.unwrap_or_default();
    let casting = beam.surfaces.casting();
    if !casting.is_empty() {
        check_kind(kind, settings)?;
    }
    match kind {
        MapKind::Threshold => {
            let texels = passes.trace_threshold(casters, &frame, progress)?;
            Ok(Map::Threshold(ThresholdMap::new(texels, settings, view, &around)))
        }
        MapKind::Coded(coding) => {
            let bytes =
                passes.trace_coded(casters, &frame.with_all_slabs(), &*codec(coding), progress)?;
            Ok(Map::Coded(CodedMap::new(bytes, coding, view, &around)))
        }
        MapKind::Visibility => {
            let tolerance = settings.finer(settings.map.fragments.tolerance) as f32;
            let lists =
                passes.trace_visibility(casters, &frame.with_all_slabs(), tolerance, progress)?;
            Ok(Map::Visibility(VisibilityMap::new(lists, tolerance, view, &frame)))
        }
        MapKind::Grid(count) => {
            let shape = grid_shape(media.dims(), count);
            let values = passes.trace_grid(media, &frame, shape, progress)?;
            Ok(Map::Grid(GridMap::new(values, shape, view, &frame)))
        }
        MapKind::Fragments => {
            let runs = runs(passes, casters, &frame, settings, progress)?;
            let links = if settings.map.follows_links(true) {
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

/// Checks that maps of surfaces are built with these settings.
///
/// # Errors
/// If they are not.
pub(crate) fn check_kind(kind: MapKind, settings: &Settings) -> Result<()> {
    if matches!(kind, MapKind::Grid(_)) {
        let why = format!("'{kind}' maps of meshes and hair are not built");
        return Err(Error::value("map", why));
    }
    if kind == MapKind::Fragments && settings.map.fragments.slices == Slices::Raster {
        let why = "'raster' draws no meshes and no hair; take 'auto'";
        return Err(Error::value("slices", why));
    }
    Ok(())
}

/// The nodes of a fragment map, made by the passes that `settings` select.
fn runs(
    passes: &dyn Passes,
    casters: Casters<'_>,
    frame: &Frame,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Runs> {
    let memory = settings.map.fragments.memory;
    match settings.map.fragments.slices {
        Slices::Raster => passes.raster_slices(casters.media, frame, memory, progress),
        Slices::Auto | Slices::Ray | Slices::Planes => {
            passes.trace_slices(casters, frame, memory, progress)
        }
    }
}

/// The picture of `beam`, lit through `map`, made by pass `march_view`.
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
    passes.march_view(beam.casters(), &frame, map, progress)
}

/// The error of a renderer that does not build maps of some kind.
pub(crate) fn unbuilt(backend: &str) -> Error {
    Error::value("map", format!("{backend} cannot build this kind of map"))
}
