//! Tests of properties that every codec must have, and of its errors on simple rays.

use super::*;

const EXTENT: [f32; 2] = [2.0, 6.0];

/// Every coding: for those with a count, the smallest and the largest.
fn codings() -> Vec<Coding> {
    let usual = MapKind::all();
    let more = ["slices:2", "fourier:3", "fourier:63", "moments:6", "trigonometric:2"].into_iter();
    let more = more.chain(["trigonometric:4", "adaptive:3", "adaptive:16", "layers:1"]);
    let kinds = usual.chain(more.filter_map(|name| name.parse().ok()));
    kinds
        .filter_map(|kind| if let MapKind::Coded(coding) = kind { Some(coding) } else { None })
        .collect()
}

/// Encodes a ray, and returns its transmittance as a function of depth.
fn coded(coding: Coding, nodes: &[Node]) -> impl Fn(f32) -> f32 + use<> {
    let codec = codec(coding);
    let mut texel = vec![0; codec.stride()];
    codec.encode(&TexelRay { nodes, extent: EXTENT }, &mut texel);
    move |depth| codec.transmittance(&texel, EXTENT, depth)
}

/// Depths from before the volume to behind it.
fn depths() -> impl Iterator<Item = f32> {
    (0..=600_u16).map(|i| 1.0 + f32::from(i) * 0.01)
}

/// Largest difference from the ray's own transmittance.
fn worst(coding: Coding, nodes: &[Node]) -> f32 {
    let (found, exact) = (coded(coding, nodes), TexelRay { nodes, extent: EXTENT });
    depths().map(|z| (found(z) - exact.transmittance(z)).abs()).fold(0.0, f32::max)
}

fn node(depth: f32, optical_depth: f32) -> Node {
    Node { depth, optical_depth }
}

/// A slab of uniform medium, cut into `pieces`.
fn slab([front, back]: [f32; 2], optical_depth: f32, pieces: u16) -> Vec<Node> {
    let at = |i: u16| f32::from(i) / f32::from(pieces);
    (0..=pieces).map(|i| node(front + at(i) * (back - front), at(i) * optical_depth)).collect()
}

#[test]
fn an_empty_ray_lets_all_light_through() {
    for coding in codings() {
        let found = coded(coding, &[]);
        assert!(depths().all(|z| found(z) == 1.0), "{coding:?}");
    }
}

#[test]
fn nothing_is_dark_in_front_of_the_volume_and_all_is_behind_it() {
    for coding in codings() {
        for optical_depth in [0.01, 1.0, 5.0] {
            let found = coded(coding, &slab([2.5, 5.5], optical_depth, 50));
            assert!([f32::NEG_INFINITY, -1.0, 0.0, 2.0].map(&found) == [1.0; 4], "{coding:?}");
            for depth in [6.0, 7.0, 1e30, f32::INFINITY] {
                let error = (found(depth) - (-optical_depth).exp()).abs();
                let most =
                    if let Coding::Stochastic(n) = coding { 1.0 / f32::from(n) } else { 0.002 };
                assert!(error < most, "{coding:?}: {error} at {depth}");
            }
        }
    }
}

/// Largest allowed error of transmittance: where a uniform medium of optical depth 2 fills the ray,
/// and where one of optical depth 1 begins and ends within it.
fn bounds(coding: Coding) -> [f32; 2] {
    match coding {
        Coding::Nested => [0.007, 0.007],
        Coding::Relative => [0.0002, 0.017],
        Coding::Slices(2) => [0.08, 0.22],
        Coding::Slices(_) => [0.004, 0.033],
        Coding::FloatSlices(_) => [0.003, 0.033],
        Coding::Fourier(3) => [0.000_01, 0.056],
        Coding::Fourier(63) => [0.000_01, 0.004],
        Coding::Fourier(_) => [0.000_01, 0.031],
        // A quarter of the way between two bounds that are far apart.
        Coding::Moments(6) => [0.11, 0.075],
        Coding::Moments(_) => [0.16, 0.1],
        Coding::Trigonometric(2) => [0.3, 0.095],
        Coding::Trigonometric(3) => [0.23, 0.067],
        Coding::Trigonometric(_) => [0.19, 0.055],
        Coding::Adaptive(3) => [0.21, 0.08],
        Coding::Adaptive(16) => [0.003, 0.002],
        Coding::Adaptive(_) => [0.022, 0.008],
        Coding::Layers(1) => [0.000_2, 0.18],
        Coding::Layers(_) => [0.000_2, 0.033],
        // All that is behind the eighth of 200 and of 100 slabs is part of it.
        Coding::Peeling(_) => {
            [(-0.07_f32).exp() - (-2.0_f32).exp(), (-0.07_f32).exp() - (-1.0_f32).exp()]
        }
        // Slices at the ends are occupied in part.
        Coding::Occupancy(_) => [0.000_1, 1.0 / 58.0],
        Coding::Stochastic(n) => [1.0 / f32::from(n); 2],
    }
}

#[test]
fn uniform_slabs_are_as_near_as_stated() {
    for coding in codings() {
        let [whole, part] = bounds(coding);
        let found = worst(coding, &slab(EXTENT, 2.0, 200));
        assert!(found <= whole, "{coding:?}: {found} over the whole ray");
        let found = worst(coding, &slab([3.1, 4.9], 1.0, 100));
        assert!(found <= part, "{coding:?}: {found} in the middle");
    }
}

