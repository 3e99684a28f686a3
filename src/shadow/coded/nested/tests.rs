//! Tests of nine nested knots on rays with known results, and on invalid bytes.

use super::Nested;
use crate::shadow::Node;
use crate::shadow::coded::{Codec, TexelRay};

const EXTENT: [f32; 2] = [2.0, 4.0];

fn nodes(list: &[[f32; 2]]) -> Vec<Node> {
    list.iter().map(|&[depth, optical_depth]| Node { depth, optical_depth }).collect()
}

fn coded(list: &[[f32; 2]], extent: [f32; 2]) -> [u8; 16] {
    let mut texel = [0xa5; 16];
    Nested.encode(&TexelRay { nodes: &nodes(list), extent }, &mut texel);
    texel
}

/// Depths in and around the extent, rising.
fn depths() -> impl Iterator<Item = f32> {
    (0..=3000_u16).map(|i| 1.5 + f32::from(i) * 1e-3)
}

/// Numbers without a pattern (xorshift).
fn noise(state: &mut u32) -> u32 {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    *state
}

/// A texel from fields; each word has a list of (value, bit offset).
fn packed(fields: [&[(u32, u32)]; 4]) -> [u8; 16] {
    bytemuck::cast(fields.map(|fields| {
        fields.iter().fold(0_u32, |word, &(value, shift)| word | value << shift).to_le()
    }))
}

#[test]
fn an_empty_ray_is_all_zeros_and_lets_everything_through() {
    for list in [&[][..], &[[2.5, 0.0]], &[[2.5, 0.0], [3.0, 0.0]], &[[2.5, 0.0], [3.0, 1e-5]]] {
        let texel = coded(list, EXTENT);
        assert_eq!(texel, [0; 16], "{list:?}");
        assert!(depths().all(|z| Nested.transmittance(&texel, EXTENT, z) == 1.0));
    }
}

#[test]
fn a_uniform_slab_follows_beer_lambert() {
    for (tau, most) in [(0.01, 2e-4), (0.5, 2e-3), (3.0, 8e-3), (16.0, 0.012)] {
        // Two nodes describe the same curve as many.
        let few = vec![[2.0, 0.0], [4.0, tau]];
        let many = (0..=100_u8).map(|i| f32::from(i) * 0.01).map(|x| [2.0 + 2.0 * x, tau * x]);
        for list in [few, many.collect()] {
            let texel = coded(&list, EXTENT);
            for z in depths() {
                let truth = (-tau * (z - 2.0).clamp(0.0, 2.0) * 0.5).exp();
                let found = Nested.transmittance(&texel, EXTENT, z);
                assert!((found - truth).abs() < most, "{tau} at {z}: {found}, not {truth}");
            }
        }
    }
}

#[test]
fn two_thin_steps_stay_apart() {
    let texel = coded(&[[2.4, 0.0], [2.44, 0.5], [3.4, 0.5], [3.44, 1.2]], EXTENT);
    let at = |z: f32| Nested.transmittance(&texel, EXTENT, z);
    for z in depths() {
        let truth = match z {
            z if z < 2.4 => 1.0,
            z if (2.445..3.395).contains(&z) => (-0.5_f32).exp(),
            z if z > 3.445 => (-1.2_f32).exp(),
            _ => continue,
        };
        assert!((at(z) - truth).abs() < 0.006, "at {z}: {}, not {truth}", at(z));
    }
    assert!((at(2.42) - (-0.25_f32).exp()).abs() < 0.03, "{}", at(2.42));
}

#[test]
fn in_front_of_the_medium_transmittance_is_exactly_one_and_behind_it_the_rest() {
    for front in [2.0, 2.1234, 3.3333, 3.99] {
        for back in [front, front + 0.003, 4.0] {
            for tau in [0.01, 1.0, 1e4, f32::INFINITY] {
                let texel = coded(&[[front, 0.0], [back, tau]], EXTENT);
                let at = |z: f32| Nested.transmittance(&texel, EXTENT, z);
                assert!([-9.0, 1.0, 2.0, front - 1e-5].map(at) == [1.0; 4], "{front} {back} {tau}");
                // At most one code of depth later.
                let rest = at(back + 2.0 / 1023.0 + 1e-5);
                assert!((rest - (-tau).exp()).abs() < 1.3e-4, "{front} {back} {tau}: {rest}");
                assert!([4.0, 9.0, f32::INFINITY].map(at) == [rest; 3], "{front} {back} {tau}");
            }
        }
    }
}

