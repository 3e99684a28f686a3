//! Sequences of pictures: what is chosen is chosen once, and every frame is there, whole.

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use ndarray::Array3;

use crate::cli::{Folder, must_succeed, program, stderr};
use crate::support::Picture;
use crate::usage::must_fail;

const SMALL: &str = "--backend cpu --size 48x40 --map-size 32";

/// A puff with a dense core at the top, which grows downwards: nothing comes between its core and a
/// light above, or between its core and a camera.
fn puff(age: usize) -> Array3<f32> {
    Array3::from_shape_fn((24, 32, 24), |(z, y, x)| {
        let in_column = (8..16).contains(&x) && (8..16).contains(&z);
        let core = (22..30).contains(&y);
        let trail = y < 22 && y + 4 * age >= 22;
        if in_column && core {
            1.0
        } else if in_column && trail {
            2.0
        } else {
            0.0
        }
    })
}

/// Mean radiance of the middle of the core: a part of the picture that a fixed camera
/// sees in every frame.
fn brightness(folder: &Folder, name: &str) -> f64 {
    let picture = Picture::open(folder.path().join(name));
    let all: Vec<f64> = picture.pixels().map(|pixel| f64::from(pixel[0]) / 255.0).collect();
    let width = 48;
    let rows = all.chunks(width).skip(14).take(4);
    let core: Vec<f64> = rows.flat_map(|row| row[22..26].to_vec()).collect();
    core.iter().sum::<f64>() / core.len() as f64
}

#[test]
fn growth_is_seen_and_brightness_stays() {
    let folder = Folder::new();
    for age in 0..5 {
        folder.write_npy(&format!("puff.{:04}.npy", age + 7), &puff(age));
    }
    let stage = "--light 0,-1,0 --camera 11.5,20,110 --target 11.5,20,11.5 --tonemap none";
    let output = folder.run(&format!("render puff.####.npy {stage} {SMALL}"));
    must_succeed(&output);
    let names: Vec<String> = (7..12).map(|frame| format!("puff.{frame:04}.png")).collect();
    assert!(names.iter().all(|name| folder.names().contains(name)), "{:?}", folder.names());
    // What is chosen is said once.
    assert_eq!(stderr(&output).matches("density scale").count(), 1, "{}", stderr(&output));
    let found: Vec<f64> = names.iter().map(|name| brightness(&folder, name)).collect();
    for one in &found {
        assert!((one / found[0] - 1.0).abs() < 0.02, "{found:?}");
    }
    // A part of the sequence looks like the whole.
    must_succeed(&folder.run(&format!("render puff.####.npy {stage} {SMALL} --frames 8 -o 8.png")));
    let [whole, part] = ["puff.0008.png", "8.png"].map(|name| folder.path().join(name));
    assert!(fs::read(whole).unwrap() == fs::read(part).unwrap());
    // By themselves, frames would choose other densities.
    let alone: Vec<f64> = [7, 11]
        .map(|frame| {
            must_succeed(
                &folder.run(&format!("render puff.{frame:04}.npy {stage} {SMALL} -o a.png")),
            );
            brightness(&folder, "a.png")
        })
        .to_vec();
    assert!((alone[1] / alone[0] - 1.0).abs() > 0.04, "{alone:?}");
}

#[test]
fn the_camera_sees_all_of_what_grows() {
    let folder = Folder::new();
    for age in 0..6 {
        folder.write_npy(&format!("p{age}.npy"), &puff(age));
    }
    let all = "--transparent -o p#.png --save-scene s.toml";
    must_succeed(&folder.run(&format!("render p#.npy {SMALL} {all}")));
    let [width, height] = [48, 40];
    let (mut across, mut down) = (vec![false; width], vec![false; height]);
    for age in 0..6 {
        let picture = Picture::open(folder.path().join(format!("p{age}.png")));
        for (at, pixel) in picture.pixels().enumerate() {
            let (x, y) = (at % width, at / width);
            let is_border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
            assert!(pixel[3] == 0 || !is_border, "frame {age} is cut off at {x}, {y}");
            across[x] |= pixel[3] > 0;
            down[y] |= pixel[3] > 0;
        }
    }
    let span = |seen: &[bool]| seen.iter().filter(|seen| **seen).count() as f64 / seen.len() as f64;
    assert!(span(&across).max(span(&down)) > 0.7, "{} {}", span(&across), span(&down));
    // The saved scene repeats the sequence.
    must_succeed(&folder.run("render s.toml --backend cpu --transparent -o q#.png"));
    for age in 0..6 {
        let open = |name: &str| Picture::open(folder.path().join(format!("{name}{age}.png")));
        assert!(open("p").pixels().eq(open("q").pixels()), "{age}");
    }
}

