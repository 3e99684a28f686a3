//! The processor takes over from a GPU.

use std::sync::Mutex;

use deepshadow::backend::{Backend, Fallback, Passes, Stage};
use deepshadow::cpu::CpuBackend;
use deepshadow::image::Image;
use deepshadow::progress::{Progress, Silent};
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{Beam, Scene, SceneFile};
use deepshadow::settings::{MapKind, Settings};
use deepshadow::shadow::Map;
use deepshadow::volume::Axis;
use deepshadow::volume::presets::Preset;
use deepshadow::{Error, ErrorKind, Result};

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
    let gpu = Small(limit);
    let backend = Fallback::new(&gpu, &CpuBackend, say);
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
    let gpu = Small(wrong);
    let backend = Fallback::new(&gpu, &CpuBackend, |_| ());
    let (scene, settings) = scene();
    let error = backend.render(&scene, &settings, &Silent).unwrap_err();
    assert_eq!(error.to_string(), "light: no such light");
    assert_eq!(backend.description(), "a small GPU");
}
