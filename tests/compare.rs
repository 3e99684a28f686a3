//! Tests of `compare` as a user calls it: the report's folder, its numbers, and what is rejected.

use std::fs;

use deepshadow::compare::{Bench, Method};
use deepshadow::ndarray::Array3;
use deepshadow::{Scene, Settings, Silent, Volume};
use serde_json::Value as Json;

use crate::cli::{Folder, must_succeed, stderr};

const SMALL: &str = "--map-size 24 --points 1500 --size 24x20";
const MAPS: &str = "--maps threshold,threshold@paper,slices:4,fragments@0.01,fragments@raw";

/// All numbers in `json`, each with its path.
fn numbers(json: &Json, place: &str, found: &mut Vec<(String, f64)>) {
    match json {
        Json::Object(entries) => {
            entries.iter().for_each(|(key, one)| numbers(one, &format!("{place}.{key}"), found));
        }
        Json::Array(entries) => entries.iter().for_each(|one| numbers(one, place, found)),
        Json::Number(number) => found.push((place.to_owned(), number.as_f64().unwrap())),
        _ => {}
    }
}

#[test]
fn a_report_is_whole_and_says_the_same_everywhere() {
    let folder = Folder::new();
    let output = folder.run(&format!("compare bucky {SMALL} {MAPS} --json"));
    must_succeed(&output);
    assert_eq!(folder.names(), ["bucky-compare"]);
    let path = folder.path().join("bucky-compare");
    let mut names: Vec<_> =
        fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["report.html", "results.csv", "results.json"]);
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();

    // Stdout contains the file and nothing else.
    assert_eq!(String::from_utf8(output.stdout.clone()).unwrap(), read("results.json"));
    let json: Json = serde_json::from_slice(&output.stdout).unwrap();
    let mut found = Vec::new();
    numbers(&json, "", &mut found);
    assert!(found.len() > 150, "{}", found.len());
    assert!(found.iter().all(|(_, number)| number.is_finite()));
    let methods = json["methods"].as_array().unwrap();
    assert_eq!(methods.len(), 5);
    assert_eq!(json["points"]["volume"], 1500);
    for method in methods {
        assert!(method["bytes_per_texel"].as_f64().unwrap() >= 4.0, "{method}");
        assert!(method["lookup_nanoseconds"].as_f64().unwrap() > 0.0, "{method}");
        let errors = &method["errors"]["rays"];
        let of = |key: &str| errors[key].as_f64().unwrap();
        assert!(of("rms") <= of("max") && of("p99_9") <= of("max"), "{method}");
    }
    let rms = |label: &str| {
        let method = methods.iter().find(|method| method["label"] == label).unwrap();
        method["errors"]["rays"]["rms"].as_f64().unwrap()
    };
    assert!(rms("threshold@paper") > rms("threshold") && rms("threshold") > rms("fragments@0.01"));
    assert!(rms("fragments@raw") < 5e-4);
    assert!(json["floor"]["errors"]["rays"]["max"].as_f64().unwrap() < 1e-5);

    let csv = read("results.csv");
    let columns = csv.lines().next().unwrap().split(',').count();
    assert_eq!(csv.lines().count(), 7, "a head, the floor, five methods");
    assert!(csv.lines().all(|line| line.split(',').count() == columns));

    let html = read("report.html");
    assert!(!html.contains("{{") && !html.contains("http"), "nothing left open, nothing outside");
    for attribute in ["src=\"", "href=\""] {
        for (at, _) in html.match_indices(attribute) {
            let rest = &html[at + attribute.len()..];
            assert!(rest.starts_with('#') || rest.starts_with("data:"), "{rest:.40}");
        }
    }
    // Truth, floor and methods; four plots, and one curve per method.
    assert_eq!(html.matches("<img ").count(), 1 + 2 * 6);
    assert_eq!(html.matches("<svg ").count(), 4 + 5);
    assert_eq!(html.matches("<svg ").count(), html.matches("<title id=").count());
    for fact in ["seed 1", "1500 rays", "24 \u{d7} 24 texels", "32 \u{d7} 32 \u{d7} 32 voxels"] {
        assert!(html.contains(fact), "{fact}");
    }
}

