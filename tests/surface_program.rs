//! Tests of hair and meshes in the program: what is drawn, what is refused, and what is kept.

use std::fs;

use crate::cli::{Folder, must_succeed, stderr};
use crate::support::Picture;
use crate::usage::must_fail;

const SMALL: &str = "--size 48x36 --map-size 64 --format npy";
/// A pane over the ground.
const PANE: &str = "v -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nf 1 2 3 4\n";

/// A file of hair: `count` upright strands of two points.
fn hair(count: u32) -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    for number in [count, 2 * count, 0b10, 1] {
        bytes.extend(number.to_le_bytes());
    }
    for number in [0.05_f32, 0.0, 0.5, 0.4, 0.3] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.resize(128, 0);
    for i in 0..count {
        let at = i as f32 / count as f32;
        for number in [at, 0.3 * at, 0.2, at, 0.3 * at, 1.0] {
            bytes.extend(number.to_le_bytes());
        }
    }
    bytes
}

fn folder() -> Folder {
    let folder = Folder::new();
    fs::write(folder.path().join("pane.obj"), PANE).unwrap();
    fs::write(folder.path().join("fur.hair"), hair(40)).unwrap();
    folder
}

/// The red values of a picture, from left to right and from top to bottom.
fn picture(folder: &Folder, arguments: &str) -> Vec<f32> {
    must_succeed(&folder.run(&format!("render {arguments} {SMALL} --quiet -o p.npy")));
    let bytes = fs::read(folder.path().join("p.npy")).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let values: Vec<f32> =
        bytes[start..].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    values.chunks_exact(4).map(|pixel| pixel[0]).collect()
}

/// The share of pixels darker than the brightest by more than a tenth.
fn shaded(pixels: &[f32]) -> f64 {
    let brightest = pixels.iter().copied().fold(0.0, f32::max);
    pixels.iter().filter(|&&pixel| pixel < 0.9 * brightest).count() as f64 / pixels.len() as f64
}

/// The smallest, the median and the largest value of a picture.
fn spread(mut pixels: Vec<f32>) -> [f32; 3] {
    pixels.sort_by(f32::total_cmp);
    [pixels[0], pixels[pixels.len() / 2], pixels[pixels.len() - 1]]
}

#[test]
fn a_file_of_hair_or_a_mesh_is_seen_with_its_shadow() {
    let folder = folder();
    for (name, least) in [("pane.obj", 0.05), ("fur.hair", 0.005)] {
        let share = shaded(&picture(&folder, name));
        assert!((least..1.0).contains(&share), "{name}: {share}");
        // Surfaces are brighter than the ground, which most pixels see, and their shadow is darker.
        let [dark, ground, bright] = spread(picture(&folder, &format!("{name} --albedo 0.9")));
        assert!(dark < 0.95 * ground && bright > 1.5 * ground, "{name}: {dark} {ground} {bright}");
    }
    let [dark, ground, bright] = spread(picture(&folder, "pane.obj --opacity 0.25 --albedo 0"));
    assert!(dark > 0.5 * ground && bright < 1.01 * ground, "{dark} {ground} {bright}");
    assert_eq!(shaded(&picture(&folder, "fur.hair --opacity 0")), 0.0);
}