#[test]
fn an_opaque_surface_is_dark_behind_and_lit_in_front() {
    let nodes = [node(4.0, 0.0), node(4.0, OPAQUE_OPTICAL_DEPTH)];
    for coding in codings() {
        let found = coded(coding, &nodes);
        let coarse = matches!(coding, Coding::Fourier(_) | Coding::Layers(1) | Coding::Slices(2));
        let reach = if coarse { 2.0 } else { 0.6 };
        assert!(found(4.0 - reach) > 0.7, "{coding:?}: {} in front", found(4.0 - reach));
        assert!(found(4.0 + reach) < 0.1, "{coding:?}: {} behind", found(4.0 + reach));
        assert!(found(6.0) < 0.001, "{coding:?}: {} behind the volume", found(6.0));
    }
}

#[test]
fn two_thin_steps_keep_their_heights() {
    let nodes = [node(3.0, 0.0), node(3.0, 0.7), node(5.0, 0.7), node(5.0, 1.4)];
    for coding in codings() {
        let found = coded(coding, &nodes);
        let error = (found(4.0) - (-0.7_f32).exp()).abs();
        let most = match coding {
            Coding::Layers(1) | Coding::Adaptive(3) => 0.14,
            Coding::Stochastic(n) => 1.0 / f32::from(n),
            // None of the shares of opacity lies on the plateau.
            Coding::Relative => 0.025,
            // Half a code of six bits, of the ray's largest opacity.
            Coding::Nested => 0.5 / 63.0 * (1.0 - (-1.4_f32).exp()),
            _ => 0.003,
        };
        assert!(error <= most, "{coding:?}: {error} between the steps");
    }
}

/// Seeded random numbers.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

#[test]
fn any_bytes_are_some_transmittance() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1.0, 1e30, 1e-40, f32::MAX];
    let extents =
        [EXTENT, [0.0, 1e-30], [3.0, 3.0], [5.0, 2.0], [f32::NAN, 1.0], [0.0, f32::INFINITY]];
    let mut random = Random(7);
    for coding in codings() {
        let codec = codec(coding);
        let mut texel = vec![0; codec.stride()];
        for round in 0..400 {
            texel.fill_with(|| if round == 0 { 255 } else { random.next() as u8 });
            // Numbers that random bytes seldom give.
            for bytes in texel.as_chunks_mut::<4>().0 {
                match random.next() % 4 {
                    0 => *bytes = odd[random.next() as usize % odd.len()].to_le_bytes(),
                    1 => *bytes = (random.next() as i8 as f32 / 100.0).to_le_bytes(),
                    _ => {}
                }
            }
            for extent in extents {
                let inside = (0..8).map(|_| extent[0] + random.next() as u8 as f32 / 64.0);
                for depth in inside.chain(odd).chain(extent) {
                    let found = codec.transmittance(&texel, extent, depth);
                    assert!(
                        (0.0..=1.0).contains(&found),
                        "{coding:?}: {found} at {depth} in {extent:?}"
                    );
                    if depth <= extent[0] {
                        assert_eq!(found, 1.0, "{coding:?} in front of {extent:?}");
                    }
                }
            }
        }
    }
}

/// Counts that a coding does not allow are replaced by ones that it does.
#[test]
fn any_count_is_a_codec() {
    for n in [0, 1, 2, 5, 7, 99] {
        let all =
            [Coding::Slices(n), Coding::FloatSlices(n), Coding::Fourier(n), Coding::Moments(n)];
        let more = [Coding::Trigonometric(n), Coding::Adaptive(n), Coding::Layers(n)];
        let peeled = [Coding::Peeling(n), Coding::Occupancy(n)];
        for coding in all.into_iter().chain(more).chain(peeled) {
            let found = coded(coding, &slab(EXTENT, 1.0, 20));
            assert!((found(6.0) - (-1.0_f32).exp()).abs() < 0.002, "{coding:?}");
        }
    }
}

/// The mean over many rays of what a few random samples say is the transmittance.
#[test]
fn random_samples_are_right_on_average() {
    for optical_depth in [0.2_f32, 1.0, 3.0] {
        let found = |i: u16| {
            let begin = 2.0 + f32::from(i) * 0.001;
            let nodes = slab([begin, begin + 2.0], optical_depth, 7);
            f64::from(coded(Coding::Stochastic(2), &nodes)(begin + 1.0))
        };
        let mean = (0..2_000).map(found).sum::<f64>() / 2_000.0;
        let due = f64::from(-0.5 * optical_depth).exp();
        // Three standard deviations of a mean of 4,000 samples.
        assert!((mean - due).abs() < 3.0 * 0.5 / 4_000.0_f64.sqrt(), "{mean}, not {due}");
    }
}

/// Layers in front of the last one are exact, and the last one holds what is left.
#[test]
fn peeled_layers_are_exact_up_to_the_last() {
    let steps = [2.5, 3.0, 3.5, 4.0, 4.5_f32];
    let pair = |(i, &at): (usize, &f32)| [node(at, 0.3 * i as f32), node(at, 0.3 * (i + 1) as f32)];
    let nodes: Vec<Node> = steps.iter().enumerate().flat_map(pair).collect();
    let found = coded(Coding::Peeling(3), &nodes);
    for (depth, steps) in [(2.4, 0), (2.6, 1), (3.1, 2), (3.4, 2), (3.6, 5), (9.0, 5)] {
        let due = (-0.3 * f32::from(steps as u8)).exp();
        assert!((found(depth) - due).abs() < 1e-4, "{depth}: {}, not {due}", found(depth));
    }
}
