//! The renderer for callers that wait: the crate's interfaces of renderers, and the functions that
//! wait for a future of the same name. There is none of this in browsers.

use super::adapter::{AdapterChoice, adapters_async};
use super::fragments::GpuFragments;
use super::link::MediaKind;
use super::lists::GpuLists;
use super::passes::{NESTED, passes};
use super::programs::Variant;
use super::renderer::{GpuImage, Renderer};
use super::waiting::wait;
use super::{GpuBackend, GpuStage};
use crate::backend::{Backend, Expected, Passes, Stage, check_host};
use crate::error::Result;
use crate::frame::Frame;
use crate::image::{Image, Tone};
use crate::progress::Progress;
use crate::scene::{Beam, Casters, Media, Scene};
use crate::settings::{MapKind, Settings};
use crate::shadow::{Links, Map, Runs};

/// One line of text per adapter: name, kind, driver, and the limits that matter here.
pub fn adapters() -> Vec<String> {
    wait(adapters_async())
}

impl Renderer {
    /// Records commands with `record`, submits them, and waits for the device to finish.
    ///
    /// # Errors
    /// Those of `record`. If the device finds the commands invalid or is lost.
    pub fn submit(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<()> {
        wait(self.submit_async(record))
    }

    /// Reads a map or a picture back to the host, row by row, row 0 on top.
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Vec<[f32; 4]>> {
        wait(self.read_async(texture))
    }

    /// Waits for a map's pass `trace_slices` and checks its capacity
    /// ([`Renderer::nodes_missing_async`]).
    ///
    /// # Errors
    /// If the device fails.
    pub fn nodes_missing(&self, fragments: &GpuFragments) -> Result<Option<u32>> {
        wait(self.nodes_missing_async(fragments))
    }

    /// Copies the nodes of a tile to the host, texel by texel.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read_fragments(&self, fragments: &GpuFragments) -> Result<Runs> {
        wait(self.read_fragments_async(fragments))
    }

    /// Waits for the lists' pass and returns how many fragments were drawn
    /// ([`Renderer::fragments_drawn_async`]).
    ///
    /// # Errors
    /// If the device fails.
    pub fn fragments_drawn(&self, lists: &GpuLists) -> Result<u64> {
        wait(self.fragments_drawn_async(lists))
    }
}

impl GpuBackend {
    /// Opens a device of its own on an adapter that `choice` allows.
    ///
    /// # Errors
    /// If there is no such adapter, or if it does not open a device.
    pub fn open(choice: AdapterChoice) -> Result<Self> {
        wait(Self::request(choice))
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
        wait(self.draw_async(scene, settings, progress))
    }

    /// What a screen shows of a picture that [`GpuStage::draw`] made: four bytes a pixel
    /// ([`Renderer::shown_async`]).
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub fn show(&self, image: &GpuImage, tone: Tone) -> Result<Vec<u8>> {
        wait(self.show_async(image, tone))
    }
}

impl Stage for GpuStage<'_> {
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        wait(self.render_async(scene, settings, progress))
    }
}

impl Backend for GpuBackend {
    // What browsers ask without this trait is answered in one place.
    fn description(&self) -> String {
        Self::description(self)
    }

    fn builds(&self, kind: MapKind) -> bool {
        Self::builds(self, kind)
    }

    fn draws_surfaces(&self, kind: MapKind) -> bool {
        Self::draws_surfaces(self, kind)
    }

    /// Compiles the passes in advance.
    fn expect(&self, kind: Option<MapKind>, expected: Expected) {
        let media = match expected {
            Expected::Plain => MediaKind::Plain,
            Expected::Function => MediaKind::OneField,
        };
        let passes = passes(kind.unwrap_or_default());
        // An error occurs again, and is reported, when the pass is needed.
        let _ = self.renderer.programs.compile(&passes, media, Variant::USUAL);
    }

    fn check_room(&self, settings: &Settings) -> Result<()> {
        check_host(settings)?;
        let fits = || {
            let [width, height] = settings.image.size;
            self.renderer.image(width, height)?;
            match settings.map.kind.unwrap_or_default() {
                MapKind::Threshold => self.renderer.map(settings.map.size).map(drop),
                NESTED => self.renderer.nested(settings.map.size).map(drop),
                // Lists are built in tiles.
                _ => self.renderer.check_size("map", [settings.map.size; 2]),
            }
        };
        wait(self.over(async { fits() }))
    }

    fn map(&self, beam: &Beam, settings: &Settings, progress: &dyn Progress) -> Result<Map> {
        wait(self.map_async(beam, settings, progress))
    }

    fn view(
        &self,
        beam: &Beam,
        settings: &Settings,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        wait(self.view_async(beam, settings, map, progress))
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
        wait(self.threshold(casters, frame, progress))
    }

    fn trace_slices(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        wait(self.traced(casters, frame, memory, progress))
    }

    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        wait(self.rastered(media, frame, memory, progress))
    }

    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links> {
        wait(self.links(runs, size))
    }

    fn march_view(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        wait(self.marched(casters, frame, map, progress))
    }
}
