//! The program on mutated files of every format, scenes and transfer functions, as a process of
//! little memory: it does its work or says in one line why not, within seconds, whatever the bytes
//! are. Everything follows from a seed, so that a run that fails can be made again.

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::messages::{fault, steering};
use crate::cli::program;
use crate::formats::{
    DEEP_COMPRESSIONS, MATERIALS, NANOVDB_FIXTURES, Xorshift, dense_cases, mutate, nanovdb_fixture,
    small_deep_image, surface_seeds, vdb_fixture_files,
};

/// KiB of address space, and seconds of processor time, that a run may take.
const MEMORY: &str = "1500000";
const SECONDS: &str = "10";

/// Files of which some are mutated.
struct Seed {
    name: String,
    /// The first one is what a command is given.
    files: Vec<(String, Vec<u8>)>,
    commands: &'static [&'static str],
}

const VOLUME: &[&str] = &[
    "info FILE",
    "info FILE --json",
    "convert FILE out.vdb --quiet",
    "convert FILE out.npy --quiet",
    "convert FILE out.nrrd --quiet --compression gzip",
    "convert FILE out.mhd --quiet --type u8",
    "convert FILE out.vdb --quiet --resample 0.5 --half",
    "convert FILE out.raw --quiet --threshold 2",
    "render FILE SMALL -o out.png",
    "render FILE SMALL -o out.exr --map fragments",
    "render FILE SMALL -o out.deep.exr --transfer auto",
    "map FILE MAP -o out.exr --map threshold",
    "map FILE MAP -o out.exr --map nested",
];
const SURFACE: &[&str] = &["info FILE", "info FILE --json", "convert FILE out.vdb --quiet"];
const SCENE: &[&str] =
    &["render FILE SMALL -o out.png", "render FILE SMALL -o out.exr", "map FILE MAP -o out.exr"];
const TRANSFER: &[&str] =
    &["render v.npy SMALL -o out.png --transfer FILE", "map v.npy MAP -o out.exr --transfer FILE"];

const MAP: &str = "--map-size 32 --backend cpu --quiet";

fn ramp() -> Vec<u8> {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (6, 5, 4), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend((0..120).flat_map(|i| (i as f32 / 60.0).to_le_bytes()));
    bytes
}

fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for case in dense_cases() {
        seeds.push(Seed { name: case.name.to_owned(), files: case.files, commands: VOLUME });
    }
    for (name, codec) in NANOVDB_FIXTURES {
        let files = vec![("v.nvdb".to_owned(), nanovdb_fixture(name))];
        seeds.push(Seed { name: format!("nanovdb_{codec}"), files, commands: VOLUME });
    }
    for path in vdb_fixture_files() {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let files = vec![(name.clone(), std::fs::read(&path).unwrap())];
        seeds.push(Seed { name, files, commands: VOLUME });
    }
    for compression in DEEP_COMPRESSIONS {
        let bytes = small_deep_image(compression).encode().unwrap();
        let files = vec![("deep.exr".to_owned(), bytes)];
        seeds.push(Seed { name: "deep_exr".to_owned(), files, commands: VOLUME });
    }
    for (_, name, bytes) in surface_seeds() {
        let files = vec![(name.to_owned(), bytes), ("of it.mtl".to_owned(), MATERIALS.to_vec())];
        seeds.push(Seed { name: name.to_owned(), files, commands: SURFACE });
    }
    for (name, text) in [("scene_full", FULL), ("scene_several", SEVERAL)] {
        let files =
            vec![("s.toml".to_owned(), text.as_bytes().to_vec()), ("v.npy".to_owned(), ramp())];
        seeds.push(Seed { name: name.to_owned(), files, commands: SCENE });
    }
    for (name, file, text) in [
        ("transfer_text", "t.txt", "# v r g b a\n0 0 0 0 0\n0.5 1 0.5 0 0.2\n2 1 1 1 1\n"),
        (
            "transfer_json",
            "t.json",
            "[{\"ColorSpace\": \"RGB\", \"Name\": \"n\", \"Points\": [0, 0, 0.5, 0, 2, 1, 0.5, 0], \
             \"RGBPoints\": [0, 0, 0, 1, 1, 0.5, 0.5, 0.5, 2, 1, 0, 0]}]",
        ),
    ] {
        let files = vec![(file.to_owned(), text.as_bytes().to_vec()), ("v.npy".to_owned(), ramp())];
        seeds.push(Seed { name: name.to_owned(), files, commands: TRANSFER });
    }
    seeds
}

