//! Tests of every representation: its error against the exact integral on the four presets and its
//! size (the figures used for comparisons), and that pictures and files can be made with it.

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::frame::Frame;
use deepshadow::image::Image;
use deepshadow::kernel::light::light_extent;
use deepshadow::progress::Silent;
use deepshadow::scene::Scene;
use deepshadow::settings::{MapKind, Settings};
use deepshadow::shadow::{
    CodedMap, FragmentMap, Map, Runs, Shadow, TexelRay, VisibilityMap, codec, fit_visibility,
};
use deepshadow::volume::presets::Preset;
use rayon::prelude::*;

use crate::accuracy::{MAP, average, error, points};
use crate::cli::{Folder, must_succeed, stderr};
use crate::support::scenes::{anchor_scene, settings};

/// A kind of map, with the expected averages over the presets.
struct Case {
    kind: &'static str,
    tolerance: f32,
    /// Largest number of bytes per texel.
    bytes: f64,
    /// Root mean square error of transmittance at the largest optical depths 4 and 16, within 5 %.
    errors: [f64; 2],
    /// The prototype's figures, if it had this representation; they must not be exceeded by more
    /// than 5 %.
    published: Option<[f64; 2]>,
}

const fn case(kind: &'static str, bytes: f64, errors: [f64; 2], published: [f64; 2]) -> Case {
    Case { kind, tolerance: 0.0, bytes, errors, published: Some(published) }
}

/// Three are better than the prototype's: `relative` (its shares were not tuned there; lookups know
/// where the ray enters), `adaptive` (points are judged by the triangle that they span) and
/// `visibility` (lines go through the exact values where possible, and need fewer points). The
/// others agree with it within 2 %.
const CASES: [Case; 19] = [
    Case { published: None, ..case("nested", 16.0, [0.0030, 0.0053], [0.0; 2]) },
    case("relative", 16.0, [0.0053, 0.0065], [0.0062, 0.0083]),
    case("slices:16", 16.0, [0.0073, 0.0154], [0.0073, 0.0155]),
    Case { published: None, ..case("slices-float:16", 64.0, [0.0072, 0.0154], [0.0; 2]) },
    case("fourier:3", 16.0, [0.0416, 0.0840], [0.0417, 0.0842]),
    case("fourier:7", 32.0, [0.0143, 0.0346], [0.0143, 0.0346]),
    case("moments:4", 20.0, [0.0458, 0.0496], [0.0459, 0.0498]),
    Case { published: None, ..case("moments:6", 28.0, [0.0376, 0.0403], [0.0; 2]) },
    Case { published: None, ..case("trigonometric:3", 28.0, [0.0334, 0.0446], [0.0; 2]) },
    case("adaptive:8", 64.0, [0.0129, 0.0196], [0.0215, 0.0306]),
    case("adaptive:16", 128.0, [0.0039, 0.0067], [0.0050, 0.0079]),
    Case { tolerance: 0.01, ..case("visibility", 34.0, [0.0053, 0.0070], [0.0059, 0.0077]) },
    Case { tolerance: 0.001, ..case("visibility", 85.0, [0.0024, 0.0046], [0.0024, 0.0048]) },
    Case { published: None, ..case("layers:3", 8.0, [0.0333, 0.0509], [0.0; 2]) },
    Case { published: None, ..case("layers:7", 16.0, [0.0107, 0.0174], [0.0; 2]) },
    Case { published: None, ..case("peeling:8", 32.0, [0.2379, 0.2429], [0.0; 2]) },
    Case { published: None, ..case("occupancy:128", 18.0, [0.0604, 0.1157], [0.0; 2]) },
    Case { published: None, ..case("stochastic:16", 32.0, [0.0136, 0.0132], [0.0; 2]) },
    Case { published: None, ..case("grid:64", 4.0, [0.0144, 0.0272], [0.0; 2]) },
];

fn all_slabs() -> Settings {
    let map = Some(MapKind::Fragments);
    settings(MAP, [1, 1]).with(|s| {
        s.map.kind = map;
        s.map.fragments.tolerance = 0.0;
        s.map.fragments.truncation = 0.0;
        s.map.fragments.links = Some(false);
    })
}

/// A map of `case` from the same slabs that `raw` contains.
fn map_of(case: &Case, scene: &Scene, raw: &FragmentMap) -> Map {
    let settings = all_slabs();
    let frame = Frame::new(&scene.only_beam().unwrap(), &settings).unwrap();
    let view = *raw.view();
    let texel = |i: usize| raw.nodes(i as u32 % MAP, i as u32 / MAP);
    match case.kind.parse().unwrap() {
        MapKind::Coded(coding) => {
            let codec = codec(coding);
            let mut bytes = vec![0; (MAP * MAP) as usize * codec.stride()];
            bytes.par_chunks_exact_mut(codec.stride()).enumerate().for_each(|(i, bytes)| {
                let [u, v] =
                    [i as u32 % MAP, i as u32 / MAP].map(|i| (i as f32 + 0.5) / MAP as f32);
                let extent = light_extent(&frame, u, v).into();
                codec.encode(&TexelRay { nodes: texel(i), extent }, bytes);
            });
            Map::Coded(CodedMap::new(bytes, coding, view, &frame))
        }
        MapKind::Visibility => {
            let (mut runs, mut points) = (Runs::default(), Vec::new());
            for i in 0..(MAP * MAP) as usize {
                fit_visibility(texel(i), case.tolerance, &mut points);
                runs.push(&points).unwrap();
            }
            Map::Visibility(VisibilityMap::new(runs, case.tolerance, view, &frame))
        }
        kind => CpuBackend
            .map(&scene.only_beam().unwrap(), &settings.with(|s| s.map.kind = Some(kind)), &Silent)
            .unwrap(),
    }
}

