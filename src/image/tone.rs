//! From linear radiance to what a screen can show: exposure, then a tone curve. Both are for files
//! encoded for screens only. Knows no file format.

use std::fmt;
use std::str::FromStr;

use glam::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

use super::{Image, lit_percentile};
use crate::error::{Error, Result};
use crate::math::three_digits;

/// Published curves that bring radiance above 1 into what a screen can show. Colours are linear,
/// with the primaries of sRGB, before and after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[non_exhaustive]
pub enum ToneMap {
    /// `none`: radiance up to 1 stays as it is, and what is above becomes 1.
    #[default]
    None,
    /// `aces`: Stephen Hill's fit of ACES 1's reference and output transforms (RRT and the ODT for
    /// sRGB), as published in MJP's BakingLab, `ACES.hlsl`, without its factor on exposure.
    Aces,
    /// `agx`: Troy Sobotka's AgX with primaries of Rec. 2020 as in Blender 4, its default look, in
    /// the form that Filament published (`ToneMapper.cpp`, pull request 7236) with Benjamin
    /// Wrensch's polynomial for the curve ("Minimal AgX Implementation").
    Agx,
    /// `khronos-neutral`: the Khronos PBR Neutral Tone Mapper, whose specification is in the
    /// repository KhronosGroup/ToneMapping. Colours up to 0.8 keep their hue and saturation.
    KhronosNeutral,
}

impl ToneMap {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::None, Self::Aces, Self::Agx, Self::KhronosNeutral];

    /// The name on the command line and in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Aces => "aces",
            Self::Agx => "agx",
            Self::KhronosNeutral => "khronos-neutral",
        }
    }

    /// The curve's colour for a linear colour without negative components, each in 0..1 but for
    /// `none`, which changes nothing.
    pub fn apply(self, color: Vec3) -> Vec3 {
        match self {
            Self::None => color,
            Self::Aces => aces(color),
            Self::Agx => agx(color),
            Self::KhronosNeutral => khronos_neutral(color),
        }
    }
}

impl FromStr for ToneMap {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|one| one.name() == text).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::value("tonemap", format!("'{text}' is not one of {names}"))
        })
    }
}

fn aces(color: Vec3) -> Vec3 {
    // Both matrices row by row: from sRGB to the space of the fit, and back.
    const IN: [f32; 9] =
        [0.59719, 0.35458, 0.04823, 0.07600, 0.90834, 0.01566, 0.02840, 0.13383, 0.83777];
    const OUT: [f32; 9] =
        [1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602];
    // Beyond f32's square root the quotient below would be infinite; it is at its limit by then.
    let v = (rows(&IN) * color).min(Vec3::splat(1e9));
    let fit =
        (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    saturated(rows(&OUT) * fit)
}

fn agx(color: Vec3) -> Vec3 {
    const REC2020_FROM_SRGB: [f32; 9] =
        [0.6274, 0.3293, 0.0433, 0.0691, 0.9195, 0.0113, 0.0164, 0.0880, 0.8956];
    const SRGB_FROM_REC2020: [f32; 9] =
        [1.6605, -0.5876, -0.0728, -0.1246, 1.1329, -0.0083, -0.0182, -0.1006, 1.1187];
    const INSET: [f32; 9] = [
        0.856_627_15,
        0.095_121_24,
        0.048_251_606,
        0.137_318_97,
        0.761_242,
        0.101_439_04,
        0.111_898_21,
        0.076_799_42,
        0.811_302_4,
    ];
    const OUTSET: [f32; 9] = [
        1.127_100_6,
        -0.110_606_64,
        -0.016_493_939,
        -0.141_329_76,
        1.157_823_7,
        -0.016_493_939,
        -0.141_329_76,
        -0.110_606_64,
        1.251_936_4,
    ];
    /// Stops of radiance: 10 below and 6.5 above a grey of 0.18.
    const STOPS: [f32; 2] = [-12.473_93, 4.026_069];
    let inset = rows(&INSET) * (rows(&REC2020_FROM_SRGB) * color);
    let stops = inset.max(Vec3::splat(1e-10)).map(f32::log2);
    let x = saturated((stops - STOPS[0]) / (STOPS[1] - STOPS[0]));
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve =
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
            - 0.00232;
    let display = (rows(&OUTSET) * curve).max(Vec3::ZERO);
    saturated(rows(&SRGB_FROM_REC2020) * display.powf(2.2))
}

fn khronos_neutral(color: Vec3) -> Vec3 {
    /// Reflection of a usual surface, which is taken off.
    const F90: f32 = 0.04;
    const START: f32 = 0.8 - F90;
    const DESATURATION: f32 = 0.15;
    let least = color.min_element();
    let offset = if least <= 2.0 * F90 { least - least * least / (4.0 * F90) } else { F90 };
    let color = color - offset;
    let peak = color.max_element();
    if peak <= START {
        return color;
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + room - START);
    let kept = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    // Rounding may exceed 1.
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), 1.0 - kept).min(Vec3::ONE)
}

/// A matrix from its rows.
fn rows(rows: &[f32; 9]) -> Mat3 {
    Mat3::from_cols_array(rows).transpose()
}

fn saturated(color: Vec3) -> Vec3 {
    color.clamp(Vec3::ZERO, Vec3::ONE)
}

