//! Outputs and the files around them: no input ever changes, no file of another output does, and
//! whatever ends a run leaves old files or new ones, whole and matching. `DEEPSHADOW_KILLS=n` kills n
//! runs of each kind (a few by default).

use std::fs;
use std::io::Read;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::cli::{Folder, must_succeed, program, stderr};
use super::formats::vdb_fixture;
use super::support::Random;

/// Every format that `convert` writes, as endings.
const ENDINGS: [&str; 7] = ["vdb", "npy", "raw", "nrrd", "nhdr", "mha", "mhd"];

type Contents = Vec<(String, Vec<u8>)>;

/// All files and what is in them, by name.
fn contents(folder: &Path) -> Contents {
    let mut all: Contents = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| {
            let bytes = fs::read(entry.path()).unwrap_or_default();
            (entry.file_name().to_string_lossy().into_owned(), bytes)
        })
        .collect();
    all.sort();
    all
}

/// A folder with one volume as `v` in every format.
fn with_all_formats() -> Folder {
    let folder = Folder::new();
    fs::copy(vdb_fixture("ball_blosc.vdb"), folder.path().join("v.vdb")).unwrap();
    for ending in &ENDINGS[1..] {
        must_succeed(&folder.run(&format!("convert v.vdb v.{ending} --quiet")));
    }
    folder
}

/// The voxels of `name`, as an array's bytes.
fn voxels(folder: &Folder, name: &str) -> Result<Vec<u8>, String> {
    let outside = Folder::new();
    let to = outside.path().join("x.raw");
    let output = folder.run(&format!("convert {name} {} --quiet", to.display()));
    if output.status.success() { Ok(fs::read(to).unwrap()) } else { Err(stderr(&output)) }
}

#[test]
fn files_of_every_pair_of_formats_live_side_by_side() {
    let folder = with_all_formats();
    let before = contents(folder.path());
    let first = voxels(&folder, "v.vdb").unwrap();
    for from in ENDINGS {
        assert!(voxels(&folder, &format!("v.{from}")).unwrap() == first, "{from}");
        for to in ENDINGS {
            // The same name with another ending, other voxels: nothing that was there changes.
            let output = folder.run(&format!("convert v.{from} w.{to} --type f64 --quiet"));
            must_succeed(&output);
            for (name, bytes) in &before {
                let now = fs::read(folder.path().join(name)).unwrap();
                assert!(now == *bytes, "{name} after {from} to {to}");
            }
        }
    }
    for from in ENDINGS {
        assert!(voxels(&folder, &format!("v.{from}")).unwrap() == first, "{from} at last");
    }
}