#[test]
fn every_representation_errs_as_published() {
    for (d, largest) in [4.0, 16.0].into_iter().enumerate() {
        let mut found = [([0.0; 4], 0.0); CASES.len()];
        for (p, preset) in Preset::ALL.into_iter().enumerate() {
            let scene = anchor_scene(preset, largest, MAP);
            let points = points(&scene);
            let raw = CpuBackend.map(&scene.only_beam().unwrap(), &all_slabs(), &Silent).unwrap();
            let raw = raw.as_fragments().unwrap();
            for (case, (errors, bytes)) in CASES.iter().zip(&mut found) {
                let map = map_of(case, &scene, raw);
                errors[p] = error(&map, &points);
                *bytes += 0.25 * map.bytes() as f64 / f64::from(MAP * MAP);
            }
        }
        for (Case { kind, tolerance, bytes: most, errors: expected, published }, (errors, bytes)) in
            CASES.iter().zip(found)
        {
            let error = average(errors);
            eprintln!(
                "depth {largest}, {kind} {tolerance}, {bytes:.1} B: {errors:.4?}, {error:.4}"
            );
            assert!(error <= 1.05 * expected[d], "{kind}: {error}");
            assert!(
                published.is_none_or(|published| error <= 1.05 * published[d]),
                "{kind}: {error}"
            );
            assert!(bytes <= *most, "{kind}: {bytes} bytes");
        }
    }
}

fn picture(kind: MapKind) -> Image {
    let scene = anchor_scene(Preset::Bucky, 4.0, 48);
    let settings = settings(48, [32, 24]).with(|s| s.map.kind = Some(kind));
    CpuBackend.render(&scene, &settings, &Silent).unwrap()
}

/// Mean absolute difference of radiance.
fn difference(a: &Image, b: &Image) -> f32 {
    let pixels = a.pixels.iter().zip(&b.pixels);
    let sum: f32 = pixels.flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| (a - b).abs()).sum();
    sum / (4 * a.pixels.len()) as f32
}

#[test]
fn every_kind_renders_nearly_the_exact_maps_picture() {
    let exact = picture(MapKind::Fragments);
    for kind in MapKind::all() {
        let found = difference(&picture(kind), &exact);
        eprintln!("{kind}: {found:.5}");
        let name = kind.to_string();
        let is_one_of = |names: &[&str]| names.iter().any(|n| name.starts_with(n));
        let most = if is_one_of(&["peeling", "occupancy"]) {
            // Made for hair; a medium has more layers, and its slices are not alike.
            0.04
        } else if is_one_of(&["moments", "trigonometric", "fourier"]) {
            0.01
        } else {
            0.0025
        };
        assert!(found < most, "{kind}: {found}");
    }
}

#[test]
fn every_kind_is_written_or_says_that_it_is_not() {
    let folder = Folder::new();
    for kind in MapKind::all() {
        let output =
            folder.run(&format!("map bucky --backend cpu --map-size 8 --map {kind} -o m.exr"));
        if matches!(kind, MapKind::Visibility | MapKind::Grid(_)) {
            assert_eq!(output.status.code(), Some(2), "{kind}");
            let line = stderr(&output);
            assert!(
                line.contains(&kind.to_string()) && line.contains("not written to files"),
                "{line}"
            );
        } else {
            must_succeed(&output);
            std::fs::remove_file(folder.path().join("m.exr")).unwrap();
        }
    }
}

#[test]
fn a_map_of_fixed_bytes_is_coded_from_every_slab() {
    let scene = anchor_scene(Preset::Rods, 4.0, 32);
    let build = |kind: MapKind, tolerance: f64| {
        let settings = settings(32, [1, 1]).with(|s| {
            s.map.kind = Some(kind);
            s.map.fragments.tolerance = tolerance;
            s.map.fragments.truncation = 0.0;
        });
        CpuBackend.map(&scene.only_beam().unwrap(), &settings, &Silent).unwrap()
    };
    let all = build(MapKind::Fragments, 0.0);
    let slices = build("slices-float:1024".parse().unwrap(), 0.5);
    for (x, y) in (0..32).flat_map(|y| (0..32).map(move |x| (x, y))) {
        for depth in (0..40_u8).map(|i| f32::from(i) * 0.05) {
            let [a, b] =
                [&all, &slices].map(|map| map.texels().unwrap().texel_transmittance(x, y, depth));
            assert!((a - b).abs() < 0.005, "{a} and {b} at ({x}, {y}), {depth}");
        }
    }
}

#[test]
fn names_without_a_map_are_refused_with_those_that_have_one() {
    let folder = Folder::new();
    let output = folder.run("render bucky --map moment:4");
    assert_eq!(output.status.code(), Some(2));
    let message = stderr(&output);
    for name in ["moments:N", "visibility", "grid:N", "relative"] {
        assert!(message.contains(name), "{message}");
    }
    let help = folder.run("render --help");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    for kind in MapKind::all() {
        let name = kind.to_string();
        assert!(help.contains(name.split(':').next().unwrap()), "{name} is not in --help");
    }
}
