//! Exposure and tone curves: what the published curves give, and what is chosen for a picture.

use std::fs;

use deepshadow::image::{Exposure, Image, Tone, ToneMap};
use glam::Vec3;

use super::cli::{Folder, must_succeed, stderr};
use super::support::{Picture, Random};

/// Colours before and after each curve, computed apart from the program, in f64, from the
/// publications that [`ToneMap`] names.
const KNOWN: [([f32; 3], [[f64; 3]; 3]); 7] = [
    ([0.0; 3], [[0.0; 3]; 3]),
    (
        [0.18; 3],
        [[0.105_591, 0.105_591, 0.105_590], [0.214_549, 0.214_502, 0.214_499], [0.14, 0.14, 0.14]],
    ),
    (
        [1.0; 3],
        [
            [0.619_115, 0.619_115, 0.619_109],
            [0.590_229, 0.590_136, 0.590_102],
            [0.869_091, 0.869_091, 0.869_091],
        ],
    ),
    (
        [4.0; 3],
        [
            [0.909_014, 0.909_014, 0.909_005],
            [0.861_016, 0.860_910, 0.860_839],
            [0.983_256, 0.983_256, 0.983_256],
        ],
    ),
    (
        [0.5, 0.1, 0.02],
        [
            [0.356_765, 0.045_584, 0.006_879],
            [0.464_492, 0.146_862, 0.057_074],
            [0.4825, 0.0825, 0.0025],
        ],
    ),
    (
        [10.0, 2.0, 0.1],
        [
            [1.0, 0.842_060, 0.430_615],
            [1.0, 0.788_010, 0.579_829],
            [0.993_898, 0.653_454, 0.572_599],
        ],
    ),
    (
        [0.02, 0.05, 0.2],
        [
            [0.000_309, 0.013_837, 0.107_758],
            [0.021_748, 0.082_041, 0.255_143],
            [0.0025, 0.0325, 0.1825],
        ],
    ),
];

const CURVES: [ToneMap; 3] = [ToneMap::Aces, ToneMap::Agx, ToneMap::KhronosNeutral];

/// The numbers above have six digits; the polynomial of `agx` adds terms of up to 40, whose
/// rounding to f32 is multiplied by the slope of x^2.2, which is at most 2.2.
#[test]
fn the_curves_give_what_their_publications_give() {
    let rounding = 40.0 * 8.0 * f64::from(f32::EPSILON) * 2.2;
    for (color, expected) in KNOWN {
        for (curve, expected) in CURVES.into_iter().zip(expected) {
            let found = curve.apply(Vec3::from(color)).to_array();
            for (found, expected) in found.into_iter().zip(expected) {
                let error = (f64::from(found) - expected).abs();
                assert!(error < 1e-6 + rounding, "{curve:?} of {color:?}: {found} for {expected}");
            }
        }
    }
}

/// Sobotka's own curve is a sigmoid with slope 2 at its pivot and the powers 3 and 3.25. Its
/// polynomial was published with a mean squared error of 3.7e-6; three times the root of that
/// bounds it everywhere.
#[test]
fn agx_follows_the_sigmoid_that_its_polynomial_stands_for() {
    let scale =
        |x: f64, p: f64| ((2.0 * x).powf(-p) * ((2.0 * x / 0.5).powf(p) - 1.0)).powf(-1.0 / p);
    let pivot = 0.606;
    let sigmoid = |x: f64| {
        let (scale, p) =
            if x < pivot { (-scale(pivot, 3.0), 3.0) } else { (scale(1.0 - pivot, 3.25), 3.25) };
        let term = 2.0 * (x - pivot) / scale;
        0.5 + scale * term / (1.0 + term.powf(p)).powf(1.0 / p)
    };
    for step in 1..100 {
        let x = f64::from(step) / 100.0;
        // Grey is grey in all of the primaries, to the four digits of the matrices.
        let radiance = f64::exp2(x * (4.026_069 + 12.473_93) - 12.473_93);
        let found = ToneMap::Agx.apply(Vec3::splat(radiance as f32));
        let display = f64::from(found.y).powf(1.0 / 2.2);
        let bound = 3.0 * 3.7e-6_f64.sqrt() + 5e-4;
        assert!((display - sigmoid(x)).abs() < bound, "{x}: {display} for {}", sigmoid(x));
    }
}

