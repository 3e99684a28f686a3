//! Tests of the light meter, in the library and in the program.

use std::fs;

use deepshadow::probe::{ProbePoint, probe};
use deepshadow::scene::{Light, LightKind};
use deepshadow::{CpuBackend, Silent};
use glam::DVec3;

use deepshadow::probe::Probe;

use crate::cli::{Folder, must_succeed};
use crate::surfaces::{bare, exact, fragments, pane, through_map};
use crate::usage::must_fail;

#[test]
fn the_light_meter_minds_normals_bias_and_each_light() {
    let mut scene = bare(vec![pane(1.0, 0.0, 0.75)], DVec3::NEG_Y);
    scene
        .lights
        .push(Light::new(LightKind::Point { position: DVec3::new(0.0, -3.0, 0.0) }, DVec3::ONE));
    let on_pane =
        |normal: Option<DVec3>| ProbePoint { position: DVec3::new(0.2, 0.0, 0.1), normal };
    let points = [on_pane(Some(DVec3::Y)), on_pane(Some(DVec3::NEG_Y * 3.0)), on_pane(None)];
    for how in [exact(None), through_map(None)] {
        let found = probe(&scene, &fragments(32), &CpuBackend, &points, &how, &Silent).unwrap();
        let first = |row: usize| [found[row][0][0], found[row][1][0]];
        assert_eq!(first(0), [1.0, 0.0], "lit from above alone");
        assert_eq!(first(1), [0.0, 1.0], "lit from below alone");
        let mut biased = how.clone();
        biased.bias = 0.01;
        let found = probe(&scene, &fragments(32), &CpuBackend, &points, &biased, &Silent).unwrap();
        assert_eq!([found[2][0][0], found[2][1][0]], [1.0; 2], "on both sides with a bias");
        biased.bias = -0.01;
        let found = probe(&scene, &fragments(32), &CpuBackend, &points, &biased, &Silent).unwrap();
        assert!((found[2][0][0] - 0.25).abs() < 1e-6, "{:?}", found[2]);
    }
    let mut wrong = exact(Some(0.0));
    let refused = |how: &Probe, points: &[ProbePoint]| {
        probe(&scene, &fragments(32), &CpuBackend, points, how, &Silent).unwrap_err().to_string()
    };
    assert_eq!(refused(&wrong, &points), "footprint: 0 is not above 0");
    wrong.footprint = None;
    let nowhere = [DVec3::NAN.into()];
    assert!(refused(&wrong, &nowhere).starts_with("points: point 0"), "NaN");
    let flat = [on_pane(Some(DVec3::ZERO))];
    assert!(refused(&wrong, &flat).starts_with("normals: normal 0"), "no direction");
}

/// The share of a spot light is that of a light in all directions, also among what casts shadows.
#[test]
fn a_spot_lights_cone_is_no_shadow() {
    let mut scene = bare(vec![pane(1.0, 0.5, 0.75), pane(1.0, -0.5, 0.5)], DVec3::NEG_Y);
    let direction = DVec3::NEG_Y;
    let kind = LightKind::Spot {
        position: DVec3::new(0.1, 0.0, 0.1),
        direction,
        cone_degrees: 20.0,
        cone_softness: 0.2,
    };
    scene.lights = vec![Light::new(kind, DVec3::ONE)];
    let at = |x: f64, y: f64| ProbePoint::from(DVec3::new(x, y, 0.0));
    let points = [at(0.1, -2.0), at(0.1, 2.0), at(0.6, 0.0), at(0.1, 0.3)];
    for how in [exact(None), through_map(None), through_map(Some(1e-30))] {
        let found = probe(&scene, &fragments(32), &CpuBackend, &points, &how, &Silent).unwrap();
        for (row, due) in found.iter().zip([0.5, 0.25, 1.0, 1.0]) {
            assert!((row[0][0] - due).abs() < 1e-6, "{how:?}: {found:?}");
        }
    }
    scene.lights = vec![Light::directional(DVec3::NEG_Y)];
    let far = [at(0.0, -1e39), at(0.0, 1e39)];
    let found = probe(&scene, &fragments(32), &CpuBackend, &far, &through_map(None), &Silent);
    let found = found.unwrap();
    assert!((found[0][0][0] - 0.125).abs() < 1e-6 && found[1][0][0] == 1.0, "{found:?}");
}

/// An array of 32-bit floats of shape (n, columns).
fn npy(rows: &[&[f32]]) -> Vec<u8> {
    let shape = [rows.len(), rows[0].len()];
    let values: Vec<f32> = rows.concat();
    deepshadow::io::encode_array(&shape, values.into_iter()).unwrap()
}

