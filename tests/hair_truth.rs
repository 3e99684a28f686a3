//! Hair against what another ray tracer counted: Mitsuba, on a model that is no part of the
//! repository. `tests/surfaces.rs` holds the same against closed forms, and always runs.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use deepshadow::io::load_surfaces;
use deepshadow::probe::{Probe, ProbePoint, probe};
use deepshadow::scene::{Camera, Light, Media, Scene, SceneFile};
use deepshadow::settings::MapKind;
use deepshadow::{CpuBackend, Settings, Silent};
use flate2::read::DeflateDecoder;
use glam::DVec3;

/// The arrays of f64 in a NumPy archive (.npz), by name.
fn arrays(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let bytes = std::fs::read(path).unwrap();
    let short = |at: usize| usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
    let long = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let mut found = BTreeMap::new();
    // The end of the directory stands at the end of the file.
    let end = bytes.windows(4).rposition(|mark| mark == b"PK\x05\x06").unwrap();
    let mut at = long(end + 16);
    for _ in 0..short(end + 10) {
        let name = String::from_utf8_lossy(&bytes[at + 46..][..short(at + 28)]).into_owned();
        let (packed, head) = (long(at + 20), long(at + 42));
        let data = &bytes[head + 30 + short(head + 26) + short(head + 28)..][..packed];
        let mut array = Vec::new();
        match short(at + 10) {
            0 => array.extend_from_slice(data),
            _ => drop(DeflateDecoder::new(data).read_to_end(&mut array).unwrap()),
        }
        let start = 10 + usize::from(u16::from_le_bytes([array[8], array[9]]));
        if String::from_utf8_lossy(&array[..start]).contains("<f8") {
            let values = array[start..].chunks_exact(8);
            let values = values.map(|eight| f64::from_le_bytes(eight.try_into().unwrap()));
            found.insert(name.trim_end_matches(".npy").to_owned(), values.collect());
        }
        at += 46 + short(at + 28) + short(at + 30) + short(at + 32);
    }
    found
}

fn rms(found: &[f64], due: &[f64]) -> f64 {
    let squares = found.iter().zip(due).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / due.len() as f64).sqrt()
}

mod outside {
    use super::*;
    use crate::support::data::outside;

    /// Twin: `what_is_asked_for_as_a_footprint_gets_better_with_every_doubling`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn hair_is_as_dark_as_another_ray_tracer_found() {
        let truth = arrays(&outside("accuracy/hair_truth.npz"));
        let path = outside("data/hair/straight.hair.gz");
        let text = format!("[[hair]]\npath = {path:?}\nopacity = 0.3\nthickness = 0.1\nup = 'y'\n");
        let file = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
        let camera = Camera::perspective(DVec3::splat(200.0), DVec3::ZERO, 30.0);
        let to_light = DVec3::from_slice(&truth["to_light"]);
        let mut scene = Scene::new(Media::none(), vec![Light::directional(-to_light)], camera);
        scene.surfaces = load_surfaces(&file).unwrap().0;
        let points: Vec<ProbePoint> =
            truth["points"].chunks_exact(3).map(|p| DVec3::from_slice(p).into()).collect();
        let measured = |settings: &Settings, change: &dyn Fn(&mut Probe)| -> Vec<f64> {
            let mut how = Probe::default();
            how.bias = 0.11;
            change(&mut how);
            let rows = probe(&scene, settings, &CpuBackend, &points, &how, &Silent).unwrap();
            rows.iter().map(|row| f64::from(row[0][0])).collect()
        };
        let map = |kind: &str, size: u32| {
            Settings::default().with(|s| {
                (s.map.kind, s.map.size) = (Some(kind.parse::<MapKind>().unwrap()), size);
            })
        };
        let exact = measured(&map("fragments", 64), &|how| how.exact = true);
        let crossings = |(found, due): (&f64, &f64)| (found / due).ln() / 0.7_f64.ln();
        let off: Vec<f64> = exact.iter().zip(&truth["point"]).map(crossings).collect();
        let equal = off.iter().filter(|off| off.abs() < 0.5).count() as f64 / off.len() as f64;
        let mean = exact.iter().zip(&truth["point"]).map(|(a, b)| a - b).sum::<f64>() / 4_000.0;
        eprintln!("{:.1} % of points equal, mean difference {mean:.4}", 100.0 * equal);
        assert!(equal >= 0.92 && mean.abs() < 0.02, "{equal} {mean}");
        let sides = &truth["sides"];
        for (name, size, edge, against, allowed) in [
            ("fragments", 512, None, "footprint_1", 0.030),
            ("fragments", 512, Some(sides[0]), "footprint_1", 0.030),
            ("fragments", 512, Some(sides[1]), "footprint_4", 0.020),
            ("nested", 768, Some(sides[0]), "footprint_1", 0.030),
            ("nested", 768, Some(sides[1]), "footprint_4", 0.020),
        ] {
            let found = measured(&map(name, size), &|how| how.footprint = edge);
            let error = rms(&found, &truth[against]);
            eprintln!("{name} {size}^2, {edge:?} against {against}: {error:.4}");
            assert!(error <= allowed, "{name} {size}, {edge:?}: {error}");
        }
        let mut last = f64::INFINITY;
        for size in [256, 512, 1024] {
            let found = measured(&map("fragments", size), &|how| how.footprint = Some(sides[0]));
            let error = rms(&found, &truth["footprint_1"]);
            eprintln!("{size}^2: {error:.4}");
            assert!(error < last, "{size}: {error}");
            last = error;
        }
    }
}
