//! Tests of single moves of knots against brute force.

use super::*;
use crate::shadow::Node;
use crate::shadow::coded::nested::samples::largest_opacity;

/// Squared error of the polyline through `knots`, in f64.
fn error(samples: &Samples, knots: &[Knot; KNOTS]) -> f64 {
    let line = |x: f32| {
        let [a, b] = match knots.iter().position(|knot| x < knot.depth) {
            Some(0) => return 0.0,
            Some(j) => [knots[j - 1], knots[j]].map(|k| [k.depth, k.opacity].map(f64::from)),
            None => return 1.0,
        };
        a[1] + (b[1] - a[1]) * (f64::from(x) - a[0]) / (b[0] - a[0])
    };
    let off = |i: usize| f64::from(samples.opacity[i]) - line(samples.depth[i]);
    (0..COUNT).map(|i| f64::from(samples.weight[i]) * off(i) * off(i)).sum()
}

/// A ray through noise, of optical depth 2 or so.
fn rough_samples(random: &mut u32) -> Samples {
    let mut node = Node { depth: 0.1, optical_depth: 0.0 };
    let mut nodes = vec![node];
    for _ in 0..150 {
        *random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        node.depth += 0.005;
        node.optical_depth += 0.03 * (*random >> 8) as f32 / 16_777_216.0;
        nodes.push(node);
    }
    Samples::new(&nodes, [0.0, 1.0], largest_opacity(&nodes))
}

#[test]
fn knots_move_to_where_brute_force_finds_the_least_error() {
    let (mut random, mut moved) = (1, 0);
    for _ in 0..20 {
        let samples = rough_samples(&mut random);
        let at = farthest_points(&samples);
        let knots = at.map(|i| Knot { depth: samples.depth[i], opacity: samples.opacity[i] });
        for j in 0..KNOTS {
            let mut fit = Fit { samples: samples.clone(), at, knots };
            let mut sums = Sums::new();
            let (places, opacities) = match j {
                0 => {
                    fit.move_first(&mut sums);
                    (0..at[1], [0.0; 2])
                }
                LAST => {
                    fit.move_last(&mut sums);
                    (at[LAST - 1] + 1..COUNT, [1.0; 2])
                }
                _ => {
                    fit.move_inner(&mut sums, j);
                    let first = at[j].saturating_sub(FARTHEST).max(at[j - 1] + 1);
                    let end = at[j + 1].min(at[j] + FARTHEST);
                    (first..end, [knots[j - 1].opacity, knots[j + 1].opacity])
                }
            };
            let mut least = f64::INFINITY;
            for (i, k) in places.flat_map(|i| (0..=200_u8).map(move |k| (i, k))) {
                let [a, b] = opacities;
                let mut tried = knots;
                let opacity = a + (b - a) * f32::from(k) / 200.0;
                tried[j] = Knot { depth: samples.depth[i], opacity };
                least = least.min(error(&samples, &tried));
            }
            let found = error(&samples, &fit.knots);
            // A score has 17 bits beside the point's index, and gains are less than the first error
            // of a chord, which is less than all weights.
            assert!(found <= least + 2.0 * 0.5_f64.powi(17), "{j}: {found}, not {least}");
            moved += usize::from(fit.at != at);
        }
    }
    assert!(moved > 180 / 4, "{moved}: hardly a move is tested");
}
