//! A GPU with the processor as a fallback: when the GPU is too small or fails, the processor takes
//! over from then on. Knows neither of them.

use std::sync::OnceLock;

use super::{Backend, Expected, Passes, Stage};
use crate::error::{Error, ErrorKind, Result};
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Scene};
use crate::settings::{MapKind, Settings};
use crate::shadow::Map;

/// A backend that works on a GPU until that has no room for something, or fails; the processor does
/// that and everything after it.
pub struct Fallback<'a> {
    gpu: &'a dyn Backend,
    processor: &'a dyn Backend,
    /// Set when the GPU has failed.
    failed: OnceLock<()>,
    say: Box<dyn Fn(&str) + Send + Sync + 'a>,
}

impl<'a> Fallback<'a> {
    /// A backend with fallback; `say` receives the reason when the processor takes over.
    pub fn new(
        gpu: &'a dyn Backend,
        processor: &'a dyn Backend,
        say: impl Fn(&str) + Send + Sync + 'a,
    ) -> Self {
        Self { gpu, processor, failed: OnceLock::new(), say: Box::new(say) }
    }

    /// Does `work` on the GPU, or on the processor if the GPU cannot.
    fn run<T>(&self, work: impl Fn(&dyn Backend) -> Result<T>) -> Result<T> {
        if !self.has_failed() {
            match work(self.gpu) {
                Err(error) if is_of_gpu(&error) => self.fail(&error),
                done => return done,
            }
        }
        work(self.processor)
    }

    fn has_failed(&self) -> bool {
        self.failed.get().is_some()
    }

    fn fail(&self, error: &Error) {
        if self.failed.set(()).is_ok() {
            (self.say)(&format!("the CPU takes over from the GPU: {error}"));
        }
    }
}

/// Whether another backend may succeed where this error occurred.
fn is_of_gpu(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Gpu { .. } | ErrorKind::Limit { .. })
}

impl Backend for Fallback<'_> {
    fn description(&self) -> String {
        match self.failed.get() {
            Some(()) => self.processor.description(),
            None => self.gpu.description(),
        }
    }

    fn passes(&self) -> &dyn Passes {
        if self.has_failed() { self.processor.passes() } else { self.gpu.passes() }
    }

    fn builds(&self, kind: MapKind) -> bool {
        self.gpu.builds(kind)
    }

    fn draws_surfaces(&self, kind: MapKind) -> bool {
        self.gpu.draws_surfaces(kind)
    }

    fn expect(&self, kind: Option<MapKind>, expected: Expected) {
        self.gpu.expect(kind, expected);
    }

    fn check_room(&self, settings: &Settings) -> Result<()> {
        self.run(|backend| backend.check_room(settings))
    }

    fn map(&self, beam: &Beam, settings: &Settings, progress: &dyn Progress) -> Result<Map> {
        self.run(|backend| backend.map(beam, settings, progress))
    }

    fn view(
        &self,
        beam: &Beam,
        settings: &Settings,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        self.run(|backend| backend.view(beam, settings, map, progress))
    }

    fn stage(&self) -> Box<dyn Stage + '_> {
        let (gpu, processor) = (Some(self.gpu.stage()), self.processor.stage());
        Box::new(FallbackStage { fallback: self, gpu, processor })
    }
}

/// Makes pictures on the GPU, and on the processor from the first one that the GPU cannot make.
struct FallbackStage<'a> {
    fallback: &'a Fallback<'a>,
    /// `None` after a failure.
    gpu: Option<Box<dyn Stage + 'a>>,
    processor: Box<dyn Stage + 'a>,
}

impl Stage for FallbackStage<'_> {
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        if let Some(stage) = &mut self.gpu {
            if !self.fallback.has_failed() {
                match stage.render(scene, settings, progress) {
                    Err(error) if is_of_gpu(&error) => self.fallback.fail(&error),
                    done => return done,
                }
            }
            self.gpu = None;
        }
        self.processor.render(scene, settings, progress)
    }

    fn pixels(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        pixels: &[[u32; 2]],
    ) -> Result<Option<Vec<[f32; 4]>>> {
        match &mut self.gpu {
            Some(stage) => stage.pixels(scene, settings, pixels),
            None => self.processor.pixels(scene, settings, pixels),
        }
    }
}