#[test]
fn no_output_takes_the_place_of_an_input() {
    let folder = with_all_formats();
    fs::write(folder.path().join("colours.txt"), "0 1 1 1 0\n25 1 0 0 1\n").unwrap();
    let scene = "[volume]\npath = \"v.mhd\"\n[volume.transfer]\nfile = \"colours.txt\"\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let all: Vec<String> = folder.names();
    let voxels_of = |header: &str| {
        let name = all.iter().find(|name| name.starts_with(&format!("{header}.")));
        name.unwrap_or_else(|| panic!("{header}")).clone()
    };
    // Names that lead to what is read: itself, a symbolic link, a hard link.
    let aims = [
        ("v.raw", "v.raw"),
        ("v.raw", "v.raw.toml"),
        ("v.npy", "v.npy.toml"),
        ("v.mhd", &voxels_of("v.mhd")),
        ("v.nhdr", &voxels_of("v.nhdr")),
        ("v.nrrd", "v.nrrd"),
        ("v.vdb", "v.vdb"),
        ("scene.toml", &voxels_of("v.mhd")),
        ("scene.toml", "v.mhd"),
        ("scene.toml", "colours.txt"),
        ("scene.toml", "scene.toml"),
    ];
    let before = contents(folder.path());
    for (input, aim) in aims {
        for ending in ["raw", "npy", "vdb", "mhd", "nhdr", "nrrd", "png", "exr", "deep.exr"] {
            let name = format!("aim.{ending}");
            let output = folder.path().join(&name);
            for hard in [false, true] {
                let aim = folder.path().join(aim);
                if hard { fs::hard_link(aim, &output) } else { symlink(aim, &output) }.unwrap();
                let small = "--backend cpu --size 8x8 --map-size 8 --quiet";
                let run = match (ending, input.ends_with("toml")) {
                    ("exr", _) => format!("map {input} --backend cpu --map-size 8 -o {name}"),
                    ("png" | "deep.exr", _) => format!("render {input} {small} -o {name}"),
                    (_, false) => format!("convert {input} {name} --type u8"),
                    // A scene is no volume to convert.
                    (_, true) => String::new(),
                };
                if !run.is_empty() {
                    let result = folder.run(&run);
                    assert_eq!(result.status.code(), Some(1), "{run}: {}", stderr(&result));
                    assert!(stderr(&result).contains("which is read here"), "{}", stderr(&result));
                }
                let _ = fs::remove_file(&output);
            }
        }
        assert!(contents(folder.path()) == before, "{input}, {aim}");
    }
    // Under their own names, and beside a header's own voxels.
    for (run, code) in [
        ("convert v.vdb v.vdb --compression none".to_owned(), 1),
        ("convert v.raw v.raw --type u8".to_owned(), 1),
        (format!("convert v.mhd {} --type u8", voxels_of("v.mhd")), 1),
        ("convert v.mhd v.mhd --crop 55,55,55,60,60,60".to_owned(), 1),
    ] {
        assert_eq!(folder.run(&run).status.code(), Some(code), "{run}");
        assert!(contents(folder.path()) == before, "{run}");
    }
}

/// As other programs and earlier versions write them: `x.raw` beside `x.mhd`, `x.toml` beside `x.raw`.
#[test]
fn files_named_as_before_are_read_and_spared() {
    let folder = Folder::new();
    let voxels: Vec<u8> = (0..24).collect();
    fs::write(folder.path().join("x.raw"), &voxels).unwrap();
    let header = "NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = x.raw\n";
    fs::write(folder.path().join("x.mhd"), header).unwrap();
    fs::write(folder.path().join("x.toml"), "dims = [4, 3, 2]\ntype = \"u8\"\n").unwrap();
    let before = contents(folder.path());
    for run in
        ["x.mhd x.nhdr --crop 0,0,0,1,1,1", "x.raw x.npy --type f32", "x.npy x.mha --type u16"]
    {
        must_succeed(&folder.run(&format!("convert {run}")));
    }
    assert_eq!(folder.run("convert x.mhd x.raw --type f32").status.code(), Some(1));
    for (name, bytes) in &before {
        assert!(fs::read(folder.path().join(name)).unwrap() == *bytes, "{name}");
    }
    assert_eq!(self::voxels(&folder, "x.raw").unwrap(), voxels);
    // Two files that it may be of, neither of which says what it holds.
    fs::write(folder.path().join("x.bin"), &voxels).unwrap();
    let why = self::voxels(&folder, "x.raw").unwrap_err();
    assert!(why.contains("x.toml") && why.contains("x.raw.toml"), "{why}");
}

#[test]
fn a_sidecar_of_other_voxels_is_refused() {
    let folder = Folder::new();
    fs::copy(vdb_fixture("ball_blosc.vdb"), folder.path().join("v.vdb")).unwrap();
    for name in ["a.raw", "a.npy"] {
        must_succeed(&folder.run(&format!("convert v.vdb {name} --quiet")));
        let path = folder.path().join(name);
        let mut bytes = fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(&path, bytes).unwrap();
        let why = voxels(&folder, name).unwrap_err();
        assert!(why.contains("do not belong together"), "{why}");
        let output = folder.run(&format!("render {name} --backend cpu --size 8x8 --map-size 8"));
        assert_eq!(output.status.code(), Some(1));
    }
    // An array of another shape beside the sidecar.
    must_succeed(&folder.run("convert v.vdb b.npy --crop 56,56,56,60,60,60 --quiet"));
    fs::copy(folder.path().join("b.npy"), folder.path().join("a.npy")).unwrap();
    let why = voxels(&folder, "a.npy").unwrap_err();
    assert!(why.contains("describes other voxels"), "{why}");
}

