//! What files and options ask for is refused where it is too much, in one line with the number, and
//! never by an abort; and what works takes little more memory than a volume.

use std::fs;
use std::path::Path;

use glam::IVec3;

use crate::cli::{Folder, must_succeed, stderr};
use crate::formats::{dense_cases, gzip, vdb_fixture};

/// Runs the program with an address space of so many KiB.
#[cfg(target_os = "linux")]
fn limited(folder: &Path, kibibytes: u64, arguments: &str) -> std::process::Output {
    std::process::Command::new("sh")
        .args(["-c", "ulimit -v \"$0\" && exec \"$@\"", &kibibytes.to_string()])
        .arg(crate::cli::program())
        .args(arguments.split_whitespace())
        .env("RAYON_NUM_THREADS", "2")
        // An arena a thread reserves more than it takes.
        .env("MALLOC_ARENA_MAX", "1")
        .current_dir(folder)
        .output()
        .unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn a_small_file_of_many_voxels_is_looked_through_or_refused_in_one_line() {
    let folder = Folder::new();
    // 512 x 512 x 400 floats: 400 MiB, as members of one gzip stream.
    let member = gzip(&vec![0; 16 << 20]);
    let mut bytes = b"NRRD0004\ntype: float\ndimension: 3\nsizes: 512 512 400\nencoding: gzip\n\
                      endian: little\n\n"
        .to_vec();
    (0..25).for_each(|_| bytes.extend(&member));
    fs::write(folder.path().join("zeros.nrrd"), bytes).unwrap();
    let run = |arguments: &str| limited(folder.path(), 400_000, arguments);
    let output = run("info zeros.nrrd --json");
    must_succeed(&output);
    assert!(String::from_utf8_lossy(&output.stdout).contains("\"mean\": 0.0"));
    for arguments in [
        "convert zeros.nrrd zeros.npy",
        "convert zeros.nrrd zeros.mha --type u8",
        "render zeros.nrrd --backend cpu --quiet",
        "render rods --backend cpu --size 16384x16384 --quiet",
        "map rods --backend cpu --map-size 8192 --quiet",
    ] {
        let output = run(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments}: {said}");
        assert_eq!(said.lines().count(), 1, "{arguments}: {said}");
        assert!(said.contains("needs ") && said.contains(" bytes"), "{arguments}: {said}");
        assert_eq!(folder.names(), ["zeros.nrrd"], "{arguments}");
    }
    // A layer of leaves at a time, and all of them tiles.
    must_succeed(&run("convert zeros.nrrd zeros.vdb"));
}

#[cfg(target_os = "linux")]
#[test]
fn converting_takes_little_more_than_the_volume() {
    let folder = Folder::new();
    let (small, edge) = (16, 300);
    for n in [small, edge] {
        let mut state = 1_u32;
        let noise = (0..n * n * n).flat_map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state as f32 / u32::MAX as f32).to_le_bytes()
        });
        let noise: Vec<u8> = noise.collect();
        let header = format!(
            "NRRD0004\ntype: float\ndimension: 3\nsizes: {n} {n} {n}\nencoding: raw\n\
             endian: little\n\n"
        );
        let bytes = [header.as_bytes(), &noise].concat();
        fs::write(folder.path().join(format!("{n}.nrrd")), bytes).unwrap();
    }
    let volume = 4 * edge * edge * edge / 1024;
    // Noise cannot be packed.
    for (ending, more) in [
        ("vdb", ""),
        ("npy", ""),
        ("mha", ""),
        ("nrrd", "--compression gzip"),
        ("mhd", "--compression zlib"),
        ("raw", ""),
    ] {
        // What the program takes for a small one, to some MiB.
        let needed = (1..200).map(|step| 4096 * step).find(|&kibibytes| {
            let arguments = format!("convert {small}.nrrd out.{ending} --quiet {more}");
            limited(folder.path(), kibibytes, &arguments).status.success()
        });
        // And some layers of leaves, which are more of a small volume than of a large one.
        let most = needed.unwrap() + (1.2 * f64::from(volume)) as u64 + (8 << 10);
        must_succeed(&limited(
            folder.path(),
            most,
            &format!("convert {edge}.nrrd out.{ending} --quiet {more}"),
        ));
    }
}

