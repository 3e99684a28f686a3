//! Tests of the program as a user calls it: the real binary in a fresh folder. Exit codes, errors
//! of one line, files that are complete or absent.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use deepshadow::io::deep_exr::{Attribute, DeepFile};
use exr::prelude::{AttributeValue, read_first_flat_layer_from_file};
use tempfile::TempDir;

use super::support::Picture;

/// The path of the program, also if the tests run from an archive on another machine.
pub fn program() -> String {
    std::env::var("NEXTEST_BIN_EXE_deepshadow")
        .unwrap_or_else(|_| env!("CARGO_BIN_EXE_deepshadow").to_owned())
}

pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn run(&self, arguments: &str) -> Output {
        Command::new(program())
            .args(arguments.split_whitespace())
            .current_dir(self.path())
            .output()
            .unwrap()
    }

    /// Writes a file of NumPy with 32-bit floats.
    pub fn write_npy(&self, name: &str, values: &ndarray::Array3<f32>) {
        let shape = values.shape().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let mut header =
            format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}");
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        fs::write(self.path().join(name), bytes).unwrap();
    }

    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path()).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn must_succeed(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

const SMALL: &str = "--backend cpu --size 40x30 --map-size 32";

#[test]
fn endings_count_in_capitals_too() {
    let folder = Folder::new();
    for name in ["a.PNG", "b.Exr", "c.DEEP.EXR"] {
        must_succeed(&folder.run(&format!("render bucky {SMALL} -o {name}")));
        assert!(folder.names().contains(&name.to_owned()));
    }
    must_succeed(&folder.run("map bucky --backend cpu --map-size 8 --map threshold -o m.EXR"));
    let (png, exr) = (fs::read(folder.path().join("a.PNG")), fs::read(folder.path().join("m.EXR")));
    assert!(png.unwrap().starts_with(b"\x89PNG") && exr.unwrap().starts_with(&[0x76, 0x2f]));
}

#[test]
fn render_writes_a_picture_named_after_the_input() {
    let folder = Folder::new();
    let output = folder.run(&format!("render bucky {SMALL}"));
    must_succeed(&output);
    assert_eq!(folder.names(), ["bucky.png"]);
    assert!(output.stdout.is_empty(), "stdout is for results that are asked for");
    let said = stderr(&output);
    for what in ["light direction", "ground height", "camera position", "wrote bucky.png", "cpu"] {
        assert!(said.contains(what), "'{what}' is missing in: {said}");
    }
    let picture = Picture::open(folder.path().join("bucky.png"));
    assert_eq!((picture.size, picture.channels), ([40, 30], 3));
    let [darkest, brightest] =
        picture.pixels().fold([255, 0], |[lo, hi], p| [lo.min(p[0]), hi.max(p[0])]);
    assert!(
        darkest < 80 && brightest > 170,
        "shadow and light are both seen: {darkest}..{brightest}"
    );
}

#[test]
fn quiet_says_nothing_and_transparent_writes_alpha() {
    let folder = Folder::new();
    let output = folder.run(&format!("render rods {SMALL} --quiet --transparent -o t.png"));
    must_succeed(&output);
    assert!(stderr(&output).is_empty(), "{}", stderr(&output));
    let picture = Picture::open(folder.path().join("t.png"));
    assert_eq!(picture.channels, 4);
    assert_eq!(picture.bytes[3], 0, "nothing in the corner");
    assert!(picture.pixels().any(|p| p[3] > 250), "an opaque rod");
}

#[test]
fn raw_data_renders_from_options_and_from_its_sidecar_alike() {
    let folder = Folder::new();
    let voxels: Vec<u8> =
        (0..6_u32 * 5 * 4).flat_map(|i| ((i * 977 % 4001) as u16).to_be_bytes()).collect();
    fs::write(folder.path().join("scan.raw"), voxels).unwrap();
    must_succeed(&folder.run(&format!(
        "render scan.raw --dims 6,5,4 --type u16 --endian big --spacing 1,1,2 --window 100,3000 --up z {SMALL} -o a.exr"
    )));
    fs::write(
        folder.path().join("scan.toml"),
        "dims = [6, 5, 4]\ntype = \"u16\"\nendian = \"big\"\nspacing = [1, 1, 2]\nup = \"z\"\n",
    )
    .unwrap();
    must_succeed(&folder.run(&format!("render scan.raw --window 100,3000 {SMALL} -o b.exr")));
    let [a, b] = ["a.exr", "b.exr"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b, "the same picture, byte for byte");
}

/// The file contains what another program needs to look up shadows.
#[test]
fn map_writes_its_channels_and_attributes() {
    let folder = Folder::new();
    must_succeed(&folder.run("map box --backend cpu --map-size 24 -o box.exr"));
    let image = read_first_flat_layer_from_file(folder.path().join("box.exr")).unwrap();
    let layer = &image.layer_data;
    assert_eq!((layer.size.0, layer.size.1), (24, 24));
    let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R"]);
    let attribute = |name: &str| {
        layer.attributes.other.iter().find(|(key, _)| **key == *name).map(|(_, v)| v.clone())
    };
    assert_eq!(attribute("kind"), Some(AttributeValue::Text("threshold".into())));
    assert_eq!(attribute("depth_unit"), Some(AttributeValue::Text("world".into())));
    assert_eq!(attribute("thresholds"), Some(AttributeValue::FloatVec3((0.1, 0.5, 0.9))));
    assert_eq!(attribute("lookup"), Some(AttributeValue::Text("default".into())));
    assert_eq!(attribute("domain_max"), Some(AttributeValue::FloatVec3((63.5, 63.5, 63.5))));
    let Some(AttributeValue::Matrix4x4(index)) = attribute("index_from_world") else {
        panic!("no index_from_world");
    };
    assert!((index[0] - 64.0).abs() < 1e-3 && (index[3] - 31.5).abs() < 1e-3, "{index:?}");
    let Some(AttributeValue::Matrix4x4(m)) = attribute("light_from_world") else {
        panic!("no light_from_world");
    };
    // The cube's centre is in the middle of the map, at half of the cube's depth extent.
    let [u, v, depth, w] = [0, 1, 2, 3].map(|row| m[4 * row + 3]);
    assert!((u - 0.5).abs() < 1e-5 && (v - 0.5).abs() < 1e-5 && w == 1.0, "{u}, {v}, {w}");
    let samples =
        |c: usize| layer.channel_data.list[c].sample_data.values_as_f32().collect::<Vec<_>>();
    let (opacity, middle) = (samples(0), samples(2));
    let at = 12 * 24 + 12;
    assert!(opacity[at] > 0.9, "the box is opaque in the middle: {}", opacity[at]);
    assert!(
        middle[at] > 0.2 * depth && middle[at] < depth,
        "half of the light is lost before the centre"
    );
}

#[test]
fn wrong_usage_exits_with_2_and_writes_nothing() {
    let folder = Folder::new();
    for arguments in [
        "",
        "paint bucky",
        "render",
        "render bucky --no-such-option",
        "render bucky --size 40",
        "render bucky --size 0x30",
        "render bucky --dims 1,2",
        "render bucky --dims 1,2,x",
        "render bucky --light 1,2,3,4",
        "render bucky --backend tpu",
        "render bucky --threads 0",
        "map bucky --exposure 2",
        "render bucky --type u7",
        "render bucky --up w",
        "render bucky --density-scale -1",
        "render bucky --density-scale 1e39",
        "render bucky --map shadow",
        "render bucky --lookup none",
        "render bucky --map-size 0",
        "render bucky --map-size 16384",
        "render bucky --steps 0",
        "render bucky --samples 0",
        "render bucky --exposure nan",
        "render bucky --from jpeg",
    ] {
        let output = folder.run(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "'{arguments}': {said}");
        assert!(!said.contains("panicked"), "{said}");
        let one_line = said.lines().count() == 1 && said.starts_with("deepshadow: ");
        assert!(one_line || arguments.is_empty(), "'{arguments}': {said}");
    }
    assert!(folder.names().is_empty());
}

#[test]
fn bad_input_exits_with_1_and_one_line_that_names_it() {
    let folder = Folder::new();
    fs::write(folder.path().join("v.raw"), [1_u8; 27]).unwrap();
    fs::write(folder.path().join("bad.toml"), "[volume]\npreset = \"box\"\n[camera]\nzoomed = 3\n")
        .unwrap();
    fs::write(folder.path().join("no.toml"), "[volume\n").unwrap();
    let before = folder.names();
    let cases = [
        ("render missing.vdb", "missing.vdb"),
        ("render missing.toml", "missing.toml"),
        ("render v.raw", "--dims"),
        ("render v.raw --dims 3,3,3", "--type"),
        ("render v.raw --dims 3,3,4 --type u8", "27 bytes"),
        ("render v.raw --dims 3,3,3 --type u16", "54"),
        ("render v.raw --dims 1048576,1048576,1048576 --type f64", "27 bytes"),
        ("render bad.toml", "zoomed"),
        ("render no.toml", "no.toml"),
        ("render box -o nowhere/picture.png", "nowhere"),
    ];
    for (arguments, named) in cases {
        let output = folder.run(&format!("{arguments} --backend cpu"));
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "'{arguments}': {said}");
        assert!(said.contains(named), "'{arguments}' does not name '{named}': {said}");
        let errors: Vec<&str> = said.lines().filter(|line| !line.contains("(chosen)")).collect();
        assert!(
            errors.len() == 1 && errors[0].starts_with("deepshadow: "),
            "'{arguments}': {said}"
        );
    }
    assert_eq!(folder.names(), before, "nothing was left behind");
}

