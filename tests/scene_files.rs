//! Tests of scene files: absolute parameters give absolute radiance, and errors are named.

use std::fs;
use std::path::Path;

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::io::{load_ingredients, load_volume};
use deepshadow::progress::Silent;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{LightKind, Scene, SceneFile, descriptor};
use deepshadow::settings::Settings;
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::{project, rms};

const BOX_OF_EXTINCTION_4: &str = r#"
[volume]
path = "box.raw"
dims = [4, 5, 6]
type = "u8"
density_scale = 2.0
bounds = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]
[light]
kind = "directional"
direction = [0.5976143, -0.7171372, -0.3585686]
irradiance = [12.566371, 6.2831853, 12.566371]
[camera]
position = [0.0, 0.55, 2.0]
target = [0.0, -0.1, 0.0]
fov_y_degrees = 45.0
[image]
width = 96
height = 80
[ground]
enabled = false
[background]
radiance = [0.25, 0.25, 0.25]
"#;

fn load(text: &str, folder: &Path) -> deepshadow::Result<(Scene, Settings)> {
    let file = SceneFile::parse(text, &folder.join("scene.toml"))?;
    let own = file.volume.iter().map(|table| load_ingredients(table, false).map(|(own, _)| own));
    complete(&file, own.collect::<deepshadow::Result<Vec<_>>>()?, Surroundings::Void)
        .map(|(scene, settings, _)| (scene, settings))
}

/// Single scattering in a uniform box: with s(t) the distance to the light from distance t, L =
/// integral of e^(-x t) e^(-x s(t)) x dt. s is linear between a few kinks, so fine midpoint sums
/// are as good as the closed form.
#[test]
fn box_of_extinction_4_has_its_closed_form_radiance() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.raw"), [2_u8; 4 * 5 * 6]).unwrap();
    let (scene, settings) = load(BOX_OF_EXTINCTION_4, folder.path()).unwrap();
    let image = CpuBackend.render(&scene, &settings, &Silent).unwrap();
    let bounds = scene.media.world_bounds();
    assert!((bounds.min + 0.5).length() + (bounds.max - 0.5).length() < 1e-12, "{bounds:?}");
    let rays = scene.camera.rays(96.0 / 80.0);
    let to_light = -scene.lights[0].direction_at(DVec3::ZERO);
    let (extinction, parts) = (4.0, 4000);
    let mut errors = Vec::new();
    for (i, pixel) in image.pixels.iter().enumerate() {
        let (x, y) = ((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
        let (origin, direction) = rays.ray(x / 96.0, y / 80.0);
        let Some((enter, exit)) = bounds.intersect(origin, direction) else {
            assert_eq!(*pixel, [0.25, 0.25, 0.25, 1.0], "background beside the box");
            continue;
        };
        let step = (exit - enter) / f64::from(parts);
        let scattered: f64 = (0..parts)
            .map(|k| {
                let t = (f64::from(k) + 0.5) * step;
                let point = origin + (enter + t) * direction;
                let way = bounds.intersect(point, to_light).map_or(0.0, |(_, exit)| exit);
                (-extinction * (t + way)).exp() * extinction * step
            })
            .sum();
        let through = (-extinction * (exit - enter)).exp();
        let expected = [1.0, 0.5, 1.0].map(|e| e * scattered + through * 0.25);
        errors.extend(pixel.iter().zip(expected).map(|(a, b)| f64::from(*a) - b));
    }
    let error = rms(errors.iter().copied());
    eprintln!("box of extinction 4: RMSE {error:.2e} over {} box pixels", errors.len() / 3);
    assert!(errors.len() > 3 * 1000, "the box fills much of the picture");
    assert!(error < 5e-3, "{error}");
}

#[test]
fn mistakes_are_named_with_their_key() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.raw"), [2_u8; 4 * 5 * 6]).unwrap();
    let cases = [
        ("width = 96", "widht = 96", "widht"),
        ("width = 96", "width = 0", "image.width"),
        ("dims = [4, 5, 6]", "dims = [4, 5, 7]", "140"),
        ("dims = [4, 5, 6]", "dims = [0, 5, 6]", "0,5,6"),
        ("dims = [4, 5, 6]", "dims = [4, 5]", "line 4"),
        ("type = \"u8\"", "type = \"u9\"", "u9"),
        ("density_scale = 2.0", "density_scale = -1.0", "density_scale"),
        ("density_scale = 2.0", "density_scale = nan", "density_scale"),
        ("density_scale = 2.0", "albedo = [1.0, 1.0, 1.5]", "albedo"),
        ("density_scale = 2.0", "phase_g = 1.0", "phase_g"),
        ("[-0.5, -0.5, -0.5]", "[0.5, -0.5, -0.5]", "bounds"),
        ("[0.5976143, -0.7171372, -0.3585686]", "[0, 0, 0]", "direction"),
        ("kind = \"directional\"", "kind = \"point\"", "position"),
        ("kind = \"directional\"", "kind = \"area\"", "area"),
        ("irradiance = [12.566371, 6.2831853, 12.566371]", "irradiance = [-1, 0, 0]", "irradiance"),
        ("fov_y_degrees = 45.0", "fov_y_degrees = 180.0", "fov_y_degrees"),
        ("target = [0.0, -0.1, 0.0]", "target = [0.0, 0.55, 2.0]", "target"),
        ("[background]", "[sky]", "sky"),
        ("path = \"box.raw\"", "path = \"other.raw\"", "other.raw"),
    ];
    for (from, to, named) in cases {
        let text = BOX_OF_EXTINCTION_4.replace(from, to);
        assert_ne!(text, BOX_OF_EXTINCTION_4, "{from} stands in the scene");
        let error = load(&text, folder.path()).map(|_| ()).expect_err(to).to_string();
        assert!(error.contains(named) && !error.contains('\n'), "{to}: {error}");
    }
}