#[test]
fn max_bytes_bounds_trees_and_volumes_together() {
    let folder = Folder::new();
    let ball = vdb_fixture("ball_blosc.vdb");
    for target in ["out.vdb", "out.npy"] {
        let output = folder.run(&format!("convert {} {target} --max-bytes 1000", ball.display()));
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("the limit is 1000 bytes"), "{}", stderr(&output));
    }
    must_succeed(&folder.run(&format!("convert {} out.vdb", ball.display())));
    // Boxes of 64^3 numbers: a MiB each.
    let scene = "[[volume]]\npreset = \"box\"\n".repeat(20);
    fs::write(folder.path().join("boxes.toml"), scene).unwrap();
    let output =
        folder.run("render boxes.toml --max-bytes 5300000 --backend cpu --size 4x4 --map-size 4");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let due = "6 volumes together: needs 6291456 bytes, the limit is 5300000 bytes";
    assert!(stderr(&output).contains(due), "{}", stderr(&output));
}

/// Two ways lead from dense files to packed ones: part by part, and, where voxels are to be
/// changed, through all of them.
#[test]
fn both_ways_to_packed_files_give_the_same_bytes() {
    let crop = |dims: [i32; 3], origin: IVec3| {
        let last = origin + IVec3::from_array(dims) - 1;
        let corners = [origin.to_array(), last.to_array()].concat();
        corners.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
    };
    let folder = Folder::new();
    let both = |name: &str, crop: &str| {
        for (compression, ending) in
            [("blosc", "vdb"), ("zip", "vdb"), ("none", "vdb"), ("gzip", "nrrd"), ("zlib", "mha")]
        {
            let common = format!("--compression {compression} --quiet");
            must_succeed(&folder.run(&format!("convert {name} a.{ending} {common}")));
            // Nothing is cut, but this way has all voxels at once.
            must_succeed(&folder.run(&format!("convert {name} b.{ending} {common} --crop {crop}")));
            let [a, b] = ["a", "b"]
                .map(|name| fs::read(folder.path().join(format!("{name}.{ending}"))).unwrap());
            assert!(a == b, "{name}, {compression}: {} and {} bytes", a.len(), b.len());
        }
    };
    for (kind, size) in [("i1", 1), ("u2", 2), ("i4", 4), ("f4", 4), ("f8", 8), ("i8", 8)] {
        for origin in [IVec3::ZERO, IVec3::new(-3, 5, -13)] {
            let dims = [19, 9, 21];
            let count = dims.iter().product::<usize>();
            // Constant where z is low, so that there are tiles.
            let voxel = |i: usize| if i < 9 * 19 * 12 { 0 } else { (i * 7 % 23) as u8 };
            let bytes = (0..count).flat_map(|i| {
                let mut bytes = vec![0; size];
                bytes[size - 1] = voxel(i);
                bytes
            });
            let order = if size == 1 { '|' } else { '>' };
            let header = format!(
                "{{'descr': '{order}{kind}', 'fortran_order': False, 'shape': (21, 9, 19), }}\n"
            );
            let mut file = b"\x93NUMPY\x01\x00".to_vec();
            file.extend((header.len() as u16).to_le_bytes());
            file.extend(header.bytes().chain(bytes));
            fs::write(folder.path().join("v.npy"), file).unwrap();
            let [x, y, z] = origin.to_array();
            let sidecar = format!("index_origin = [{x}.0, {y}.0, {z}.0]\nbackground = 0.0\n");
            fs::write(folder.path().join("v.toml"), sidecar).unwrap();
            both("v.npy", &crop([19, 9, 21], origin));
        }
    }
    fs::remove_file(folder.path().join("v.toml")).unwrap();
    fs::remove_file(folder.path().join("v.npy")).unwrap();
    for case in dense_cases() {
        let inputs = tempfile::tempdir().unwrap();
        let path = case.write(&inputs);
        let origin = if case.name == "npy_c" { continue } else { IVec3::ZERO };
        both(&path.display().to_string(), &crop([3, 2, 2], origin));
    }
}
