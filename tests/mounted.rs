//! Mounted files are read as those of the disk are, whatever names them and whatever their source
//! does.

use std::cell::{Cell, RefCell};
use std::fs;
use std::io::{Error, Result as IoResult};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use deepshadow::glam::Vec3;
use deepshadow::io::{self, Described, FileSource, SceneLoader, files_of, frames_of, is_numbered};
use deepshadow::scene::automatic::Loaded;
use deepshadow::scene::{NumberedName, Shape};

use crate::support::fixture;

/// Files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// What `input` is loaded as, and what is said of it.
fn load(input: &str) -> deepshadow::Result<(Loaded, Vec<String>)> {
    SceneLoader::default().load(&Described::of(input, false)?.file, true)
}

/// All numbers of what was loaded, bit by bit, with their places.
fn bits(loaded: &Loaded) -> Vec<u64> {
    let mut bits = Vec::new();
    for ingredients in &loaded.volumes {
        let volume = &ingredients.volume;
        bits.extend(volume.dims().map(|n| n as u64));
        bits.extend(volume.world_from_index().to_cols_array().map(f64::to_bits));
        bits.extend(volume.voxels().to_dense().iter().map(|value| u64::from(value.to_bits())));
    }
    for surface in loaded.surfaces.iter() {
        let points = match &surface.shape {
            Shape::Mesh(mesh) => mesh.positions(),
            Shape::Strands(strands) => strands.points(),
        };
        bits.extend(points.iter().flat_map(Vec3::to_array).map(|x| u64::from(x.to_bits())));
    }
    bits
}

#[test]
fn every_fixture_is_the_same_mounted_as_on_the_disk() {
    let root = fixture("");
    let of_disk: Vec<_> = files(&root)
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
            let found = load(path.to_str().unwrap());
            (format!("nowhere/{name}"), fs::read(&path).unwrap(), found)
        })
        .collect();
    for (name, bytes, _) in &of_disk {
        io::mount(name, bytes.clone());
    }
    let mut same = 0;
    for (name, _, of_disk) in of_disk {
        let whole =
            |text: &str| text.replace(root.to_str().unwrap().trim_end_matches('/'), "nowhere");
        match (load(&name), of_disk) {
            (Ok((mounted, notes)), Ok((loaded, others))) => {
                assert_eq!(bits(&mounted), bits(&loaded), "{name}");
                assert_eq!(notes, others.iter().map(|note| whole(note)).collect::<Vec<_>>());
                same += 1;
            }
            (Err(error), Err(other)) => assert_eq!(error.to_string(), whole(&other.to_string())),
            (mounted, _) => panic!("{name}: {:?}", mounted.err()),
        }
    }
    assert!(same > 25, "{same} files");
}

#[test]
fn scenes_meshes_and_sequences_find_what_they_name() {
    let nrrd = |value: u8| {
        let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n";
        [head.as_bytes(), &[value; 8]].concat()
    };
    io::mount("./set/data/../smoke.0007.nrrd", nrrd(7));
    io::mount("set/smoke.0012.nrrd", nrrd(12));
    io::mount("set/smoke.99.nrrd", nrrd(99));
    let obj = "mtllib red.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    io::mount("set/data/one.obj", obj.as_bytes());
    io::mount("set/data/red.mtl", "newmtl red\nKd 0.9 0.1 0.2\n".as_bytes());
    let scene = "[[volume]]\npath = \"../smoke.0012.nrrd\"\n[[mesh]]\npath = \"../data/one.obj\"\n";
    io::mount("set/scenes/scene.toml", scene.as_bytes());

    let (loaded, _) = load("set/scenes/scene.toml").unwrap();
    assert_eq!(loaded.volumes[0].volume.largest(), 12.0);
    let Shape::Mesh(mesh) = &loaded.surfaces.iter().next().unwrap().shape else { panic!() };
    assert!((mesh.materials()[0].albedo.x - 0.9).abs() < 1e-6);

    let described = Described::of("set/smoke.####.nrrd", false).unwrap();
    let table = described.file.volume.iter().next().unwrap();
    assert!(is_numbered(table));
    let name = NumberedName::of(table.path.as_deref().unwrap()).unwrap();
    assert_eq!(files_of(&name).unwrap(), [7, 12]);
    assert_eq!(frames_of(&described.file).unwrap(), Some(vec![7, 12]));
    let of = io::at_frame(&described.file, 7).unwrap();
    let (loaded, _) = SceneLoader::default().load(&of, true).unwrap();
    assert_eq!(loaded.volumes[0].volume.largest(), 7.0);

    let none = files_of(&NumberedName::of("set/dust.####.nrrd".as_ref()).unwrap()).unwrap_err();
    assert!(none.to_string().contains("no file has a name like this"), "{none}");
    let folder = load("set/scenes").unwrap_err().to_string();
    assert_eq!(folder, "set/scenes: a folder, not a file");
}