/// The numbers of a file that `probe` wrote, and the text of its shape.
fn measured(folder: &Folder, name: &str) -> (String, Vec<f32>) {
    let bytes = fs::read(folder.path().join(name)).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let head = String::from_utf8_lossy(&bytes[10..start]);
    let shape = head.split_once("'shape': (").unwrap().1.split_once(')').unwrap().0.to_owned();
    let values = bytes[start..].chunks_exact(4);
    (shape, values.map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect())
}

/// A pane of glass at a height of 1, over which light falls straight down.
const PANE: &str = "mtllib glass.mtl\nusemtl glass\nv -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\n\
                    f 1 2 3 4\n";

#[test]
fn the_program_measures_what_arrives_at_points() {
    let folder = Folder::new();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    write("pane.obj", PANE.as_bytes());
    write("glass.mtl", b"newmtl glass\nKd 1 1 1\nd 0.75\n");
    write("p.npy", &npy(&[&[0.1, 0.0, 0.2], &[0.1, 2.0, 0.2], &[3.0, 0.0, 0.0]]));
    for how in ["--exact", "", "--exact --footprint 0.1", "--footprint 0.1"] {
        let command = format!("probe pane.obj --points p.npy --light 0,-1,0 {how} -o t.npy");
        must_succeed(&folder.run(&command));
        let (shape, values) = measured(&folder, "t.npy");
        assert_eq!(shape, "3, 1, 3");
        for (value, due) in values.chunks(3).zip([0.25, 1.0, 1.0]) {
            assert!(value.iter().all(|v| (v - due).abs() < 1e-6), "{how}: {values:?}");
        }
    }
    write(
        "scene.toml",
        b"[[mesh]]\npath = 'pane.obj'\nopacity = 0.5\n[[light]]\n\
        direction = [0, -1, 0]\n[[light]]\nkind = 'point'\nposition = [0, -2, 0]\n",
    );
    must_succeed(&folder.run("probe scene.toml --points p.npy --exact -o t.npy"));
    let (shape, values) = measured(&folder, "t.npy");
    assert_eq!(shape, "3, 2, 3");
    assert_eq!(values[..6], [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]);
    assert_eq!(values[6..12], [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]);
    // Normals: the pane's points are lit from one side each.
    write("n.npy", &npy(&[&[0.0, 1.0, 0.0], &[0.0, -1.0, 0.0], &[0.0, 1.0, 0.0]]));
    must_succeed(&folder.run("probe scene.toml --points p.npy --normals n.npy --exact -o t.npy"));
    let (_, values) = measured(&folder, "t.npy");
    let firsts: Vec<f32> = values.chunks(3).map(|value| value[0]).collect();
    assert_eq!(firsts, [0.5, 0.0, 0.0, 0.5, 1.0, 0.0]);
}

#[test]
fn the_program_says_what_is_wrong_with_points() {
    let folder = Folder::new();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    write("pane.obj", PANE.split_once('\n').unwrap().1.replace("usemtl glass\n", "").as_bytes());
    write("p.npy", &npy(&[&[0.0, 0.0, 0.0]]));
    write("flat.npy", &npy(&[&[0.0, 0.0]]));
    write("nan.npy", &npy(&[&[0.0, f32::NAN, 0.0]]));
    write("cut.npy", &npy(&[&[0.0, 0.0, 0.0]])[..130]);
    write("text.npy", b"x y z");
    for (points, said) in [
        ("flat.npy", "shape (1, 2), expected (n, 3)"),
        ("nan.npy", "row 0"),
        ("cut.npy", "130 bytes, its header says 140"),
        ("text.npy", "not a NumPy file"),
        ("none.npy", "none.npy"),
    ] {
        must_fail(&folder, &format!("probe pane.obj --points {points} -o t.npy"), 1, &[said]);
    }
    let two = "probe pane.obj --points p.npy --normals flat.npy -o t.npy";
    must_fail(&folder, two, 1, &["flat.npy"]);
    must_fail(&folder, "probe pane.obj --points p.npy --footprint 0", 2, &["footprint"]);
    must_fail(&folder, "probe pane.obj --points p.npy -o t.png", 2, &["t.png", ".npy"]);
    for input in ["p.npy", "pane.obj"] {
        let before = fs::read(folder.path().join(input)).unwrap();
        let out = if input == "p.npy" { "p.npy" } else { "./pane.obj" };
        let command = format!("probe pane.obj --points p.npy -o {out}");
        let code = if input == "p.npy" { 1 } else { 2 };
        must_fail(&folder, &command, code, &[]);
        assert_eq!(fs::read(folder.path().join(input)).unwrap(), before);
    }
    assert!(!folder.path().join("t.npy").exists());
}
