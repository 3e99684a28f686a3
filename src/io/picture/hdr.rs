//! Writes pictures as Radiance's RGBE (`.hdr`): linear radiance in three mantissas of 8 bits and
//! one exponent a pixel, runs packed. The format is described in Greg Ward, "Real Pixels", Graphics
//! Gems II (1991), and in Radiance's documentation of its file formats.

use crate::image::Image;

/// Widths whose rows are packed; others are written pixel by pixel.
const PACKED_WIDTHS: std::ops::RangeInclusive<u32> = 8..=0x7fff;
/// The longest pieces of a packed row.
const LONGEST_RUN: usize = 127;
const LONGEST_LITERAL: usize = 128;
/// The shortest run that is worth its two bytes in the middle of others.
const SHORTEST_RUN: usize = 4;

/// Encodes the picture in front of black. Rounding to the common exponent errs by at most 1/256 of
/// a pixel's largest channel.
pub(super) fn encode(image: &Image) -> Vec<u8> {
    let [width, height] = [image.width, image.height];
    let mut bytes = format!(
        "#?RADIANCE\nSOFTWARE=deepshadow {}\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n",
        env!("CARGO_PKG_VERSION")
    )
    .into_bytes();
    for row in image.pixels.chunks(width.max(1) as usize) {
        let pixels: Vec<[u8; 4]> = row.iter().map(|&[r, g, b, _]| rgbe([r, g, b])).collect();
        if !PACKED_WIDTHS.contains(&width) {
            bytes.extend_from_slice(pixels.as_flattened());
            continue;
        }
        bytes.extend([2, 2, (width >> 8) as u8, width as u8]);
        for channel in 0..4 {
            let values: Vec<u8> = pixels.iter().map(|pixel| pixel[channel]).collect();
            pack(&values, &mut bytes);
        }
    }
    bytes
}

/// A colour with a common exponent: a channel is its byte times 2^(e - 136).
fn rgbe(rgb: [f32; 3]) -> [u8; 4] {
    // Largest and smallest exponents are e = 255 and e = 1. NaN counts as 0.
    let rgb = rgb.map(|c| f64::from(c.max(0.0)));
    let largest = rgb.into_iter().fold(0.0, f64::max).min(255.0 * f64::exp2(119.0));
    if largest < f64::exp2(-128.0) {
        return [0; 4];
    }
    let mut exponent = largest.log2().floor() as i32 + 1;
    // Rounding up may take one bit more, and a logarithm may err at powers of two.
    if (largest * f64::exp2(f64::from(8 - exponent))).round() > 255.0 {
        exponent += 1;
    }
    let scale = f64::exp2(f64::from(8 - exponent));
    let [r, g, b] = rgb.map(|c| (c * scale).round() as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// Packs one channel of a row: a count above 128 repeats the next byte that many times less 128;
/// another count is followed by so many bytes.
fn pack(values: &[u8], bytes: &mut Vec<u8>) {
    let run_at = |at: usize| {
        let rest = &values[at..];
        rest.iter().take(LONGEST_RUN).take_while(|&value| *value == rest[0]).count()
    };
    let mut at = 0;
    while at < values.len() {
        let run = run_at(at);
        if run >= SHORTEST_RUN {
            bytes.extend([128 + run as u8, values[at]]);
            at += run;
            continue;
        }
        let begin = at;
        while at < values.len() && at - begin < LONGEST_LITERAL && run_at(at) < SHORTEST_RUN {
            at += 1;
        }
        bytes.push((at - begin) as u8);
        bytes.extend_from_slice(&values[begin..at]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded([r, g, b, e]: [u8; 4]) -> [f64; 3] {
        [r, g, b].map(|m| f64::from(m) * f64::exp2(f64::from(e) - 136.0))
    }

    #[test]
    fn a_colour_keeps_eight_bits_of_its_largest_channel() {
        let mut values = vec![1e-30, 0.1, 0.999, 1.0, 1.001, 255.4, 255.6, 3e38, 1e20];
        values.extend((0..500).map(|i| f32::powf(1.37, (i - 250) as f32 * 0.7)));
        for largest in values {
            let rgb = [largest * 0.3, largest, 0.0];
            for (c, found) in decoded(rgbe(rgb)).into_iter().enumerate() {
                let error = (found - f64::from(rgb[c])).abs();
                // Half of the last of at least 128 steps; the largest numbers are cut.
                let bound = f64::from(largest) / 256.0;
                assert!(error <= bound || largest > 1.6e38, "{rgb:?}: {found}");
            }
        }
        assert_eq!(decoded(rgbe([1.0, 0.5, 0.25])), [1.0, 0.5, 0.25]);
        assert_eq!(rgbe([0.0, f32::NAN, -3.0]), [0; 4]);
        assert_eq!(rgbe([1e-40; 3]), [0; 4]);
        assert_eq!(rgbe([f32::INFINITY, 0.0, 0.0])[3], 255);
    }

    #[test]
    fn packed_rows_unpack_to_themselves() {
        let mut row: Vec<u8> = (0..700_u32).map(|i| (i * i / 50 % 7) as u8).collect();
        row.extend([9; 400]);
        row.extend((0..=255).chain(0..=255));
        row.extend([1, 1, 1, 2, 2, 3]);
        for end in [1, 8, 130, 700, 1100, row.len()] {
            let mut packed = Vec::new();
            pack(&row[..end], &mut packed);
            let mut rest = &packed[..];
            let mut unpacked = Vec::new();
            while let [count, tail @ ..] = rest {
                let count = usize::from(*count);
                if count > 128 {
                    unpacked.extend(std::iter::repeat_n(tail[0], count - 128));
                    rest = &tail[1..];
                } else {
                    unpacked.extend_from_slice(&tail[..count]);
                    rest = &tail[count..];
                }
            }
            assert_eq!(unpacked, row[..end], "{end}");
        }
    }
}
