//! Volumes of which a part is kept.

use deepshadow::glam::{DVec3, dvec3};
use deepshadow::io::SceneLoader;
use deepshadow::ndarray::Array3;
use deepshadow::reference::Extinction;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::file::VolumeTable;
use deepshadow::scene::{Light, Media, Scene, SceneFile};
use deepshadow::shadow::Shadow;
use deepshadow::volume::Volume;
use deepshadow::{Backend, CpuBackend, Settings, Silent};

use super::cli::{Folder, must_succeed, stderr};

/// A homogeneous box of 8 x 10 x 6 unit voxels.
fn even() -> Volume {
    let values = Array3::from_elem((6, 10, 8), 0.5);
    Volume::from_array("even", values, [1.0; 3]).unwrap()
}

/// What is kept of a homogeneous box is a smaller one: optical depths along rays are in closed form,
/// by the reference and by maps alike.
#[test]
fn a_clipped_box_is_a_smaller_one() {
    let volume = even().clipped([[0.25, 0.0, 0.5], [0.75, 0.6, 1.0]]).unwrap();
    let bounds = volume.world_bounds();
    // From -0.5 to 7.5, 9.5 and 5.5 it was.
    assert!(bounds.min.distance(dvec3(1.5, -0.5, 2.5)) < 1e-12, "{bounds:?}");
    assert!(bounds.max.distance(dvec3(5.5, 5.5, 5.5)) < 1e-12, "{bounds:?}");
    let media = Media::from(volume.clone());
    let exact = Extinction::of(&media);
    let depth = |from: DVec3, way: DVec3| exact.optical_depth(from, way, [0.0, f64::INFINITY]);
    for (from, way, expected) in [
        (dvec3(-9.0, 1.0, 3.0), DVec3::X, 0.5 * 4.0),
        (dvec3(2.0, 20.0, 4.0), DVec3::NEG_Y, 0.5 * 6.0),
        (dvec3(2.0, 3.0, -9.0), DVec3::Z, 0.5 * 3.0),
        // Through what was clipped away.
        (dvec3(-9.0, 8.0, 3.0), DVec3::X, 0.0),
        (dvec3(1.0, 20.0, 4.0), DVec3::NEG_Y, 0.0),
    ] {
        assert!((depth(from, way) - expected).abs() < 1e-12, "{from} {way}");
    }
    let mut scene = Scene::automatic(volume).unwrap();
    scene.media.medium_mut().density_scale = 1.0;
    scene.lights = vec![Light::directional(DVec3::NEG_Y)];
    let settings = Settings::default().with(|settings| settings.map.size = 64);
    let beam = scene.only_beam().unwrap();
    let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
    for (at, expected) in [
        (dvec3(3.5, -2.0, 4.0), (-3.0_f64).exp()),
        (dvec3(3.5, 2.5, 4.0), (-1.5_f64).exp()),
        (dvec3(3.5, 7.0, 4.0), 1.0),
        (dvec3(1.0, -2.0, 4.0), 1.0),
    ] {
        let place = beam.view.place(at).unwrap();
        let found = f64::from(map.lookup(0, place.x, place.y, place.z));
        assert!((found - expected).abs() < 0.003, "{at}: {found} {expected}");
    }
}

/// A clip replaces the one before; the whole is what it was.
#[test]
fn clips_replace_each_other() {
    let whole = even();
    let part = whole.clipped([[0.5; 3], [1.0; 3]]).unwrap();
    let other = part.clipped([[0.0; 3], [0.25; 3]]).unwrap();
    assert_eq!(other.domain(), whole.clipped([[0.0; 3], [0.25; 3]]).unwrap().domain());
    assert_eq!(part.clipped([[0.0; 3], [1.0; 3]]).unwrap().domain(), whole.domain());
    for wrong in [
        [[0.0; 3], [0.0, 1.0, 1.0]],
        [[0.5; 3], [0.4; 3]],
        [[-0.1, 0.0, 0.0], [1.0; 3]],
        [[0.0; 3], [1.0, 1.5, 1.0]],
        [[f64::NAN; 3], [1.0; 3]],
    ] {
        let error = whole.clipped(wrong).unwrap_err().to_string();
        assert!(error.starts_with("volume.clip: ") && !error.contains('\n'), "{error}");
    }
}

/// A scene that is edited clips what it has, and nothing but the clip has changed.
#[test]
fn an_edited_clip_needs_no_file() {
    let file_of = |clip| {
        let preset = Some("bucky".to_owned());
        let table = VolumeTable { preset, clip, ..VolumeTable::default() };
        SceneFile { volume: vec![table].into(), ..SceneFile::default() }
    };
    let mut loader = SceneLoader::default();
    let mut scales = Vec::new();
    for clip in [None, Some([[0.0; 3], [0.5, 1.0, 1.0]]), Some([[0.2; 3], [0.9; 3]]), None] {
        let file = file_of(clip);
        let (loaded, _) = loader.load(&file, true).unwrap();
        let (fresh, _) = SceneLoader::default().load(&file, true).unwrap();
        let [own, fresh] = [loaded, fresh].map(|all| all.volumes[0].volume.clone());
        assert_eq!((own.domain(), own.values()), (fresh.domain(), fresh.values()));
        let (loaded, _) = loader.load(&file, true).unwrap();
        let (scene, ..) = complete(&file, loaded, Surroundings::Studio).unwrap();
        scales.push(scene.media.bodies()[0].medium.density_scale);
    }
    // What is clipped away leaves the rest as dense as it was.
    assert!(scales.iter().all(|scale| *scale == scales[0]), "{scales:?}");
}

#[test]
fn the_program_clips() {
    let folder = Folder::new();
    let run = |name: &str, more: &str| {
        folder.run(&format!("render bucky --size 64x48 --backend cpu -o {name} {more}"))
    };
    must_succeed(&run("half.npy", "--clip 0,0,0,0.5,1,1 --save-scene s.toml"));
    must_succeed(&run("whole.npy", ""));
    must_succeed(&folder.run("render s.toml --backend cpu -o again.npy"));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("half.npy") == read("again.npy"));
    assert!(read("half.npy") != read("whole.npy"));
    let failed = run("bad.npy", "--clip 0,0,0,2,1,1");
    let error = stderr(&failed);
    assert_eq!(failed.status.code(), Some(2), "{error}");
    assert!(error.contains("clip: ") && error.contains("not corners of a box"), "{error}");
}
