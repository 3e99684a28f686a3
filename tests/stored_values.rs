//! Tests against closed forms that functions of stored values are applied between voxels, after
//! interpolation.

use std::path::Path;

use deepshadow::io::load_ingredients;
use deepshadow::reference::Extinction;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{Media, Scene, SceneFile};
use deepshadow::settings::Settings;
use glam::DVec3;

use crate::cli::{Folder, stderr};
use crate::support::backends::every_backend;

/// Writes numbers (z, y, x) as a NumPy file of f32.
pub fn write_npy(path: &Path, [nz, ny, nx]: [usize; 3], value: impl Fn([usize; 3]) -> f32) {
    let shape = format!("({nz}, {ny}, {nx})");
    let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.into_bytes());
    for (z, y, x) in
        (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x))))
    {
        bytes.extend(value([x, y, z]).to_le_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}

/// The scene for a table `[volume]` with a file in `folder`, and what was reported.
pub fn described(text: &str, folder: &Path) -> (Scene, Settings, Vec<String>) {
    let file = SceneFile::parse(text, &folder.join("scene.toml")).unwrap();
    let mut notes = Vec::new();
    let own = file.volume.iter().map(|table| {
        let (own, said) = load_ingredients(table, false).unwrap();
        notes.extend(said);
        own
    });
    let (scene, settings, _) =
        complete(&file, own.collect::<Vec<_>>(), Surroundings::Void).unwrap();
    (scene, settings, notes)
}

/// Optical depth along all of x through the middle.
fn along_x(media: &Media) -> f64 {
    let bounds = media.world_bounds();
    let origin = bounds.center() - DVec3::X * bounds.size().x;
    Extinction::of(media).optical_depth(origin, DVec3::X, [0.0, 2.0 * bounds.size().x])
}

#[test]
fn windows_and_functions_are_applied_between_voxels() {
    let folder = tempfile::tempdir().unwrap();
    write_npy(&folder.path().join("v.npy"), [4, 4, 2], |[x, ..]| [-1000.0, 1000.0][x]);
    for (how, expected) in [
        // From -1000 to 1000 within a voxel: a ramp over .05 of it, .45 behind that, half a voxel
        // of border.
        ("window = [0.0, 100.0]", 0.025 + 0.45 + 0.5),
        ("window = [-200.0, 200.0]", 0.1 + 0.4 + 0.5),
        ("transfer = { points = [[0, 1, 1, 1, 0], [100, 1, 1, 1, 1]] }", 0.025 + 0.45 + 0.5),
        ("transfer = { points = [[-600, 1, 1, 1, 0], [-500, 1, 1, 1, 1]] }", 0.025 + 0.75 + 0.5),
        // With a window, a function is over 0..1: here from 50 to 100.
        (
            "window = [0.0, 100.0]\ntransfer = { points = [[0.5, 1, 1, 1, 0], [1, 1, 1, 1, 1]] }",
            0.0125 + 0.45 + 0.5,
        ),
        // The ray passes through a band that no voxel's value is in.
        ("transfer = { points = [[-100, 1, 1, 1, 0], [0, 1, 1, 1, 1], [100, 1, 1, 1, 0]] }", 0.05),
        // The window contains all values.
        ("window = [-1000.0, 1000.0]", 0.5 + 0.5),
    ] {
        let text = format!("[volume]\npath = \"v.npy\"\ndensity_scale = 1.0\n{how}\n");
        let (scene, _, _) = described(&text, folder.path());
        let found = along_x(&scene.media);
        assert!((found - expected).abs() < 1e-5, "{how}: {found} instead of {expected}");
    }
}

/// Emission over densities, with a window: the ramp applies to the densities that result from the
/// window.
#[test]
fn emission_speaks_of_densities_whatever_is_held() {
    let folder = tempfile::tempdir().unwrap();
    write_npy(&folder.path().join("v.npy"), [4, 4, 4], |_| -300.0);
    let text = "[volume]\npath = \"v.npy\"\nwindow = [-400.0, -200.0]\ndensity_scale = 0.0\n\
         emission = { colors = \"grey\", scale = 2.0, range = [0.0, 1.0] }\n";
    let (scene, _, _) = described(text, folder.path());
    let body = scene.media.first().unwrap();
    let emission = body.medium.emission.as_ref().unwrap();
    let held = f64::from(body.volume.values()[[1, 1, 1]]);
    assert!((emission.ramp.at(held).1 - 0.5).abs() < 1e-6, "{:?}", emission.ramp);
}

/// A function that begins above the lowest value gives the same picture as one with a further point
/// at that value.
#[test]
fn a_function_that_begins_high_makes_no_bricks() {
    let folder = tempfile::tempdir().unwrap();
    write_npy(&folder.path().join("v.npy"), [9, 9, 9], |at| {
        let away = (0..3).map(|axis| (at[axis] as f32 - 4.0).powi(2)).sum::<f32>().sqrt();
        1.0 - 0.25 * away
    });
    let scene = |points: &str| {
        let text = format!(
            "[volume]\npath = \"v.npy\"\ndensity_scale = 3.0\ntransfer = {{ points = [{points}] }}\n\
             [image]\nwidth = 32\nheight = 32\n[shadow]\nsize = 32\n[background]\n\
             radiance = [0.2, 0.2, 0.2]\n[camera]\nposition = [14.0, 10.0, 20.0]\n\
             target = [4.0, 4.0, 4.0]\n[ground]\nenabled = false\n"
        );
        let (scene, settings, _) = described(&text, folder.path());
        (scene, settings)
    };
    // The step spans many cells of either table. The two functions have different cells, which a
    // sharp silhouette would show.
    let step = "[0.45, 1, 1, 1, 0], [0.55, 1, 1, 1, 1], [1, 1, 1, 1, 1]";
    let (high, settings) = scene(step);
    let (low, _) = scene(&format!("[-2, 1, 1, 1, 0], {step}"));
    assert!((along_x(&high.media) - along_x(&low.media)).abs() < 1e-6);
    for backend in every_backend() {
        let picture = |scene: &Scene| {
            backend.render(scene, &settings, &deepshadow::progress::Silent).unwrap().pixels
        };
        let (high, low) = (picture(&high), picture(&low));
        let differences = high.iter().zip(&low).map(|(a, b)| (a[0] - b[0]).abs());
        let off = differences.fold(0.0, f32::max);
        for (k, (a, b)) in high.iter().zip(&low).enumerate() {
            if (a[0] - b[0]).abs() > 0.01 {
                eprintln!("{} {} {a:?} {b:?}", k % 32, k / 32);
            }
        }
        assert!(off < 0.02, "{off}");
    }
}

#[test]
fn ranges_that_do_not_meet_the_data_are_spread_over_it() {
    let folder = tempfile::tempdir().unwrap();
    write_npy(&folder.path().join("v.npy"), [10, 10, 10], |[x, y, z]| {
        (3 * (x + 10 * y + 100 * z)) as f32
    });
    let map = r#"[{"Name": "n", "RGBPoints": [0, 0, 0, 1, 1, 1, 0, 0]}]"#;
    std::fs::write(folder.path().join("n.json"), map).unwrap();
    let range = |more: &str| {
        let text = format!("[volume]\npath = \"v.npy\"\n[volume.transfer]\n{more}\n");
        let (scene, _, notes) = described(&text, folder.path());
        let function = scene.media.first().unwrap().medium.transfer.clone().unwrap();
        (function.range(), notes.iter().any(|note| note.contains("`volume.transfer.range`")))
    };
    assert_eq!(range("file = \"n.json\""), ([0.0, 2997.0], true));
    assert_eq!(range("file = \"n.json\"\nrange = [0.0, 1.0]"), ([0.0, 1.0], false));
    assert_eq!(range("file = \"n.json\"\nrange = \"data\""), ([0.0, 2997.0], false));
    assert_eq!(range("name = \"viridis\"\nrange = \"data\""), ([0.0, 2997.0], false));
    let own = "points = [[200, 1, 1, 1, 0], [900, 1, 1, 1, 1]]";
    assert_eq!(range(own), ([200.0, 900.0], false));
    let beyond = "points = [[5000, 1, 1, 1, 0], [6000, 1, 1, 1, 1]]";
    assert_eq!(range(beyond), ([0.0, 2997.0], true));
    let wrong = "[volume.transfer]\nname = \"grey\"\nrange = \"all\"\n";
    let error = SceneFile::parse(wrong, Path::new("s.toml")).unwrap_err().to_string();
    assert!(
        error.contains("expected two numbers or \"data\"") && error.contains("line 3"),
        "{error}"
    );
}

/// Doubles may exceed what volumes can hold. The result must not be an empty picture, whatever the
/// file format.
#[test]
fn numbers_above_what_f32_holds_are_an_error_that_names_them() {
    let folder = Folder::new();
    let write = |largest: f64| {
        let voxels = [0.0, 1.0, largest, 3.0, 2.0, 1.0, -1e40, 5.0];
        let bytes: Vec<u8> = voxels.into_iter().flat_map(f64::to_le_bytes).collect();
        std::fs::write(folder.path().join("v.raw"), bytes).unwrap();
        let converted = folder.run("convert v.raw v.vdb --dims 2,2,2 --type f64");
        assert!(converted.status.success(), "{}", stderr(&converted));
    };
    let render = "--density-scale 0 --size 8x8 --map-size 8 --backend cpu -o o.png";
    let commands =
        ["v.raw --dims 2,2,2 --type f64", "v.vdb"].map(|file| format!("render {file} {render}"));
    write(1e40);
    for command in &commands {
        let output = folder.run(command);
        assert_eq!(output.status.code(), Some(1), "{command}");
        let said = stderr(&output);
        assert!(said.contains("1e40") && said.lines().count() == 1, "{command}: {said}");
    }
    write(3e38);
    for command in &commands {
        let output = folder.run(command);
        assert!(output.status.success(), "{command}: {}", stderr(&output));
    }
}
