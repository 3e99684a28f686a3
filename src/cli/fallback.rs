//! A GPU backend with the processor as a fallback: when the GPU is too small or fails, the
//! processor takes over from then on. Knows no particular GPU.

use std::sync::OnceLock;

use crate::backend::{Backend, Passes, Stage};
use crate::cpu::CpuBackend;
use crate::error::{Error, ErrorKind, Result};
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Scene};
use crate::settings::{MapKind, Settings};
use crate::shadow::Map;

pub(super) struct Fallback {
    gpu: Box<dyn Backend>,
    /// Set when the GPU has failed.
    failed: OnceLock<()>,
    say: fn(&str),
}

impl Fallback {
    /// A backend with fallback; `say` receives the reason when the processor takes over.
    pub(super) fn new(gpu: Box<dyn Backend>, say: fn(&str)) -> Self {
        Self { gpu, failed: OnceLock::new(), say }
    }

    /// Does `work` on the GPU, or on the processor if the GPU cannot.
    fn run<T>(&self, work: impl Fn(&dyn Backend) -> Result<T>) -> Result<T> {
        if !self.has_failed() {
            match work(&*self.gpu) {
                Err(error) if is_of_gpu(&error) => self.fail(&error),
                done => return done,
            }
        }
        work(&CpuBackend)
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

impl Backend for Fallback {
    fn description(&self) -> String {
        match self.failed.get() {
            Some(()) => CpuBackend.description(),
            None => self.gpu.description(),
        }
    }

    fn passes(&self) -> &dyn Passes {
        if self.has_failed() { &CpuBackend } else { self.gpu.passes() }
    }

    fn builds(&self, kind: MapKind) -> bool {
        self.gpu.builds(kind)
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
        let (gpu, cpu) = (Some(self.gpu.stage()), CpuBackend.stage());
        Box::new(FallbackStage { fallback: self, gpu, cpu })
    }
}

/// Makes pictures on the GPU, and on the processor from the first one that the GPU cannot make.
struct FallbackStage<'a> {
    fallback: &'a Fallback,
    /// `None` after a failure.
    gpu: Option<Box<dyn Stage + 'a>>,
    cpu: Box<dyn Stage>,
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
        self.cpu.render(scene, settings, progress)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Mutex;

    use super::*;
    use crate::progress::Silent;
    use crate::scene::automatic::{Surroundings, complete};
    use crate::scene::{Scene, SceneFile};
    use crate::volume::Axis;
    use crate::volume::presets::Preset;

    /// A test backend that builds maps but has no room for pictures.
    struct Small(fn() -> Error);

    impl Backend for Small {
        fn description(&self) -> String {
            "a small GPU".to_owned()
        }
        fn passes(&self) -> &dyn Passes {
            &CpuBackend
        }
        fn view(&self, _: &Beam, _: &Settings, _: &Map, _: &dyn Progress) -> Result<Image> {
            Err((self.0)())
        }
        fn stage(&self) -> Box<dyn Stage + '_> {
            Box::new(Small(self.0))
        }
    }

    impl Stage for Small {
        fn render(&mut self, _: &Scene, _: &Settings, _: &dyn Progress) -> Result<Image> {
            Err((self.0)())
        }
    }

    fn scene() -> (Scene, Settings) {
        let volume = Preset::Rods.volume(Axis::Y).unwrap().into();
        let file = SceneFile::default();
        let (scene, mut settings, _) = complete(&file, vec![volume], Surroundings::Studio).unwrap();
        (settings.image.size, settings.map.size) = ([16, 12], 16);
        settings.map.kind = Some(MapKind::Threshold);
        (scene, settings)
    }

    #[test]
    fn the_processor_takes_over_what_a_gpu_has_no_room_for_and_says_why() {
        static SAID: Mutex<Vec<String>> = Mutex::new(Vec::new());
        let say = |line: &str| SAID.lock().unwrap().push(line.to_owned());
        let limit = || {
            let [what, needed, limit] = ["picture", "16384x16384", "8192"].map(str::to_owned);
            ErrorKind::Limit { what, needed, limit }.into()
        };
        let backend = Fallback::new(Box::new(Small(limit)), say);
        let (scene, settings) = scene();
        assert_eq!(backend.description(), "a small GPU");
        let expected = CpuBackend.render(&scene, &settings, &Silent).unwrap();
        let beam = scene.only_beam().unwrap();
        let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
        for _ in 0..2 {
            assert_eq!(backend.render(&scene, &settings, &Silent).unwrap(), expected);
            assert_eq!(backend.view(&beam, &settings, &map, &Silent).unwrap(), expected);
        }
        assert_eq!(backend.description(), CpuBackend.description());
        let said = SAID.lock().unwrap();
        let due = "the CPU takes over from the GPU: picture: needs 16384x16384, the limit is 8192";
        assert_eq!(*said, [due]);
    }

    #[test]
    fn what_is_wrong_for_every_backend_stays_an_error() {
        let wrong = || Error::value("light", "no such light");
        let backend = Fallback::new(Box::new(Small(wrong)), |_| ());
        let (scene, settings) = scene();
        let error = backend.render(&scene, &settings, &Silent).unwrap_err();
        assert_eq!(error.to_string(), "light: no such light");
        assert_eq!(backend.description(), "a small GPU");
    }
}
