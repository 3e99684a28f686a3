//! `info` as others call it: a table for people, JSON for programs, exit codes.

use std::fs;

use deepshadow::io::deep_exr::{DeepHeader, Slab, encode_slabs};
use serde_json::{Value as Json, json};

use super::cli::{Folder, must_succeed, stderr};
use super::formats::{MATERIALS, OBJ, surface_seeds, vdb_fixture, vdb_fixture_files};

fn with_scan() -> Folder {
    let folder = Folder::new();
    let values = [f32::NAN, 1.0, 2.0, f32::INFINITY, 4.0, 5.0];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(folder.path().join("odd.raw"), bytes).unwrap();
    fs::write(
        folder.path().join("odd.toml"),
        "dims = [3, 2, 1]\ntype = \"f32\"\nspacing = [1, 2, 4]\n",
    )
    .unwrap();
    folder
}

fn json_of(folder: &Folder, arguments: &str) -> Json {
    let output = folder.run(arguments);
    must_succeed(&output);
    assert!(stderr(&output).is_empty(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn json_has_the_schema_and_words_for_nan_and_infinity() {
    let folder = with_scan();
    let found = json_of(&folder, "info odd.raw --json");
    assert_eq!(found["format"], "raw");
    let expected = json!({
        "name": "odd",
        "type": "f32",
        "class": "dense",
        "active_voxels": 6,
        "active_bbox": [[0, 0, 0], [2, 1, 0]],
        "background": null,
        "world_from_index":
            [[1.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 4.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
        "min": 1.0,
        "max": "inf",
        "mean": "inf",
        "metadata": {},
        "compression": "none",
        "file_bytes": 24,
        "memory_bytes": 24,
    });
    assert_eq!(found["grids"], json!([expected]));
}

#[test]
fn no_stats_reads_no_voxels() {
    let folder = Folder::new();
    // The voxels that the header promises are not there.
    let header = "NRRD0004\ntype: float\ndimension: 3\nsizes: 300 300 300\nencoding: raw\n\n";
    fs::write(folder.path().join("v.nrrd"), header).unwrap();
    let found = json_of(&folder, "info v.nrrd --json --no-stats");
    assert_eq!(found["grids"][0]["active_voxels"], 27_000_000);
    assert_eq!(found["grids"][0]["min"], Json::Null);
    let output = folder.run("info v.nrrd");
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("v.nrrd: it ends early: 0 bytes"), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
}

#[test]
fn people_get_a_table_with_a_histogram() {
    let folder = with_scan();
    let output = folder.run("info odd.raw");
    must_succeed(&output);
    let text = String::from_utf8(output.stdout).unwrap();
    for part in ["odd.raw: raw, 1 grid", "6 in 3 x 2 x 1", "1,2,4", "1 NaN", "histogram"] {
        assert!(text.contains(part), "'{part}' is missing in:\n{text}");
    }
    let counts: Vec<u64> = text
        .lines()
        .filter_map(|line| line.split_once('|'))
        .filter_map(|(_, bar)| bar.split_whitespace().last()?.parse().ok())
        .collect();
    assert_eq!((counts.len(), counts.iter().sum::<u64>()), (16, 4), "{text}");
}

#[test]
fn openvdb_grids_are_listed_in_the_order_of_the_file() {
    let folder = Folder::new();
    let mut listed = 0;
    for path in vdb_fixture_files() {
        let found = json_of(&folder, &format!("info {} --json", path.display()));
        assert_eq!(found["format"], "openvdb");
        for grid in found["grids"].as_array().unwrap() {
            assert!(grid["name"].is_string() && grid["type"].is_string(), "{grid}");
            listed += 1;
        }
    }
    assert!(listed > 0);
}

#[test]
fn openvdb_facts_are_those_of_the_formulas() {
    let folder = Folder::new();
    for (name, grids, voxels, bbox) in [
        ("ball_blosc.vdb", 1, 515, json!([[55, 55, 55], [65, 65, 65]])),
        ("bumps.vdb", 1, 1345, json!([[-6, -20, 0], [300, -5, 15]])),
        ("types_zip.vdb", 6, 74, json!([[0, 0, -27], [19, 18, 3]])),
    ] {
        let found = json_of(&folder, &format!("info {} --json", vdb_fixture(name).display()));
        let found = found["grids"].as_array().unwrap();
        assert_eq!(found.len(), grids, "{name}");
        for grid in found {
            assert_eq!((&grid["active_voxels"], &grid["active_bbox"]), (&json!(voxels), &bbox));
        }
    }
}

mod outside {
    use super::*;
    use crate::support::data::outside_grids;

    /// The same facts that the reader's own tests check, through the program.
    ///
    /// Twin: `openvdb_facts_are_those_of_the_formulas`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn openvdb_facts_are_those_of_the_real_library() {
        let folder = Folder::new();
        for path in outside_grids("vdb").into_iter().take(12) {
            let truth = fs::read(path.with_extension("json")).unwrap();
            let truth: Json = serde_json::from_slice(&truth).unwrap();
            let found = json_of(&folder, &format!("info {} --json", path.display()));
            let grids = found["grids"].as_array().unwrap();
            let no_grids = Vec::new();
            for truth in truth["truth"]["grids"].as_array().unwrap_or(&no_grids) {
                let grid = &grids[truth["file_order"].as_u64().unwrap() as usize];
                assert_eq!(grid["name"], truth["name"], "{}", path.display());
                if grid["refused"].is_null() {
                    assert_eq!(grid["active_voxels"], truth["active_voxels"], "{}", path.display());
                    assert_eq!(grid["active_bbox"], truth["active_bbox"], "{}", path.display());
                }
            }
        }
    }
}

#[test]
fn deep_images_are_told_by_their_samples() {
    let folder = Folder::new();
    let header = DeepHeader::new([4, 2], Vec::new()).with("depth_unit", "world");
    let bytes = encode_slabs(&header, |x, _| {
        (0..x).map(|k| {
            let front = k as f32 + 1.0;
            Slab::with_alpha(front, front + 1.0, 0.5)
        })
    });
    fs::write(folder.path().join("map.exr"), bytes.unwrap()).unwrap();
    let found = json_of(&folder, "info map.exr --json");
    assert_eq!((&found["format"], &found["grids"]), (&json!("deep-exr"), &json!([])));
    assert_eq!(found["metadata"]["depth_unit"], "world");
    let float = |name: &str| json!({ "name": name, "type": "float" });
    let deep = &found["deep"];
    for (key, due) in [
        ("width", json!(4)),
        ("height", json!(2)),
        ("data_window", json!([[0, 0], [3, 1]])),
        ("channels", json!([float("A"), float("Z"), float("ZBack")])),
        ("samples", json!(12)),
        ("samples_per_pixel", json!({ "min": 0, "mean": 1.5, "max": 3 })),
        ("empty_pixels", json!(2)),
        ("depth", json!({ "min": 1.0, "max": 4.0 })),
        ("final_alpha", json!({ "min": 0.0, "mean": 0.531_25, "max": 0.875 })),
        ("compression", json!("zips")),
    ] {
        assert_eq!(deep[key], due, "{key}");
    }
    let headers_only = json_of(&folder, "info map.exr --json --no-stats");
    assert_eq!(headers_only["deep"]["samples"], Json::Null);

    let output = folder.run("info map.exr");
    must_succeed(&output);
    let text = String::from_utf8(output.stdout).unwrap();
    for part in ["map.exr: deep-exr", "4 x 2", "A (float), Z (float)", "0 .. 3, mean 1.5", "1 .. 4"]
    {
        assert!(text.contains(part), "'{part}' is missing in:\n{text}");
    }
    let output = folder.run("render map.exr --backend cpu");
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("a deep image, not a volume"), "{}", stderr(&output));
}

#[test]
fn hair_and_meshes_are_told_by_their_parts() {
    let folder = Folder::new();
    for (_, name, bytes) in surface_seeds() {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    fs::write(folder.path().join("of it.mtl"), MATERIALS).unwrap();
    let found = json_of(&folder, "info h.hair.gz --json");
    assert_eq!((&found["format"], &found["grids"]), (&json!("hair"), &json!([])));
    let file_bytes = fs::metadata(folder.path().join("h.hair.gz")).unwrap().len();
    let expected = json!({
        "kind": "strands",
        "strands": 2,
        "points": 6,
        "segments": 4,
        "vertices": null,
        "triangles": null,
        "smooth": null,
        "bounds": [[0.0, -4.5, 0.0], [5.0, 0.5, 10.0]],
        "thickness": [0.5, 5.5],
        "opacity": [0.6875, 1.0],
        "materials": [],
        "skipped": 0,
        "file_bytes": file_bytes,
        "memory_bytes": 6 * (12 + 4 + 4 + 12) + 3 * 4,
    });
    assert_eq!(found["surface"], expected);

    let output = folder.run("info m.obj --json");
    must_succeed(&output);
    assert!(stderr(&output).contains("1 texture is not read"), "{}", stderr(&output));
    let found: Json = serde_json::from_slice(&output.stdout).unwrap();
    let expected = json!({
        "kind": "mesh",
        "strands": null,
        "points": null,
        "segments": null,
        "vertices": 5,
        "triangles": 4,
        "smooth": true,
        "bounds": [[0.0, 0.0, 0.0], [1.0, 1.0, 2.0]],
        "thickness": null,
        "opacity": [0.75, 0.75],
        "materials": [
            { "name": "red", "albedo": [0.5, 0.25, 0.125], "opacity": 0.75 },
            { "name": "thin glass", "albedo": [0.5, 0.5, 0.5], "opacity": 0.75 },
        ],
        "skipped": 0,
        "file_bytes": OBJ.len(),
        "memory_bytes": 5 * 12 + 4 * (16 + 3 * 12),
    });
    assert_eq!((&found["format"], &found["surface"]), (&json!("obj"), &expected));

    for (name, parts) in [
        ("h.hair", ["h.hair: hair\n", "6, 4 segments", "thickness   0.5 .. 5.5"]),
        ("m.glb", ["m.glb: gltf\n", "triangles   8", "glass: albedo 0.5,0.25,1, opacity 0.25"]),
    ] {
        let output = folder.run(&format!("info {name}"));
        must_succeed(&output);
        let text = String::from_utf8(output.stdout).unwrap();
        for part in parts {
            assert!(text.contains(part), "'{part}' is missing in:\n{text}");
        }
    }
    for (arguments, code, word) in [
        ("info h.tfx --dims 1,2,3 --from tfx", 2, "dims: does not apply to h.tfx (format tfx)"),
        ("info m.obj --from gltf", 1, "its JSON"),
        ("convert h.tfx out.vdb", 1, "h.tfx: hair, not a volume"),
        ("convert m.glb out.vdb", 1, "m.glb: a mesh, not a volume"),
    ] {
        let output = folder.run(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {}", stderr(&output));
        assert!(stderr(&output).contains(word), "{arguments}: {}", stderr(&output));
    }
}

#[test]
fn exit_codes_tell_wrong_usage_from_bad_input() {
    let folder = with_scan();
    for (arguments, code, word) in [
        ("info", 2, "FILE"),
        ("info odd.raw --window 1,2", 2, "--window"),
        ("info missing.vdb", 1, "missing.vdb"),
        ("info odd.toml", 1, "odd.toml"),
        ("info odd.raw --type u8", 1, "24 bytes"),
        ("info odd.raw --from nrrd", 1, "odd.raw"),
        ("info odd.raw --from tiff", 2, "tiff"),
        ("info odd.raw --max-bytes 10", 1, "the limit is 10 bytes"),
    ] {
        let output = folder.run(arguments);
        assert_eq!(output.status.code(), Some(code), "'{arguments}': {}", stderr(&output));
        assert!(stderr(&output).contains(word), "'{arguments}': {}", stderr(&output));
        assert!(output.stdout.is_empty(), "'{arguments}'");
        assert!(code == 2 || stderr(&output).lines().count() == 1, "{}", stderr(&output));
    }
}
