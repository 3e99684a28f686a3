//! Chooses a transfer function from a histogram.

use glam::DVec3;

use super::{TransferFunction, TransferPoint, holds, linear_from_srgb, tidy};

/// Number of bins considered; those of finer histograms are merged.
const BINS: usize = 256;
/// Share of the bins, from the low end, in which the background is looked for.
const LOW_END: f64 = 0.4;
/// The background's peak must be at least this many times as high as the average bin.
const OUTSTANDING: f64 = 2.0;
/// The background ends where counts have fallen to this share of its peak.
const BACKGROUND_END: f64 = 0.01;
/// A valley counts as one if the counts behind it rise again by this factor.
const VALLEY: f64 = 1.5;
/// Blue, terracotta, ivory, in sRGB: distinguishable for everybody, and none of them dark.
const COLORS: [[f64; 3]; 3] = [[0.44, 0.64, 0.78], [0.85, 0.54, 0.37], [0.95, 0.92, 0.84]];
/// Opacity where each band begins and ends.
const OPACITIES: [[f64; 2]; 3] = [[0.0, 0.1], [0.15, 0.4], [0.55, 1.0]];
/// Half of the width of the transition between two bands, in widths of the narrower one.
const SOFTNESS: f64 = 0.125;

/// Chooses a transfer function for a volume from the `histogram` of its stored values: counts in
/// bins of equal width from `low` to `high`.
///
/// 1. The background is the most frequent bin of the low two fifths, if it is a peak and at least
///    twice the average bin. It ends in the valley behind it or where counts have fallen to a
///    hundredth of the peak, whichever comes first. Up to there opacity is 0.
/// 2. The rest is cut into three parts where the variance between the parts is largest (Otsu 1979,
///    on square roots of counts, so that a little bone counts beside much flesh). A cut among
///    empty bins is moved to their middle.
/// 3. The parts are soft blue, terracotta and ivory, and opacity rises throughout: to 0.1 in the
///    first, to 0.4 in the second, to 1 in the third.
///
/// If no parts can be distinguished (no bins, no counts, at most one bin with counts, nothing above
/// the background), it is a grey ramp from `low` to `high`: a step if they are equal, and a ramp
/// from 0 to 1 if they fall or are not finite in f32.
pub fn automatic(histogram: &[u64], [low, high]: [f64; 2]) -> TransferFunction {
    if !(holds(low) && holds(high) && low <= high) {
        return TransferFunction::grey([0.0, 1.0]);
    }
    let grey = || TransferFunction::grey([low, high]);
    let group = histogram.len().div_ceil(BINS).max(1);
    let sum = |bins: &[u64]| bins.iter().map(|&count| count as f64).sum();
    let counts: Vec<f64> = histogram.chunks(group).map(sum).collect();
    let start = background_end(&counts);
    let occupied = |counts: &[f64]| counts.iter().filter(|&&count| count > 0.0).count();
    if low == high || occupied(&counts) < 2 || occupied(&counts[start..]) == 0 {
        return grey();
    }
    let [first, second] = cuts(&counts[start..]).map(|cut| start as f64 + cut);
    let value = |bin: f64| {
        let share = (bin * group as f64 / histogram.len() as f64).min(1.0);
        (low + share * (high - low)).min(high)
    };
    let points = bands([start as f64, first, second, counts.len() as f64]);
    let points = points.map(|point| TransferPoint { value: value(point.value), ..point });
    let begin = TransferPoint { value: low, ..points[0] };
    let end = TransferPoint { value: high, ..points[5] };
    let points = [begin].into_iter().chain(points).chain([end]);
    TransferFunction::new(tidy(points)).unwrap_or_else(|_| grey())
}