#[test]
fn frames_on_the_disk_are_found() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.02.vdb", "a.11.vdb", "a.5.vdb", "b.77.vdb"] {
        fs::write(folder.path().join(name), "").unwrap();
    }
    let name = NumberedName::of(&folder.path().join("a.##.vdb")).unwrap();
    assert_eq!(files_of(&name).unwrap(), [2, 11]);
    assert!(files_of(&NumberedName::of("no such/a.##.vdb".as_ref()).unwrap()).is_err());
}

#[test]
fn what_is_unmounted_is_gone_for_its_own_thread_alone() {
    let bytes = fs::read(fixture("vdb/bumps.vdb")).unwrap();
    io::mount("bumps.vdb", bytes.clone());
    assert!(io::open("bumps.vdb").is_ok());
    assert!(io::open("./x/../bumps.vdb").is_ok());
    std::thread::spawn(|| assert!(io::open("bumps.vdb").is_err())).join().unwrap();

    // An open file is no other file that gets its name.
    let open = io::vdb::VdbFile::open("bumps.vdb").unwrap();
    io::mount("bumps.vdb", vec![0; bytes.len()]);
    assert!(io::open("bumps.vdb").is_err());
    // Its few bytes were read already; those of a larger file would be an error.
    assert!(open.load(0).is_ok());
    assert!(io::unmount("./bumps.vdb"));
    assert!(!io::unmount("bumps.vdb"));
    assert!(io::open("bumps.vdb").is_err());
    io::mount("bumps.vdb", b"NRRD".as_slice());
    io::unmount_all();
    assert!(io::open("bumps.vdb").is_err());
}

/// A source that answers as a function says.
struct Odd<F>(u64, F);

impl<F: Fn(u64, &mut [u8]) -> IoResult<usize>> FileSource for Odd<F> {
    fn length(&self) -> u64 {
        self.0
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> IoResult<usize> {
        self.1(offset, bytes)
    }
}

#[test]
fn sources_that_fail_or_lie_are_errors() {
    let bytes: Rc<[u8]> = fs::read(fixture("vdb/bumps.vdb")).unwrap().into();
    let length = bytes.len() as u64;
    let honest = bytes.clone();
    // A byte at a time is slow, and right.
    io::mount(
        "slow.vdb",
        Odd(length, move |at, into: &mut [u8]| honest.read_at(at, &mut into[..1])),
    );
    assert_eq!(bits(&load("slow.vdb").unwrap().0), {
        bits(&load(fixture("vdb/bumps.vdb").to_str().unwrap()).unwrap().0)
    });
    io::mount("fails.vdb", Odd(length, |_, _: &mut [u8]| Err(Error::other("the disk is out"))));
    assert_eq!(load("fails.vdb").unwrap_err().to_string(), "fails.vdb: the disk is out");
    io::mount("ends.vdb", Odd(length, |_, _: &mut [u8]| Ok(0)));
    assert!(load("ends.vdb").is_err());
    io::mount("more.vdb", Odd(length, |_, into: &mut [u8]| Ok(into.len() + 1)));
    assert!(load("more.vdb").is_err());
    io::mount("long.vdb", Odd(u64::MAX, move |at, into: &mut [u8]| bytes.read_at(at, into)));
    let _ = load("long.vdb");
}

#[test]
fn a_header_that_claims_much_is_a_limit_and_little_is_read() {
    let head = b"NRRD0004\ntype: float\ndimension: 3\nsizes: 4000 4000 4000\nencoding: raw\n\n";
    let read = Rc::new(Cell::new(0));
    let counted = read.clone();
    let source = move |at: u64, into: &mut [u8]| {
        counted.set(counted.get() + into.len());
        into.fill(0);
        let _ = head.as_slice().read_at(at, into)?;
        Ok(into.len())
    };
    io::mount("large.nrrd", Odd(head.len() as u64 + (4 << 36), source));
    let error = load("large.nrrd").unwrap_err();
    assert!(matches!(error.kind(), deepshadow::ErrorKind::Limit { .. }), "{error}");
    assert!(read.get() < 10 << 20, "{} bytes", read.get());
}

#[test]
fn small_reads_of_a_source_are_few() {
    let bytes: Rc<[u8]> = fs::read(fixture("vdb/types_zip.vdb")).unwrap().into();
    let calls = Rc::new(RefCell::new(Vec::new()));
    let counted = calls.clone();
    let length = bytes.len() as u64;
    let source = move |at: u64, into: &mut [u8]| {
        counted.borrow_mut().push((at, into.len()));
        bytes.read_at(at, into)
    };
    io::mount("counted.vdb", Odd(length, source));
    io::vdb::VdbFile::open("counted.vdb").unwrap();
    // The whole file fits in one window, and a window is only filled anew after a jump back.
    assert_eq!(*calls.borrow(), [(0, length as usize)]);
}