/// What radiance is multiplied by before a picture is encoded for screens.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Exposure {
    /// A factor above 0.
    Factor(f64),
    /// Chosen from the picture by [`Image::auto_exposure`].
    Auto,
}

impl Default for Exposure {
    fn default() -> Self {
        Self::Factor(1.0)
    }
}

/// Parses `2.5` (a factor), `+1.5ev` (stops: each doubles) or `auto`.
impl FromStr for Exposure {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let word = text.trim();
        if word.eq_ignore_ascii_case("auto") {
            return Ok(Self::Auto);
        }
        let lower = word.to_ascii_lowercase();
        let factor = match lower.strip_suffix("ev") {
            Some(stops) => stops.trim_end().parse().map(f64::exp2),
            None => lower.parse(),
        };
        let is_factor = |factor: &f64| *factor > 1e-30 && *factor < 1e30;
        factor.ok().filter(is_factor).map(Self::Factor).ok_or_else(|| {
            let why = format!("'{text}' is not a factor above 0, stops such as +1.5ev, or auto");
            Error::value("exposure", why)
        })
    }
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Factor(factor) => factor.fmt(f),
            Self::Auto => f.write_str("auto"),
        }
    }
}

/// How a picture is shown on a screen.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct Tone {
    /// Factor on radiance, above 0.
    pub exposure: f32,
    /// The curve that it goes through after that.
    pub map: ToneMap,
}

impl Tone {
    /// With this factor and curve.
    pub fn new(exposure: f32, map: ToneMap) -> Self {
        Self { exposure, map }
    }

    /// With an exposure and a curve for `image`. Where no curve is given it is `none`, or `agx` if
    /// a screen would visibly lose detail of the picture: a curve that keeps the middle greys of
    /// what is within a screen's range, and detail up to 16 times white.
    pub fn for_picture(image: &Image, exposure: Exposure, map: Option<ToneMap>) -> Self {
        let factor = match exposure {
            Exposure::Factor(factor) => factor,
            Exposure::Auto => image.auto_exposure(),
        };
        let chosen = || if image.is_cut_off(factor) { ToneMap::Agx } else { ToneMap::None };
        Self::new(factor as f32, map.unwrap_or_else(chosen))
    }

    /// The colour on a screen, linear, of a colour that is not premultiplied.
    pub(super) fn shown(self, color: Vec3) -> Vec3 {
        if self.map == ToneMap::None {
            return color * self.exposure;
        }
        // NaN counts as 0, and infinity as a large number, with which curves can compute.
        let exposed = color * self.exposure;
        self.map.apply(exposed.map(|c| if c > 0.0 { c.min(1e30) } else { 0.0 }))
    }
}

/// With a factor on radiance and no curve.
impl From<f32> for Tone {
    fn from(exposure: f32) -> Self {
        Self::new(exposure, ToneMap::None)
    }
}

/// Where automatic exposure puts the brightest hundredth of a picture.
const WHITE: f64 = 0.9;
/// Share of the pixels with light that automatic exposure leaves below [`WHITE`].
const SHARE: f64 = 0.99;
/// Share of a picture's pixels that may be above 1 without anybody missing them.
const LOST: f64 = 1.0 / 500.0;
/// Straight radiance above white that is not missed of transparent pixels: lit media under a sky are
/// about so bright, and behind a curve they would not match the same picture with a background.
const WISPS: f32 = 1.15;
/// Radiance above 1 that counts as lost; up to this a screen's white is right to 8 bits.
const VISIBLY_ABOVE: f32 = 1.01;

impl Image {
    /// The exposure, to three digits, at which the 99th percentile of the pixels' largest channels
    /// is 0.9, among pixels that have any light. Alpha counts as what it covers. 1 for a black
    /// picture. The same picture always has the same exposure.
    pub fn auto_exposure(&self) -> f64 {
        let bright = lit_percentile(self.largest().filter(|c| c.is_finite()), SHARE);
        if bright == 0.0 {
            return 1.0;
        }
        three_digits(WHITE / f64::from(bright)).clamp(1e-30, 1e30)
    }

    /// Whether a screen would visibly lose detail of the picture at this exposure without a tone
    /// curve: whether more than one pixel in 500 has a channel above 1.
    pub fn is_cut_off(&self, exposure: f64) -> bool {
        let exposure = exposure as f32;
        let is_lost = |&[r, g, b, a]: &[f32; 4]| {
            // What is seen of a transparent pixel is premultiplied, and something else shines
            // through it.
            let covered = if a > 0.0 { a.min(1.0) } else { 0.0 };
            let white = if covered < 1.0 { WISPS * covered } else { 1.0 };
            covered > 0.0 && r.max(g).max(b) * exposure > white + VISIBLY_ABOVE - 1.0
        };
        let lost = self.pixels.iter().filter(|pixel| is_lost(pixel)).count();
        lost as f64 > self.pixels.len() as f64 * LOST
    }

    /// The largest channel of every pixel, not premultiplied.
    fn largest(&self) -> impl Iterator<Item = f32> {
        self.pixels.iter().map(
            |&[r, g, b, a]| {
                if a > 0.0 { r.max(g).max(b) / a.min(1.0) } else { 0.0 }
            },
        )
    }
}