#[test]
fn an_older_report_gives_way_and_nothing_else_does() {
    let folder = Folder::new();
    let run =
        |out: &str| folder.run(&format!("compare box {SMALL} --maps slices:2 --quiet -o {out}"));
    must_succeed(&run("report"));
    fs::write(folder.path().join("report/results.csv"), "older").unwrap();
    must_succeed(&run("report"));
    let csv = fs::read_to_string(folder.path().join("report/results.csv")).unwrap();
    assert!(csv.starts_with("method,"), "{csv}");

    fs::write(folder.path().join("report/notes.txt"), "mine").unwrap();
    fs::write(folder.path().join("file"), "mine").unwrap();
    for (out, named) in [("report", "notes.txt"), ("file", "file"), ("nowhere/report", "nowhere")] {
        let refused = run(out);
        assert_eq!(refused.status.code(), Some(1), "{out}");
        let said = stderr(&refused);
        assert!(said.contains(named) && said.lines().count() == 1, "{said}");
        assert!(refused.stdout.is_empty());
    }
    assert_eq!(fs::read_to_string(folder.path().join("file")).unwrap(), "mine");
    assert_eq!(folder.names(), ["file", "report"], "no temporary folder stays");
}

#[test]
fn depth_scales_the_extinction() {
    let folder = Folder::new();
    let output =
        folder.run(&format!("compare rods {SMALL} --maps slices:4 --depth 7.5 --seed 9 --json"));
    must_succeed(&output);
    let json: Json = serde_json::from_slice(&output.stdout).unwrap();
    // It is measured again.
    let deepest = json["largest_optical_depth"].as_f64().unwrap();
    assert!((deepest - 7.5).abs() < 1e-12, "{deepest}");
    assert_eq!(json["seed"], 9);
    fs::write(folder.path().join("empty.raw"), [0_u8; 27]).unwrap();
    let empty = "compare empty.raw --dims 3,3,3 --type u8 --maps slices:4";
    let refused = folder.run(&format!("{empty} {SMALL} --depth 4"));
    assert_eq!(refused.status.code(), Some(1));
    assert!(stderr(&refused).contains("depth: no light ray"), "{}", stderr(&refused));
    // An empty volume can be measured too.
    must_succeed(&folder.run(&format!("{empty} {SMALL}")));
}

#[test]
fn wrong_options_are_refused() {
    let folder = Folder::new();
    for arguments in [
        "compare",
        "compare box --maps",
        "compare box --maps shadow",
        "compare box --maps threshold,threshold",
        "compare box --maps slices:1",
        "compare box --maps fragments@2",
        "compare box --points 0",
        "compare box --depth 0",
        "compare box --map-size 8192",
        "compare box --map threshold",
        "compare box --backend gpu",
        "compare box --filter edsm --quiet",
    ] {
        let output = folder.run(arguments);
        assert_eq!(output.status.code(), Some(2), "'{arguments}': {}", stderr(&output));
    }
    assert!(folder.names().is_empty());
}

/// Lengths of a map are in the media's unit, which is not the world's where that is very large or
/// small; those of a report are the world's.
#[test]
fn the_worst_ray_is_drawn_in_world_lengths_whatever_the_unit() {
    for spacing in [1e-7, 0.1, 1e7] {
        let cloud = Array3::from_shape_fn((8, 9, 10), |(z, y, x)| ((x + 2 * y * z) % 5) as f32);
        let volume = Volume::from_array("cloud", cloud, [spacing; 3]).unwrap();
        let scene = Scene::automatic(volume).unwrap();
        let settings = Settings::default().with(|settings| {
            (settings.map.size, settings.image.size) = (16, [8, 8]);
        });
        let bench = Bench::new(&scene, &settings, [300, 1], &Silent).unwrap();
        let worst = bench.measure(&Method::parse("fragments@0.001").unwrap()).unwrap().worst;
        let worst = worst.unwrap();
        let longest = 30.0 * spacing;
        assert!((0.0..longest).contains(&(worst.extent[1] - worst.extent[0])), "{worst:?}");
        let [last, ..] = worst.points.last().copied().unwrap();
        assert!((worst.points[0][0]..=last).contains(&worst.depth), "{spacing}: {worst:?}");
        let off = worst.points.iter().map(|[_, truth, found]| (truth - found).abs());
        assert!(off.fold(0.0, f64::max) < 0.01, "{spacing}: {worst:?}");
    }
}
