//! Scans of patients stand up and can be seen from their own sides.

use std::fs;

use crate::cli::{Folder, must_succeed, stderr};
use crate::usage::must_fail;

const SMALL: &str = "--backend cpu --size 32x32 --map-size 16";

/// Writes a head, higher than wide, with a nose at the front and an ear on the left: a file whose
/// first axis goes to the back, the second to the head and the third to the right.
fn write_scan(folder: &Folder, name: &str, space: &str, signs: [i32; 3]) {
    let [l, p, s] = signs;
    let axes = format!("(0,{p},0) (0,0,{s}) ({},0,0)", -l);
    let origin = format!("({},{},{})", 8 * l, -8 * p, -12 * s);
    let header = format!(
        "NRRD0004\ntype: uchar\ndimension: 3\nspace: {space}\nsizes: 16 24 16\n\
         space directions: {axes}\nspace origin: {origin}\nencoding: raw\n\n"
    );
    let mut bytes = header.into_bytes();
    for right in 0..16 {
        for up in 0..24 {
            for back in 0..16 {
                let head =
                    (4..12).contains(&right) && (4..20).contains(&up) && (4..12).contains(&back);
                let nose =
                    (7..9).contains(&right) && (10..12).contains(&up) && (1..4).contains(&back);
                bytes.push(if head || nose { 200 } else { 0 });
            }
        }
    }
    fs::write(folder.path().join(name), bytes).unwrap();
}

/// A key of three numbers in a saved scene.
fn numbers(folder: &Folder, key: &str) -> Vec<f64> {
    let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let line = text.lines().find(|line| line.starts_with(&format!("{key} = ["))).unwrap();
    let inside = line.split(['[', ']']).nth(1).unwrap().to_owned();
    inside.split(',').map(|number| number.trim().parse().unwrap()).collect()
}

#[test]
fn a_patient_stands_and_is_seen_from_the_front() {
    let folder = Folder::new();
    for (name, space, signs) in [
        ("lps.nrrd", "left-posterior-superior", [1, 1, 1]),
        ("ras.nrrd", "right-anterior-superior", [-1, -1, 1]),
    ] {
        write_scan(&folder, name, space, signs);
        let save = "--save-scene s.toml -o a.png";
        let output = folder.run(&format!("render {name} {SMALL} {save}"));
        must_succeed(&output);
        assert!(stderr(&output).contains("up (--up) z"), "{}", stderr(&output));
        let towards = |folder: &Folder| {
            let (eye, target) = (numbers(folder, "position"), numbers(folder, "target"));
            let length = (0..3).map(|i| (eye[i] - target[i]).powi(2)).sum::<f64>().sqrt();
            [0, 1, 2].map(|i| (eye[i] - target[i]) / length)
        };
        // In the world of the picture the head is at +y and the nose at +z.
        assert!(towards(&folder)[2] > 0.8, "{:?}", towards(&folder));
        for (side, axis, sign) in [
            ("anterior", 2, 1.0),
            ("posterior", 2, -1.0),
            ("superior", 1, 1.0),
            ("inferior", 1, -1.0),
        ] {
            must_succeed(&folder.run(&format!("render {name} {SMALL} --view {side} {save}")));
            let found = towards(&folder);
            assert!(found[axis] * sign > 0.99, "{name} {side}: {found:?}");
            let up = numbers(&folder, "up");
            let expected = if axis == 2 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, -sign] };
            for i in 0..3 {
                assert!((up[i] - expected[i]).abs() < 1e-9, "{name} {side}: up {up:?}");
            }
        }
    }
    // Left is the patient's, also seen from a little above.
    must_succeed(
        &folder.run(&format!("render lps.nrrd {SMALL} --view left --save-scene s.toml -o a.png")),
    );
    assert!(numbers(&folder, "position")[0] > 20.0, "{:?}", numbers(&folder, "position"));
    let raised = "--view left --elevation 30 --save-scene s.toml -o a.png";
    must_succeed(&folder.run(&format!("render lps.nrrd {SMALL} {raised}")));
    let (eye, target) = (numbers(&folder, "position"), numbers(&folder, "target"));
    let slope = (eye[1] - target[1]) / (eye[0] - target[0]);
    assert!((slope - 30_f64.to_radians().tan()).abs() < 1e-6, "{slope}");
    // The numbers of a scene file stay those of the file's world.
    let scene =
        "[volume]\npath = 'lps.nrrd'\ndensity_scale = 0.01\n[light]\ndirection = [0, -1, 0]\n";
    fs::write(folder.path().join("absolute.toml"), scene).unwrap();
    let output = folder.run(&format!("render absolute.toml {SMALL} -o a.png"));
    must_succeed(&output);
    assert!(!stderr(&output).contains("--up"), "{}", stderr(&output));
}

#[test]
fn other_files_have_no_anatomy() {
    let folder = Folder::new();
    must_fail(&folder, &format!("render bucky {SMALL} --view anterior"), 2, &["'anterior' needs"]);
    must_fail(&folder, &format!("render bucky {SMALL} --view nose"), 2, &["posterior"]);
    let save = "--view left --save-scene s.toml -o a.png";
    must_succeed(&folder.run(&format!("render bucky {SMALL} {save}")));
    assert!(numbers(&folder, "position")[0] < -1.0, "{:?}", numbers(&folder, "position"));
}