const FULL: &str = r#"
[volume]
path = "v.npy"
density_scale = 8.0
albedo = [1.0, 0.9, 0.8]
window = [0.0, 1.5]
spacing = [1.0, 2.0, 0.5]
phase_g = 0.3
translate = [0.1, 0.2, 0.3]
rotate_degrees = [10.0, 20.0, 30.0]
scale = 0.5
[volume.transfer]
name = "tissue"
range = [0.0, 1.2]
gradient = [[0.0, 0.1], [0.4, 1.0]]
[volume.emission]
colors = "blackbody"
kelvin = [800.0, 2400.0]
scale = 2.0
[light]
kind = "spot"
position = [1.0, 3.0, 1.0]
direction = [-0.3, -1.0, -0.3]
irradiance = [12.0, 12.0, 12.0]
cone_degrees = 40.0
cone_softness = 0.2
[ambient]
radiance = [0.1, 0.1, 0.1]
[camera]
kind = "perspective"
position = [0.0, 0.55, 6.0]
target = [0.0, -0.1, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_degrees = 45.0
[image]
width = 32
height = 32
samples = 2
exposure = 1.5
[shadow]
map = "fragments"
size = 32
steps = 64
tolerance = 0.002
filter = "bilinear"
octaves = 2
[ground]
height = -0.55
albedo = 0.15
half_extent = 6.0
[background]
radiance = [0.2, 0.2, 0.2]
"#;

const SEVERAL: &str = r#"
[[volume]]
path = "v.npy"
density_scale = 3.0
tint = [0.3, 1.0, 1.4]
[[volume]]
preset = "box"
bounds = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]
translate = [1.0, 0.0, 0.0]
scale = 2.0
[[light]]
kind = "directional"
direction = [0.6, -0.72, -0.36]
[[light]]
kind = "point"
position = [1.0, 2.0, 0.5]
irradiance = [2.0, 4.0, 9.0]
[camera]
kind = "orthographic"
height = 3.0
position = [0.0, 0.0, 4.0]
target = [0.0, 0.0, 0.0]
[shadow]
map = "threshold"
thresholds = [0.1, 0.5, 0.9]
lookup = "default"
filter = "pcf3"
"#;

/// One to three changes to a text: other numbers and words, lines lost and doubled, what terminals
/// obey.
fn mutate_text(bytes: &mut Vec<u8>, random: &mut Xorshift) {
    const WORDS: [&str; 24] = [
        "0",
        "-1",
        "1e30",
        "-1e30",
        "1e-30",
        "nan",
        "inf",
        "-inf",
        "1e400",
        "0.5",
        "1e10",
        "18446744073709551616",
        "2147483648",
        "-2147483649",
        "65537",
        "[]",
        "\"\"",
        "true",
        "\"\u{1b}[31m\u{9b}\"",
        "\u{1b}]0;x\u{7}",
        "1e5",
        "1e-5",
        "\u{202e}",
        "{}",
    ];
    let mut text = String::from_utf8_lossy(bytes).into_owned();
    for _ in 0..=random.below(3) {
        let word = WORDS[random.below(WORDS.len())];
        let is_part = |c: char| c.is_alphanumeric() || ".-+".contains(c);
        match random.below(8) {
            // A number or a word becomes another one.
            0..=5 => {
                let starts: Vec<usize> = text
                    .char_indices()
                    .filter(|&(at, c)| {
                        is_part(c) && !text[..at].chars().next_back().is_some_and(is_part)
                    })
                    .map(|(at, _)| at)
                    .collect();
                let numbers: Vec<usize> = starts
                    .iter()
                    .copied()
                    .filter(|&at| text[at..].starts_with(|c: char| "-.0123456789".contains(c)))
                    .collect();
                let places =
                    if random.below(4) == 0 || numbers.is_empty() { starts } else { numbers };
                let Some(&at) = places.get(random.below(places.len())) else { continue };
                let length = text[at..].find(|c| !is_part(c)).unwrap_or(text.len() - at);
                text.replace_range(at..at + length, word);
            }
            6 => {
                let mut lines: Vec<&str> = text.lines().collect();
                if lines.is_empty() {
                    continue;
                }
                let at = random.below(lines.len());
                if random.below(2) == 0 {
                    lines.remove(at);
                } else {
                    lines.insert(random.below(lines.len()), lines[at]);
                }
                text = lines.join("\n") + "\n";
            }
            _ => {
                let places: Vec<usize> = text.char_indices().map(|(at, _)| at).collect();
                let at = places.get(random.below(places.len())).copied().unwrap_or(0);
                let long = word.repeat(1 + random.below(2) * 400);
                text.insert_str(at, &long);
            }
        }
    }
    *bytes = text.into_bytes();
}

