//! Tests that saved scene files repeat pictures to the bit.

use std::fs;

use crate::cli::{Folder, must_succeed, stderr};
use crate::support::Picture;
use crate::usage::must_fail;

const SMALL: &str = "--backend cpu --size 48x32 --map-size 40";

#[test]
fn a_saved_scene_repeats_its_picture_to_the_bit() {
    let folder = Folder::new();
    write_ball(&folder, "ball.npy", [0.0, 0.0, 3.0]);
    // For a ball in noisy surroundings a window is chosen.
    write_ball(&folder, "scan.npy", [100.0, 16.0, 900.0]);
    for (input, options) in [
        ("bucky", ""),
        ("clouds", "--light 200,35 --azimuth 10 --elevation 80 --zoom 1.3 --phase 0.4"),
        ("ball.npy", "--transfer auto --ground none --background 0,0.2,1 --samples 3"),
        ("ball.npy", "--emission density --albedo 0.5,0.9,1 --exposure +1ev --tonemap aces"),
        ("scan.npy", "--light 0.1,-1,0.3 --light-color 2,1,1 --camera 3,4,60 --map threshold"),
        ("bucky", "--map nested --filter pcf3 --quality 0.5 --picture-tolerance 0.01"),
    ] {
        for name in ["a.png", "a.exr"] {
            let render = format!("render {input} {options} {SMALL} --save-scene s.toml -o {name}");
            must_succeed(&folder.run(&render));
            must_succeed(&folder.run(&format!("render s.toml --backend cpu -o b-{name}")));
            let [a, b] = [name, &format!("b-{name}")].map(|name| folder.path().join(name));
            assert!(fs::read(a).unwrap() == fs::read(b).unwrap(), "{input} {options} {name}");
        }
        let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
        for key in ["density_scale", "position", "irradiance", "tolerance", "quality"] {
            assert!(text.contains(key), "{key}: {text}");
        }
    }
}

/// Writes a ball of some density more than its surroundings, which are noisy.
fn write_ball(folder: &Folder, name: &str, [around, noise, more]: [f32; 3]) {
    let mut state = 1_u32;
    let values = ndarray::Array3::from_shape_fn((14, 15, 16), |(z, y, x)| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let away = [x as f32 - 7.5, y as f32 - 7.0, z as f32 - 6.5].map(|c| c * c);
        let inside = away.iter().sum::<f32>() < 25.0;
        around + noise * (state >> 28) as f32 / 16.0 + if inside { more } else { 0.0 }
    });
    folder.write_npy(name, &values);
}

#[test]
fn what_a_scene_file_cannot_say_is_told() {
    let folder = Folder::new();
    let output =
        folder.run(&format!("render bucky {SMALL} --transparent --save-scene s.toml -o a.png"));
    must_succeed(&output);
    assert!(stderr(&output).contains("--transparent as well"), "{}", stderr(&output));
    must_succeed(&folder.run("render s.toml --backend cpu --transparent -o b.png"));
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b);
}

#[test]
fn a_chosen_quality_is_saved_too() {
    let folder = Folder::new();
    let goal = "--max-picture-error 0.02 --save-scene s.toml";
    must_succeed(&folder.run(&format!("render bucky --backend cpu --size 64x64 {goal} -o a.png")));
    must_succeed(&folder.run("render s.toml --backend cpu -o b.png"));
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b);
}

#[test]
fn nothing_is_overwritten_or_left_behind() {
    let folder = Folder::new();
    must_succeed(&folder.run(&format!("render bucky {SMALL} --save-scene s.toml -o a.png")));
    let before = fs::read(folder.path().join("s.toml")).unwrap();
    // The scene that is being read.
    must_fail(
        &folder,
        &format!("render s.toml {SMALL} --save-scene s.toml -o b.png"),
        1,
        &["s.toml"],
    );
    assert!(fs::read(folder.path().join("s.toml")).unwrap() == before);
    must_fail(&folder, &format!("render bucky {SMALL} --save-scene s.txt -o b.png"), 2, &[".toml"]);
    must_fail(&folder, "render bucky --save-scene s.toml --max-error 0.1", 2, &["--max-error"]);
    let same = "render bucky --format png -o t.toml --save-scene ./t.toml";
    must_fail(&folder, same, 2, &["t.toml"]);
    let mut names = folder.names();
    names.sort();
    assert_eq!(names, ["a.png", "s.toml"]);
}

