//! Pictures of meshes and strands against closed forms and against rays in f64.

use std::f64::consts::PI;
use std::sync::Arc;

use deepshadow::cpu::DeepView;
use deepshadow::frame::Frame;
use deepshadow::image::Image;
use deepshadow::math::Aabb;
use deepshadow::reference::BruteForce;
use deepshadow::scene::{Camera, Ground, Light, LightKind, Scene};
use deepshadow::settings::{MapKind, Shading};
use deepshadow::{Backend, CpuBackend, Settings, Silent};
use glam::DVec3;

use crate::support::rms;
use crate::support::scenes::{settings, unit_cube, volume};
use crate::surfaces::{ball, bare, ends, mixed, pane, rods, tangle};

fn render(scene: &Scene, settings: &Settings) -> Image {
    CpuBackend.render(scene, settings, &Silent).unwrap()
}

fn maps(size: u32, image: [u32; 2], samples: u32) -> Settings {
    settings(size, image).with(|s| {
        (s.map.kind, s.image.samples) = (Some(MapKind::Fragments), samples);
    })
}

/// Root mean square difference of two pictures' pixels over all channels.
fn difference(a: &Image, b: &Image) -> f64 {
    assert_eq!([a.width, a.height], [b.width, b.height]);
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    rms(pairs.map(|(a, b)| f64::from(a - b)))
}

/// A camera straight above, with parallel rays.
fn above(height: f64) -> Camera {
    let mut camera = Camera::orthographic(DVec3::Y * 5.0, DVec3::ZERO, height);
    camera.up = DVec3::Z;
    camera
}

/// Light from above, of irradiance pi: a white surface that faces it has radiance 1.
fn noon() -> Light {
    Light::new(LightKind::Directional { direction: DVec3::NEG_Y }, DVec3::splat(PI))
}