/// Points at both ends of three bands with these edges; the inner ends are drawn back to make room
/// for transitions.
fn bands(edges: [f64; 4]) -> [TransferPoint; 6] {
    let width = |band: usize| edges[band + 1] - edges[band];
    let soft = [0.0, width(0).min(width(1)), width(1).min(width(2)), 0.0];
    std::array::from_fn(|i| {
        let (band, end) = (i / 2, i % 2);
        let edge = band + end;
        let inwards = if end == 0 { SOFTNESS } else { -SOFTNESS };
        TransferPoint {
            value: edges[edge] + inwards * soft[edge],
            color: color(band),
            opacity: OPACITIES[band][end],
        }
    })
}

fn color(band: usize) -> DVec3 {
    linear_from_srgb(COLORS[band])
}

/// The first bin above the background; 0 if there is no background.
fn background_end(counts: &[f64]) -> usize {
    let count = |bin: usize| counts[bin.min(counts.len() - 1)];
    let smooth =
        |bin: usize| (count(bin.saturating_sub(1)) + 2.0 * count(bin) + count(bin + 1)) / 4.0;
    let low_end = ((counts.len() as f64 * LOW_END) as usize).max(1).min(counts.len());
    let Some(peak) = (0..low_end).max_by(|&a, &b| smooth(a).total_cmp(&smooth(b)).then(b.cmp(&a)))
    else {
        return 0;
    };
    let top = smooth(peak);
    let average = counts.iter().sum::<f64>() / counts.len() as f64;
    let is_peak = peak + 1 >= counts.len() || top >= smooth(peak + 1);
    if !is_peak || top < OUTSTANDING * average {
        return 0;
    }
    let mut valley = peak;
    for bin in peak + 1..counts.len() {
        let here = smooth(bin);
        if here <= BACKGROUND_END * top {
            return bin;
        }
        let lowest = smooth(valley);
        if here < lowest {
            valley = bin;
        } else if lowest < 0.5 * top && here > VALLEY * lowest {
            break;
        }
    }
    // A plateau that never falls is not a background.
    if valley == peak { 0 } else { valley }
}

/// The two positions, in bins, that cut `counts` into the three most different parts; equal thirds
/// if there are too few bins.
fn cuts(counts: &[f64]) -> [f64; 2] {
    let bins = counts.len();
    let thirds = [1.0, 2.0].map(|part| part * bins as f64 / 3.0);
    if counts.iter().filter(|&&count| count > 0.0).count() < 3 {
        return thirds;
    }
    // Weight and first moment of all bins in front of each bin.
    let mut before = vec![(0.0, 0.0)];
    let (mut weight, mut moment) = (0.0, 0.0);
    for (bin, count) in counts.iter().enumerate() {
        weight += count.sqrt();
        moment += count.sqrt() * bin as f64;
        before.push((weight, moment));
    }
    // A part's share of the variance between parts, up to a constant.
    let part = |from: usize, to: usize| {
        let (weight, moment): (f64, f64) =
            (before[to].0 - before[from].0, before[to].1 - before[from].1);
        if weight > 0.0 { moment * moment / weight } else { 0.0 }
    };
    let mut best = (f64::NEG_INFINITY, thirds);
    for first in 1..bins - 1 {
        for second in first + 1..bins {
            let found = part(0, first) + part(first, second) + part(second, bins);
            if found > best.0 {
                best = (found, [first, second].map(|cut| centred(counts, cut)));
            }
        }
    }
    best.1
}

