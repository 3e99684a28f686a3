//! Scene files: absolute parameters give absolute radiance, and mistakes are named.

use std::fs;
use std::path::Path;

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::io::{load_ingredients, load_volume};
use deepshadow::progress::Silent;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{Scene, SceneFile, descriptor};
use deepshadow::settings::Settings;
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::rms;

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
    let (own, _) = load_ingredients(file.volume.first(), false)?;
    complete(&file, vec![own], Surroundings::Void).map(|(scene, settings, _)| (scene, settings))
}

/// Single scattering in a uniform box: with s(t) the way to the light from distance t,
/// L = integral of e^(-x t) e^(-x s(t)) x dt. s is a straight line between few kinks, so that fine
/// midpoints are as good as the closed form.
#[test]
fn box_of_extinction_4_has_its_closed_form_radiance() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.raw"), [2_u8; 4 * 5 * 6]).unwrap();
    let (scene, settings) = load(BOX_OF_EXTINCTION_4, folder.path()).unwrap();
    let (image, _) = CpuBackend.render(&scene, &settings, &Silent).unwrap();
    let bounds = scene.media.world_bounds();
    assert!((bounds.min + 0.5).length() + (bounds.max - 0.5).length() < 1e-12, "{bounds:?}");
    let rays = scene.camera.rays(96.0 / 80.0);
    let to_light = -scene.light().direction_at(DVec3::ZERO);
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
        let volume = load_volume(file.volume.first()).unwrap();
        let (scene, ..) = complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let bounds = scene.media.world_bounds();
        assert!((bounds.size().max_element() - 1.0).abs() < 1e-9, "{}: {bounds:?}", preset.name());
        assert!(bounds.center().length() < 1e-9, "{}: {bounds:?}", preset.name());
    }
}
