//! Tests that outputs go where their names lead: through links, to other file systems, pipes,
//! devices, folders.

use std::fs;
use std::io::Read;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};

use super::{contents, voxels};
use crate::cli::{Folder, must_succeed, program, stderr};
use crate::formats::vdb_fixture;

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
    // With a link, a header's voxels lie beside the header itself, and are found from both places.
    symlink("far/v.mhd", path("v.mhd")).unwrap();
    fs::copy(vdb_fixture("ball_blosc.vdb"), path("v.vdb")).unwrap();
    must_succeed(&folder.run("convert v.vdb v.mhd --quiet"));
    symlink("far/v.raw", path("v.raw")).unwrap();
    must_succeed(&folder.run("convert v.vdb v.raw --quiet"));
    for name in ["v.mhd", "far/v.mhd", "v.raw", "far/v.raw"] {
        assert!(voxels(&folder, name).unwrap() == voxels(&folder, "v.vdb").unwrap(), "{name}");
    }
}

/// A link to another file system, which shared memory is on most machines.
#[test]
fn a_link_to_another_file_system_works() {
    let shm = Path::new("/dev/shm");
    let folder = Folder::new();
    let other = fs::metadata(shm)
        .is_ok_and(|shm| shm.is_dir() && shm.dev() != fs::metadata(folder.path()).unwrap().dev());
    if !other {
        eprintln!("not run: /dev/shm is no other file system here");
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
    // A device without space causes an error, and stays.
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
    // No file can lie beside a device.
    fs::copy(vdb_fixture("ball_blosc.vdb"), folder.path().join("v.vdb")).unwrap();
    for (name, code) in [("null.raw", 0), ("null.npy", 0), ("null.mhd", 1), ("null.nhdr", 1)] {
        symlink("/dev/null", folder.path().join(name)).unwrap();
        let output = folder.run(&format!("convert v.vdb {name}"));
        assert_eq!(output.status.code(), Some(code), "{name}: {}", stderr(&output));
    }
    assert!(
        !fs::read_dir("/dev")
            .unwrap()
            .any(|entry| { entry.unwrap().file_name().to_string_lossy().starts_with("null.") })
    );
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
    // Without a driver the work fails after the folder was created.
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
