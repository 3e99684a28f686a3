//! Tests of colour through the program: options, scene files, grids of colours, layers of maps.

use std::fs;

use deepshadow::io::vdb::{Compression, IndexBox, Metadata, NewGrid, TreeBuilder, VdbWriter};
use glam::{DMat4, IVec3};
use serde_json::Value as Json;

use crate::cli::{Folder, must_succeed, stderr};

const SMALL: &str = "--backend cpu --size 40x30 --map-size 32 --quiet";
const TINTED: &str =
    "[volume]\npreset = \"bucky\"\ndensity_scale = 12.0\ntint = [0.25, 1.0, 2.0]\n";

fn pixels(folder: &Folder, name: &str) -> Vec<[f32; 4]> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        folder.path().join(name),
        |size, _| vec![[0.0; 4]; size.width() * size.height()],
        |pixels: &mut Vec<[f32; 4]>, at, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.y() * 40 + at.x()] = [r, g, b, a];
        },
    );
    image.unwrap().layer_data.channel_data.pixels
}

#[test]
fn threshold_maps_of_channels_and_lights_are_layers_and_other_maps_are_files() {
    let folder = Folder::new();
    let lights = "[[light]]\ndirection = [0, -1, 0]\n[[light]]\ndirection = [1, -1, 0]\n";
    fs::write(folder.path().join("scene.toml"), format!("{TINTED}{lights}")).unwrap();
    let map = "--backend cpu --map-size 16 --quiet";
    must_succeed(&folder.run(&format!("map scene.toml {map} --map threshold -o t.exr")));
    let file = exr::prelude::read_all_flat_layers_from_file(folder.path().join("t.exr")).unwrap();
    let layers: Vec<String> = file
        .layer_data
        .iter()
        .map(|layer| layer.attributes.layer_name.as_ref().unwrap().to_string())
        .collect();
    let channels = ["red", "green", "blue"];
    let expected = ["light1", "light2"].map(|light| channels.map(|c| format!("{light}.{c}")));
    assert_eq!(layers, expected.concat());
    must_succeed(&folder.run(&format!("map scene.toml {map} --map fragments -o f.exr")));
    let names = folder.names();
    for name in ["f.light1.red.exr", "f.light1.blue.exr", "f.light2.green.exr", "t.exr"] {
        assert!(names.iter().any(|other| other == name), "{name} in {names:?}");
    }
    assert_eq!(names.len(), 8, "{names:?}");
}