#[test]
fn a_saved_sequence_keeps_its_surroundings() {
    let folder = Folder::new();
    for age in 1..3 {
        folder.write_npy(&format!("p{age}.npy"), &puff(age));
    }
    // From below, where the background is seen.
    let below = "--elevation -20 -o p#.png --save-scene s.toml";
    must_succeed(&folder.run(&format!("render p#.npy {SMALL} {below}")));
    must_succeed(&folder.run("render s.toml --backend cpu -o q#.png"));
    for age in 1..3 {
        let open = |name: &str| Picture::open(folder.path().join(format!("{name}{age}.png")));
        assert!(open("p").pixels().next().unwrap()[2] > 40, "the sky is seen");
        assert!(open("p").pixels().eq(open("q").pixels()), "{age}");
    }
    let wrong = "surroundings = \"sea\"\n[volume]\npreset = \"bucky\"\n";
    fs::write(folder.path().join("wrong.toml"), wrong).unwrap();
    let refused = folder.run("render wrong.toml");
    assert_eq!(refused.status.code(), Some(1));
    assert!(stderr(&refused).contains("expected `void` or `studio`"), "{}", stderr(&refused));
}

#[test]
fn empty_frames_are_pictures() {
    let folder = Folder::new();
    folder.write_npy("e.1.npy", &Array3::zeros((24, 32, 24)));
    folder.write_npy("e.2.npy", &puff(2));
    must_succeed(&folder.run(&format!("render e.%d.npy {SMALL} -o e.%d.png")));
    let picture = Picture::open(folder.path().join("e.1.png"));
    let first = picture.pixels().next().unwrap().to_vec();
    let differs =
        picture.pixels().filter(|pixel| pixel.iter().zip(&first).any(|(a, b)| a.abs_diff(*b) > 2));
    assert_eq!(differs.count(), 0, "the horizon shows");
    let other = Picture::open(folder.path().join("e.2.png"));
    assert_eq!(other.pixels().next().unwrap(), first);
    // A sequence of nothing else is one too.
    folder.write_npy("n.1.npy", &Array3::zeros((4, 4, 4)));
    folder.write_npy("n.2.npy", &Array3::zeros((4, 4, 4)));
    must_succeed(&folder.run(&format!("render n.#.npy {SMALL} -o n.#.png")));
}

#[test]
fn several_inputs_are_frames() {
    let folder = Folder::new();
    for name in ["a.npy", "b.npy", "x.08.npy", "x.11.npy"] {
        folder.write_npy(name, &puff(usize::from(name.contains('b'))));
    }
    must_succeed(&folder.run(&format!("render x.08.npy x.11.npy {SMALL} -o x.####.png")));
    must_succeed(&folder.run(&format!("render a.npy b.npy {SMALL} -o y.###.jpg")));
    let names = folder.names();
    for name in ["x.0008.png", "x.0011.png", "y.001.jpg", "y.002.jpg"] {
        assert!(names.contains(&name.to_owned()), "{names:?}");
    }
}

