//! Tests of scenes of any magnitude: their cost is bounded by what is requested, and their results
//! are finite numbers or an error of one line. Samples are counted, not timed.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

use std::sync::Arc;

use glam::{DMat4, DVec3};
use ndarray::Array3;

use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::Result;
use crate::image::Image;
use crate::kernel::density::counted::SAMPLES;
use crate::math::Aabb;
use crate::progress::Silent;
use crate::scene::transfer::preset;
use crate::scene::{
    Body, Camera, Emission, Ground, Light, LightKind, Media, Medium, Projection, Scene, Surfaces,
};
use crate::settings::{MapKind, Settings};
use crate::volume::{Axis, Volume, world_from_index_in_bounds};

/// xorshift64*.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mostly of ordinary size, else anything from 1e-30 to 1e30.
    fn magnitude(&mut self) -> f64 {
        let power = if self.unit() < 0.7 { 2.0 } else { 60.0 };
        10.0_f64.powf((self.unit() - 0.5) * power)
    }

    fn vector(&mut self) -> DVec3 {
        let direction = DVec3::new(self.unit(), self.unit(), self.unit()) - 0.5;
        direction * self.magnitude()
    }

    fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }
}

fn settings(kind: MapKind, size: u32) -> Settings {
    Settings::default().with(|s| {
        s.map.kind = Some(kind);
        s.map.size = size;
        s.image.size = [size; 2];
    })
}

/// The result of some work, and the number of density samples that it takes.
fn counted<T: Send>(work: impl FnOnce() -> T + Send) -> (T, u64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        SAMPLES.set(0);
        let found = work();
        (found, SAMPLES.get())
    })
}

fn render(scene: &Scene, settings: &Settings) -> (Result<Image>, u64) {
    counted(|| CpuBackend.render(scene, settings, &Silent))
}

/// A cube with edges of length `edge` around `center`, with `voxels` voxels along each.
fn cube(voxels: usize, center: DVec3, edge: f64) -> Arc<Volume> {
    let bounds = Aabb { min: center - 0.5 * edge, max: center + 0.5 * edge };
    let placement = world_from_index_in_bounds([voxels; 3], &bounds, Axis::Y).unwrap();
    let values = Array3::from_shape_fn([voxels; 3], |(z, y, x)| ((x * y + z) % 5) as f32 * 0.3);
    Arc::new(Volume::new("cube", values, placement).unwrap())
}

fn seen(media: Media, size: f64) -> Scene {
    let direction = DVec3::new(0.6, -0.72, -0.36);
    Scene {
        surfaces: Surfaces::default(),
        media,
        lights: vec![Light {
            kind: LightKind::Directional { direction },
            irradiance: DVec3::splat(Light::UNIT_IRRADIANCE),
        }],
        ambient: DVec3::ZERO,
        camera: Camera {
            projection: Projection::Perspective { fov_y_degrees: 45.0 },
            position: DVec3::new(0.0, 0.5, 3.0) * size,
            target: DVec3::ZERO,
            up: DVec3::Y,
        },
        ground: Some(Ground { height: -size, albedo: 0.2, half_extent: None }),
        background: Some(DVec3::ZERO),
    }
}

/// The common index space of both is as fine as the smaller body, whatever its scale.
#[test]
fn bodies_of_any_scale_take_as_many_samples_as_their_voxels_ask_for() {
    for kind in [MapKind::Fragments, MapKind::Threshold, MapKind::Grid(8)] {
        let taken = [0.5, 1e-3, 1e-5, 1e-12].map(|scale| {
            let bodies = [(DVec3::ZERO, 1.0), (DVec3::new(0.0, 0.6, 0.0), scale)];
            let bodies = bodies.map(|(center, edge)| Body {
                volume: cube(16, center, edge),
                medium: Medium { density_scale: 3.0, ..Medium::default() },
            });
            let scene = seen(Media::new(bodies.into()), 1.0);
            let (image, samples) = render(&scene, &settings(kind, 8));
            image.unwrap();
            samples
        });
        eprintln!("{kind}: {taken:?}");
        let most = taken[1] + taken[1] / 10;
        assert!(taken.iter().all(|&samples| samples <= most), "{kind}: {taken:?}");
    }
}

