//! Tests of pictures that are chosen for an error (`--max-picture-error`) or a time (`--time`): the
//! error is kept against another implementation of the truth than the one that certifies it.

use deepshadow::Result;
use deepshadow::backend::{Backend, Passes, Stage};
use deepshadow::compare::{Given, Goal, PictureError, Sampled, choose_picture, picture_error};
use deepshadow::cpu::{CpuBackend, LazyFragments};
use deepshadow::frame::Frame;
use deepshadow::image::Image;
use deepshadow::math::Aabb;
use deepshadow::progress::{Progress, Silent};
use deepshadow::reference::brute_force_image;
use deepshadow::scene::{Ground, Light, LightKind, Projection, Scene};
use deepshadow::settings::{MapKind, Settings};
use deepshadow::shadow::Shadow;
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::cli::{Folder, must_succeed, stderr};
use crate::support::Random;
use crate::support::scenes::{anchor_scene, scene, settings, unit_cube, volume};

/// Puffs, a light and a camera drawn by a seed.
fn drawn(seed: u64) -> Scene {
    let mut random = Random(seed + 1);
    let mut within = |low: f64, high: f64| low + (high - low) * random.unit();
    let n = within(12.0, 24.0) as usize;
    let puffs: Vec<(DVec3, f64, f64)> = (0..6)
        .map(|_| {
            let center = DVec3::from_array([0; 3].map(|_| within(0.2, 0.8) * n as f64));
            (center, within(0.1, 0.3) * n as f64, within(0.3, 1.0))
        })
        .collect();
    let density = |voxel: [usize; 3]| {
        let place = DVec3::from_array(voxel.map(|c| c as f64));
        let near = |(center, radius, density): &(DVec3, f64, f64)| {
            density * (1.0 - place.distance(*center) / radius).clamp(0.0, 1.0)
        };
        puffs.iter().map(near).sum::<f64>() as f32
    };
    let mut drawn = scene(volume([n; 3], unit_cube(), density), within(5.0, 30.0));
    let around = |distance: f64, within: &mut dyn FnMut(f64, f64) -> f64| {
        let (turn, height) = (within(0.0, std::f64::consts::TAU), within(0.2, 0.9));
        distance * DVec3::new(turn.cos(), height, turn.sin())
    };
    let from = around(1.0, &mut within);
    let kind = if seed.is_multiple_of(3) {
        LightKind::Point { position: 2.0 * from }
    } else {
        LightKind::Directional { direction: -from }
    };
    drawn.lights[0] = Light::new(kind, DVec3::splat(Light::UNIT_IRRADIANCE));
    drawn.camera.position = around(1.6, &mut within);
    drawn.camera.target = DVec3::ZERO;
    if seed.is_multiple_of(2) {
        drawn.ground = Some(Ground::new(-0.55, 0.3));
    }
    drawn
}

/// The RMS error over lit pixels, as a share of the 99.9th percentile of the radiance.
fn true_error(image: &Image, truth: &Image) -> f64 {
    let lit = |pixel: &[f32; 4]| pixel[..3].iter().any(|&c| c > 0.0);
    let pairs = image.pixels.iter().zip(&truth.pixels).filter(|(_, truth)| lit(truth));
    let squares = pairs.flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)));
    let squares: Vec<f64> = squares.collect();
    let mut bright: Vec<f32> = truth.pixels.iter().flat_map(|p| p[..3].to_owned()).collect();
    bright.retain(|&radiance| radiance > 0.0);
    bright.sort_by(f32::total_cmp);
    let unit = bright[((bright.len() - 1) as f64 * 0.999) as usize];
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / f64::from(unit)
}

#[test]
fn the_error_asked_for_is_kept() {
    let mut settings = settings(128, [48, 40]);
    settings.map.kind = None;
    for seed in 0..5 {
        let drawn = drawn(seed);
        let truth = brute_force_image(&drawn, [48, 40], 2).unwrap();
        for most in [0.02, 0.004] {
            let chosen = choose_picture(
                &CpuBackend,
                &drawn,
                &settings,
                Goal::Error(most),
                Given::default(),
                &Silent,
            );
            let chosen = chosen.unwrap();
            let error = true_error(&chosen.image, &truth);
            let said = chosen.error;
            eprintln!("{seed}, {most}: {error:.5}, certified {said}");
            assert!(error <= most, "{seed}: {error} instead of {most}");
            assert!(said.rms <= said.bound && said.bound <= most && said.pixels >= 100);
            // The certificate is about that error: both are means of heavy tails.
            assert!((0.4..2.5).contains(&(said.rms / error)), "{said}, not {error}");
            let again = CpuBackend.render(&drawn, &chosen.settings, &Silent).unwrap();
            assert!(again == chosen.image, "the settings do not repeat the picture");
        }
    }
}