/// A scene file that adds nothing shows what the command line shows.
#[test]
fn a_scene_file_that_says_nothing_more_changes_nothing() {
    let folder = Folder::new();
    write_ball(&folder, "ball.npy", [0.0, 0.0, 3.0]);
    write_ball(&folder, "scan.npy", [100.0, 16.0, 900.0]);
    for (input, scene) in [
        ("ball.npy", "path = 'ball.npy'"),
        ("scan.npy", "path = 'scan.npy'"),
        ("clouds", "preset = 'clouds'"),
        ("rods", "preset = 'rods'"),
    ] {
        fs::write(folder.path().join("s.toml"), format!("[volume]\n{scene}\n")).unwrap();
        for (input, name) in [(input, "a.png"), ("s.toml", "b.png")] {
            must_succeed(&folder.run(&format!("render {input} {SMALL} -o {name}")));
        }
        let [a, b] = ["a.png", "b.png"].map(|name| fs::read(folder.path().join(name)).unwrap());
        assert!(a == b, "{scene}");
    }
    // What a preset brings is said.
    let output = folder.run(&format!("render s.toml {SMALL} -o b.png"));
    assert!(stderr(&output).contains("up (--up) z"), "{}", stderr(&output));
    // Absolute numbers stay what they are: nothing but the light shines.
    let scene = "[volume]\npath = 'ball.npy'\ndensity_scale = 0\n[light]\ndirection = [0, -1, 0]\n\
                 [ground]\nenabled = false\n";
    fs::write(folder.path().join("dark.toml"), scene).unwrap();
    must_succeed(&folder.run(&format!("render dark.toml {SMALL} -o c.png")));
    let picture = Picture::open(folder.path().join("c.png"));
    assert!(picture.pixels().all(|pixel| pixel[..3] == [0, 0, 0]));
}

#[test]
fn from_below_no_ground_is_in_the_way() {
    let folder = Folder::new();
    write_ball(&folder, "ball.npy", [0.0, 0.0, 3.0]);
    let middle = |options: &str| {
        must_succeed(&folder.run(&format!("render ball.npy {SMALL} {options} -o a.png")));
        let picture = Picture::open(folder.path().join("a.png"));
        let at = |index: usize| f64::from(picture.pixels().nth(index).unwrap()[0]);
        (at(16 * 48 + 24) - at(0)).abs()
    };
    assert!(middle("--view bottom --background 0,0,0") > 8.0);
    assert!(middle("--elevation -30 --background 0,0,0") > 8.0);
    let hidden = format!("render ball.npy {SMALL} --elevation -60 --ground 0 -o a.png");
    let output = folder.run(&hidden);
    must_succeed(&output);
    assert!(stderr(&output).contains("below the ground"), "{}", stderr(&output));
    let catch = "--elevation -30 --transparent --catch-shadow";
    must_fail(&folder, &format!("render ball.npy {SMALL} {catch} -o b.png"), 2, &["no ground"]);
}

#[test]
fn radiance_of_what_glows_has_a_unit_that_can_be_guessed() {
    let folder = Folder::new();
    write_ball(&folder, "ball.npy", [0.0, 0.0, 3.0]);
    let fire = "--emission density --light-color 0,0,0 --ground none --background 0,0,0";
    let brightest = |radiance: f64| {
        let options = format!("{fire} --emission-radiance {radiance} --tonemap none");
        must_succeed(&folder.run(&format!("render ball.npy {SMALL} {options} -o a.npy")));
        let bytes = fs::read(folder.path().join("a.npy")).unwrap();
        let values = bytes[bytes.len() - 48 * 32 * 16..].chunks(4);
        let values = values.map(|four| f32::from_le_bytes(four.try_into().unwrap()));
        values
            .enumerate()
            .filter(|(i, _)| i % 4 == 0)
            .map(|(_, r)| f64::from(r))
            .fold(0.0, f64::max)
    };
    // Without glow there is still ambient light.
    let dark = brightest(0.0);
    let (one, four) = (brightest(1.0) - dark, brightest(4.0) - dark);
    assert!((0.6..1.7).contains(&one), "{one}");
    assert!((four / one - 4.0).abs() < 0.02, "{one} {four}");
    let scene = "[volume]\npath = 'ball.npy'\nemission = { scale = 2.0, radiance = 1.0 }\n";
    fs::write(folder.path().join("both.toml"), scene).unwrap();
    must_fail(&folder, &format!("render both.toml {SMALL} -o a.png"), 1, &["emission.scale"]);
}