#[test]
fn a_turntable_goes_around_at_one_distance() {
    let folder = Folder::new();
    let render = format!("render bucky --turntable 4 {SMALL}");
    must_succeed(&folder.run(&format!("{render} --save-scene s.toml")));
    must_succeed(&folder.run("render s.toml --backend cpu -o again.%04d.png"));
    for frame in 1..=4 {
        let pixels =
            |name: &str| Picture::open(folder.path().join(format!("{name}.{frame:04}.png")));
        let (one, other) = (pixels("bucky"), pixels("again"));
        assert!(one.pixels().eq(other.pixels()), "{frame}");
    }
    // A single frame is the same as among all of them.
    must_succeed(&folder.run(&format!("{render} --frames 3 -o third.png")));
    let [a, b] =
        ["bucky.0003.png", "third.png"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b);
    // After a quarter the camera stands a quarter further.
    let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let azimuth: f64 = text
        .split("azimuth_degrees = ")
        .nth(1)
        .and_then(|rest| rest.split([' ', '\n', ',']).next()?.parse().ok())
        .unwrap();
    let turned = format!("render s.toml --backend cpu --azimuth {} -o a.png", azimuth + 90.0);
    let distance = text.lines().find_map(|line| line.strip_prefix("distance = ")).unwrap();
    must_succeed(&folder.run(&turned));
    assert!(distance.parse::<f64>().unwrap() > 1.0);
}

#[test]
fn keyframes_move_cameras_lights_and_volumes() {
    let folder = Folder::new();
    let scene = "[volume]\npreset = 'bucky'\nkeyframes = [{ frame = 1, translate = [0, 0, 0] }, \
                 { frame = 3, translate = [1.5, 0, 0] }]\n\
                 [light]\nkeyframes = [{ frame = 1, direction = [0, -1, 0] }, \
                 { frame = 3, direction = [1, -1, 0] }]\n\
                 [camera]\nkeyframes = [{ frame = 1, zoom = 1.0 }, { frame = 3, zoom = 0.5 }]\n";
    fs::write(folder.path().join("k.toml"), scene).unwrap();
    must_succeed(&folder.run(&format!("render k.toml {SMALL} -o k.#.png")));
    let frames =
        [1, 2, 3].map(|frame| fs::read(folder.path().join(format!("k.{frame}.png"))).unwrap());
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    // A light that only turns leaves the surroundings as they are.
    let corner = Picture::open(folder.path().join("k.1.png")).pixels().next().unwrap().to_vec();
    assert!(corner.iter().all(|&c| c > 40), "{corner:?}");
    // Options replace what keyframes say.
    let still = "--zoom 1 --light 0,-1,0 --frames 1-2";
    must_succeed(&folder.run(&format!("render k.toml {SMALL} {still} -o s.#.png")));
    // Other commands see the first frame.
    must_succeed(&folder.run("map k.toml --backend cpu --map-size 16 -o m.exr"));
}

/// The whole sequence by one run, and by three parts of which one was killed.
#[test]
fn parts_of_a_sequence_are_the_same_as_all_of_it() {
    let folder = Folder::new();
    for age in 0..9 {
        folder.write_npy(&format!("p.{age}.npy"), &puff(age));
    }
    let render = "render p.#.npy --backend cpu --size 160x120".to_owned();
    must_succeed(&folder.run(&format!("{render} -o whole.#.png")));
    let parts = |options: &str| format!("{render} -o part.#.png {options}");
    for part in 1..=2 {
        must_succeed(&folder.run(&parts(&format!("--shard {part}/3"))));
    }
    let mut killed = Command::new(program())
        .args(parts("--shard 3/3").split_whitespace())
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while killed.try_wait().unwrap().is_none() && !folder.path().join("part.2.png").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    // If it has ended already, all its frames are there.
    let _ = killed.kill();
    killed.wait().unwrap();
    // A frame that is cut short, and one of other settings.
    let path = |name: &str| folder.path().join(name);
    let first = fs::read(path("part.0.png")).unwrap();
    fs::write(path("part.0.png"), &first[..first.len() / 2]).unwrap();
    must_succeed(&folder.run(&format!("{render} --frames 4 --exposure 0.5 -o part.#.png")));
    let kept = fs::metadata(path("part.1.png")).unwrap().modified().unwrap();
    for part in 1..=3 {
        let output = folder.run(&parts(&format!("--shard {part}/3 --resume")));
        must_succeed(&output);
        assert!(stderr(&output).contains("kept"), "{}", stderr(&output));
    }
    assert_eq!(fs::metadata(path("part.1.png")).unwrap().modified().unwrap(), kept);
    for age in 0..9 {
        let [whole, part] =
            ["whole", "part"].map(|name| fs::read(path(&format!("{name}.{age}.png"))));
        assert!(whole.unwrap() == part.unwrap(), "frame {age}");
    }
    let names = folder.names();
    assert_eq!(names.iter().filter(|name| name.starts_with("part")).count(), 9, "{names:?}");
}