#[test]
fn links_are_followed_and_modes_are_kept() {
    let folder = Folder::new();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("far")).unwrap();
    fs::write(path("far/old.png"), "old").unwrap();
    fs::set_permissions(path("far/old.png"), fs::Permissions::from_mode(0o600)).unwrap();
    symlink("far/old.png", path("link.png")).unwrap();
    symlink("far/new.png", path("dangling.png")).unwrap();
    let small = "--backend cpu --size 8x8 --map-size 8 --quiet";
    for name in ["link.png", "dangling.png", "far/old.png"] {
        must_succeed(&folder.run(&format!("render box {small} -o {name}")));
    }
    for name in ["link.png", "dangling.png"] {
        assert!(fs::symlink_metadata(path(name)).unwrap().is_symlink(), "{name}");
    }
    for name in ["far/old.png", "far/new.png"] {
        assert!(fs::read(path(name)).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
    assert_eq!(fs::metadata(path("far/old.png")).unwrap().mode() & 0o777, 0o600);
    assert_eq!(folder.names(), ["dangling.png", "far", "link.png"]);
    // Through a link the voxels of a header lie where the header does, and are found from both.
    symlink("far/v.mhd", path("v.mhd")).unwrap();
    fs::copy(vdb_fixture("ball_blosc.vdb"), path("v.vdb")).unwrap();
    must_succeed(&folder.run("convert v.vdb v.mhd --quiet"));
    symlink("far/v.raw", path("v.raw")).unwrap();
    must_succeed(&folder.run("convert v.vdb v.raw --quiet"));
    for name in ["v.mhd", "far/v.mhd", "v.raw", "far/v.raw"] {
        assert!(voxels(&folder, name).unwrap() == voxels(&folder, "v.vdb").unwrap(), "{name}");
    }
}

/// A link to another file system: shared memory is one on most machines.
#[test]
fn a_link_to_another_file_system_works() {
    let shm = Path::new("/dev/shm");
    let folder = Folder::new();
    let other = fs::metadata(shm)
        .is_ok_and(|shm| shm.is_dir() && shm.dev() != fs::metadata(folder.path()).unwrap().dev());
    if !other {
        println!("not run: /dev/shm is no other file system here");
        return;
    }
    let far = tempfile::tempdir_in(shm).unwrap();
    symlink(far.path().join("p.png"), folder.path().join("p.png")).unwrap();
    for _ in 0..2 {
        must_succeed(&folder.run("render box --backend cpu --size 8x8 --map-size 8 -o p.png"));
        assert!(fs::read(far.path().join("p.png")).unwrap().starts_with(b"\x89PNG"));
    }
}

#[test]
fn pipes_and_devices_take_outputs_as_streams() {
    let folder = Folder::new();
    let pipe = folder.path().join("pipe.png");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let render = "render box --backend cpu --size 8x8 --map-size 8 --quiet -o";
    let reading = pipe.clone();
    let reader = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        fs::File::open(reading).unwrap().read_to_end(&mut bytes).unwrap();
        bytes
    });
    must_succeed(&folder.run(&format!("{render} pipe.png")));
    assert!(reader.join().unwrap().starts_with(b"\x89PNG"));
    assert_eq!(folder.names(), ["pipe.png"], "the pipe is one still");
    // A device without room says so, and stays.
    symlink("/dev/full", folder.path().join("full.png")).unwrap();
    let output = folder.run(&format!("{render} full.png"));
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("full.png"), "{}", stderr(&output));
    symlink("/dev/null", folder.path().join("null.png")).unwrap();
    must_succeed(&folder.run(&format!("{render} null.png")));
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
    symlink("/dev/stdout", folder.path().join("out.png")).unwrap();
    let output = folder.run(&format!("{render} out.png"));
    assert!(output.stdout.starts_with(b"\x89PNG"));
    assert_eq!(folder.names(), ["full.png", "null.png", "out.png", "pipe.png"]);
}