#[test]
fn voxels_as_flat_as_numbers_allow_take_no_more_samples() {
    for kind in [MapKind::Fragments, MapKind::Threshold, MapKind::Grid(64)] {
        let taken = [1.0, 1e-6, 1e-20, 1e-30].map(|thickness| {
            let values = Array3::from_shape_fn([16; 3], |(z, y, x)| ((x + y + z) % 4) as f32);
            let placement = DMat4::from_scale(DVec3::new(thickness, 1.0, 1.0) / 16.0);
            let volume = Volume::new("flat", values, placement).unwrap();
            let scene = seen(Media::from(volume), 1.0);
            render(&scene, &settings(kind, 8)).1
        });
        eprintln!("{kind}: {taken:?}");
        assert!(taken.iter().all(|&samples| samples < 4 * taken[0]), "{kind}: {taken:?}");
    }
}

/// A scene with any magnitude in each key.
fn any_scene(random: &mut Random) -> Scene {
    let bodies = 1 + usize::from(random.chance(0.3));
    let bodies = (0..bodies).map(|_| {
        let edge = random.magnitude();
        let center = if random.chance(0.8) { DVec3::ZERO } else { random.vector() };
        let brightest = random.magnitude().min(1e38) as f32;
        let spacing = DVec3::from_array(
            [0; 3].map(|_| edge * if random.chance(0.9) { 1.0 } else { random.magnitude() }),
        );
        let placement =
            DMat4::from_translation(center - 0.5 * spacing) * DMat4::from_scale(spacing / 6.0);
        let values =
            Array3::from_shape_fn([6; 3], |(z, y, x)| ((x * y + z) % 5) as f32 * brightest);
        let mut medium = Medium {
            density_scale: random.magnitude() / f64::from(brightest) / edge,
            albedo: DVec3::splat(random.unit()),
            phase_g: 1.8 * (random.unit() - 0.5),
            ..Medium::default()
        };
        if random.chance(0.2) {
            medium.density_scale = random.magnitude();
        }
        if random.chance(0.3) {
            medium.transfer = Some(Arc::new(preset("inferno").unwrap()));
        }
        if random.chance(0.3) {
            let (ramp, scale) = (Arc::new(preset("fire").unwrap()), random.magnitude() / edge);
            medium.emission = Some(Emission { field: None, ramp, scale });
        }
        Body { volume: Arc::new(Volume::new("any", values, placement).unwrap()), medium }
    });
    let media = Media::new(bodies.collect());
    let size = media.world_bounds().size().length();
    let mut scene = seen(media, if random.chance(0.8) { size } else { random.magnitude() });
    scene.lights[0].irradiance = DVec3::splat(random.magnitude());
    if random.chance(0.4) {
        let position = DVec3::new(0.3, 2.0, 1.0) * size;
        let position = if random.chance(0.7) { position } else { random.vector() };
        scene.lights[0].kind = LightKind::Point { position };
        if random.chance(0.7) {
            scene.lights[0].irradiance *= size * size;
        }
    }
    if random.chance(0.2) {
        scene.camera.target = random.vector();
    }
    if random.chance(0.2) {
        scene.camera.projection = Projection::Orthographic { height: random.magnitude() };
    }
    if random.chance(0.2) {
        scene.ambient = DVec3::splat(random.magnitude());
        scene.background = Some(DVec3::splat(random.magnitude()));
    }
    scene
}

#[test]
fn scenes_of_any_magnitude_give_numbers_or_one_line_within_a_bound() {
    let mut random = Random(17);
    let (mut pictures, mut most) = (0, 0);
    for seed in 0..1000 {
        let scene = any_scene(&mut random);
        let kind = if seed % 2 == 0 { MapKind::Fragments } else { MapKind::Threshold };
        let (image, samples) = render(&scene, &settings(kind, 4));
        most = samples.max(most);
        match image {
            Err(error) => assert!(!error.to_string().contains('\n'), "{seed}: {error}"),
            Ok(image) => {
                pictures += 1;
                for [r, g, b, a] in image.pixels {
                    let light = [r, g, b].iter().all(|value| (0.0..f32::MAX).contains(value));
                    assert!(light && (0.0..=1.0).contains(&a), "{seed}: {r} {g} {b} {a}");
                }
            }
        }
    }
    // With 16 rays to the light and 16 to the camera each.
    let per_ray = most / 32;
    eprintln!("{pictures} pictures, {per_ray} samples a ray");
    assert!(pictures > 500, "only {pictures} of 1000 are pictures");
    assert!(per_ray < MOST_SAMPLES, "{per_ray} samples a ray");
}