#[test]
fn curves_stay_in_range_and_rise_whatever_they_get() {
    let mut random = Random(5);
    for curve in CURVES {
        let mut last = -1.0;
        for stop in -60..90 {
            let shown = curve.apply(Vec3::splat(f32::exp2(stop as f32))).y;
            // Where a curve is flat, rounding may take back some units of the last digit.
            assert!(shown >= last - 1e-6 && shown <= 1.0, "{curve:?}: {shown} after {last}");
            last = shown;
        }
        for _ in 0..2000 {
            let color = [0; 3].map(|_| f64::exp2(200.0 * random.unit() - 100.0) as f32);
            let shown = curve.apply(Vec3::from(color));
            let inside = shown.to_array().iter().all(|c| (0.0..=1.0).contains(c));
            assert!(inside, "{curve:?} of {color:?}: {shown}");
        }
        let odd = [
            [f32::NAN; 4],
            [f32::INFINITY, 1.0, 0.0, 1.0],
            [f32::MAX, 1.0, 0.0, 1e-30],
            [-1.0, 0.5, 0.5, 1.0],
        ];
        let image = Image { width: 4, height: 1, pixels: odd.to_vec() };
        assert_eq!(image.to_srgb16(Tone::new(1e30, curve)).len(), 16);
    }
}

#[test]
fn exposures_are_factors_stops_or_automatic() {
    for (text, factor) in [
        ("2", 2.0),
        ("0.25", 0.25),
        ("+1ev", 2.0),
        ("-1ev", 0.5),
        ("+1.5EV", f64::exp2(1.5)),
        ("0ev", 1.0),
        ("3 ev", 8.0),
    ] {
        assert_eq!(text.parse::<Exposure>().unwrap(), Exposure::Factor(factor), "{text}");
    }
    assert_eq!("auto".parse::<Exposure>().unwrap(), Exposure::Auto);
    for text in ["", "0", "-1", "nan", "inf", "ev", "1e40", "200ev", "automatic", "+1.5e"] {
        assert!(text.parse::<Exposure>().is_err(), "{text}");
    }
}