#[test]
fn a_failed_run_leaves_the_older_picture() {
    let folder = Folder::new();
    fs::write(folder.path().join("box.png"), "older").unwrap();
    // The error is found only after the output was prepared: the light has no position.
    let nowhere = "[volume]\npreset = \"box\"\n[light]\nkind = \"point\"\n";
    fs::write(folder.path().join("nowhere.toml"), nowhere).unwrap();
    let output = folder.run(&format!("render nowhere.toml {SMALL} -o box.png"));
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("a point light needs one"), "{}", stderr(&output));
    assert_eq!(fs::read_to_string(folder.path().join("box.png")).unwrap(), "older");
    assert_eq!(folder.names(), ["box.png", "nowhere.toml"]);
    must_succeed(&folder.run(&format!("render box {SMALL}")));
    assert!(fs::read(folder.path().join("box.png")).unwrap().starts_with(b"\x89PNG"));
    assert_eq!(folder.names(), ["box.png", "nowhere.toml"]);
}

/// Hounsfield units: a ball of 100 in air of -1000 gives the same picture as both shifted by 1000.
/// The deep image's opacity equals that in the map's statistics.
#[test]
fn a_fragment_map_is_a_deep_image_or_its_statistics() {
    let folder = Folder::new();
    let map = "map bucky --map fragments --backend cpu --map-size 32";
    must_succeed(&folder.run(&format!("{map} -o deep.exr")));
    must_succeed(&folder.run(&format!("{map} --statistics -o flat.exr")));
    let mut deep = DeepFile::open(folder.path().join("deep.exr"), 1 << 30).unwrap();
    assert_eq!(deep.header().attribute("kind"), Some(&Attribute::from("fragments")));
    assert_eq!(deep.header().attribute("tolerance"), Some(&Attribute::from(0.002)));
    assert!(deep.header().attribute("light_from_world").is_some());
    let flat = read_first_flat_layer_from_file(folder.path().join("flat.exr")).unwrap();
    let channels = &flat.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "back", "count", "front"]);
    let opacity: Vec<f32> = channels[0].sample_data.values_as_f32().collect();
    let flattened = deep.read().unwrap().flatten().unwrap();
    let pairs = flattened.pixels.iter().zip(&opacity);
    assert!(pairs.clone().all(|(pixel, opacity)| (pixel[3] - opacity).abs() < 1e-5));
    assert!(opacity.iter().any(|&a| a > 0.5), "some light is lost");
}