/// The processor, which misses something in one of two hundred pixels, the more of it the larger the
/// tolerance of pixels is.
struct Missing;

impl Missing {
    const EVERY: usize = 200;
    const MISSED: f32 = 20.0;
}

impl Backend for Missing {
    fn description(&self) -> String {
        CpuBackend.description()
    }

    fn passes(&self) -> &dyn Passes {
        CpuBackend.passes()
    }

    fn stage(&self) -> Box<dyn Stage + '_> {
        Box::new(MissingStage(CpuBackend.stage()))
    }
}

struct MissingStage<'a>(Box<dyn Stage + 'a>);

impl Stage for MissingStage<'_> {
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let mut image = self.0.render(scene, settings, progress)?;
        let missed = Missing::MISSED * settings.image.tolerance as f32;
        let lit = image.pixels.iter_mut().filter(|pixel| pixel[0] > 0.0);
        for pixel in lit.step_by(Missing::EVERY) {
            *pixel = pixel.map(|c| c + missed);
        }
        Ok(image)
    }

    fn pixels(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        pixels: &[[u32; 2]],
    ) -> Result<Option<Vec<[f32; 4]>>> {
        self.0.pixels(scene, settings, pixels)
    }
}

#[test]
fn rare_errors_of_pixels_that_are_not_marched_are_certified() {
    let scene = drawn(4);
    // As a whole, and as a sample.
    for size in [[48, 40], [128, 100]] {
        let mut settings = settings(128, size);
        // With several rays pixels may always have fewer than others.
        (settings.map.kind, settings.image.samples) = (None, 2);
        let fine = settings.with(|s| (s.quality, s.map.size, s.image.tolerance) = (4.0, 512, 0.0));
        let truth = CpuBackend.render(&scene, &fine, &Silent).unwrap();
        let most = 0.004;
        let goal = Goal::Error(most);
        let chosen =
            choose_picture(&Missing, &scene, &settings, goal, Given::default(), &Silent).unwrap();
        let tolerance = chosen.settings.image.tolerance;
        // What is missed alone is more than that at the tolerance that is tried first.
        let missed = f64::from(Missing::MISSED) / (Missing::EVERY as f64).sqrt();
        assert!(missed * most > 1.4 * most && tolerance < 0.8 * most, "{tolerance}");
        let (error, said) = (true_error(&chosen.image, &truth), chosen.error);
        assert!(error <= most, "{size:?}: {error}, {said}");
        let least = 0.5 * missed * tolerance;
        assert!((least..error).contains(&said.interpolated), "{} of {error}", said.interpolated);
    }
}

#[test]
fn a_bent_picture_is_not_certified() {
    let scene = drawn(1);
    let settings = settings(128, [48, 40]).with(|s| s.quality = 2.0);
    let image = CpuBackend.render(&scene, &settings, &Silent).unwrap();
    let right: PictureError = picture_error(&scene, &settings, &image).unwrap();
    let mut bent = image.clone();
    for pixel in &mut bent.pixels {
        *pixel = pixel.map(|c| c * 1.01);
    }
    let wrong = picture_error(&scene, &settings, &bent).unwrap();
    assert!(right.bound < 0.001, "{right}");
    assert!(wrong.rms > 0.002 && wrong.rms > 3.0 * right.rms, "{wrong}, {right}");
}

#[test]
fn pixels_alone_are_those_of_the_picture() {
    let scene = anchor_scene(Preset::Bucky, 6.0, 32);
    let settings = settings(48, [40, 32]);
    let beam = scene.only_beam().unwrap();
    let frame = Frame::new(&beam, &settings).unwrap();
    let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
    let image = CpuBackend.view(&beam, &settings, &map, &Silent).unwrap();
    let lazy = LazyFragments::new(&beam.media, &frame).unwrap();
    let pixels: Vec<[u32; 2]> = (0..300).map(|i| [i * 7 % 40, i * 11 % 32]).collect();
    for shadow in [&map as &dyn Shadow, &lazy] {
        let found = CpuBackend.march_pixels(beam.casters(), &frame, shadow, &pixels).unwrap();
        for (&[x, y], found) in pixels.iter().zip(found) {
            for (a, b) in found.iter().zip(image.pixel(x, y)) {
                assert!((a - b).abs() < 1e-5, "({x}, {y}): {a}, not {b}");
            }
        }
    }
    let (texels, seconds) = lazy.traced();
    assert!(texels > 100 && texels < 48 * 48 && seconds > 0.0, "{texels} texels, {seconds} s");
}