/// With a tint of 1, a channel's errors equal those of a grey medium's map at the same points.
#[test]
fn compare_says_the_errors_of_each_channel() {
    let folder = Folder::new();
    fs::write(folder.path().join("tinted.toml"), TINTED).unwrap();
    fs::write(folder.path().join("grey.toml"), TINTED.replace("0.25, 1.0, 2.0", "1, 1, 1"))
        .unwrap();
    let small = "--map-size 16 --points 800 --size 16x12 --maps threshold,slices:4 --quiet --json";
    let compare = |name: &str| -> Json {
        let output = folder.run(&format!("compare {name} {small} -o {name}-out"));
        must_succeed(&output);
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let (tinted, grey) = (compare("tinted.toml"), compare("grey.toml"));
    for i in 0..2 {
        let (tinted, grey) = (&tinted["methods"][i], &grey["methods"][i]);
        assert_eq!(tinted["channels"]["green"], grey["errors"], "{}", grey["label"]);
        let rms = |channel: &str| tinted["channels"][channel]["rays"]["rms"].as_f64().unwrap();
        let all = tinted["errors"]["rays"]["rms"].as_f64().unwrap();
        let mean = ["red", "green", "blue"].map(|c| rms(c).powi(2)).iter().sum::<f64>() / 3.0;
        assert!((all * all - mean).abs() < 1e-12 && rms("red") != rms("blue"));
        let bytes = |row: &Json| row["bytes"].as_u64().unwrap();
        assert_eq!(bytes(tinted), 3 * bytes(grey));
    }
    let page = fs::read_to_string(folder.path().join("tinted.toml-out/report.html")).unwrap();
    assert!(page.contains("RMS errors by channel"));
    let page = fs::read_to_string(folder.path().join("grey.toml-out/report.html")).unwrap();
    assert!(!page.contains("RMS errors by channel"));
}

#[test]
fn a_transfer_function_comes_by_name_or_from_a_file() {
    let folder = Folder::new();
    // Red where ParaView shows red.
    let map = r#"[{"Name": "r", "RGBPoints": [0, 1, 0, 0, 1, 1, 0, 0], "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}]"#;
    fs::write(folder.path().join("red.json"), map).unwrap();
    fs::write(folder.path().join("list.txt"), "# value r g b opacity\n0 0 0 1 0\n1 0 0 1 1\n")
        .unwrap();
    for (name, channel) in [("red.json", 0), ("list.txt", 2)] {
        let out = format!("{name}.exr");
        must_succeed(
            &folder.run(&format!("render bucky {SMALL} --transparent --transfer {name} -o {out}")),
        );
        let sum = |c: usize| pixels(&folder, &out).iter().map(|p| p[c]).sum::<f32>();
        for other in (0..3).filter(|&c| c != channel) {
            assert!(sum(channel) > 4.0 * sum(other), "{name}: {} and {}", sum(channel), sum(other));
        }
    }
    for name in ["viridis", "bone", "auto"] {
        must_succeed(&folder.run(&format!("render bucky {SMALL} --transfer {name} -o p.png")));
    }
    let output = folder.run(&format!("render bucky {SMALL} --transfer rainbow -o q.png"));
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(
        said.contains("rainbow") && said.contains("viridis") && said.lines().count() == 1,
        "{said}"
    );
    assert!(!folder.names().contains(&"q.png".to_owned()));
}

/// A grid of vectors beside the densities colours them; an emitting grid needs no light.
#[test]
fn grids_of_colours_and_of_what_glows_are_read_from_openvdb() {
    let folder = Folder::new();
    let bounds = IndexBox { min: IVec3::ZERO, max: IVec3::splat(9) };
    let mut density = TreeBuilder::new(0.0_f32);
    density.fill(bounds, 1.0, true);
    let mut color = TreeBuilder::new([0.0_f32; 3]);
    color.fill(bounds, [0.9, 0.3, 0.0], true);
    let mut heat = TreeBuilder::new(0.0_f32);
    heat.fill(bounds, 1500.0, true);
    let names = ["density", "Cd", "temperature"];
    let mut writer = VdbWriter::new(&names, Compression::BLOSC, &Metadata::default());
    let place = DMat4::from_scale(glam::DVec3::splat(0.1));
    for grid in [density.finish().into(), color.finish().into(), heat.finish().into()] {
        writer.add(NewGrid::new(grid, &place)).unwrap();
    }
    fs::write(folder.path().join("box.vdb"), writer.finish().unwrap()).unwrap();
    let scene = "[volume]\npath = \"box.vdb\"\ndensity_scale = 4.0\ncolor = \"Cd\"\n\
                 [ground]\nenabled = false\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    must_succeed(&folder.run(&format!("render scene.toml {SMALL} -o lit.exr")));
    let sum = |name: &str, c: usize| pixels(&folder, name).iter().map(|p| p[c]).sum::<f32>();
    let [red, green, blue] = [0, 1, 2].map(|c| sum("lit.exr", c));
    assert!((green / red - 1.0 / 3.0).abs() < 0.01 && blue < 1e-4 * red, "{red} {green} {blue}");
    let wrong = scene.replace("\"Cd\"", "\"temperature\"");
    fs::write(folder.path().join("wrong.toml"), wrong).unwrap();
    let output = folder.run(&format!("render wrong.toml {SMALL} -o no.exr"));
    assert!(stderr(&output).contains("temperature") && output.status.code() == Some(1));
    let dark = format!("{scene}[[light]]\ndirection = [0, -1, 0]\nirradiance = [0, 0, 0]\n");
    fs::write(folder.path().join("dark.toml"), dark).unwrap();
    must_succeed(&folder.run(&format!("render dark.toml {SMALL} -o dark.exr")));
    assert!(sum("dark.exr", 0) == 0.0);
    must_succeed(
        &folder.run(&format!("render dark.toml {SMALL} --emission temperature -o hot.exr")),
    );
    let [red, green, blue] = [0, 1, 2].map(|c| sum("hot.exr", c));
    assert!(red > 1.0 && red > 2.0 * green && green > blue, "{red} {green} {blue}");
}
