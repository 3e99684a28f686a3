//! What a renderer does: the passes both backends implement, their inputs and outputs.

use crate::error::memory;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{LightView, Media, Scene};
use crate::settings::{MapKind, Settings, Slices};
use crate::shadow::{
    Codec, CodedMap, FragmentMap, GridMap, Links, Map, Runs, ThresholdMap, VisibilityMap,
    VisibilityPoint, codec, grid_shape,
};

/// A renderer. The passes have the same names in every backend and in `shaders/`.
pub trait Backend {
    /// What does the work, for people: the processor or the graphics adapter.
    fn description(&self) -> String;

    /// The kind of map that is built where none is asked for: the exact one where it costs little more
    /// than the other.
    fn default_map(&self) -> MapKind;

    /// Whether maps of `kind` are built and marched through here.
    fn builds(&self, kind: MapKind) -> bool {
        matches!(kind, MapKind::Threshold | MapKind::Fragments)
    }

    /// Makes sure, before any work, that there is room for the picture and the map of `settings`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] with what they take, if there is none.
    fn check_room(&self, settings: &Settings) -> Result<()> {
        check_host(settings)
    }

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

    /// Pass `trace_slices`: integrates every slab of every texel's ray, in order, into nodes: all of
    /// them, or as few as keep the frame's tolerance. Texels row by row, row 0 at v = 0. `memory`:
    /// bytes that may be taken at a time, as far as a backend reserves any; more are made in tiles.
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

    /// Passes `raster_slices` and `sort_fragments`: draws planes through the volume into linked lists
    /// of fragments, which are sorted and turned into nodes. `memory` as for `trace_slices`.
    ///
    /// # Errors
    /// As [`Backend::trace_slices`].
    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs>;

    /// Pass `link_neighbors`: links from every node of a map of `size` squared texels to the nearest
    /// in depth of the texels to the right and above.
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

    /// Pass `trace_visibility`: integrates every slab of every texel's ray, in order, into as few points
    /// of transmittance as keep `tolerance`. Texels row by row, row 0 at v = 0; `frame` asks for all
    /// nodes of a ray.
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

    /// The shadow map of `scene`, a [`crate::scene::Beam`]'s, of the kind that `settings` ask for: of its first light, in
    /// extinction without tints.
    ///
    /// # Errors
    /// As [`Backend::trace_threshold`], and if the light cannot be fitted to the volume.
    fn map(&self, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Map> {
        let view = LightView::fit(scene.light(), &scene.media)?;
        let frame = Frame::with_light_view(scene, settings, &view)?;
        let media = &scene.media;
        match settings.map.unwrap_or(self.default_map()) {
            MapKind::Threshold => {
                let texels = self.trace_threshold(media, &frame, progress)?;
                Ok(Map::Threshold(ThresholdMap::new(texels, settings, view, &frame)))
            }
            MapKind::Coded(coding) => {
                let bytes =
                    self.trace_coded(media, &frame.with_all_slabs(), &*codec(coding), progress)?;
                Ok(Map::Coded(CodedMap::new(bytes, coding, view, &frame)))
            }
            MapKind::Visibility => {
                let tolerance = settings.finer(settings.tolerance) as f32;
                let lists =
                    self.trace_visibility(media, &frame.with_all_slabs(), tolerance, progress)?;
                Ok(Map::Visibility(VisibilityMap::new(lists, tolerance, view, &frame)))
            }
            MapKind::Grid(count) => {
                let shape = grid_shape(media.dims(), count);
                let values = self.trace_grid(media, &frame, shape, progress)?;
                Ok(Map::Grid(GridMap::new(values, shape, view, &frame)))
            }
            MapKind::Fragments => {
                let runs = self.runs(media, &frame, settings, progress)?;
                let wide = settings.filter.window().0 > 1;
                let links = if settings.links && wide {
                    Some(self.link_neighbors(&runs, settings.map_size)?)
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
    ///
    /// # Errors
    /// As [`Backend::trace_slices`].
    fn runs(
        &self,
        media: &Media,
        frame: &Frame,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        match settings.slices {
            Slices::Raster => self.raster_slices(media, frame, settings.memory, progress),
            Slices::Auto | Slices::Ray | Slices::Planes => {
                self.trace_slices(media, frame, settings.memory, progress)
            }
        }
    }

    /// A picture of `scene`: for each of its beams the map, then the camera march.
    ///
    /// # Errors
    /// As the two passes.
    fn render(
        &self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<(Image, Vec<Map>)> {
        let [width, height] = settings.image_size;
        let mut image = Image::filled(width, height, [0.0; 4]);
        let mut maps = Vec::new();
        for beam in scene.beams() {
            let map = self.map(&beam.scene, settings, progress)?;
            let frame = Frame::with_light_view(&beam.scene, settings, map.view())?;
            let picture = self.march_view(&beam.scene.media, &frame, &map, progress)?;
            beam.add_finite(&picture, &mut image)?;
            maps.push(map);
        }
        Ok((image, maps))
    }
}

/// Makes sure that the host has room for the picture and the map of `settings`.
///
/// # Errors
/// [`crate::ErrorKind::Limit`] with what they take, if it has none.
pub fn check_host(settings: &Settings) -> Result<()> {
    // The sum of all beams, that of one, and the file.
    const COPIES: u64 = 3;
    const PIXEL: u64 = 16;
    let [width, height] = settings.image_size;
    let texels = u64::from(settings.map_size) * u64::from(settings.map_size);
    let texel = match settings.map {
        Some(MapKind::Coded(coding)) => codec(coding).stride() as u64,
        // Lists ask for their own.
        Some(_) | None => PIXEL,
    };
    let picture = u64::from(width) * u64::from(height) * PIXEL * COPIES;
    memory::check(picture, &format!("a picture of {width}x{height}"))?;
    let size = settings.map_size;
    memory::check(picture + texels * texel * COPIES, &format!("a map of {size}x{size}"))
}

fn unbuilt(backend: &str) -> Error {
    Error::value("map", format!("{backend} does not build such maps"))
}