#[test]
fn panes_in_a_medium_are_seen_through_it() {
    // A cube of optical depth .8 from top to bottom, with panes in its middle and below it.
    let mut scene = crate::support::scenes::scene(volume([8; 3], unit_cube(), |_| 1.0), 0.8);
    scene.lights = vec![noon()];
    scene.camera = above(0.2);
    scene.surfaces = vec![pane(2.0, 0.1, 0.25), pane(2.0, -1.0, 1.0)].into();
    scene.ambient = DVec3::splat(0.2);
    let found = render(&scene, &maps(64, [4, 4], 1));
    let truth = BruteForce::default().image(&scene, [4, 4]).unwrap();
    // In front of the upper pane lies .4 of the cube, behind it .6. What scatters once comes back
    // the way that it went, so its share is (1 - T^2) / 2 of E / (4 pi) = 1/4; ambient light
    // arrives everywhere.
    let [front, back] = [0.4, 0.6].map(|share: f64| (-0.8 * share).exp());
    let scattered = |t: f64| 0.25 * 0.5 * (1.0 - t * t) + 0.2 * (1.0 - t);
    let (albedo, glass) = (0.7, 0.75);
    let pane_seen = front * 0.25 * albedo * (front + 0.2);
    let behind =
        front * glass * (0.25 * 0.5 * (front * glass) * (1.0 - back * back) + 0.2 * (1.0 - back));
    let ground = (front * back * glass) * albedo * (front * back * glass + 0.2);
    let due = scattered(front) + pane_seen + behind + ground;
    for (what, image, allowed) in [("rays", &truth, 1e-6), ("map", &found, 2e-3)] {
        for pixel in &image.pixels {
            assert!((f64::from(pixel[0]) - due).abs() < allowed, "{what}: {pixel:?}, not {due}");
            assert!((pixel[3] - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn strands_cover_parts_of_pixels() {
    // A rod across the picture, a tenth of a pixel thick: pixels are .25 wide.
    let ends = [[DVec3::new(-4.0, 0.0, 0.03), DVec3::new(4.0, 0.0, 0.03)]];
    let mut scene = bare(vec![rods(&ends, 0.025, 0.5)], DVec3::NEG_Y);
    scene.lights = vec![noon()];
    scene.camera = above(1.0);
    scene.background = Some(DVec3::splat(0.5));
    let found = render(&scene, &maps(256, [4, 4], 1));
    for (i, pixel) in found.pixels.iter().enumerate() {
        // A white strand across the light, seen from there: its diffuse part, and its highlight.
        let due = if i / 4 == 1 { 0.5 + 0.5 * 0.1 * (1.1 - 0.5) } else { 0.5 };
        assert!((f64::from(pixel[0]) - due).abs() < 1e-5, "{i}: {pixel:?}, not {due}");
    }
    let rays = BruteForce { rays: 40, ..BruteForce::default() }.image(&scene, [4, 4]).unwrap();
    assert!(difference(&found, &rays) < 1e-5);
    // From the side, its shine is gone, and light along it gives none.
    let mut along = scene.clone();
    along.lights[0].kind = LightKind::Directional { direction: DVec3::X };
    let dark = render(&along, &maps(256, [4, 4], 1));
    assert!((f64::from(dark.pixels[4][0]) - (0.5 - 0.5 * 0.1 * 0.5)).abs() < 1e-4);
}

#[test]
fn what_does_not_cast_or_receive_is_still_seen() {
    let mut scene = bare(vec![pane(1.0, 1.0, 1.0), pane(4.0, 0.0, 1.0)], DVec3::NEG_Y);
    scene.lights = vec![noon()];
    scene.camera = Camera::orthographic(DVec3::new(0.0, 3.0, 5.0), DVec3::ZERO, 0.5);
    let seen = |scene: &Scene| f64::from(render(scene, &maps(64, [1, 1], 1)).pixels[0][0]);
    assert!(seen(&scene).abs() < 1e-6, "{}", seen(&scene));
    let mut changed: Vec<_> = scene.surfaces.to_vec();
    changed[0].casts = false;
    scene.surfaces = changed.clone().into();
    assert!((seen(&scene) - 0.7).abs() < 1e-6, "{}", seen(&scene));
    (changed[0].casts, changed[1].receives) = (true, false);
    scene.surfaces = changed.into();
    assert!((seen(&scene) - 0.7).abs() < 1e-6, "{}", seen(&scene));
    // The upper one is lit, and seen from above.
    scene.camera = above(0.5);
    assert!((seen(&scene) - 0.7).abs() < 1e-6, "{}", seen(&scene));
    // From below it is dark: the light is on its other side.
    (scene.camera.position, scene.camera.target) = (DVec3::Y * 0.5, DVec3::Y * 2.0);
    assert!(seen(&scene).abs() < 1e-6, "{}", seen(&scene));
}

/// The mean over a Lambertian ball, seen from the light, is 2/3 of its albedo, and smooth normals
/// come close to it with few triangles.
#[test]
fn a_ball_becomes_round() {
    let seen = |surface, light: DVec3| {
        let mut scene = bare(vec![surface], DVec3::NEG_Y);
        scene.lights = vec![noon()];
        scene.lights[0].kind = LightKind::Directional { direction: light };
        (scene.camera, scene.background) = (above(2.0), None);
        let image = render(&scene, &maps(128, [48, 48], 4));
        let sum: f64 = image.pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
        sum * (2.0_f64 / 48.0).powi(2) / (PI * 0.7)
    };
    let smooth = |parts| {
        let mut surface = ball(parts, 1.0);
        let deepshadow::scene::Shape::Mesh(mesh) = &surface.shape else { panic!() };
        surface.shape = deepshadow::scene::Shape::Mesh(Arc::new((**mesh).clone().smoothed(60.0)));
        surface
    };
    let [coarse, fine] = [4, 24].map(|parts| seen(ball(parts, 1.0), DVec3::NEG_Y));
    assert!((fine - 2.0 / 3.0).abs() < 0.004, "{fine}");
    assert!((coarse - 2.0 / 3.0).abs() < 0.05, "{coarse}");
    // From the side, half a ball is lit: 1/3 of it are seen, and no triangle shadows its neighbours.
    let side = seen(smooth(8), DVec3::new(-1.0, 0.0, 0.0));
    let due = seen(smooth(32), DVec3::new(-1.0, 0.0, 0.0));
    assert!((side - due).abs() < 0.012 && (due - 2.0 / (3.0 * PI)).abs() < 0.01, "{side} {due}");
}

/// The place in the ball of a mixture, outside of its medium, that is farthest from all strands:
/// near them, light changes much within a pixel.
fn free_place() -> DVec3 {
    let along = |i: i32| 0.1 * f64::from(i);
    let places =
        (-8..=8).flat_map(|x| (-8..=8).flat_map(move |y| (-8..=8).map(move |z| [x, y, z])));
    let places = places.map(|place| DVec3::from_array(place.map(along)));
    let free = places.filter(|p| p.length() < 0.85 && p.abs().max_element() > 0.65);
    let away = |p: DVec3| {
        let of = |[a, b]: &[DVec3; 2]| {
            let share = ((p - *a).dot(*b - *a) / (*b - *a).length_squared()).clamp(0.0, 1.0);
            a.lerp(*b, share).distance(p)
        };
        ends().iter().map(of).fold(f64::INFINITY, f64::min)
    };
    free.max_by(|a, b| away(*a).total_cmp(&away(*b))).unwrap()
}

/// Scenes of strands, meshes and a medium, in the light of all kinds, seen from all around.
fn scenes() -> Vec<(&'static str, Scene)> {
    let eye = DVec3::new(1.6, 1.9, 2.6);
    let camera = Camera::perspective(eye, DVec3::ZERO, 40.0);
    let ground = Some(Ground::new(-1.1, 0.3));
    let with = |mut scene: Scene, light: Light| {
        scene.lights = vec![Light::new(light.kind, DVec3::new(3.0, 2.5, 2.0))];
        (scene.camera, scene.ground) = (camera, ground);
        (scene.ambient, scene.background) = (DVec3::splat(0.1), Some(DVec3::splat(0.2)));
        scene
    };
    let sun = Light::directional(DVec3::new(0.5, -0.8, -0.3));
    let position = DVec3::new(-1.5, 2.5, 1.0);
    let lamp = Light::new(LightKind::Point { position }, DVec3::ONE);
    let inside = Light::new(LightKind::Point { position: free_place() }, DVec3::ONE);
    let mut hair = bare(Vec::new(), DVec3::NEG_Y);
    hair.surfaces = tangle(120);
    let round = bare(vec![ball(6, 1.0), pane(2.0, -1.05, 1.0)], DVec3::NEG_Y);
    let mut flat = with(mixed(0.6), sun);
    flat.camera = Camera::orthographic(eye, DVec3::ZERO, 2.0);
    vec![
        ("hair", with(hair.clone(), sun)),
        ("hair by a lamp", with(hair, lamp)),
        ("ball", with(round, sun)),
        ("mixture", with(mixed(0.6), sun)),
        ("mixture by a lamp", with(mixed(0.4), lamp)),
        ("light inside", with(mixed(0.5), inside)),
        ("parallel rays", flat),
    ]
}

#[test]
fn pictures_are_those_of_rays() {
    let size = [30, 24];
    for (name, scene) in scenes() {
        let brute = BruteForce { rays: 8, ..BruteForce::default() };
        let truth = brute.image(&scene, size).unwrap();
        let found = render(&scene, &maps(384, size, 32));
        let off = difference(&found, &truth);
        eprintln!("{name}: {off:.4}");
        assert!(off < 0.01, "{name}: {off}");
    }
}

/// The deep image's samples, composited, give the picture of central rays.
#[test]
fn deep_images_of_surfaces_in_media_are_the_picture() {
    let size = [30, 24];
    for (name, scene) in scenes().into_iter().filter(|(name, _)| !name.contains("inside")) {
        let settings = maps(128, size, 1);
        let beam = scene.only_beam().unwrap();
        let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
        let frame = Frame::new(&beam, &settings).unwrap();
        let view = DeepView::new(beam.casters(), &frame, &map).unwrap();
        let picture = render(&scene, &settings);
        let mut in_order = true;
        for (y, row) in picture.pixels.chunks_exact(30).enumerate() {
            for (pixel, samples) in row.iter().zip(view.row(y as u32)) {
                let (mut light, mut through) = (0.0, 1.0);
                for sample in &samples {
                    light += through * sample.radiance.x;
                    through *= 1.0 - sample.alpha;
                }
                light += through * 0.2;
                let off = (light - pixel[0]).abs();
                assert!(off < 3e-3, "{name}, row {y}: {light}, not {}", pixel[0]);
                in_order &= samples.is_sorted_by(|a, b| a.back <= b.front);
            }
        }
        assert!(in_order, "{name}");
    }
}

/// Media of one tint share a beam for all channels; surfaces take as much of each.
#[test]
fn surfaces_beside_tinted_media_cast_grey_shadows() {
    let aside = Aabb { min: DVec3::new(5.0, -0.5, -0.5), max: DVec3::new(6.0, 0.5, 0.5) };
    let mut scene = crate::support::scenes::scene(volume([4; 3], aside, |_| 1.0), 1.0);
    scene.media.medium_mut().tint = DVec3::new(0.5, 1.0, 1.5);
    scene.surfaces = vec![pane(2.0, 0.0, 0.5), pane(2.0, -1.0, 1.0)].into();
    scene.lights = vec![noon()];
    scene.camera = above(0.5);
    let pixel = render(&scene, &maps(64, [2, 2], 1)).pixels[0];
    // Half of the light on the upper pane comes back, and a quarter of that on the lower one.
    for channel in &pixel[..3] {
        assert!((channel - 0.7 * 0.75).abs() < 1e-3, "{pixel:?}");
    }
}

/// Pixels at the edge of a ball are covered in part, in deep images too.
#[test]
fn deep_images_of_meshes_have_soft_edges() {
    let mut scene = bare(vec![ball(12, 1.0)], DVec3::NEG_Y);
    (scene.camera, scene.background) = (above(2.4), None);
    let settings = maps(64, [24, 24], 16);
    let beam = scene.only_beam().unwrap();
    let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
    let frame = Frame::new(&beam, &settings).unwrap();
    let view = DeepView::new(beam.casters(), &frame, &map).unwrap();
    let flat = render(&scene, &settings);
    for (i, pixel) in flat.pixels.iter().enumerate() {
        let row = view.row(i as u32 / 24);
        let through: f32 = row[i % 24].iter().map(|sample| 1.0 - sample.alpha).product();
        assert!((1.0 - through - pixel[3]).abs() < 2e-2, "{i}: {through}, not 1 - {}", pixel[3]);
    }
    let soft = flat.pixels.iter().filter(|pixel| pixel[3] > 0.0 && pixel[3] < 1.0).count();
    assert!(soft > 20, "{soft}");
}

/// Pictures change by as much from one step of a turning light to the next: nothing pops.
#[test]
fn nothing_pops_while_the_light_turns() {
    let (_, mut scene) = scenes().swap_remove(0);
    scene.surfaces = [&scene.surfaces[..], &[ball(8, 1.0)]].concat().into();
    let frames: Vec<Image> = (0..9)
        .map(|i| {
            let angle = (30.0 + 0.5 * f64::from(i)).to_radians();
            let direction = DVec3::new(-angle.cos(), -1.2, -angle.sin());
            scene.lights[0].kind = LightKind::Directional { direction };
            render(&scene, &maps(128, [48, 40], 8))
        })
        .collect();
    let steps: Vec<f64> = frames.array_windows().map(|[a, b]| difference(a, b)).collect();
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    eprintln!("{steps:.5?}");
    assert!(steps.iter().all(|step| (0.6..1.5).contains(&(step / mean))), "{steps:.5?}");
}

/// What casts no shadow is no part of maps: not of their extent, and no reason to refuse one.
#[test]
fn maps_know_nothing_of_what_casts_no_shadow() {
    let mut scene = mixed(0.5);
    scene.surfaces = vec![scene.surfaces[0].clone()].into();
    let mut floor = pane(400.0, -0.9, 1.0);
    floor.casts = false;
    let mut with = scene.clone();
    with.surfaces = vec![scene.surfaces[0].clone(), floor.clone()].into();
    let image = |scene: &Scene, kind: &str| {
        let settings = maps(48, [12, 9], 1).with(|s| s.map.kind = Some(kind.parse().unwrap()));
        let beam = scene.only_beam().unwrap();
        CpuBackend.map(&beam, &settings, &Silent).map(|map| {
            use deepshadow::shadow::Shadow;
            [0.2, 0.5, 0.7].map(|u| map.lookup(1, u, 0.5, 1.0))
        })
    };
    for kind in ["slices:16", "occupancy:128", "threshold"] {
        let [alone, beside] = [image(&scene, kind).unwrap(), image(&with, kind).unwrap()];
        // The frame's origin moves with what is seen, so rounding differs.
        for (a, b) in alone.into_iter().zip(beside) {
            assert!((a - b).abs() < 1e-3, "{kind}: {a} {b}");
        }
    }
    with.surfaces = vec![floor].into();
    assert!(image(&with, "grid:8").is_ok() && image(&scene, "grid:8").is_err());
    // The paper's shading has no place for surfaces.
    let paper = maps(48, [4, 4], 1).with(|s| s.view.shading = Shading::Paper);
    assert!(CpuBackend.render(&scene, &paper, &Silent).is_err());
}

mod outside {
    use std::path::Path;

    use deepshadow::io::{load_ingredients, load_surfaces};
    use deepshadow::scene::SceneFile;
    use deepshadow::scene::automatic::{Loaded, Surroundings, complete};

    use super::*;
    use crate::support::data::outside;

    /// Twin: `pictures_are_those_of_rays`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn hair_a_head_and_a_teapot_in_smoke_are_what_rays_see() {
        let data = |name: &str| format!("{:?}", outside("data").join(name));
        let hair = format!("[[hair]]\npath = {}\n", data("hair/straight.hair.gz"));
        let head = format!(
            "[[mesh]]\npath = {}\n[[hair]]\npath = {}\nthickness = 0.1\nalbedo = [0.5, 0.2, 0.1]\n",
            data("mesh/sintel.obj"),
            data("hair/sintel.tfx"),
        );
        let teapot = format!(
            "[[volume]]\npath = {}\n[[mesh]]\npath = {}\nscale = 9\ntranslate = [60, 8, 30]\n",
            data("vdb/daichi_smoke.vdb"),
            data("mesh/teapot.obj"),
        );
        for (name, text) in [("hair", hair), ("head", head), ("teapot in smoke", teapot)] {
            let mut file = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
            (file.image.width, file.image.height) = (Some(80), Some(60));
            (file.shadow.size, file.image.tolerance) = (Some(1024), Some(0.0));
            let volumes = file.volume.iter().map(|table| load_ingredients(table, true).unwrap().0);
            let (volumes, surfaces) = (volumes.collect(), load_surfaces(&file).unwrap().0);
            let loaded = Loaded { volumes, surfaces };
            let (scene, settings, _) = complete(&file, loaded, Surroundings::Studio).unwrap();
            // Of two pictures by different rays the difference tells how noisy their mean is.
            let rays = [7, 8];
            let [a, b] = rays.map(|rays| {
                let brute = BruteForce { rays, ..BruteForce::default() };
                brute.image(&scene, settings.image.size).unwrap()
            });
            let [n, m] = rays.map(|rays| f64::from(rays * rays));
            let noise = difference(&a, &b) * (1.0 / (n + m) / (1.0 / n + 1.0 / m)).sqrt();
            let mut truth = a.clone();
            let pairs = truth.pixels.iter_mut().flatten().zip(b.pixels.iter().flatten());
            pairs.for_each(|(a, b)| *a += (b - *a) * (m / (n + m)) as f32);
            let off = difference(&render(&scene, &settings), &truth);
            let error = (off * off - noise * noise).max(0.0).sqrt();
            eprintln!("{name}: {off:.4}, of which {noise:.4} is the noise of rays: {error:.4}");
            assert!(error < 0.01, "{name}: {error}");
        }
    }
}