#[test]
fn every_preset_has_a_scene_that_loads() {
    for preset in Preset::ALL {
        let file = descriptor(preset).unwrap();
        let volume = load_volume(&file.volume[0]).unwrap();
        let (scene, ..) = complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let bounds = scene.media.world_bounds();
        assert!((bounds.size().max_element() - 1.0).abs() < 1e-9, "{}: {bounds:?}", preset.name());
        assert!(bounds.center().length() < 1e-9, "{}: {bounds:?}", preset.name());
    }
}

/// The scene files of the README, with a preset in place of each file, because people copy them.
#[test]
fn the_readmes_scene_files_can_be_used() {
    let readme = fs::read_to_string(project().join("README.md")).unwrap();
    let blocks = readme.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    // The other blocks are for a program's Cargo.toml.
    let scenes: Vec<&str> = blocks.filter(|text| text.starts_with('[')).collect();
    assert_eq!(scenes.len(), 4, "{scenes:#?}");
    for text in scenes {
        let file = SceneFile::parse(text, Path::new("README.md")).unwrap();
        let mut file = file.at_frame(24).unwrap();
        for table in file.volume.iter_mut() {
            (table.path, table.preset) = (None, Some("bucky".to_owned()));
            // A preset has no further grids.
            table.color = None;
            if let Some(emission) = &mut table.emission {
                emission.grid = None;
            }
        }
        let own = file.volume.iter().map(|table| load_ingredients(table, false).unwrap().0);
        complete(&file, own.collect::<Vec<_>>(), Surroundings::Void).unwrap();
    }
}

