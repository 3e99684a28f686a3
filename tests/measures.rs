//! Tests of the measures themselves, on maps and pictures with known errors.

use deepshadow::accuracy::{
    Errors, ExactPoints, ExactTexels, Place, Points, TruePicture, largest_optical_depth,
};
use deepshadow::image::Image;
use deepshadow::progress::Silent;
use deepshadow::scene::{Beam, LightKind, Scene};
use deepshadow::shadow::Shadow;
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::scenes::{anchor_scene, scene, unit_cube, volume};

const MAP: u32 = 32;
const COUNT: u64 = 3_000;

fn points(scene: &Scene, seed: u64) -> (Beam, Points) {
    let beam = scene.only_beam().unwrap();
    let points = Points::draw(&beam, MAP, &Place::ALL, [COUNT, seed], &Silent);
    (beam, points)
}

/// Another map's transmittances plus a constant.
struct Off<M>(M, f32);

impl<M: Shadow> Shadow for Off<M> {
    fn bytes(&self) -> u64 {
        1234
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.0.lookup(width, u, v, depth) + self.1
    }
}

/// Parallel, point and spot light: the exact integral in place of a map has only rounding errors.
#[test]
fn the_exact_map_is_measured_as_exact() {
    let mut scene = anchor_scene(Preset::Bucky, 4.0, MAP);
    let center = scene.media.world_bounds().center();
    let position = center + DVec3::new(0.8, 1.9, 0.4) * scene.media.world_bounds().size();
    let spot = LightKind::Spot {
        position,
        direction: center - position,
        cone_degrees: 40.0,
        cone_softness: 0.1,
    };
    for kind in [scene.lights[0].kind, LightKind::Point { position }, spot] {
        scene.lights[0].kind = kind;
        let (beam, points) = points(&scene, 5);
        let exact = ExactPoints(ExactTexels::new(&beam, MAP));
        for place in Place::ALL {
            assert_eq!(points.of(place).len() as u64, COUNT, "{}", place.name());
            let errors = points.errors(place, &exact, 0);
            assert!(errors.max < 2e-6, "{kind:?}, {}: {errors:?}", place.name());
            assert_eq!(errors.visible, 0.0);
        }
    }
}

#[test]
fn a_known_error_is_measured_as_such() {
    let scene = anchor_scene(Preset::Rods, 4.0, MAP);
    let (beam, points) = points(&scene, 5);
    let off = Off(ExactPoints(ExactTexels::new(&beam, MAP)), -0.01);
    for place in Place::ALL {
        let found = points.errors(place, &off, 0);
        for (what, value) in [("rms", found.rms), ("p999", found.p999), ("max", found.max)] {
            assert!((value - 0.01).abs() < 3e-6, "{}: {what} {value}", place.name());
        }
        assert!((found.bias + 0.01).abs() < 1e-6, "{found:?}");
        assert_eq!(found.visible, 1.0);
    }
}

/// On its texels' central rays the floor is exact; between them it has the error of the map's
/// resolution.
#[test]
fn the_floor_errs_between_texels_only() {
    let scene = anchor_scene(Preset::Bucky, 4.0, MAP);
    let (beam, points) = points(&scene, 5);
    let floor = |size| {
        let exact = ExactTexels::new(&beam, size);
        points.errors(Place::Volume, &exact, 0).rms
    };
    let texels = ExactTexels::new(&beam, MAP);
    assert!(points.errors(Place::Rays, &texels, 0).max < 2e-6);
    assert!(points.worst(&texels).is_some());
    let (coarse, fine) = (floor(MAP), floor(4 * MAP));
    assert!(coarse > 1e-3 && fine < coarse / 6.0, "{coarse}, of four times as many texels {fine}");
}

#[test]
fn points_are_the_seeds_alone() {
    let scene = anchor_scene(Preset::Box, 4.0, MAP);
    let [(_, a), (_, b), (_, c)] = [1, 1, 2].map(|seed| points(&scene, seed));
    for place in Place::ALL {
        assert_eq!(a.of(place), b.of(place));
        assert_ne!(a.of(place), c.of(place));
    }
}

#[test]
fn medium_points_lie_in_voxels_that_hold_some() {
    let one = volume([5, 4, 3], unit_cube(), |index| f32::from(u8::from(index == [3, 1, 2])));
    let scene = scene(one, 2.0);
    let (beam, points) = points(&scene, 3);
    let (low, high) = (DVec3::new(0.6, 0.25, 2.0 / 3.0) - 0.5, DVec3::new(0.8, 0.5, 1.0) - 0.5);
    for sample in points.of(Place::Medium) {
        let [u, v, depth] = sample.place.map(f64::from);
        let (origin, direction) = beam.view.ray(u, v);
        let point = origin + depth * direction;
        assert!((point - low).min_element() > -1e-6 && (high - point).min_element() > -1e-6);
    }
    let empty = crate::support::scenes::scene(volume([2; 3], unit_cube(), |_| 0.0), 1.0);
    let (beam, points) = self::points(&empty, 3);
    assert!(points.of(Place::Medium).is_empty());
    let exact = ExactTexels::new(&beam, MAP);
    assert_eq!(points.errors(Place::Medium, &exact, 0), Errors::default());
    assert_eq!(largest_optical_depth(&beam, MAP), 0.0);
}