#[test]
fn figures_of_hair_are_those_of_the_files_that_are_named() {
    let folder = folder();
    must_succeed(
        &folder.run("figures -o sheets --backend cpu --quiet --hair fur.hair --hair fur.hair"),
    );
    for (name, columns) in [("1.1", 2), ("1.2", 2), ("1.6", 3)] {
        let path = folder.path().join(format!("sheets/hair-figure-{name}.png"));
        let sheet = Picture::open(path);
        assert_eq!(sheet.size[0], 8 + columns * 488, "{name}");
        let bright = sheet.pixels().filter(|pixel| pixel[2] > 100).count();
        assert!(bright > 2_000, "{name} shows something: {bright} bright pixels");
    }
    let table = fs::read_to_string(folder.path().join("sheets/hair-table-1.1.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "map_size,method,map_ms,picture_ms,frames_per_second");
    assert_eq!(lines.len(), 22);
    for line in &lines[1..] {
        let numbers: Vec<f64> = line.split(',').skip(2).map(|one| one.parse().unwrap()).collect();
        let rate = 1000.0 / (numbers[0] + numbers[1]);
        assert!((numbers[2] / rate - 1.0).abs() < 0.05, "{line}");
    }
    must_fail(&folder, "figures -o more --hair pane.obj", 1, &["pane.obj", "a mesh"]);
    assert!(!folder.path().join("more").exists());
}

#[test]
fn scene_files_place_hair_and_meshes_beside_volumes() {
    let folder = folder();
    let scene = |text: &str| fs::write(folder.path().join("s.toml"), text).unwrap();
    let with = "[[volume]]\npreset = 'box'\n[[mesh]]\npath = 'pane.obj'\ntranslate = [0, 2, 0]\n\
                [[hair]]\npath = 'fur.hair'\nthickness = 0.1\n[light]\ndirection = [0, -1, 0]\n\
                [camera]\nposition = [0, 3, 9]\ntarget = [0, 0, 0]\n";
    scene(with);
    let shadowed: f32 = picture(&folder, "s.toml").iter().sum();
    scene(&with.replace("[[hair]]", "casts = false\n[[hair]]\ncasts = false"));
    let lit: f32 = picture(&folder, "s.toml").iter().sum();
    assert!(shadowed < 0.98 * lit, "{shadowed} {lit}");
    scene(&with.replace(
        "translate = [0, 2, 0]",
        "keyframes = [{ frame = 1, translate = [0, 2, 0] }, \
                         { frame = 3, translate = [50, 2, 0] }]",
    ));
    must_succeed(&folder.run(&format!("render s.toml {SMALL} --quiet -o f.#.npy")));
    let frame = |i: u32| fs::read(folder.path().join(format!("f.{i}.npy"))).unwrap();
    assert!(frame(1) != frame(2) && frame(1) != frame(3));
    // What is saved repeats the picture.
    scene(with);
    let save = format!("render s.toml {SMALL} --quiet --save-scene t.toml -o a.npy");
    must_succeed(&folder.run(&save));
    must_succeed(&folder.run("render t.toml --format npy --quiet -o b.npy"));
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("a.npy"), read("b.npy"));
}

#[test]
fn what_does_not_fit_hair_or_meshes_is_refused_in_one_line() {
    let folder = folder();
    let scene = |text: &str| fs::write(folder.path().join("s.toml"), text).unwrap();
    must_fail(&folder, "render box --opacity 0.5", 2, &["opacity", "no mesh and no hair"]);
    must_fail(&folder, "render pane.obj --thickness 2", 2, &["thickness", "no hair"]);
    must_fail(&folder, "render pane.obj --density-scale 2", 2, &["density-scale", "no volume"]);
    must_fail(&folder, "render pane.obj --grid density", 2, &["grid"]);
    must_fail(&folder, "render pane.obj --opacity 1.5", 2, &["opacity", "1.5"]);
    must_fail(&folder, "convert pane.obj v.vdb", 1, &["a mesh, not a volume"]);
    for (text, named) in [
        ("[[mesh]]\npath = 'fur.hair'\n", "[[hair]]"),
        ("[[hair]]\npath = 'pane.obj'\n", "[[mesh]]"),
        ("[[hair]]\nopacity = 0.5\n", "hair: give a path"),
        ("[[mesh]]\npath = 'none.obj'\n", "none.obj"),
        ("[[mesh]]\npath = 'pane.obj'\nscale = 0.0\n", "mesh.scale"),
        ("[[hair]]\npath = 'fur.hair'\nthickness = -1.0\n", "hair.thickness"),
        ("[[hair]]\npath = 'fur.hair'\nopacity = 2.0\n", "hair.opacity"),
        ("[[mesh]]\npath = 'pane.obj'\nup = 'w'\n", "up"),
        ("[[mesh]]\npath = 'pane.obj'\nthickness = 1.0\n", "thickness"),
    ] {
        scene(text);
        let said = stderr(&folder.run("render s.toml -o p.png --quiet"));
        assert!(said.contains(named) && said.lines().count() == 1, "{text}: {said}");
    }
    let refused = folder.run("render pane.obj --map grid:16 --quiet -o p.png");
    assert!(stderr(&refused).contains("meshes and hair"), "{}", stderr(&refused));
    assert!(!folder.path().join("p.png").exists());
    for input in ["pane.obj", "fur.hair"] {
        let before = fs::read(folder.path().join(input)).unwrap();
        let output = folder.run(&format!("render {input} --format png -o {input}"));
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert_eq!(fs::read(folder.path().join(input)).unwrap(), before);
    }
}

#[test]
fn meshes_and_hair_of_any_shape_end_in_a_picture_or_one_line() {
    let folder = folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 1\nf 1 2 3\n";
    write("flat.obj", &format!("{triangle}{}", "f 1 1 2\n".repeat(100_000)));
    write("nan.obj", &format!("{triangle}f 1 2 4\n"));
    write("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    write("far.obj", "v 1e30 0 0\nv 1e30 1 0\nv 0 1e30 0\nf 1 2 3\n");
    for name in ["flat.obj", "nan.obj", "line.obj", "far.obj"] {
        for light in ["0,-1,0", "1,0,0", "0.3,-0.5,0.2"] {
            picture(&folder, &format!("{name} --light {light}"));
        }
    }
    write("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
    write("outside.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    write("none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for (name, said) in [("point.obj", "one point"), ("outside.obj", "9"), ("none.obj", "no ")] {
        let output = folder.run(&format!("render {name} --quiet -o p.png"));
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {text}");
        assert!(text.lines().count() == 1 && text.contains(said), "{name}: {text}");
    }
    // Strands as wide as the map, over each other.
    fs::write(folder.path().join("many.hair"), hair(4_000)).unwrap();
    picture(&folder, "many.hair --thickness 9");
    fs::write(folder.path().join("many.hair"), hair(40_000)).unwrap();
    let output = folder.run(&format!("render many.hair --thickness 9 {SMALL} --quiet -o p.npy"));
    let text = stderr(&output);
    assert!(text.contains("over one tile of a map") && text.lines().count() == 1, "{text}");
}