/// What one run came to: its exit code.
fn one(seeds: &[Seed], seed: u64) -> Result<i32, String> {
    // Seeds that follow one another shall not begin alike.
    let mut random = Xorshift((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    for _ in 0..4 {
        random.next();
    }
    let chosen = &seeds[random.below(seeds.len())];
    let folder = tempfile::tempdir().unwrap();
    let mutated = if random.below(4) == 0 { random.below(chosen.files.len()) } else { 0 };
    for (at, (name, bytes)) in chosen.files.iter().enumerate() {
        let mut bytes = bytes.clone();
        if at == mutated {
            let is_text = std::str::from_utf8(&bytes).is_ok();
            // Headers of text before binary voxels, too.
            if is_text && random.below(4) > 0 {
                mutate_text(&mut bytes, &mut random);
            } else {
                mutate(&mut bytes, &mut random);
            }
        }
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let before = names(folder.path());
    let command = chosen.commands[random.below(chosen.commands.len())]
        .replace("SMALL", &format!("--size 32x32 {MAP}"))
        .replace("MAP", MAP)
        .replace("FILE", &chosen.files[0].0);
    let output = limited(folder.path(), &command);
    let mut wrong = wrong(&output);
    if output.status.code() != Some(0) && names(folder.path()) != before {
        wrong = Some(format!("it left {:?}", names(folder.path())));
    }
    match (wrong, output.status.code()) {
        (None, Some(code)) => Ok(code),
        (wrong, _) => {
            let kept = folder.keep();
            let (name, file) = (&chosen.name, &chosen.files[mutated].0);
            let why = wrong.unwrap_or_default();
            Err(format!("seed {seed}, {name}, {file} in {}: '{command}': {why}", kept.display()))
        }
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn limited(folder: &Path, arguments: &str) -> Output {
    let script = format!("ulimit -v {MEMORY} && ulimit -t {SECONDS} && ulimit -c 0 && exec \"$@\"");
    Command::new("sh")
        .args(["-c", &script, "sh"])
        .arg(program())
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap()
}

/// What is wrong with how a run ended, if anything.
fn wrong(output: &Output) -> Option<String> {
    let [said, printed] = [&output.stderr, &output.stdout].map(|b| String::from_utf8_lossy(b));
    let lines = said.lines().count();
    match output.status.code() {
        None => return Some(format!("signal {:?}: {said}", output.status.signal())),
        // Notes on what is read are lines of their own.
        Some(0) if said.lines().any(|line| !line.starts_with("deepshadow: ")) => {
            return Some(format!("it said {said}"));
        }
        Some(1 | 2) if lines != 1 => return Some(format!("{lines} lines: {said}")),
        Some(0..=2) => {}
        Some(code) => return Some(format!("exit code {code}: {said}")),
    }
    if said.contains("a bug in the program") {
        return Some(said.into_owned());
    }
    // JSON is for programs, which take lines of any length.
    let of_printed = if printed.starts_with('{') { steering(&printed) } else { fault(&printed) };
    fault(&said).or(of_printed)
}

/// Runs the seeds and says how they ended.
fn run(range: std::ops::Range<u64>) {
    let seeds = seeds();
    let codes: [AtomicUsize; 3] = Default::default();
    let wrong = Mutex::new(Vec::new());
    range.into_par_iter().for_each(|seed| match one(&seeds, seed) {
        Ok(code) => {
            codes[code as usize].fetch_add(1, Ordering::Relaxed);
        }
        Err(why) => {
            eprintln!("{why}");
            wrong.lock().unwrap().push(why);
        }
    });
    let wrong = wrong.into_inner().unwrap();
    let [done, refused, misused] = codes.map(AtomicUsize::into_inner);
    eprintln!("{done} done, {refused} refused, {misused} misused, {} wrong", wrong.len());
    assert!(done > 0 && refused > 0, "mutations that change nothing, or everything");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn mutated_files_end_in_an_answer_or_in_one_line() {
    run(0..60);
}

/// `DEEPSHADOW_MUTATIONS` runs, from seed `DEEPSHADOW_SEED` on.
#[test]
#[ignore = "takes an hour"]
fn many_mutated_files_end_in_an_answer_or_in_one_line() {
    let number = |name: &str, usual: u64| {
        std::env::var(name).map_or(usual, |value| value.parse().expect("a number"))
    };
    let first = number("DEEPSHADOW_SEED", 0);
    run(first..first + number("DEEPSHADOW_MUTATIONS", 20_000));
}
