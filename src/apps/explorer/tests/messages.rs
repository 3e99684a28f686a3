//! What is sent between a page and its workers arrives as it was.

use std::sync::Arc;
use std::time::Duration;

use deepshadow::scene::SceneFile;
use deepshadow::scene::automatic::Surroundings;
use deepshadow::settings::MapKind;
use deepshadow_explorer::Document;
use deepshadow_explorer::engine::{Device, Event, Motion, Wish};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::support::Window;

fn sent<T: Serialize + DeserializeOwned>(message: &T) -> T {
    serde_json::from_str(&serde_json::to_string(message).unwrap()).unwrap()
}

/// A scene in which one number in three is none that decimals have.
const SCENE: &str = "
    [[volume]]
    preset = 'box'
    density_scale = 0.1
    albedo = [0.3333333333333333, 0.1, 0.7]
    clip = [[0.0, 0.0, 0.1], [1.0, 1.0, 0.9]]
    [volume.transfer]
    points = [[0.0, 1.0, 1.0, 1.0, 0.0], [0.1, 0.2, 0.3, 0.4, 0.30000000000000004]]
    [[volume]]
    preset = 'rods'
    window = [0.1, 1e-7]
    [[light]]
    kind = 'spot'
    position = [1e300, -0.0, 5e-324]
    [[light.keyframes]]
    frame = 3
    position = [1.0, 2.0, 3.0]
    [camera]
    position = [0.1, 0.2, 0.3]
    target = [0.0, 0.0, 0.0]
    [image]
    exposure = 'auto'
    [shadow]
    map = 'fourier:7'
    thresholds = [0.1, 0.4, 0.9]
";

#[test]
fn wishes_arrive_as_they_were() {
    let file = SceneFile::parse(SCENE, std::path::Path::new("scene.toml")).unwrap();
    let wish = Wish {
        document: 7,
        file: file.clone(),
        surroundings: Surroundings::Studio,
        beside: Some(file),
        size: [919, 647],
        motion: Motion::Light,
        budget: Duration::from_micros(33_333),
        device: Device::Gpu,
    };
    assert_eq!(sent(&wish), wish);
}

#[test]
fn documents_arrive_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, SCENE).unwrap();
    let document = Document::open(path.to_str().unwrap()).unwrap();
    let arrived = sent(&document);
    assert_eq!((&arrived.file, &arrived.opened), (&document.file, &document.opened));
    assert_eq!((&arrived.frames, arrived.frame), (&document.frames, document.frame));
    assert_eq!(arrived.now().unwrap(), document.now().unwrap());
    assert_ne!(arrived.numbered_anew().id, document.id);
}

#[test]
fn pictures_arrive_but_for_their_pixels() {
    let mut window = Window::tall("box");
    for kind in MapKind::all() {
        let file = &mut window.explorer().document.as_mut().unwrap().file;
        (file.shadow.map, file.shadow.size) = (Some(kind.to_string()), Some(16));
        window.wait();
        let picture = window.explorer().shown().unwrap().picture.clone();
        let Event::Picture(arrived) = sent(&Event::Picture(Box::new(picture.clone()))) else {
            panic!("a picture is another event");
        };
        assert_eq!(arrived.scene, picture.scene, "{kind}");
        assert_eq!(arrived.settings, picture.settings, "{kind}");
        assert_eq!((arrived.tone, &arrived.saved), (picture.tone, &picture.saved), "{kind}");
        let [own, other] = [&picture, &arrived].map(|picture| picture.volumes[0].clone());
        let heights = |one: &Arc<deepshadow_explorer::panels::OfDensities>| one.heights.clone();
        assert_eq!(own.histogram.as_ref().map(heights), other.histogram.as_ref().map(heights));
    }
}