#[test]
fn fields_lie_where_the_table_says() {
    let texel = packed([
        &[(4095, 0), (0, 12), (1023, 22)],
        &[(51, 0), (204, 8), (51, 16), (204, 24)],
        &[(21, 0), (0, 6), (0, 13), (127, 19), (63, 26)],
        &[(42, 0), (127, 6), (63, 13), (0, 19), (0, 26)],
    ]);
    let extent = [0.0, 100.0];
    // Knot 4 at (20, .8); 2 at (4, .8 / 3), 6 at (84, .8 + .4 / 3); 1 on 0, 3 on 4, 5 on 6, 7 on 6.
    let at = |z: f32| 1.0 - Nested.transmittance(&texel, extent, z);
    let (second, sixth) = (0.8 / 3.0, 0.8 + 0.4 / 3.0);
    for (z, expected) in [
        (0.0, 0.0),
        (2.0, second * 0.5),
        (4.0, second),
        (12.0, (second + 0.8) * 0.5),
        (20.0, 0.8),
        (52.0, (0.8 + sixth) * 0.5),
        (84.0, sixth),
        (92.0, (sixth + 1.0) * 0.5),
        (100.0, 1.0),
    ] {
        assert!((at(z) - expected).abs() < 1e-5, "at {z}: {}, not {expected}", at(z));
    }
    let ends = packed([&[(1000, 0), (300, 12), (200, 22)], &[], &[], &[]]);
    let behind = 1.0 - 1000.0 / 4095.0;
    for (z, expected) in [(29.0, 1.0), (29.4, behind), (99.0, behind)] {
        assert_eq!(Nested.transmittance(&ends, extent, z), expected, "at {z}");
    }
}

#[test]
fn any_bytes_are_a_curve_that_falls_within_0_and_1() {
    let mut state = 7;
    for round in 0..400 {
        let mut texel: [u8; 16] = bytemuck::cast([(); 4].map(|()| noise(&mut state)));
        if round % 4 == 0 {
            texel = texel.map(|byte| if byte & 1 == 0 { 0 } else { 255 });
        }
        let mut before = 1.0_f32;
        for z in depths() {
            let t = Nested.transmittance(&texel, EXTENT, z);
            assert!((0.0..=1.0).contains(&t) && t <= before + 1e-6, "{texel:?} at {z}: {t}");
            before = t;
        }
        for depth in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, 3.0, f32::MAX] {
            for extent in odd_extents() {
                let t = Nested.transmittance(&texel, extent, depth);
                assert!((0.0..=1.0).contains(&t), "{texel:?} {extent:?} {depth}: {t}");
            }
        }
        assert_eq!(Nested.transmittance(&texel[..15], EXTENT, 3.0), 1.0);
    }
}

fn odd_extents() -> [[f32; 2]; 8] {
    let [inf, nan] = [f32::INFINITY, f32::NAN];
    [
        [3.0, 3.0],
        [4.0, 2.0],
        [0.0, 0.0],
        [-inf, inf],
        [nan, nan],
        [2.0, inf],
        [inf, inf],
        [2.0, nan],
    ]
}

#[test]
fn no_nodes_are_too_odd() {
    let odd = [0.0, -1.0, 2.5, 3.0, 1e30, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let mut state = 3;
    for round in 0..4000_u32 {
        let mut pick = |all: &[f32]| all[noise(&mut state) as usize % all.len()];
        let list: Vec<[f32; 2]> = (0..round % 7).map(|_| [pick(&odd), pick(&odd)]).collect();
        let extents = odd_extents();
        let extent = if round % 3 == 0 { extents[round as usize % 8] } else { EXTENT };
        let texel = coded(&list, extent);
        for depth in odd {
            let t = Nested.transmittance(&texel, extent, depth);
            assert!((0.0..=1.0).contains(&t), "{list:?} {extent:?} at {depth}: {t}");
        }
        let mut short = [9; 15];
        Nested.encode(&TexelRay { nodes: &nodes(&list), extent }, &mut short);
        assert_eq!(short, [9; 15]);
    }
}

#[test]
fn rough_rays_are_followed_closely() {
    // Some 200 slabs of noise with gaps, at three optical depths: RMS over depth.
    for (tau, most) in [(0.5, 0.004), (4.0, 0.008), (16.0, 0.01)] {
        let (mut state, mut sum, mut count) = (11, 0.0, 0.0);
        for _ in 0..40 {
            let mut smooth = 0.0_f32;
            let mut list = vec![[2.0, 0.0]];
            for i in 1..=200_u8 {
                let drawn = (noise(&mut state) >> 8) as f32 / 16_777_216.0 - 0.5;
                smooth = 0.9 * smooth + drawn;
                let before = list[list.len() - 1][1];
                list.push([2.0 + f32::from(i) * 0.01, before + smooth.max(0.0)]);
            }
            let scale = tau / list[200][1].max(1e-3);
            for node in &mut list {
                node[1] *= scale;
            }
            let texel = coded(&list, EXTENT);
            for [z, tau] in list {
                let off = Nested.transmittance(&texel, EXTENT, z) - (-tau).exp();
                sum += off * off;
                count += 1.0;
            }
        }
        let rms = (sum / count).sqrt();
        assert!(rms < most, "optical depth {tau}: {rms}");
    }
}