/// Samples per ray: eight per voxel length of each body, and a few batches more for every step in
/// which the light fades.
const MOST_SAMPLES: u64 = 20_000;

/// The same picture in every unit, up to 8-bit differences.
#[test]
fn lengths_are_of_any_unit() {
    for point in [false, true] {
        let picture = |unit: f64| {
            let volume = cube(12, DVec3::ZERO, unit);
            let medium = Medium { density_scale: 4.0 / unit, ..Medium::default() };
            let mut scene = seen(Media::of(volume, medium), unit);
            if point {
                let position = DVec3::new(0.4, 2.0, 0.5) * unit;
                scene.lights[0].kind = LightKind::Point { position };
                scene.lights[0].irradiance *= 4.0 * unit * unit;
            }
            render(&scene, &settings(MapKind::Fragments, 24)).0.unwrap()
        };
        let usual = picture(1.0);
        assert!(usual.pixels.iter().any(|pixel| pixel[0] > 0.2), "it shows something");
        for unit in [1e-20, 1e-11, 1e-6, 1e3, 1e11, 1e22] {
            let other = picture(unit);
            let pairs = usual.pixels.iter().flatten().zip(other.pixels.iter().flatten());
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1.0 / 255.0, "{worst} at a unit of {unit:e}");
        }
    }
}

/// Values far beyond a ramp's end emit the same as those at its end.
#[test]
fn emission_of_huge_values_is_that_at_the_ramps_end() {
    let picture = |brightest: f32| {
        let values = Array3::from_elem([6; 3], brightest);
        let placement = DMat4::from_scale(DVec3::splat(1.0 / 6.0));
        let volume = Volume::new("huge", values, placement).unwrap();
        let ramp = preset("fire").unwrap();
        let emission = Emission { field: None, ramp: Arc::new(ramp), scale: 0.5 };
        let density_scale = 1.0 / f64::from(brightest);
        let medium = Medium { density_scale, emission: Some(emission), ..Medium::default() };
        let scene = seen(Media::of(Arc::new(volume), medium), 1.0);
        render(&scene, &settings(MapKind::Fragments, 8)).0.unwrap()
    };
    let [usual, huge] = [1e6, 1e38].map(picture);
    let pairs = usual.pixels.iter().flatten().zip(huge.pixels.iter().flatten());
    let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn radiance_beyond_numbers_is_an_error_that_names_whose_it_is() {
    let cube =
        Media::of(cube(6, DVec3::ZERO, 1.0), Medium { density_scale: 3.0, ..Medium::default() });
    let mut glowing = seen(cube.clone(), 1.0);
    let emission = Emission { field: None, ramp: Arc::new(preset("fire").unwrap()), scale: 3e38 };
    glowing.media.medium_mut().emission = Some(Emission { scale: 3e38 * 4.0, ..emission.clone() });
    let mut bright = seen(cube, 1.0);
    bright.lights[0].irradiance = DVec3::splat(3.3e38);
    bright.lights.push(bright.lights[0]);
    bright.lights.push(bright.lights[0]);
    bright.lights.push(bright.lights[0]);
    bright.lights.push(bright.lights[0]);
    bright.ground = Some(Ground { height: -1.0, albedo: 1.0, half_extent: None });
    for (scene, who) in [(glowing, "emission"), (bright, "light")] {
        let (image, _) = render(&scene, &settings(MapKind::Fragments, 8));
        let error = image.err().map(|error| error.to_string());
        assert!(error.as_ref().is_some_and(|error| error.starts_with(who)), "{who}: {error:?}");
    }
}
