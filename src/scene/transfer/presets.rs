//! Named transfer functions over 0..1.

use glam::DVec3;

use super::{TransferFunction, TransferPoint, linear_from_srgb};
use crate::error::{Error, Result};

/// Name and description of every preset.
pub const PRESETS: [(&str, &str); 14] = [
    ("grey", "white, opacity rising evenly"),
    ("smoke", "soft dark grey, thin where it begins"),
    ("cloud", "white, opaque early"),
    ("fire", "from soot through red, orange and yellow to white"),
    ("bone", "CT: bones only, ivory"),
    ("tissue", "CT: translucent skin and muscles around ivory bones"),
    ("skin", "CT: what a body looks like from outside"),
    ("viridis", "matplotlib's viridis, opacity rising evenly"),
    ("plasma", "matplotlib's plasma, opacity rising evenly"),
    ("inferno", "matplotlib's inferno, opacity rising evenly"),
    ("magma", "matplotlib's magma, opacity rising evenly"),
    ("turbo", "Google's turbo rainbow, opacity rising evenly"),
    ("coolwarm", "Moreland's blue to red, opacity rising evenly"),
    ("stained-glass", "five saturated colours with sharp borders"),
];

/// The preset called `name`, over 0..1.
///
/// # Errors
/// If there is none of this name; the error lists all names.
pub fn preset(name: &str) -> Result<TransferFunction> {
    let points = match name {
        "grey" => listed(&[(0.0, 0x00ff_ffff, 0.0), (1.0, 0x00ff_ffff, 1.0)]),
        "smoke" => listed(&SMOKE),
        "cloud" => listed(&CLOUD),
        "fire" => listed(&FIRE),
        "bone" => listed(&BONE),
        "tissue" => listed(&TISSUE),
        "skin" => listed(&SKIN),
        "viridis" => sampled(&VIRIDIS),
        "plasma" => sampled(&PLASMA),
        "inferno" => sampled(&INFERNO),
        "magma" => sampled(&MAGMA),
        "turbo" => sampled(&TURBO),
        "coolwarm" => sampled(&COOLWARM),
        "stained-glass" => banded(&GLASS),
        _ => {
            let names = PRESETS.map(|(name, _)| name).join(", ");
            let why = format!("no preset '{}'; the presets are {names}", name.escape_debug());
            return Err(Error::value("transfer function", why));
        }
    };
    TransferFunction::new(points)
}

/// The preset called `name` over Hounsfield units (water 0, air -1000, soft tissue 0 to 80, bone
/// from 150 to 300 up); `None` if that preset does not use them.
pub fn over_hounsfield(name: &str) -> Option<TransferFunction> {
    let points = match name {
        "bone" => listed(&BONE_HU),
        "tissue" => listed(&TISSUE_HU),
        "skin" => listed(&SKIN_HU),
        _ => return None,
    };
    TransferFunction::new(points).ok()
}

/// (value, sRGB as 0xrrggbb, opacity)
type Row = (f64, u32, f64);

/// Linear albedo falls from 0.6 to 0.36.
const SMOKE: [Row; 4] = [
    (0.0, 0x00cb_cbcd, 0.0),
    (0.15, 0x00c4_c3c5, 0.04),
    (0.5, 0x00b5_b3b4, 0.35),
    (1.0, 0x00a4_a1a0, 1.0),
];

const CLOUD: [Row; 5] = [
    (0.0, 0x00ff_ffff, 0.0),
    (0.03, 0x00ff_ffff, 0.0),
    (0.12, 0x00ff_ffff, 0.4),
    (0.35, 0x00ff_ffff, 0.8),
    (1.0, 0x00ff_ffff, 1.0),
];

const FIRE: [Row; 7] = [
    (0.0, 0x0000_0000, 0.0),
    (0.12, 0x0038_0a04, 0.02),
    (0.3, 0x00b4_1a05, 0.15),
    (0.5, 0x00f2_5c05, 0.35),
    (0.7, 0x00ff_b21a, 0.6),
    (0.88, 0x00ff_e98a, 0.85),
    (1.0, 0x00ff_fff0, 1.0),
];