#[test]
fn mistakes_about_frames_are_named() {
    let folder = Folder::new();
    for frame in [1, 2, 4] {
        folder.write_npy(&format!("p.{frame}.npy"), &puff(frame));
    }
    let before = folder.names();
    for (arguments, code, named) in [
        ("render p.#.npy -o p.png", 2, "'p.png'"),
        ("render p.#.npy --frames 1-4", 1, "p.3.npy: no such file"),
        ("render p.#.npy --frames 4-1", 2, "'4-1' ends before it begins"),
        ("render p.1.npy --transparent --catch-shadow --ground none", 2, "no ground"),
        ("render p.1.npy --transparent --ground 0", 2, "--catch-shadow"),
        ("render p.1.npy --catch-shadow", 2, "--transparent"),
        ("render q.#.npy", 1, "q.#.npy"),
        ("render p.1.npy --frames 1-3", 2, "frames: needs frames that differ"),
        ("render bucky --resume", 2, "resume: needs"),
        ("render bucky --shard 1/2", 2, "shard: needs"),
        ("render bucky --turntable 1", 2, "1"),
        ("render bucky p.1.npy", 2, "several inputs"),
        ("render p.1.npy p.2.txt", 1, "p.2.txt: no such file"),
        ("render p.##.npy", 1, "p.1.npy is there"),
        ("render p.#.npy --frames 1-9", 1, "from frame 1 to 4"),
        ("render p.1.npy none.npy", 1, "none.npy"),
        ("map p.#.npy -o m.exr", 1, "stands for a sequence"),
        ("render p.#.npy -o p.#.npy", 1, "p.1.npy: it is an input"),
    ] {
        must_fail(&folder, &format!("{arguments} --backend cpu"), code, &[named]);
    }
    let own = "render p.#.npy --format png -o t.#.toml --save-scene ./t.2.toml";
    must_fail(&folder, own, 2, &["t.2.toml"]);
    assert_eq!(folder.names(), before);
    let output = folder.run(&format!("render p.#.npy {SMALL} -o q.#.png"));
    must_succeed(&output);
    assert!(stderr(&output).contains("no file for frame 3"), "{}", stderr(&output));
}

/// A file whose own name has a # is no sequence, whatever moves.
#[test]
fn a_name_of_a_file_is_no_pattern() {
    let folder = Folder::new();
    folder.write_npy("a#.npy", &puff(2));
    must_succeed(&folder.run(&format!("render a#.npy {SMALL} --turntable 2 -o t.%d.png")));
    assert!(folder.names().contains(&"t.2.png".to_owned()), "{:?}", folder.names());
}

/// A still scene that is saved and then turned stays on its spot, and its first picture is the
/// saved one.
#[test]
fn a_saved_picture_can_be_turned() {
    let folder = Folder::new();
    folder.write_npy("p.npy", &puff(2));
    let options = "--transparent --fit volume";
    must_succeed(
        &folder.run(&format!("render p.npy {SMALL} {options} --save-scene s.toml -o a.png")),
    );
    must_succeed(&folder.run("render s.toml --backend cpu --transparent --turntable 4 -o t.#.png"));
    let middle = |name: &str| {
        let picture = Picture::open(folder.path().join(name));
        let seen = picture.pixels().enumerate().filter(|(_, pixel)| pixel[3] > 128);
        let columns: Vec<f64> = seen.map(|(at, _)| (at % 48) as f64).collect();
        columns.iter().sum::<f64>() / columns.len() as f64
    };
    let first = middle("t.1.png");
    assert!((first - middle("a.png")).abs() < 0.01);
    for frame in 2..=4 {
        let found = middle(&format!("t.{frame}.png"));
        assert!((found - first).abs() < 2.5, "frame {frame}: {found} for {first}");
    }
}