/// The middle of the run of empty bins that begins at `cut`.
fn centred(counts: &[f64], cut: usize) -> f64 {
    let empty = counts[cut..].iter().take_while(|&&count| count == 0.0).count();
    cut as f64 + 0.5 * empty as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::transfer::fault;

    /// Gaussians of (middle, width, height) in `bins` bins.
    fn modes(bins: usize, modes: &[(f64, f64, f64)]) -> Vec<u64> {
        let count = |bin: usize| {
            let at = (bin as f64 + 0.5) / bins as f64;
            let mode = |&(middle, width, height): &(f64, f64, f64)| {
                height * (-0.5 * ((at - middle) / width).powi(2)).exp()
            };
            modes.iter().map(mode).sum::<f64>() as u64
        };
        (0..bins).map(count).collect()
    }

    fn assert_good(function: &TransferFunction, range: [f64; 2]) {
        assert_eq!(fault(function.points()), None);
        assert_eq!(function.range(), range);
        assert!(function.points().is_sorted_by(|a, b| a.opacity <= b.opacity), "{function:?}");
    }

    #[test]
    fn the_background_is_clear_and_the_modes_differ() {
        // Air, two tissues, bone.
        let scan = [(0.1, 0.03, 1e6), (0.4, 0.04, 1e5), (0.6, 0.03, 6e4), (0.85, 0.03, 3e3)];
        for bins in [48, 100, 256, 1000, 4096] {
            let function = automatic(&modes(bins, &scan), [-1000.0, 3000.0]);
            assert_good(&function, [-1000.0, 3000.0]);
            let at = |share: f64| function.at(-1000.0 + 4000.0 * share);
            assert_eq!(at(0.1).1, 0.0, "{bins} bins: {function:?}");
            assert!(at(0.13).1 == 0.0 && at(0.4).1 > 0.01, "{bins} bins: {function:?}");
            for (band, mode) in [0.4, 0.6, 0.85].into_iter().enumerate() {
                assert!((at(mode).0 - color(band)).length() < 1e-12, "{bins} bins: {function:?}");
            }
        }
    }

    #[test]
    fn a_spike_of_zeros_is_a_background() {
        let mut counts = vec![1000; 64];
        counts[0] = 5_000_000;
        let function = automatic(&counts, [0.0, 64.0]);
        assert_good(&function, [0.0, 64.0]);
        assert!(function.at(1.0).1 == 0.0 && function.at(6.0).1 > 0.0, "{function:?}");
        // A mask has no values between its two.
        let mut mask = vec![0; 64];
        (mask[0], mask[63]) = (900_000, 100_000);
        assert!(automatic(&mask, [0.0, 1.0]).at(1.0).1 == 1.0);
    }

    #[test]
    fn without_a_background_nothing_is_cut_off() {
        for counts in [vec![7; 64], modes(64, &[(0.7, 0.1, 1e4)])] {
            let function = automatic(&counts, [0.0, 1.0]);
            assert_good(&function, [0.0, 1.0]);
            assert!(function.at(0.05).1 > 0.0, "{function:?}");
        }
    }

    #[test]
    fn nothing_to_tell_apart_gives_a_grey_ramp() {
        let mut single = vec![0; 64];
        single[40] = 9;
        for counts in [vec![], vec![0; 64], vec![5], single] {
            let function = automatic(&counts, [2.0, 3.0]);
            assert_eq!(function, TransferFunction::grey([2.0, 3.0]), "{counts:?}");
        }
        assert_eq!(automatic(&[1, 2, 3], [5.0, 5.0]).at(5.0).1, 1.0);
        for range in [[0.0, f64::NAN], [f64::NEG_INFINITY, 0.0], [1.0, 0.0], [0.0, 1e300]] {
            assert_eq!(automatic(&[1, 2, 3], range), TransferFunction::grey([0.0, 1.0]));
        }
    }

    #[test]
    fn any_histogram_gives_a_valid_function() {
        let mut state = 88_172_645_463_325_252_u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        for round in 0..300 {
            let bins = (random() % [5, 40, 600][round % 3]) as usize;
            let counts: Vec<u64> = (0..bins)
                .map(|_| random().checked_shr((random() % 80) as u32).unwrap_or(0))
                .collect();
            let narrow = [1e30, f64::from_bits(1e30_f64.to_bits() + 1)];
            for range in [[-3.0, 4.0], narrow, [-f64::from(f32::MAX), f64::from(f32::MAX)]] {
                assert_good(&automatic(&counts, range), range);
            }
        }
    }
}