/// The camera's deep image, flattened, equals the flat picture.
#[test]
fn a_deep_picture_flattens_to_the_flat_one() {
    let folder = Folder::new();
    must_succeed(&folder.run(&format!("render bucky {SMALL} --transparent -o flat.exr")));
    must_succeed(&folder.run(&format!("render bucky {SMALL} --transparent -o x.deep.exr")));
    let mut deep = DeepFile::open(folder.path().join("x.deep.exr"), 1 << 30).unwrap();
    let deep = deep.read().unwrap();
    assert!(deep.statistics().most > 8, "several samples in a pixel");
    let flattened = deep.flatten().unwrap();
    let flat = read_first_flat_layer_from_file(folder.path().join("flat.exr")).unwrap();
    let channel = |name: &str| -> Vec<f32> {
        let mut list = flat.layer_data.channel_data.list.iter();
        list.find(|c| c.name == *name).unwrap().sample_data.values_as_f32().collect()
    };
    for (c, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        for (pixel, flat) in flattened.pixels.iter().zip(channel(name)) {
            // The march ends where a thousandth of the light is left, which the flat picture counts
            // as none.
            assert!((pixel[c] - flat).abs() < 2e-3, "{name}: {} for {flat}", pixel[c]);
        }
    }
}

#[test]
fn a_window_maps_stored_values_below_zero_too() {
    let folder = Folder::new();
    let inside = |i: i32| (i % 9 - 4).pow(2) + (i / 9 % 9 - 4).pow(2) + (i / 81 - 4).pow(2) < 10;
    let voxels = |shift: i16| -> Vec<u8> {
        let value = |i| if inside(i) { 100 + shift } else { shift - 1000 };
        (0..729).flat_map(|i| value(i).to_le_bytes()).collect()
    };
    fs::write(folder.path().join("ct.raw"), voxels(0)).unwrap();
    fs::write(folder.path().join("up.raw"), voxels(1000)).unwrap();
    for (name, window) in [("ct", "-1000,300"), ("up", "0,1300")] {
        must_succeed(&folder.run(&format!(
            "render {name}.raw --dims 9,9,9 --type i16 --window {window} {SMALL} -o {name}.exr"
        )));
    }
    let [a, b] = ["ct.exr", "up.exr"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b, "the same picture, byte for byte");
}

