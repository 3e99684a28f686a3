//! A GPU with the processor behind it: what the GPU is too small for, or what it fails at, the processor does,
//! from then on. Knows no kind of GPU.

use std::sync::OnceLock;

use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::Media;
use crate::settings::{MapKind, Settings};
use crate::shadow::{Links, Map, Runs};

pub(super) struct Fallback {
    gpu: Box<dyn Backend>,
    /// Set once the GPU has failed.
    failed: OnceLock<()>,
    say: fn(&str),
}

impl Fallback {
    /// `say` is told why the processor takes over.
    pub(super) fn new(gpu: Box<dyn Backend>, say: fn(&str)) -> Self {
        Self { gpu, failed: OnceLock::new(), say }
    }

    /// Does `work` on the GPU, or on the processor if the GPU cannot.
    fn run<T>(&self, work: impl Fn(&dyn Backend) -> Result<T>) -> Result<T> {
        if self.failed.get().is_none() {
            match work(&*self.gpu) {
                Err(error) if is_of_gpu(&error) => {
                    if self.failed.set(()).is_ok() {
                        (self.say)(&format!("the CPU takes over from the GPU: {error}"));
                    }
                }
                done => return done,
            }
        }
        work(&CpuBackend)
    }
}

/// Whether another backend may do what came to this.
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

    fn default_map(&self) -> MapKind {
        self.gpu.default_map()
    }

    fn builds(&self, kind: MapKind) -> bool {
        self.gpu.builds(kind)
    }

    fn check_room(&self, settings: &Settings) -> Result<()> {
        self.run(|backend| backend.check_room(settings))
    }

    fn trace_threshold(
        &self,
        media: &Media,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        self.run(|backend| backend.trace_threshold(media, frame, progress))
    }

    fn trace_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        self.run(|backend| backend.trace_slices(media, frame, memory, progress))
    }

    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        self.run(|backend| backend.raster_slices(media, frame, memory, progress))
    }

    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links> {
        self.run(|backend| backend.link_neighbors(runs, size))
    }

    fn march_view(
        &self,
        media: &Media,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        self.run(|backend| backend.march_view(media, frame, map, progress))
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

    /// Builds maps, and has no room for pictures.
    struct Small(fn() -> Error);

    impl Backend for Small {
        fn description(&self) -> String {
            "a small GPU".to_owned()
        }
        fn default_map(&self) -> MapKind {
            MapKind::Fragments
        }
        fn trace_threshold(
            &self,
            media: &Media,
            frame: &Frame,
            progress: &dyn Progress,
        ) -> Result<Vec<[f32; 4]>> {
            CpuBackend.trace_threshold(media, frame, progress)
        }
        fn trace_slices(
            &self,
            media: &Media,
            frame: &Frame,
            memory: u64,
            progress: &dyn Progress,
        ) -> Result<Runs> {
            CpuBackend.trace_slices(media, frame, memory, progress)
        }
        fn raster_slices(
            &self,
            media: &Media,
            frame: &Frame,
            memory: u64,
            progress: &dyn Progress,
        ) -> Result<Runs> {
            CpuBackend.raster_slices(media, frame, memory, progress)
        }
        fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links> {
            CpuBackend.link_neighbors(runs, size)
        }
        fn march_view(&self, _: &Media, _: &Frame, _: &Map, _: &dyn Progress) -> Result<Image> {
            Err((self.0)())
        }
    }

    fn scene() -> (Scene, Settings) {
        let volume = Preset::Rods.volume(Axis::Y).unwrap().into();
        let file = SceneFile::default();
        let (scene, mut settings, _) = complete(&file, vec![volume], Surroundings::Studio).unwrap();
        (settings.image_size, settings.map_size) = ([16, 12], 16);
        settings.map = Some(MapKind::Threshold);
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
        let expected = CpuBackend.render(&scene, &settings, &Silent).unwrap().0;
        for _ in 0..2 {
            let (image, _) = backend.render(&scene, &settings, &Silent).unwrap();
            assert_eq!(image, expected);
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