#[test]
fn anchor_scenes_are_as_deep_as_they_say() {
    let scene = anchor_scene(Preset::Clouds, 16.0, MAP);
    let beam = scene.only_beam().unwrap();
    assert!((largest_optical_depth(&beam, MAP) - 16.0).abs() < 1e-9);
}

/// An image that is encoded to the given pixels of 8 bits per channel.
fn image(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f64; 3]) -> Image {
    let mut image = Image::filled(width, height, [0.0, 0.0, 0.0, 1.0]);
    for (i, out) in image.pixels.iter_mut().enumerate() {
        let (x, y) = (i as u32 % width, i as u32 / width);
        for (out, c) in out.iter_mut().zip(pixel(x, y)) {
            *out = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) } as f32;
        }
    }
    image
}

fn grey(value: f64) -> Image {
    image(64, 48, |_, _| [value; 3])
}

/// Values from the authors' own program (flip-evaluator 1.7, LDR, 67.02 pixels per degree).
#[test]
fn flip_is_that_of_its_authors() {
    let flip = |a: &Image, b: &Image| TruePicture::new(a, 1.0).difference(b).flip;
    for (value, published) in [(0.51, 0.057_495_38), (0.6, 0.285_051_97), (1.0, 0.847_090_0)] {
        let found = flip(&grey(0.5), &grey(value));
        assert!((found - published).abs() < 2e-4, "{value}: {found}, not {published}");
    }
    let found = flip(&grey(0.0), &grey(1.0));
    assert!((found - 0.967_365_27).abs() < 2e-4, "black and white: {found}");
    let pure = |c: usize| image(64, 48, |_, _| [0, 1, 2].map(|i| f64::from(u8::from(i == c))));
    let found = flip(&pure(1), &pure(2));
    assert!((found - 1.0).abs() < 1e-6, "green and blue are as far apart as can be: {found}");

    let byte = |x: u32, y: u32| [x * 4 % 256, y * 5 % 256, (x * x + 3 * y * y) / 4 % 256];
    let changed = |x: u32, y: u32| {
        let mut rgb = byte(x, y).map(i64::from);
        if (10..20).contains(&y) && (15..40).contains(&x) {
            rgb[0] += 12;
        }
        if (30..34).contains(&y) && (5..50).contains(&x) {
            rgb = rgb.map(|c| c - 30);
        }
        if (5..40).contains(&y) && (52..54).contains(&x) {
            rgb[1] += 60;
        }
        rgb.map(|c| c.clamp(0, 255) as f64 / 255.0)
    };
    let a = image(64, 48, |x, y| byte(x, y).map(|c| f64::from(c) / 255.0));
    let b = image(64, 48, changed);
    let found = TruePicture::new(&a, 1.0).difference(&b);
    assert!((found.flip - 0.086_909_50).abs() < 3e-4, "{}", found.flip);
    for (x, y, published) in
        [(20, 15, 0.124_312_9), (20, 32, 0.483_936_3), (53, 20, 0.539_865_8), (14, 21, 0.010_588_9)]
    {
        let found = found.map[y * 64 + x];
        assert!((found - published).abs() < 2e-3, "pixel {x}, {y}: {found}, not {published}");
    }
    assert_eq!(found.map[0], 0.0);
    let back = TruePicture::new(&b, 1.0).difference(&a);
    assert!((back.flip - found.flip).abs() < 1e-12, "either picture may come first");
}

#[test]
fn pictures_are_compared_as_the_formulas_say() {
    let same = TruePicture::new(&grey(0.5), 1.0).difference(&grey(0.5));
    assert_eq!((same.psnr, same.flip), (f64::INFINITY, 0.0));
    assert!((same.ssim - 1.0).abs() < 1e-12);
    let off = TruePicture::new(&grey(0.5), 1.0).difference(&grey(0.6));
    assert!((off.psnr - 20.0).abs() < 1e-3, "0.1 of 1 is 20 dB: {}", off.psnr);
    // Without structure only the luminance term remains.
    let luminance = (2.0 * 0.5 * 0.6 + 1e-4) / (0.25 + 0.36 + 1e-4);
    assert!((off.ssim - luminance).abs() < 1e-5, "{} instead of {luminance}", off.ssim);
    // A picture against its negative, which reverses the structure.
    let stripes = |phase: u32| {
        image(32, 32, move |x, _| [if (x / 2 + phase).is_multiple_of(2) { 0.25 } else { 0.75 }; 3])
    };
    let turned = TruePicture::new(&stripes(0), 1.0).difference(&stripes(1));
    assert!(turned.ssim < -0.5, "{}", turned.ssim);
}