#[test]
fn a_report_replaces_nothing_but_reports() {
    let folder = Folder::new();
    let inner = folder.path().join("out/report.html");
    fs::create_dir_all(&inner).unwrap();
    fs::write(inner.join("thesis.txt"), "years").unwrap();
    let compare = "compare box -o out --map-size 8 --size 8x8 --points 10 --maps slices:2";
    let output = folder.run(compare);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("report.html"), "{}", stderr(&output));
    assert_eq!(fs::read(inner.join("thesis.txt")).unwrap(), b"years");
    fs::remove_dir_all(folder.path().join("out")).unwrap();
    for _ in 0..2 {
        must_succeed(&folder.run(compare));
        assert_eq!(contents(&folder.path().join("out")).len(), 3);
        assert_eq!(folder.names(), ["out"]);
    }
}

#[test]
fn figures_leave_no_empty_folder() {
    let folder = Folder::new();
    // Without a driver the work fails after the folder was made.
    let status = Command::new(program())
        .args(["figures", "-o", "new/deeper", "--backend", "gpu", "--quiet"])
        .env("VK_DRIVER_FILES", "/nowhere")
        .env("VK_ICD_FILENAMES", "/nowhere")
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .status();
    assert_eq!(status.unwrap().code(), Some(1));
    assert_eq!(folder.names(), Vec::<String>::new());
}

/// What is killed, with which names it leaves, and how to tell that it is whole.
struct Kind {
    run: &'static str,
    /// The file that was asked for.
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

/// Two inputs that are told apart: the same box of voxels with other values.
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

/// What stands behind `name`: for volumes spacing and voxels, for pictures the bytes, for reports the
/// names and a line; an error if it can't be read.
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
    // Both parts of a pair belong to the same volume.
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
        let (mut refused, mut stayed) = (0, 0);
        for i in 0..kills() {
            let mut child = begin(&folder, &runs[i % 2]);
            // Most of them near the end, where files get their names.
            sleep(time.mul_f64(1.1 - 0.5 * random.unit().powi(2)));
            let killed = Command::new("kill").args([signal, &child.id().to_string()]).output();
            drop(killed);
            child.wait().unwrap();
            match seen(&folder, kind.name) {
                Ok(now) => assert!(whole.contains(&now), "{} {signal}", kind.name),
                Err(why) => {
                    // Between two renames a pair may be parted; it is never taken for one.
                    assert!(why.contains("belong") || why.contains("describes"), "{why}");
                    refused += 1;
                    assert!(begin(&folder, &runs[0]).wait().unwrap().success());
                }
            }
            let ours = |name: &&String| name.starts_with(".deepshadow");
            let left: Vec<String> = folder.names().iter().filter(ours).cloned().collect();
            if signal == "-KILL" {
                stayed += usize::from(!left.is_empty());
                for name in left {
                    let path = folder.path().join(name);
                    let _ = fs::remove_file(&path);
                    let _ = fs::remove_dir_all(&path);
                }
            } else {
                assert_eq!(left, Vec::<String>::new(), "{} {signal}", kind.name);
            }
        }
        println!("{} {signal}: {} runs, {refused} refused, {stayed} left", kind.name, kills());
        // Naming takes microseconds of a run; nothing forbids a kill just then.
        assert!(refused + stayed <= 1 + kills() / 100, "{} {signal}", kind.name);
        // A whole run clears what an ended one left, and nothing more than its files remains.
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