#[test]
fn a_closed_stderr_does_not_cost_the_picture() {
    let folder = Folder::new();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = Command::new(program())
        .args(format!("render box {SMALL}").split_whitespace())
        .current_dir(folder.path())
        .stderr(writer)
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(folder.names(), ["box.png"]);
}

#[test]
fn negative_and_nan_densities_count_as_empty_and_are_mentioned() {
    let folder = Folder::new();
    let mut values = vec![1.0_f32; 64];
    values[..4].copy_from_slice(&[f32::NAN, -1.0, f32::INFINITY, f32::NEG_INFINITY]);
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(folder.path().join("odd.raw"), bytes).unwrap();
    let output = folder.run(&format!("render odd.raw --dims 4,4,4 --type f32 {SMALL}"));
    must_succeed(&output);
    assert!(stderr(&output).contains("4 negative or non-finite voxels"), "{}", stderr(&output));
}

#[test]
fn figures_draws_all_three_sheets() {
    let folder = Folder::new();
    must_succeed(&folder.run("figures -o sheets --backend cpu"));
    for (name, width) in [("figure-2.png", 5), ("figure-3.png", 3), ("figure-4.png", 3)] {
        let sheet = Picture::open(folder.path().join("sheets").join(name));
        assert_eq!(sheet.size[0], 8 + width * 328, "{name}");
        let bright = sheet.pixels().filter(|p| p[0] > 200).count();
        assert!(bright > 500, "{name} shows something: {bright} bright pixels");
    }
}

#[test]
fn help_tells_every_command_and_adapters_answers() {
    let folder = Folder::new();
    let help = folder.run("--help");
    must_succeed(&help);
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    for command in ["render", "map", "info", "figures", "adapters"] {
        assert!(text.contains(command), "{text}");
    }
    if cfg!(feature = "gpu") {
        let output = folder.run("adapters");
        must_succeed(&output);
        assert!(!output.stdout.is_empty());
    }
}
