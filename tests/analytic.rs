//! Tests against closed forms, of the reference and of the backends.

use deepshadow::kernel::light::face_of;
use deepshadow::math::Aabb;
use deepshadow::reference::{Cells, Extinction, TexelProfile, optical_depth};
use deepshadow::scene::{Light, LightKind, LightView, Media};
use glam::DVec3;

use crate::support::Random;
use crate::support::scenes::{unit_cube, volume};

const EVERYWHERE: [f64; 2] = [0.0, f64::INFINITY];

#[test]
fn uniform_slab_follows_beer_lambert() {
    let slab = volume([3, 5, 4], unit_cube(), |_| 0.75);
    let cells = Cells::of(&slab);
    let tau = optical_depth(&cells, DVec3::new(0.1, 3.0, -0.2), DVec3::NEG_Y, EVERYWHERE);
    assert!((tau - 0.75).abs() < 1e-10, "{tau}");
    let half = optical_depth(&cells, DVec3::new(0.1, 3.0, -0.2), DVec3::NEG_Y, [0.0, 3.1]);
    assert!((half - 0.75 * 0.6).abs() < 1e-10, "0.6 of the slab lies before distance 3.1: {half}");
}

#[test]
fn uniform_box_seen_askew_is_density_times_chord() {
    let bounds = Aabb { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(1.0, 0.5, 5.0) };
    let uniform = volume([4, 3, 7], bounds, |_| 1.25);
    let cells = Cells::of(&uniform);
    let origin = DVec3::new(-3.0, 2.0, 0.5);
    for target in
        [DVec3::new(0.3, 0.2, 3.0), DVec3::new(0.9, 0.01, 4.9), DVec3::new(-0.99, 0.4, 2.1)]
    {
        let direction = (target - origin).normalize();
        let (enter, exit) = bounds.intersect(origin, direction).unwrap();
        let tau = optical_depth(&cells, origin, direction, EVERYWHERE);
        assert!((tau - 1.25 * (exit - enter)).abs() < 1e-10, "{tau}");
    }
}

/// Density = voxel index along x, so integrals are those of a clamped linear ramp.
#[test]
fn linear_ramp_integrates_to_its_parabola() {
    let n = 8;
    let ramp = volume([n, 2, 2], unit_cube(), |[x, _, _]| x as f32);
    let cells = Cells::of(&ramp);
    let voxel = 1.0 / n as f64;
    let origin = DVec3::new(-2.0, 0.1, 0.2);
    // Index i is at world -0.5 + (i + 0.5) / n; the ramp is 0 below index 0 and 7 above 7.
    for index in [0.3, 2.0, 4.71, 7.0, 7.4] {
        let distance = 1.5 + (index + 0.5) * voxel;
        let clamped = f64::min(index, 7.0);
        let exact = (clamped * clamped / 2.0 + 7.0 * (index - clamped)) * voxel;
        let tau = optical_depth(&cells, origin, DVec3::X, [0.0, distance]);
        assert!((tau - exact).abs() < 1e-10, "to index {index}: {tau}, not {exact}");
    }
}

/// A Gaussian ball exp(-r^2 / 2 s^2): along a chord at distance b from the centre, up to t behind
/// its middle, the integral is s sqrt(pi/2) exp(-b^2 / 2 s^2) (erf(t / s sqrt 2) + 1). The
/// remaining error is that of the voxels, which falls with the square of their size.
#[test]
fn gaussian_ball_converges_to_its_erf_with_the_square_of_the_voxel_size() {
    let sigma = 0.08;
    let error = |n: usize| {
        let centre = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        let ball = volume([n; 3], unit_cube(), |index| {
            let r2: f64 = index.iter().map(|&i| centre(i).powi(2)).sum();
            (-r2 / (2.0 * sigma * sigma)).exp() as f32
        });
        let cells = Cells::of(&ball);
        let direction = DVec3::new(0.3, -1.0, 0.55).normalize();
        let across = direction.any_orthonormal_vector();
        let mut worst = 0.0_f64;
        for b in [0.0, 0.05, 0.11] {
            let chord = (std::f64::consts::PI / 2.0).sqrt() * sigma * gaussian(b / sigma);
            for t in [-0.11, -0.02, 0.04, 0.13, 0.2] {
                let origin = across * b - direction * 2.0;
                let tau = optical_depth(&cells, origin, direction, [0.0, 2.0 + t]);
                let exact = chord * (erf(t / (sigma * std::f64::consts::SQRT_2)) + 1.0);
                worst = worst.max((tau - exact).abs());
            }
        }
        worst
    };
    let errors = [32, 64, 128].map(error);
    for pair in errors.windows(2) {
        assert!((3.4..4.6).contains(&(pair[0] / pair[1])), "{errors:?} does not fall by quarters");
    }
}

fn gaussian(x: f64) -> f64 {
    (-x * x / 2.0).exp()
}

