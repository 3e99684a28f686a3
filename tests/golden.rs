//! Tests that no kind of map gets worse: its errors on the four presets are compared with those in
//! `tests/golden/accuracy.csv`. DEEPSHADOW_BLESS=1 rewrites that file.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;

use deepshadow::accuracy::{Place, Points};
use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::progress::Silent;
use deepshadow::settings::{Crossing, Lookup, MapKind, Settings};
use deepshadow::volume::presets::Preset;

use crate::support::project;
use crate::support::scenes::{anchor_scene, settings};

const MAP: u32 = 48;
const POINTS: [u64; 2] = [8_000, 1];
const DEPTH: f64 = 4.0;
/// Errors that grow by no more than this factor count as equal.
const SHARE: f64 = 1.05;
/// Differences below this are rounding errors.
const ROUNDING: f64 = 2e-6;

/// Every kind with its default number, and other published variants.
fn methods() -> Vec<(String, Settings)> {
    let usual = settings(MAP, [1, 1]);
    let of = |kind| usual.with(|s| s.map.kind = Some(kind));
    let mut methods: Vec<(String, Settings)> =
        MapKind::all().map(|kind| (kind.to_string(), of(kind))).collect();
    let (threshold, fragments) = (of(MapKind::Threshold), of(MapKind::Fragments));
    let paper = threshold.with(|s| {
        s.map.threshold.lookup = Lookup::Paper;
        s.map.threshold.crossing = Crossing::Smoothstep;
    });
    let raw = fragments.with(|s| {
        s.map.fragments.tolerance = 0.0;
        s.map.fragments.truncation = 0.0;
    });
    methods.push(("threshold@paper".to_owned(), paper));
    methods.push((
        "threshold@bucket".to_owned(),
        threshold.with(|s| s.map.threshold.crossing = Crossing::Bucket),
    ));
    methods.push(("fragments@raw".to_owned(), raw));
    methods
}

/// (preset, method) to the RMS errors of all places.
fn measured() -> BTreeMap<(String, String), [f64; 4]> {
    let mut found = BTreeMap::new();
    for preset in Preset::ALL {
        let scene = anchor_scene(preset, DEPTH, MAP);
        let beam = scene.only_beam().unwrap();
        let points = Points::draw(&beam, MAP, &Place::ALL, POINTS, &Silent);
        for (label, settings) in methods() {
            let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
            let errors = Place::ALL.map(|place| points.errors(place, &map, 0).rms);
            found.insert((preset.name().to_owned(), label), errors);
        }
    }
    found
}

#[test]
fn no_kind_of_map_gets_worse() {
    let path = project().join("tests/golden/accuracy.csv");
    let found = measured();
    if std::env::var("DEEPSHADOW_BLESS").is_ok_and(|value| value == "1") {
        let mut text = "preset,method,volume,medium,rays,behind\n".to_owned();
        for ((preset, method), errors) in &found {
            write!(text, "{preset},{method}").unwrap();
            for error in errors {
                write!(text, ",{error:.7}").unwrap();
            }
            text.push('\n');
        }
        fs::write(&path, text).unwrap();
    }
    let mut published = BTreeMap::new();
    for line in fs::read_to_string(&path).unwrap().lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let errors: Vec<f64> = fields[2..].iter().map(|field| field.parse().unwrap()).collect();
        published.insert((fields[0].to_owned(), fields[1].to_owned()), errors);
    }
    let mut worse = Vec::new();
    for (key, errors) in &found {
        let Some(published) = published.get(key) else {
            worse.push(format!("{key:?} is not in the table: DEEPSHADOW_BLESS=1 adds it"));
            continue;
        };
        for ((place, error), published) in Place::ALL.iter().zip(errors).zip(published) {
            // False for NaN.
            let kept = *error <= published * SHARE + ROUNDING;
            if !kept {
                let name = place.name();
                worse.push(format!("{key:?}, {name}: {error:.6}, was {published:.6}"));
            }
        }
    }
    worse.extend(
        published
            .keys()
            .filter(|key| !found.contains_key(*key))
            .map(|key| format!("{key:?} is gone")),
    );
    assert!(worse.is_empty(), "{worse:#?}");
}