const BONE: [Row; 5] = [
    (0.0, 0x00d8_c3a5, 0.0),
    (0.35, 0x00d8_c3a5, 0.0),
    (0.45, 0x00e3_d2b5, 0.25),
    (0.6, 0x00f0_e6d0, 0.7),
    (1.0, 0x00fb_f6ea, 1.0),
];

/// Skin, fat, muscle, bone.
const TISSUE: [Row; 9] = [
    (0.0, 0x00e3_b08f, 0.0),
    (0.12, 0x00e3_b08f, 0.0),
    (0.15, 0x00e3_b08f, 0.04),
    (0.19, 0x00e8_c98a, 0.02),
    (0.23, 0x00b8_4c3e, 0.04),
    (0.33, 0x00a8_3a32, 0.08),
    (0.37, 0x00e0_c3a0, 0.25),
    (0.48, 0x00ee_e3cc, 0.75),
    (1.0, 0x00fb_f6ea, 1.0),
];

const SKIN: [Row; 5] = [
    (0.0, 0x00e3_b08f, 0.0),
    (0.12, 0x00e3_b08f, 0.0),
    (0.18, 0x00e3_b08f, 0.5),
    (0.24, 0x00e8_bb9c, 1.0),
    (1.0, 0x00e8_bb9c, 1.0),
];

const BONE_HU: [Row; 5] = [
    (150.0, 0x00d8_c3a5, 0.0),
    (300.0, 0x00e3_d2b5, 0.3),
    (600.0, 0x00f0_e6d0, 0.7),
    (1500.0, 0x00fb_f6ea, 1.0),
    (3000.0, 0x00fb_f6ea, 1.0),
];

/// Skin, fat, muscle, bone.
const TISSUE_HU: [Row; 9] = [
    (-400.0, 0x00e3_b08f, 0.0),
    (-250.0, 0x00e3_b08f, 0.04),
    (-110.0, 0x00e8_c98a, 0.02),
    (-20.0, 0x00b8_4c3e, 0.03),
    (40.0, 0x00b0_4036, 0.05),
    (80.0, 0x00a8_3a32, 0.08),
    (150.0, 0x00d8_b494, 0.12),
    (300.0, 0x00ee_e3cc, 0.7),
    (1500.0, 0x00fb_f6ea, 1.0),
];

const SKIN_HU: [Row; 4] = [
    (-500.0, 0x00e3_b08f, 0.0),
    (-300.0, 0x00e3_b08f, 0.4),
    (-100.0, 0x00e8_bb9c, 1.0),
    (3000.0, 0x00e8_bb9c, 1.0),
];

// Samples of the published maps at equal distances, in sRGB.

const VIRIDIS: [u32; 9] = [
    0x0044_0154,
    0x0047_2d7b,
    0x003b_528b,
    0x002c_728e,
    0x0021_918c,
    0x0028_ae80,
    0x005e_c962,
    0x00ad_dc30,
    0x00fd_e725,
];

const PLASMA: [u32; 9] = [
    0x000d_0887,
    0x004c_02a1,
    0x007e_03a8,
    0x00aa_2395,
    0x00cc_4778,
    0x00e6_6c5c,
    0x00f8_9540,
    0x00fd_c527,
    0x00f0_f921,
];

const INFERNO: [u32; 9] = [
    0x0000_0004,
    0x0021_0c4a,
    0x0057_106e,
    0x008a_226a,
    0x00bc_3754,
    0x00e4_5a31,
    0x00f9_8e09,
    0x00f9_cb35,
    0x00fc_ffa4,
];

const MAGMA: [u32; 9] = [
    0x0000_0004,
    0x001d_1147,
    0x0051_127c,
    0x0083_2681,
    0x00b7_3779,
    0x00e7_5263,
    0x00fc_8961,
    0x00fe_c488,
    0x00fc_fdbf,
];

