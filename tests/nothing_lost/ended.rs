//! Tests of runs that are killed at random moments, and of several runs at once.
//! `DEEPSHADOW_KILLS=n` kills n runs of each kind (a few by default).

use std::fs;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::voxels;
use crate::cli::{Folder, program, stderr};
use crate::support::Random;

/// A command that is killed, the names that it leaves, and how to check its output.
struct Kind {
    run: &'static str,
    /// The requested file.
    name: &'static str,
}

const KINDS: [Kind; 7] = [
    Kind { run: "convert IN o.raw --quiet", name: "o.raw" },
    Kind { run: "convert IN o.npy --quiet", name: "o.npy" },
    Kind { run: "convert IN o.mhd --quiet", name: "o.mhd" },
    Kind { run: "convert IN o.nhdr --quiet --compression gzip", name: "o.nhdr" },
    Kind { run: "convert IN o.vdb --quiet", name: "o.vdb" },
    Kind {
        run: "render PRESET --backend cpu --size 16x16 --map-size 16 --quiet -o o.png",
        name: "o.png",
    },
    Kind {
        run: "compare PRESET --map-size 8 --size 8x8 --points 9 --maps slices:2 --quiet -o o",
        name: "o",
    },
];

fn kills() -> usize {
    std::env::var("DEEPSHADOW_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(6)
}

fn begin(folder: &Folder, arguments: &str) -> Child {
    Command::new(program())
        .args(arguments.split_whitespace())
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Two distinguishable inputs: the same box of voxels with different values.
fn two_inputs(folder: &Folder) -> [String; 2] {
    for (name, value) in [("one", 1.0_f32), ("two", 2.0)] {
        let values: Vec<u8> = (0..32 * 32 * 32)
            .flat_map(|i| (value + (i % 7) as f32 * value).to_le_bytes())
            .collect();
        fs::write(folder.path().join(format!("{name}.raw")), values).unwrap();
        let sidecar = format!("dims = [32, 32, 32]\ntype = \"f32\"\nspacing = [{value}, 1, 1]\n");
        fs::write(folder.path().join(format!("{name}.raw.toml")), sidecar).unwrap();
    }
    ["one.raw", "two.raw"].map(str::to_owned)
}

/// What is read from `name`: for volumes spacing and voxels, for pictures the bytes, for reports
/// the names and a line. An error if it cannot be read.
fn seen(folder: &Folder, name: &str) -> Result<Vec<u8>, String> {
    let path = folder.path().join(name);
    if path.is_dir() {
        let json = fs::read_to_string(path.join("results.json")).map_err(|e| e.to_string())?;
        let html = fs::read_to_string(path.join("report.html")).map_err(|e| e.to_string())?;
        let csv = fs::read_to_string(path.join("results.csv")).map_err(|e| e.to_string())?;
        let input = |text: &str| ["bucky", "rods"].map(|name| text.contains(name));
        let same = input(&json) == input(&html) && !csv.is_empty();
        return if same { Ok(vec![u8::from(input(&json)[0])]) } else { Err("mixed".to_owned()) };
    }
    if name.ends_with("png") {
        return fs::read(path).map_err(|error| error.to_string());
    }
    let output = folder.run(&format!("info {name} --json"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let json: serde_json::Value = serde_json::from_str(&text).map_err(|_| stderr(&output))?;
    let grid = &json["grids"][0];
    let mut seen = voxels(folder, name)?;
    // Both files of a pair belong to the same volume.
    let spacing = grid["world_from_index"][0][0].as_f64().unwrap();
    let first = f32::from_le_bytes(seen[..4].try_into().unwrap());
    if spacing != f64::from(first) {
        return Err(format!("silently torn: spacing {spacing}, values from {first} on"));
    }
    seen.truncate(4);
    Ok(seen)
}

fn commands(kind: &Kind, inputs: &[String; 2]) -> [String; 2] {
    let presets = ["bucky", "rods"];
    [0, 1].map(|i| kind.run.replace("IN", &inputs[i]).replace("PRESET", presets[i]))
}

fn killed(signal: &str) {
    let folder = Folder::new();
    let inputs = two_inputs(&folder);
    let given = folder.names();
    let mut random = Random(7);
    for kind in &KINDS {
        let runs = commands(kind, &inputs);
        let mut whole = Vec::new();
        let mut time = Duration::ZERO;
        for run in &runs {
            let begun = Instant::now();
            assert!(begin(&folder, run).wait().unwrap().success(), "{run}");
            time = begun.elapsed();
            whole.push(seen(&folder, kind.name).unwrap());
        }
        let mut stayed = 0;
        for i in 0..kills() {
            let mut child = begin(&folder, &runs[i % 2]);
            // Most kills are near the end, when files get their names.
            sleep(time.mul_f64(1.1 - 0.5 * random.unit().powi(2)));
            let killed = Command::new("kill").args([signal, &child.id().to_string()]).output();
            drop(killed);
            child.wait().unwrap();
            // The output is the old or the new one, and always a complete pair.
            let now = seen(&folder, kind.name).unwrap();
            assert!(whole.contains(&now), "{} {signal}", kind.name);
            let left = folder.names().iter().any(|name| name.starts_with(".deepshadow"));
            stayed += usize::from(left);
            assert!(!left || signal == "-KILL", "{} {signal}", kind.name);
        }
        eprintln!("{} {signal}: {} runs, {stayed} left a name", kind.name, kills());
        // Moving files to their names takes microseconds of a run, but a kill may happen just then.
        // The next run removes what that leaves, so that only complete files remain.
        assert!(begin(&folder, &runs[0]).wait().unwrap().success());
        let own = |name: &String| !given.contains(name);
        let mut names = folder.names();
        names.retain(own);
        let expected = match kind.name {
            "o.vdb" | "o.png" | "o" => 1,
            _ => 2,
        };
        assert_eq!(names.len(), expected, "{names:?}");
        for name in names {
            let path = folder.path().join(name);
            if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }.unwrap();
        }
    }
}

#[test]
fn a_killed_run_leaves_old_or_new_files_whole() {
    killed("-KILL");
}

#[test]
fn an_interrupted_or_terminated_run_leaves_nothing_behind() {
    killed("-INT");
    killed("-TERM");
}

#[test]
fn writers_at_once_never_mix_their_files() {
    let folder = Folder::new();
    let inputs = two_inputs(&folder);
    let rounds = (kills() / 4).max(2);
    for kind in &KINDS {
        let runs = commands(kind, &inputs);
        for round in 0..rounds {
            let children: Vec<Child> = (0..8).map(|i| begin(&folder, &runs[i % 2])).collect();
            for mut child in children {
                assert!(child.wait().unwrap().success(), "{} round {round}", kind.name);
            }
            if let Err(why) = seen(&folder, kind.name) {
                panic!("{} round {round}: {why}", kind.name);
            }
        }
        let count = folder.names().iter().filter(|name| name.starts_with("o.")).count();
        let expected = match kind.name {
            "o" => 0,
            "o.vdb" | "o.png" => 1,
            _ => 2,
        };
        assert_eq!(count, expected, "{:?}", folder.names());
        for name in folder.names().iter().filter(|name| name.starts_with('o') && *name != "one.raw")
        {
            let path = folder.path().join(name);
            if name != "one.raw.toml" && !path.is_dir() {
                fs::remove_file(path).unwrap();
            }
        }
    }
}