#[test]
fn lit_pixels_are_drawn_and_dark_ones_left_out() {
    let mut dark = drawn(1);
    dark.ground = None;
    dark.camera.target = DVec3::new(0.0, 50.0, 0.0);
    let settings = settings(32, [16, 16]);
    let nothing = Sampled::draw(&dark, &settings, 40, [1, 1]).unwrap();
    let black = CpuBackend.render(&dark, &settings, &Silent).unwrap();
    let error = nothing.error(&black);
    assert_eq!((error.pixels, error.rms, error.bound), (0, 0.0, 0.0));
    let goal = Goal::Error(0.01);
    let given = Given::default();
    let chosen = choose_picture(&CpuBackend, &dark, &settings, goal, given, &Silent).unwrap();
    assert!(chosen.error == error && chosen.image == black, "{}", chosen.error);
}

#[test]
fn what_cannot_be_chosen_is_an_error() {
    let scene = drawn(1);
    let given = Given::default();
    let choose = |settings: &Settings, goal| {
        choose_picture(&CpuBackend, &scene, settings, goal, given, &Silent).unwrap_err().to_string()
    };
    let small = settings(32, [16, 16]);
    let threshold = small.with(|s| s.map.kind = Some(MapKind::Threshold));
    assert!(choose(&threshold, Goal::Error(0.01)).contains("not 'threshold'"));
    assert!(choose(&small, Goal::Seconds(1e-6)).contains("too short"));
    let impossible = choose(&small, Goal::Error(1e-9));
    assert!(impossible.contains("no picture is expected to be so exact"), "{impossible}");
}

#[test]
fn the_program_says_what_repeats_a_picture() {
    let folder = Folder::new();
    let output =
        folder.run("render rods --backend cpu --size 64x48 --max-picture-error 0.01 -o chosen.png");
    must_succeed(&output);
    let said = stderr(&output);
    let options = said.split("repeated by ").nth(1).unwrap().lines().next().unwrap();
    must_succeed(
        &folder.run(&format!("render rods --backend cpu --size 64x48 {options} -o again.png")),
    );
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("chosen.png") == read("again.png"), "{options}");
    must_succeed(&folder.run("render rods --backend cpu --size 32x24 --time 30 -o timed.png"));
    for (options, expected) in [
        ("--max-picture-error 0.01 --time 3", "cannot be used with"),
        ("--max-picture-error 0.01 --tolerance 0.1", "cannot be used with"),
        ("--max-picture-error 0", "above 0"),
        ("--time 1 --map nested", "it chooses fragment maps"),
    ] {
        let output = folder.run(&format!("render rods --backend cpu {options} -o no.png"));
        assert!(!output.status.success());
        assert!(stderr(&output).contains(expected), "{options}: {}", stderr(&output));
    }
    assert!(!folder.path().join("no.png").exists());
}

/// Spikes of single voxels, all of them between the pixels of the scouts' preview.
#[test]
fn what_a_preview_misses_is_chosen_for_all_the_same() {
    let spikes = |[x, y, z]: [usize; 3]| f32::from(x % 4 == 0 && y % 4 == 0 && z == 1);
    let bounds = Aabb { min: DVec3::new(-80.5, -80.5, -1.5), max: DVec3::new(80.5, 80.5, 1.5) };
    let mut scene = scene(volume([161, 161, 3], bounds, spikes), 2.0);
    scene.camera.projection = Projection::Orthographic { height: 160.0 };
    (scene.camera.position, scene.camera.target) = (DVec3::Z * 50.0, DVec3::ZERO);
    scene.camera.up = DVec3::Y;
    (scene.ground, scene.background, scene.ambient) = (None, Some(DVec3::ZERO), DVec3::ZERO);
    let settings = settings(128, [400, 400]).with(|s| s.map.kind = None);
    let goal = Goal::Error(0.05);
    let chosen =
        choose_picture(&CpuBackend, &scene, &settings, goal, Given::default(), &Silent).unwrap();
    assert!(chosen.error.pixels >= 100 && chosen.error.bound <= 0.05, "{}", chosen.error);
}