const TURBO: [u32; 17] = [
    0x0030_123b,
    0x0040_40a2,
    0x0046_6be3,
    0x0042_94ff,
    0x0028_bceb,
    0x0018_ddc2,
    0x0032_f298,
    0x006d_fe62,
    0x00a4_fc3c,
    0x00cd_ec34,
    0x00ee_cf3a,
    0x00fd_ac34,
    0x00fb_7e21,
    0x00eb_500e,
    0x00d0_2f05,
    0x00a9_1601,
    0x007a_0403,
];

const COOLWARM: [u32; 9] = [
    0x003b_4cc0,
    0x0062_82ea,
    0x008d_b0fe,
    0x00b9_d0f9,
    0x00dd_dcdc,
    0x00f5_c4ac,
    0x00f4_987a,
    0x00dd_5f4b,
    0x00b4_0426,
];

/// Cobalt, emerald, amber, ruby, violet.
const GLASS: [u32; 5] = [0x001e_5fd0, 0x0012_a36b, 0x00f5_ab0a, 0x00d4_1836, 0x0094_3ac0];

fn listed(rows: &[Row]) -> Vec<TransferPoint> {
    let point = |&(value, srgb, opacity): &Row| point(value, srgb, opacity);
    rows.iter().map(point).collect()
}

/// Colours at equal distances; opacity equals the value.
fn sampled(colors: &[u32]) -> Vec<TransferPoint> {
    let last = (colors.len() - 1) as f64;
    let value = |i: usize| i as f64 / last;
    colors.iter().enumerate().map(|(i, &srgb)| point(value(i), srgb, value(i))).collect()
}

/// Bands of constant colour and equal width; opacity equals the value.
fn banded(colors: &[u32]) -> Vec<TransferPoint> {
    let edge = |i: usize| i as f64 / colors.len() as f64;
    let band = |(i, &srgb)| [i, i + 1].map(|i| point(edge(i), srgb, edge(i)));
    colors.iter().enumerate().flat_map(band).collect()
}

fn point(value: f64, srgb: u32, opacity: f64) -> TransferPoint {
    TransferPoint { value, color: linear(srgb), opacity }
}

/// Linear RGB of an sRGB colour 0x00rr_ggbb.
fn linear(srgb: u32) -> DVec3 {
    let [_, red, green, blue] = srgb.to_be_bytes();
    linear_from_srgb([red, green, blue].map(|channel| f64::from(channel) / 255.0))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn every_preset_covers_0_to_1_with_rising_opacity() {
        for (name, description) in PRESETS {
            let function = preset(name).unwrap();
            assert_eq!(function.range(), [0.0, 1.0], "{name}");
            assert_eq!((function.at(0.0).1, function.at(1.0).1), (0.0, 1.0), "{name}");
            assert!(!description.is_empty(), "{name}");
            // Visible points are not black.
            for point in function.points().iter().filter(|point| point.opacity > 0.2) {
                assert!(point.color.max_element() > 0.1, "{name}: {point:?}");
            }
        }
    }

    #[test]
    fn smoke_is_grey_and_bone_hides_what_is_soft() {
        for point in preset("smoke").unwrap().points() {
            assert!(point.color.min_element() > 0.33 && point.color.max_element() < 0.63);
        }
        assert_eq!(preset("bone").unwrap().at(0.35).1, 0.0);
        let glass = preset("stained-glass").unwrap();
        assert_ne!(glass.at(0.4 - 1e-9).0, glass.at(0.4).0);
    }

    #[test]
    fn colors_are_linear() {
        let (viridis, _) = preset("viridis").unwrap().at(0.5);
        let [r, g, b] =
            viridis.to_array().map(|c| crate::image::srgb_from_linear(c as f32) * 255.0);
        assert!((r - 33.0).abs() < 0.01 && (g - 145.0).abs() < 0.01 && (b - 140.0).abs() < 0.01);
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let error = preset("a\nb").unwrap_err().to_string();
        assert!(error.contains("stained-glass") && !error.contains('\n'), "{error}");
    }
}
