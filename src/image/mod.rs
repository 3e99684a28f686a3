//! Linear RGBA images, and their conversion for screens. Knows no file format.

mod screen8;
mod tone;

use glam::Vec3;

use crate::parallel;
pub use tone::{Exposure, Tone, ToneMap};

/// Pixels that a thread converts at once.
const PART: usize = 1 << 14;

/// An image in linear light, f32, row 0 on top. RGB is premultiplied by alpha where alpha is below
/// 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels, row by row: radiance R, G, B and opacity A, which is 0..1.
    pub pixels: Vec<[f32; 4]>,
}

impl Image {
    /// An image in which every pixel is `pixel`.
    pub fn filled(width: u32, height: u32, pixel: [f32; 4]) -> Self {
        Self { width, height, pixels: vec![pixel; width as usize * height as usize] }
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// If `x` or `y` is outside the image.
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 4] {
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// The image for a screen: colours through `tone` (a number is an exposure), sRGB-encoded, 8 bits
    /// per channel, RGBA row by row, with alpha no longer premultiplied.
    pub fn to_srgb8(&self, tone: impl Into<Tone>) -> Vec<u8> {
        let alpha = |alpha: f32| (alpha * 255.0).round() as u8;
        self.screen(tone.into(), screen8::byte, alpha)
    }

    /// The same with 16 bits per channel.
    pub fn to_srgb16(&self, tone: impl Into<Tone>) -> Vec<u16> {
        let word = |value: f32| (value * 65535.0).round() as u16;
        self.screen(tone.into(), |linear| word(srgb_from_linear(linear)), word)
    }

    /// The straight pixels for a screen: linear colours as `encoded` has them, and alpha, 0..1, as
    /// `alpha` has it.
    fn screen<T: Copy + Send>(
        &self,
        tone: Tone,
        encoded: impl Fn(f32) -> T + Sync,
        alpha: impl Fn(f32) -> T + Sync,
    ) -> Vec<T> {
        let shown = |&[r, g, b, a]: &[f32; 4]| {
            let straight = if a > 0.0 { 1.0 / a.min(1.0) } else { 0.0 };
            let shown = tone.shown(Vec3::new(r, g, b) * straight);
            let [r, g, b] = shown.to_array().map(&encoded);
            // NaN counts as 0.
            [r, g, b, alpha(if a > 0.0 { a.min(1.0) } else { 0.0 })]
        };
        let parts = parallel::map(self.pixels.chunks(PART), |part| {
            part.iter().flat_map(shown).collect::<Vec<T>>()
        });
        parts.concat()
    }

    /// The image in front of black, opaque everywhere.
    #[must_use]
    pub fn over_black(&self) -> Self {
        let pixels = self.pixels.iter().map(|&[r, g, b, _]| [r, g, b, 1.0]).collect();
        Self { pixels, ..*self }
    }

    /// Whether no pixel lets anything through, as far as an alpha of `bits` bits can tell (32 for
    /// floats).
    pub fn is_opaque(&self, bits: u32) -> bool {
        let steps = if bits < 32 { f64::exp2(f64::from(bits)) - 1.0 } else { f64::INFINITY };
        let least = (1.0 - 0.5 / steps) as f32;
        self.pixels.iter().all(|pixel| pixel[3] >= least)
    }
}

/// The share of lit pixels whose radiance is below that to which errors and tolerances of a picture
/// are relative.
pub(crate) const BRIGHT: f64 = 0.999;

/// The value below which a share of all those above 0 lie; 0 if there are none.
pub(crate) fn lit_percentile(values: impl Iterator<Item = f32>, share: f64) -> f32 {
    let mut lit: Vec<f32> = values.filter(|&value| value > 0.0).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let rank = ((lit.len() - 1) as f64 * share).round() as usize;
    *lit.select_nth_unstable_by(rank, f32::total_cmp).1
}

/// The sRGB transfer curve (IEC 61966-2-1), which encodes a linear value to 0..1. Values outside
/// 0..1 are clamped; NaN becomes 0.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.003_130_8 {
        c * 12.92
    } else if c.is_nan() {
        0.0
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of the sRGB transfer curve, for encoded values in 0..1.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}