/// Maclaurin series, accurate to 1e-12 for |x| < 3.
fn erf(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for k in 1..80_i32 {
        term *= -x * x / f64::from(k);
        sum += term / f64::from(2 * k + 1);
    }
    sum * std::f64::consts::FRAC_2_SQRT_PI
}

#[test]
fn profiles_agree_with_single_integrals_for_every_kind_of_light() {
    let graded = volume([6, 5, 7], unit_cube(), |[x, y, z]| (x + 2 * y + z) as f32 / 20.0);
    let cells = Cells::of(&graded);
    let mut media = Media::from(graded.clone());
    media.medium_mut().density_scale = 3.0;
    let extinction = Extinction::of(&media);
    let kinds = [
        LightKind::Directional { direction: DVec3::new(0.4, -1.0, 0.2) },
        LightKind::Point { position: DVec3::new(0.3, 2.0, -1.1) },
    ];
    for kind in kinds {
        let light = Light::new(kind, DVec3::ONE);
        let view = LightView::of(&light, &media).unwrap()[0];
        let depths: Vec<f64> = (0..50).map(|i| f64::from(i) * 0.06).collect();
        for uv in [[0.5, 0.5], [0.21, 0.64], [0.8, 0.33]] {
            let profile = TexelProfile::trace(&extinction, &view, uv, &depths);
            let (origin, direction) = view.ray(uv[0], uv[1]);
            for (depth, found) in depths.iter().zip(&profile.transmittance) {
                let exact = (-3.0 * optical_depth(&cells, origin, direction, [0.0, *depth])).exp();
                assert!((found - exact).abs() < 1e-12, "{uv:?} at {depth}: {found}, not {exact}");
                let back = view.coordinates(origin + *depth * direction);
                if let Some(back) = back.filter(|_| *depth > 0.0) {
                    let there = DVec3::new(uv[0], uv[1], *depth);
                    assert!((back - there).length() < 1e-9, "{there} comes back as {back}");
                }
            }
        }
    }
}

/// The map touches the volume's outline on all four sides and does not extend further.
#[test]
fn light_views_fit_tightly() {
    let cube = Media::from(volume([4; 3], unit_cube(), |_| 1.0));
    for kind in [
        LightKind::Directional { direction: DVec3::new(0.2, -0.9, 0.35) },
        LightKind::Directional { direction: DVec3::NEG_Y },
        LightKind::Point { position: DVec3::new(1.0, 2.0, 0.5) },
    ] {
        let view = LightView::of(&Light::new(kind, DVec3::ONE), &cube).unwrap()[0];
        let seen = cube.world_corners().map(|c| view.coordinates(c).unwrap());
        for axis in 0..2 {
            let lo = seen.iter().map(|c| c[axis]).fold(f64::MAX, f64::min);
            let hi = seen.iter().map(|c| c[axis]).fold(f64::MIN, f64::max);
            assert!(lo.abs() < 1e-9 && (hi - 1.0).abs() < 1e-9, "{kind:?}: {lo}..{hi}");
        }
        if view.position.is_none() {
            let nearest = seen.iter().map(|c| c.z).fold(f64::MAX, f64::min);
            assert!(nearest.abs() < 1e-9, "depth 0 is the nearest corner's: {nearest}");
        }
    }
}

/// A light in the volume, or too near for one view, has views through the faces of a cube. Every
/// point lies in the map of exactly one face that covers it. A spot light has only the faces that
/// it shines through.
#[test]
fn a_light_in_or_too_near_the_volume_has_the_faces_of_a_cube() {
    let cube = Media::from(volume([4; 3], unit_cube(), |_| 1.0));
    for position in [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.0, 0.501, 0.0)] {
        let light = |kind| Light::new(kind, DVec3::ONE);
        let views = LightView::of(&light(LightKind::Point { position }), &cube).unwrap();
        assert_eq!(views.len(), 6);
        let mut random = Random(3);
        for _ in 0..2_000 {
            let point = 2.0 * DVec3::from_array([0; 3].map(|_| random.unit() - 0.5));
            let own: Vec<_> = views.iter().filter(|view| view.answers_for(point)).collect();
            assert_eq!(own.len(), 1, "{point}");
            let there = own[0].coordinates(point).unwrap();
            assert!(there.x.min(there.y) > 0.0 && there.x.max(there.y) < 1.0, "{point}: {there}");
            let (origin, direction) = own[0].ray(there.x, there.y);
            assert!((origin + there.z * direction - point).length() < 1e-9);
            let face = face_of((point - position).as_vec3());
            assert_eq!(Some(face), own[0].face, "{point}");
        }
        let spot = LightKind::Spot {
            position,
            direction: DVec3::new(0.1, -1.0, 0.0),
            cone_degrees: 10.0,
            cone_softness: 0.0,
        };
        let faces = LightView::of(&light(spot), &cube).unwrap();
        assert!(faces.len() < 6 && faces.iter().any(|view| view.face == Some(3)));
    }
}
