//! Linear values as bytes of sRGB, without a power for each: a byte is the number of steps of the
//! transfer curve that a value has reached, and steps are few.

use std::sync::LazyLock;

use super::srgb_from_linear;

/// Values below 1 from which on a byte is found by one or two comparisons.
const BINS: usize = 4096;

/// The steps of the curve.
struct Steps {
    /// The smallest values that become 1, 2, ..., 255.
    first: [f32; 255],
    /// The byte of the lower end of each bin.
    bins: [u8; BINS],
}

static STEPS: LazyLock<Steps> = LazyLock::new(|| {
    // Floats above 0 have the order of their bits.
    let mut first = [0.0; 255];
    let mut low = 0;
    for (below, first) in first.iter_mut().enumerate() {
        let mut high = 1.0_f32.to_bits();
        while low < high {
            let middle = low + (high - low) / 2;
            if usize::from(rounded(f32::from_bits(middle))) > below {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        *first = f32::from_bits(low);
    }
    let lower = |bin: usize| bin as f32 / BINS as f32;
    let bins = std::array::from_fn(|bin| rounded(lower(bin)));
    Steps { first, bins }
});

/// The byte of a linear value by the curve itself.
fn rounded(linear: f32) -> u8 {
    (srgb_from_linear(linear) * 255.0).round() as u8
}

/// The byte of a linear value: 0 for those below 0 and for NaN, 255 for those from 1 on.
pub(super) fn byte(linear: f32) -> u8 {
    if linear >= 1.0 {
        return 255;
    }
    let steps = &*STEPS;
    // NaN and values below 0 become bin 0.
    let mut byte = steps.bins[(linear * BINS as f32) as usize];
    while let Some(next) = steps.first.get(usize::from(byte)) {
        if linear >= *next {
            byte += 1;
        } else {
            break;
        }
    }
    byte
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_is_the_rounded_curve() {
        for first in STEPS.first {
            for away in -4..=4_i32 {
                let value = f32::from_bits(first.to_bits().wrapping_add_signed(away));
                assert_eq!(byte(value), rounded(value), "{value}");
            }
        }
        for i in 0..2_000_000_u32 {
            let value = f64::from(i) / 1_999_999.0 * 1.01 - 0.005;
            assert_eq!(byte(value as f32), rounded(value as f32), "{value}");
        }
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e-40, f32::MAX];
        assert_eq!(odd.map(byte), odd.map(rounded));
    }
}
