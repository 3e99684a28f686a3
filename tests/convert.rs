//! Tests of `convert` as a user calls it: values and positions are preserved, losses are reported,
//! files are written completely or not at all.

use std::fs;

use deepshadow::io::vdb::{Grid, Transform, VdbFile};
use glam::{DMat4, DVec3, IVec3};

use super::cli::{Folder, must_succeed, stderr};
use super::formats::vdb_fixture;

/// A folder with the project's OpenVDB fixtures.
fn with_fixtures() -> Folder {
    let folder = Folder::new();
    for name in ["ball_blosc.vdb", "types_zip.vdb", "strings.vdb", "instance.vdb"] {
        fs::copy(vdb_fixture(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn run(folder: &Folder, arguments: &str) -> String {
    let output = folder.run(&format!("convert {arguments}"));
    must_succeed(&output);
    assert!(output.stdout.is_empty());
    stderr(&output)
}

fn read(folder: &Folder, name: &str) -> Vec<u8> {
    fs::read(folder.path().join(name)).unwrap()
}

fn load(folder: &Folder, name: &str, index: usize) -> Grid {
    VdbFile::open(folder.path().join(name)).unwrap().load(index).unwrap()
}

/// Radius 5 around (60, 60, 60), with squared distances inside and 0.25 outside; see the fixtures'
/// README.
#[test]
fn a_ball_becomes_an_array_of_its_active_box_and_a_ball_again() {
    let folder = with_fixtures();
    let said = run(&folder, "ball_blosc.vdb ball.npy");
    assert!(said.contains("which voxels are active (515 of 1331)"), "{said}");
    let bytes = read(&folder, "ball.npy");
    let header = String::from_utf8_lossy(&bytes[..128]).into_owned();
    assert!(header.contains("'<f4'") && header.contains("(11, 11, 11)"), "{header}");
    let voxel = |x: usize, y: usize, z: usize| {
        let at = bytes.len() - 4 * 1331 + 4 * ((z * 11 + y) * 11 + x);
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    };
    assert_eq!(
        [voxel(5, 5, 5), voxel(6, 7, 5), voxel(10, 5, 5), voxel(0, 0, 0)],
        [0.0, 5.0, 25.0, 0.25]
    );
    let sidecar = fs::read_to_string(folder.path().join("ball.npy.toml")).unwrap();
    for line in ["index_origin = [55.0, 55.0, 55.0]", "background = 0.25", "dims = [11, 11, 11]"] {
        assert!(sidecar.contains(line), "{sidecar}");
    }
    run(&folder, "ball.npy again.vdb");
    let file = VdbFile::open(folder.path().join("again.vdb")).unwrap();
    let first = VdbFile::open(vdb_fixture("ball_blosc.vdb")).unwrap();
    let (header, expected) = (&file.grids()[0], &first.grids()[0]);
    assert_eq!((&header.name, header.class()), (&expected.name, expected.class()));
    assert_eq!((&header.transform, header.background), (&expected.transform, expected.background));
    let (found, expected) = (file.load(0).unwrap(), first.load(0).unwrap());
    for x in 50..70 {
        for y in 50..70 {
            for z in 50..70 {
                let index = IVec3::new(x, y, z);
                assert_eq!(found.get(index), expected.get(index), "{index}");
            }
        }
    }
}

#[test]
fn a_chain_through_all_formats_keeps_every_bit() {
    let folder = with_fixtures();
    run(&folder, "ball_blosc.vdb a.npy");
    let chain =
        ["a.npy", "b.nrrd", "c.mhd", "d.raw", "e.nhdr", "f.mha", "g.vdb", "h.nrrd", "i.npy"];
    for pair in chain.windows(2) {
        let packed = match pair[1] {
            "c.mhd" => "--compression zlib",
            "h.nrrd" => "--compression gzip",
            "g.vdb" => "--compression zip",
            _ => "",
        };
        run(&folder, &format!("{} {} {packed}", pair[0], pair[1]));
    }
    let voxels = |name: &str| {
        let bytes = read(&folder, name);
        bytes[bytes.len() - 4 * 1331..].to_vec()
    };
    let names = folder.names();
    let of_header = names.iter().find(|name| name.starts_with("e.nhdr.")).unwrap();
    for name in ["b.nrrd", "d.raw", of_header, "f.mha", "i.npy"] {
        assert!(voxels(name) == voxels("a.npy"), "{name}");
    }
    // The first voxel's position is preserved too.
    let file = VdbFile::open(folder.path().join("g.vdb")).unwrap();
    let Transform::Affine(place) = file.grids()[0].transform.clone() else { panic!("no matrix") };
    let first = VdbFile::open(vdb_fixture("ball_blosc.vdb")).unwrap();
    let Transform::Affine(expected) = first.grids()[0].transform.clone() else { panic!("none") };
    let corner = expected.transform_point3(DVec3::splat(55.0));
    assert!((place.transform_point3(DVec3::ZERO) - corner).length() < 1e-12, "{place}");
}

#[test]
fn several_grids_stay_together_and_one_can_be_taken() {
    let folder = with_fixtures();
    let said = run(&folder, "types_zip.vdb all.vdb");
    assert!(said.contains("6 grids"), "{said}");
    let file = VdbFile::open(folder.path().join("all.vdb")).unwrap();
    let names: Vec<&str> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
    assert_eq!(names, ["density", "density", "", "flag", "mask", "velocity"]);
    assert!(file.grids()[1].saved_as_half);
    run(&folder, "types_zip.vdb one.vdb --grid velocity --magnitude");
    let Grid::Double(tree) = load(&folder, "one.vdb", 0) else { panic!("vec3d becomes double") };
    assert_eq!(tree.get(IVec3::new(4, 8, -12)).0, (16.0_f64 + 16.0 + 1.0).sqrt());
    run(&folder, "types_zip.vdb v.npy --grid velocity");
    assert!(String::from_utf8_lossy(&read(&folder, "v.npy")[..128]).contains("3)"));
    let said = run(&folder, "types_zip.vdb d.raw");
    assert!(said.contains("'velocity'"), "what is not converted is named: {said}");
    let said = run(&folder, "strings.vdb s.vdb");
    assert!(said.contains("'words' is left out"), "{said}");
    assert_eq!(VdbFile::open(folder.path().join("s.vdb")).unwrap().grids().len(), 1);
    run(&folder, "instance.vdb i.vdb");
    let file = VdbFile::open(folder.path().join("i.vdb")).unwrap();
    assert_eq!(file.grids()[1].instance_of.as_deref(), Some("density"));
}

#[test]
fn options_change_voxels_as_they_say() {
    let folder = with_fixtures();
    run(&folder, "ball_blosc.vdb t.vdb --threshold 9 --crop 60,55,55,65,65,65 --half");
    let file = VdbFile::open(folder.path().join("t.vdb")).unwrap();
    assert!(file.grids()[0].saved_as_half);
    let grid = file.load(0).unwrap();
    let bounds = grid.active_bounds().unwrap();
    assert_eq!((bounds.min, bounds.max), (IVec3::new(60, 55, 55), IVec3::splat(65)));
    assert_eq!(grid.get(IVec3::new(63, 60, 60)), (deepshadow::io::vdb::AnyValue::Float(9.0), true));
    assert!(!grid.get(IVec3::new(62, 60, 60)).1 && !grid.get(IVec3::new(59, 60, 60)).1);

    run(&folder, "ball_blosc.vdb r.vdb --resample 0.5");
    let file = VdbFile::open(folder.path().join("r.vdb")).unwrap();
    let Grid::Float(tree) = file.load(0).unwrap() else { panic!("float") };
    // Voxels 60 and 61 along each axis: squared distances of 0 or 1 each, so their mean is 1.5.
    assert_eq!(tree.get(IVec3::splat(30)), (1.5, true));
    let first = VdbFile::open(vdb_fixture("ball_blosc.vdb")).unwrap();
    let place = |file: &VdbFile| match file.grids()[0].transform.clone() {
        Transform::Affine(place) => place,
        Transform::Refused(why) => panic!("{why}"),
    };
    let expected = place(&first).transform_point3(DVec3::splat(60.5));
    assert!((place(&file).transform_point3(DVec3::splat(30.0)) - expected).length() < 1e-12);

    run(&folder, "ball_blosc.vdb c.npy --crop 60,60,58,62,61,70");
    let header = String::from_utf8_lossy(&read(&folder, "c.npy")[..128]).into_owned();
    assert!(header.contains("(13, 2, 3)"), "the box that was asked for: {header}");
}

#[test]
fn types_are_the_outputs_but_beside_dims() {
    let folder = Folder::new();
    fs::write(folder.path().join("s.raw"), [0_u8, 0, 0, 1, 255, 3, 1, 0]).unwrap();
    run(&folder, "s.raw a.npy --dims 2,2,1 --type u16 --endian big --spacing 1,2,3");
    assert!(String::from_utf8_lossy(&read(&folder, "a.npy")[..128]).contains("'<u2'"));
    assert_eq!(read(&folder, "a.npy")[128..], [0, 0, 1, 0, 3, 255, 0, 1]);
    // Without --dims the array describes itself: integers beyond 255 need a map.
    let said = run(&folder, "a.npy b.raw --type u8");
    assert!(said.contains("value = number * "), "{said}");
    assert_eq!(read(&folder, "b.raw"), [0, 0, 255, 1]);
    let sidecar = fs::read_to_string(folder.path().join("b.raw.toml")).unwrap();
    assert!(sidecar.contains("value_scale"), "{sidecar}");
    run(&folder, "s.raw c.raw --dims 2,2,1 --type u16 --endian big --to-type u8 --range 0,256");
    assert_eq!(read(&folder, "c.raw"), [0, 1, 255, 255]);
    assert!(!fs::read_to_string(folder.path().join("c.raw.toml")).unwrap().contains("value_scale"));
    run(&folder, "a.npy d.npy --type f64");
    assert!(read(&folder, "d.npy")[128..].ends_with(&256.0_f64.to_le_bytes()));
    run(&folder, "a.npy e.vdb --type i32 --threshold 1");
    let Grid::Int32(tree) = load(&folder, "e.vdb", 0) else { panic!("int32") };
    assert_eq!(tree.get(IVec3::new(0, 1, 0)), (65283, true));
    assert_eq!(tree.active_voxel_count(), 3);
    run(&folder, "a.npy f.vdb");
    let file = VdbFile::open(folder.path().join("f.vdb")).unwrap();
    let header = &file.grids()[0];
    assert_eq!((header.name.as_str(), header.class()), ("density", "fog volume"));
    let place = DMat4::from_scale(DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(header.transform, Transform::Affine(place));
    assert_eq!(file.load(0).unwrap().active_voxel_count(), 4);
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = with_fixtures();
    for name in ["x.vdb", "x.npy", "x.nrrd --compression gzip", "x.mha --compression zlib"] {
        let path = name.split(' ').next().unwrap();
        run(&folder, &format!("ball_blosc.vdb {name}"));
        let first = read(&folder, path);
        run(&folder, &format!("ball_blosc.vdb {name} --quiet"));
        assert!(read(&folder, path) == first, "{name}");
    }
}

#[test]
fn what_cannot_be_done_is_said_in_one_line_and_leaves_nothing() {
    let folder = with_fixtures();
    fs::write(folder.path().join("old.npy"), "older").unwrap();
    fs::write(folder.path().join("scene.raw.toml"), "[volume]\npreset = \"box\"\n").unwrap();
    fs::write(folder.path().join("broken.vdb"), &read(&folder, "ball_blosc.vdb")[..900]).unwrap();
    let before = folder.names();
    for (arguments, code, word) in [
        ("", 2, "IN"),
        ("ball_blosc.vdb", 2, "OUT"),
        ("ball_blosc.vdb x.npy --type u7", 2, "u7"),
        ("ball_blosc.vdb x.npy --crop 1,2,3", 2, "6 numbers"),
        ("ball_blosc.vdb x.npy --resample 0", 2, "above 0"),
        ("ball_blosc.vdb x.npy --compression lzma", 2, "lzma"),
        ("ball_blosc.vdb x.tiff", 2, "x.tiff"),
        ("ball_blosc.vdb x", 2, "is not one of .vdb"),
        ("missing.vdb x.npy", 1, "missing.vdb"),
        ("broken.vdb old.npy", 1, "broken.vdb"),
        ("ball_blosc.vdb nowhere/x.npy", 1, "nowhere"),
        ("ball_blosc.vdb scene.raw", 1, "scene.raw.toml"),
        ("ball_blosc.vdb x.npy --grid smoke", 1, "no grid 'smoke'"),
        ("ball_blosc.vdb x.npy --compression zip", 2, "compression"),
        ("ball_blosc.vdb x.npy --spacing 1,1,1", 2, "spacing"),
        ("ball_blosc.vdb x.npy --range 5,5", 2, "5,5"),
        ("ball_blosc.vdb x.npy --crop 5,5,5,4,5,5", 2, "lowest"),
        ("ball_blosc.vdb x.vdb --type u8", 2, "no grids of u8"),
        ("ball_blosc.vdb x.nrrd --half", 2, "half"),
        ("ball_blosc.vdb x.npy --type u8 --to-type u16", 2, "--to-type"),
        ("ball_blosc.vdb x.npy --threshold 99", 1, "no active voxels"),
        ("ball_blosc.vdb old.npy --max-bytes 100", 1, "29012 bytes"),
        ("ball_blosc.vdb old.npy --max-bytes 40000 --crop 0,0,0,99,99,99", 1, "4000000 bytes"),
        ("ball_blosc.vdb x.npy --crop 0,0,0,1048575,1048575,1048575", 1, "limit"),
        ("ball_blosc.vdb x.vdb --resample 1e9", 1, "limit"),
    ] {
        let output = folder.run(&format!("convert {arguments}"));
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "'{arguments}': {said}");
        assert!(said.contains(word) && said.lines().count() == 1, "'{arguments}': {said}");
        assert!(said.starts_with("deepshadow: "), "'{arguments}': {said}");
        assert_eq!(folder.names(), before, "'{arguments}'");
    }
    assert_eq!(read(&folder, "old.npy"), b"older");
    run(&folder, "ball_blosc.vdb old.npy --quiet");
    assert!(read(&folder, "old.npy").starts_with(b"\x93NUMPY"));
}