/// Volumes and lights may occur several times, each with its own tables.
#[test]
fn tables_of_volumes_and_lights_may_be_several() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"
[[volume]]
preset = "bucky"
density_scale = 3.0
tint = [1.0, 0.5, 0.0]
transfer = { name = "viridis" }
[[volume]]
preset = "bucky"
density_scale = 2.0
translate = [1.0, 0.0, 0.0]
rotate_degrees = [0.0, 90.0, 0.0]
scale = 0.5
[volume.transfer]
points = [[0.2, 1.0, 1.0, 1.0, 0.0], [0.7, 1.0, 0.0, 0.0, 1.0]]
gradient = [[0.0, 0.1], [0.5, 1.0]]
[volume.emission]
colors = "blackbody"
kelvin = [900.0, 2000.0]
scale = 4.0
[[light]]
direction = [0.0, -1.0, 0.0]
[[light]]
kind = "point"
position = [3.0, 2.0, 1.0]
[shadow]
octaves = 2
"#;
    let (scene, settings) = load(text, folder.path()).unwrap();
    let [first, second] = scene.media.bodies() else { panic!("{} bodies", scene.media.name()) };
    assert_eq!((scene.lights.len(), settings.view.octaves), (2, 2));
    assert_eq!(scene.beams().unwrap().len(), 6, "two lights in three channels");
    let (of_preset, _) = first.medium.transfer.as_ref().unwrap().at(1.0);
    assert!(of_preset.y > of_preset.z, "viridis ends yellow");
    // Points refer to stored values, none of which is below 0 here, so they were not moved.
    let function = second.medium.transfer.as_ref().unwrap();
    assert_eq!(function.range(), [0.2, 0.7]);
    assert!(second.medium.modulation.is_some());
    assert!((second.medium.emission.as_ref().unwrap().scale - 4.0).abs() < 1e-12);
    let bounds = second.volume.world_bounds();
    let around = [DVec3::new(1.0, 0.0, 0.0), DVec3::splat(0.5)];
    assert!(
        (bounds.center() - around[0]).length() < 1e-9
            && (bounds.size() - around[1]).length() < 1e-9
    );
}

#[test]
fn mistakes_of_colour_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let points = |points: &str| format!("[volume.transfer]\npoints = [{points}]");
    let cases = [
        (points(""), "transfer"),
        (points("[0.5, 1, 1, 1, 0], [0.2, 1, 1, 1, 1]"), "point 2"),
        (points("[0.0, 1, 1, 1, 0], [nan, 1, 1, 1, 1]"), "point 2"),
        (points("[0.0, 1, 1, 1, 0], [1.0, 1, 1, 1, 1.5]"), "1.5"),
        (points("[0.0, 1, 1, -1, 0], [1.0, 1, 1, 1, 1]"), "point 1"),
        ("[volume.transfer]\nname = \"rainbow\"".to_owned(), "viridis"),
        ("[volume.transfer]\nfile = \"none.json\"".to_owned(), "none.json"),
        ("[volume.transfer]\nname = \"bone\"\nrange = [1.0, 0.0]".to_owned(), "range"),
        ("tint = [1.0, -1.0, 0.0]".to_owned(), "tint"),
        ("scale = 0.0".to_owned(), "scale"),
        ("color = \"Cd\"".to_owned(), "color"),
        ("[volume.emission]\nkelvin = [900, 800]\ncolors = \"blackbody\"".to_owned(), "kelvin"),
        ("[volume.emission]\nscale = -1.0".to_owned(), "emission.scale"),
        ("[volume.emission]\nflames = 1".to_owned(), "flames"),
        ("[[light]]\nkind = \"sun\"".to_owned(), "sun"),
        ("[shadow]\noctaves = 99".to_owned(), "octaves"),
    ];
    for (text, named) in cases {
        let text = format!("[volume]\npreset = \"bucky\"\n{text}");
        let error = load(&text, folder.path()).map(|_| ()).expect_err(&text).to_string();
        assert!(error.contains(named) && !error.contains('\n'), "{text}: {error}");
    }
}

#[test]
fn lights_with_a_place_or_a_cone_need_not_say_their_kind() {
    let folder = tempfile::tempdir().unwrap();
    let kind = |light: &str| {
        let text = format!("[volume]\npreset = \"bucky\"\n[light]\n{light}");
        load(&text, folder.path()).unwrap().0.lights[0].kind
    };
    let position = DVec3::new(0.0, 2.0, 1.0);
    assert_eq!(kind("position = [0, 2, 1]"), LightKind::Point { position });
    let LightKind::Spot { cone_degrees, .. } = kind("position = [0, 2, 1]\ncone_degrees = 20")
    else {
        panic!("no spot");
    };
    assert_eq!(cone_degrees, 20.0);
    let direction = DVec3::NEG_Y;
    let parallel = LightKind::Directional { direction };
    assert_eq!(kind("direction = [0, -1, 0]"), parallel);
    assert_eq!(kind("direction = [0, -1, 0]\nposition = [0, 2, 1]"), parallel);
}