/// One more stop on the picture is one less in the exposure, to the three digits that it has.
#[test]
fn automatic_exposure_puts_the_brightest_hundredth_at_nine_tenths() {
    let mut image = Image::filled(100, 10, [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(image.auto_exposure(), 1.0);
    // A tenth of the pixels has light, in steps of a hundredth from 0.01 to 1.
    for (at, pixel) in image.pixels.iter_mut().step_by(10).enumerate() {
        *pixel = [0.005, 0.01 * (at + 1) as f32, 0.0, 1.0];
    }
    let rank = (99.0_f64 * 0.99).round() + 1.0;
    let expected = 0.9 / (0.01 * rank);
    for stops in -20..20 {
        let factor = f32::exp2(stops as f32);
        let pixels = image.pixels.iter().map(|&[r, g, b, a]| [r * factor, g * factor, b, a]);
        let brighter = Image { pixels: pixels.collect(), ..image };
        let found = brighter.auto_exposure() * f64::from(factor);
        assert!((found / expected - 1.0).abs() < 0.005 + 1e-6, "{stops}: {found} for {expected}");
        assert_eq!(brighter.auto_exposure(), brighter.auto_exposure());
    }
    // Pixels without light and the order of pixels do not matter, nor does alpha.
    let exposure = image.auto_exposure();
    image.pixels.reverse();
    image.pixels.extend(std::iter::repeat_n([0.0; 4], 5000));
    image.height += 50;
    for pixel in &mut image.pixels {
        *pixel = pixel.map(|c| 0.5 * c);
    }
    assert_eq!(image.auto_exposure(), exposure);
}

#[test]
fn a_curve_is_chosen_only_where_a_screen_would_lose_detail() {
    let mut image = Image::filled(1000, 1, [0.9, 0.2, 0.1, 1.0]);
    let curve = |image: &Image, exposure: f64| {
        Tone::for_picture(image, Exposure::Factor(exposure), None).map
    };
    assert_eq!(curve(&image, 1.0), ToneMap::None);
    assert_eq!(curve(&image, 2.0), ToneMap::Agx);
    image.pixels[..2].fill([7.0; 4]);
    assert_eq!(curve(&image, 1.0), ToneMap::None, "two pixels of a thousand");
    image.pixels[2] = [7.0, 7.0, 7.0, 1.0];
    assert_eq!(curve(&image, 1.0), ToneMap::Agx);
    for given in ToneMap::ALL {
        assert_eq!(Tone::for_picture(&image, Exposure::Auto, Some(given)).map, given);
    }
    // Without a curve, nothing changes below white.
    let bytes = image.to_srgb8(1.0);
    assert_eq!(bytes, image.to_srgb8(Tone::new(1.0, ToneMap::None)));
    assert_ne!(bytes, image.to_srgb8(Tone::new(1.0, ToneMap::Agx)));
}

const SMALL: &str = "--backend cpu --size 40x30 --map-size 32";

/// The largest byte of a picture, and how many pixels are white.
fn brightest(folder: &Folder, name: &str) -> (u8, usize) {
    let picture = Picture::open(folder.path().join(name));
    let largest = picture.bytes.iter().copied().max().unwrap();
    (largest, picture.pixels().filter(|pixel| **pixel == [255; 3]).count())
}

#[test]
fn the_program_says_what_it_chose_for_screens_and_leaves_linear_files_alone() {
    let folder = Folder::new();
    let render = |options: &str| {
        let output = folder.run(&format!("render box {SMALL} {options}"));
        must_succeed(&output);
        let said = stderr(&output);
        let chosen =
            |what: &str| said.lines().any(|line| line.contains(what) && line.ends_with("(chosen)"));
        (chosen("(--tonemap) agx"), chosen("(--exposure)"), said.clone())
    };
    let (curve, exposure, _) = render("-o plain.png");
    assert!(!curve && !exposure);
    assert!(render("--exposure +2ev -o bright.png").0);
    assert!(!render("--exposure 4 --tonemap none -o cut.png").0);
    let (bright, cut) = (brightest(&folder, "bright.png"), brightest(&folder, "cut.png"));
    assert!(bright.0 < 255 && cut.1 > 50, "{bright:?}, {cut:?}");
    assert!(render("--exposure auto -o auto.png").1);
    let (auto, ..) = brightest(&folder, "auto.png");
    assert!(auto > 235, "nearly white: {auto}");
    // The printed exposure repeats the picture.
    let said = render("--exposure auto -o auto.png").2;
    let line = said.lines().find(|line| line.contains("(--exposure)")).unwrap();
    let factor = line.split_whitespace().rev().nth(1).unwrap();
    render(&format!("--exposure {factor} -o again.png"));
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("auto.png") == read("again.png"), "{line}");
    render("-o a.exr");
    let said = render("--exposure 4 --tonemap agx -o b.exr").2;
    assert!(said.contains("linear radiance"), "{said}");
    assert!(read("a.exr") == read("b.exr"));
}

#[test]
fn scene_files_have_the_same_keys() {
    let folder = Folder::new();
    let scene = |keys: &str| {
        let text =
            format!("[volume]\npreset = \"box\"\n[image]\nwidth = 40\nheight = 30\n{keys}\n");
        fs::write(folder.path().join("s.toml"), text).unwrap();
        let output = folder.run("render s.toml --backend cpu --map-size 32 -o s.png");
        (output.status.code(), stderr(&output))
    };
    let read = || fs::read(folder.path().join("s.png")).unwrap();
    assert_eq!(scene("exposure = 0.5\ntonemap = \"aces\"").0, Some(0));
    let expected = read();
    assert_eq!(scene("exposure = \"-1ev\"\ntonemap = \"aces\"").0, Some(0));
    assert!(read() == expected);
    assert_eq!(scene("exposure = \"auto\"").0, Some(0));
    assert!(read() != expected);
    for (keys, named) in [
        ("tonemap = \"filmic\"", "khronos-neutral"),
        ("exposure = \"much\"", "much"),
        ("exposure = 0", "exposure"),
        ("exposure = [1]", "exposure"),
    ] {
        let (code, said) = scene(keys);
        assert!(code == Some(1) && said.contains(named), "{keys}: {said}");
    }
    let output = folder.run("render box --tonemap filmic");
    assert_eq!(output.status.code(), Some(2));
}

/// What a screen would lose of a transparent picture is what is seen of it.
#[test]
fn thin_white_wisps_are_not_cut_off() {
    let wisps = Image::filled(16, 16, [0.054, 0.054, 0.054, 0.05]);
    assert!(!wisps.is_cut_off(1.0));
    assert!(Image::filled(16, 16, [1.08, 1.08, 1.08, 1.0]).is_cut_off(1.0));
    assert!(!Image::filled(16, 16, [0.86, 0.86, 0.86, 0.8]).is_cut_off(1.0));
    assert!(Image::filled(16, 16, [0.6, 0.6, 0.6, 0.5]).is_cut_off(1.0));
}
