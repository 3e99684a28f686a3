//! The curve against its known values, and where levels are found.

use glam::{Vec3, Vec4};

use super::*;

const THRESHOLDS: Vec3 = Vec3::new(0.1, 0.5, 0.9);

fn transmittance(texel: [f32; 4], depth: f32) -> f32 {
    let depths = -(Vec3::ONE - THRESHOLDS).map(f32::ln);
    // No border in the way: the free curve.
    let curve = curve(Vec4::from(texel), THRESHOLDS, depths, [-10.0, 20.0]);
    (-optical_depth_at(&curve, depth)).exp()
}

/// A texel, and transmittances at depths.
type Case = ([f32; 4], &'static [(f32, f32)]);

/// Values of an independent implementation in f64.
#[test]
fn the_default_reconstruction_has_its_known_values() {
    let cases: [Case; 12] = [
        (
            [0.3, 0.5, 0.8, 0.95],
            &[
                (0.2, 0.997_198_5),
                (0.3, 0.9),
                (0.4, 0.712_096_9),
                (0.65, 0.230_516_55),
                (0.9, 0.066_531_92),
                (1.5, 0.05),
            ],
        ),
        ([0.5, 0.5, 0.5, 0.97], &[(0.49, 1.0), (0.51, 0.03)]),
        (
            [0.2, 0.3, 0.6, 1.0],
            &[(0.25, 0.688_616_2), (0.45, 0.218_293_2), (0.8, 0.036_935_5), (2.0, 0.000_093_779)],
        ),
        (
            [0.3, 0.5, 0.75, 0.999_994],
            &[
                (0.55, 0.384_727_18),
                (0.65, 0.201_982_17),
                (0.9, 0.036_173_994),
                (1.2, 0.005_359_516),
                (2.0, 0.000_074_016),
            ],
        ),
        ([0.3, 0.5, 0.6, 0.8], &[(0.4, 0.704_113_8), (0.55, 0.404_151_97), (0.7, 0.226_927_03)]),
        (
            [0.3, 0.5, 0.4, 0.6],
            &[(0.2, 0.991_513_4), (0.35, 0.808_051_4), (0.45, 0.596_777_2), (0.55, 0.432_624_27)],
        ),
        ([0.31, 0.37, 0.54, 0.94], &[(0.45, 0.240_091_1), (0.57, 0.075_362_2)]),
        ([0.31, 0.37, 0.54, 0.993], &[(0.45, 0.234_691_12), (0.6, 0.056_421_09)]),
        ([0.3, 0.4, 0.5, 0.4], &[(0.25, 0.929_611_8), (0.35, 0.857_528_3), (0.6, 0.600_009_5)]),
        ([0.4, 0.3, 0.5, 0.2], &[(0.35, 0.942_909), (0.45, 0.866_534_4)]),
        ([0.5, 0.3, 0.4, 0.12], &[(0.35, 0.965_722_5), (0.45, 0.921_108_85)]),
        ([0.3, 0.4, 0.5, 5e-7], &[(0.1, 1.0), (9.0, 1.0)]),
    ];
    for (texel, values) in cases {
        for &(depth, expected) in values {
            let found = transmittance(texel, depth);
            assert!(
                (found - expected).abs() < 2e-6,
                "{texel:?} at {depth}: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn an_even_medium_that_ends_in_the_dark_is_straight_behind_its_second_depth() {
    let depths = -(Vec3::ONE - THRESHOLDS).map(f32::ln);
    for tau in [0.7_f32, 1.5, 2.3, 4.0, 9.0] {
        let found = transmittance((0.5 + 0.1 * depths).extend(1.0).to_array(), 0.5 + 0.1 * tau);
        assert!((found - (-tau).exp()).abs() < 1e-5, "{found} at {tau}");
    }
}

#[test]
fn levels_are_found_where_extinction_that_changes_evenly_says() {
    for s in [0.0, 0.125, 0.5, 0.9, 1.0_f32] {
        let tau = 7.0 + 0.3 * s + 0.2 * s * s;
        let found = crossing_depth(0, [5.0, 7.0], tau, [7.0, 7.5], 0.4);
        assert!((found - (5.0 + 2.0 * s)).abs() < 1e-5, "{found} at {s}");
    }
    // No more bent than a front that begins with the step.
    assert_eq!(crossing_depth(0, [0.0, 1.0], 0.25, [0.0, 1.0], 9.0), 0.5);
    assert_eq!(crossing_depth(0, [0.0, 1.0], 0.0, [0.0, 1.0], 2.0), 0.0);
    assert_eq!(crossing_depth(0, [0.0, 1.0], 0.3, [0.0, 1.0], 0.0), 0.3);
}

#[test]
fn the_default_reconstruction_falls_from_one_to_the_rest_and_never_rises() {
    for step in 0..=200_u8 {
        let a = f32::from(step) / 200.0;
        // Depths in the order of their levels, with an equal pair now and then.
        let wanted = levels(a, THRESHOLDS);
        let rank = |level: f32| (level * 10.0).round() / 8.0;
        let texel = [rank(wanted.x), rank(wanted.y), rank(wanted.z), a];
        let mut before = 1.0;
        for i in 0..=1000_u16 {
            let t = transmittance(texel, f32::from(i) / 250.0 - 0.5);
            assert!(
                (0.0..=1.0).contains(&t) && t <= before + 3e-7,
                "{texel:?} at step {i}: {before} then {t}"
            );
            before = t;
        }
        let rest = (1.0 - a).max((-LARGEST_OPTICAL_DEPTH).exp());
        assert!((transmittance(texel, 1e3) - rest).abs() < 1e-6, "{texel:?}");
        assert!((transmittance(texel, -1e3) - 1.0).abs() < 1e-6, "{texel:?}");
    }
}
