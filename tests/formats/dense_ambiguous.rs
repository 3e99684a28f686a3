//! Arrays that may be read in more than one way: the right one, or a word on what decides.

use std::path::Path;

use deepshadow::Result;
use deepshadow::io::Format;
use deepshadow::io::ReadOptions;
use deepshadow::io::dense::DenseFile;
use glam::{DMat4, DVec3};

use super::dense_fixtures::npy;

fn open(path: &Path) -> Result<DenseFile> {
    DenseFile::open(path, Format::of_file(path)?, &ReadOptions::default())
}

/// Opens files that are written into a fresh folder, the first of them; its voxels are bytes.
fn file(files: &[(&str, Vec<u8>)]) -> Result<(DenseFile, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let file = open(&folder.path().join(files[0].0))?;
    let bytes = file.voxels()?.bytes().to_vec();
    Ok((file, bytes))
}

fn refused(files: &[(&str, Vec<u8>)], words: &[&str]) {
    let error = file(files).err().unwrap().to_string();
    assert!(words.iter().all(|word| error.contains(word)) && !error.contains('\n'), "{error}");
}

fn counted(n: usize) -> Vec<u8> {
    (0..n).map(|i| i as u8).collect()
}

fn array(shape: &str, n: usize) -> Vec<u8> {
    npy(1, &format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({shape})}}"), &counted(n))
}

#[test]
fn batches_and_frames_are_not_taken_for_vectors() {
    for shape in ["1, 2, 3, 4", "1, 1, 2, 3, 4"] {
        let (file, bytes) = file(&[("v.npy", array(shape, 24))]).unwrap();
        assert_eq!((file.header().dims, file.header().components), ([4, 3, 2], 1), "{shape}");
        assert_eq!(bytes, counted(24));
        assert!(file.header().notes[0].contains("components = 4"), "{:?}", file.header().notes);
    }
    refused(&[("v.npy", array("2, 2, 3, 4", 48))], &["2 frames", "components = 4"]);
    refused(&[("v.npy", array("2, 2, 2, 6", 48))], &["2 frames", "components = 6"]);
    // What a sidecar says decides.
    let said = |count: usize| ("v.toml", format!("components = {count}\n").into_bytes());
    let (vectors, _) = file(&[("v.npy", array("1, 2, 3, 4", 24)), said(4)]).unwrap();
    assert_eq!((vectors.header().dims, vectors.header().components), ([3, 2, 1], 4));
    let (frame, _) = file(&[("v.npy", array("1, 2, 4, 3", 24)), said(1)]).unwrap();
    assert_eq!((frame.header().dims, frame.header().components), ([3, 4, 2], 1));
    // Three numbers are a vector, or a colour, and are said to be.
    let (vectors, _) = file(&[("v.npy", array("2, 2, 2, 3", 24))]).unwrap();
    assert_eq!((vectors.header().dims, vectors.header().components), ([2, 2, 2], 3));
    assert!(vectors.header().notes[0].contains("vectors"));
    // Python 2 wrote its long numbers so.
    let (long, _) = file(&[("v.npy", array("2L, 3L, 4L", 24))]).unwrap();
    assert_eq!(long.header().dims, [4, 3, 2]);
}

fn nrrd(fields: &str, voxels: usize) -> (&'static str, Vec<u8>) {
    let head = format!("NRRD0004\ntype: uchar\nencoding: raw\n{fields}\n\n");
    ("v.nrrd", [head.as_bytes(), &counted(voxels)].concat())
}

#[test]
fn nrrd_axes_that_are_not_space_are_not_taken_for_it() {
    let three = "dimension: 3\nsizes: 3 4 2\n";
    refused(&[nrrd(&format!("{three}kinds: vector domain domain"), 24)], &["axis 0", "'vector'"]);
    refused(&[nrrd(&format!("{three}kinds: domain domain list"), 24)], &["axis 2", "'list'"]);
    let four = "dimension: 4\nsizes: 3 2 2 2\n";
    refused(&[nrrd(&format!("{four}kinds: domain domain domain time"), 24)], &["2 frames"]);
    refused(&[nrrd(&format!("{four}kinds: list domain domain domain"), 24)], &["3 frames"]);
    refused(&[nrrd(&format!("{four}kinds: domain domain domain vector"), 24)], &["apart"]);
    refused(&[nrrd(four, 24)], &["4 axes", "kinds"]);
    let one = "dimension: 4\nsizes: 3 2 2 1\nspace: LPST\n\
         space directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) none\nspace origin: (4,5,6,0)";
    let (file, bytes) = file(&[nrrd(one, 12)]).unwrap();
    assert_eq!((file.header().dims, bytes), ([3, 2, 2], counted(12)));
    let world = file.header().world_from_index;
    assert_eq!(world.transform_point3(DVec3::ONE), DVec3::new(5.0, 7.0, 9.0));
}

#[test]
fn nrrd_axis_mins_and_maxs_are_heeded() {
    let place = |fields: &str| {
        let (file, _) =
            file(&[nrrd(&format!("dimension: 3\nsizes: 3 2 2\n{fields}"), 12)]).unwrap();
        (file.header().world_from_index, file.header().notes.len())
    };
    let at = |spacing: [f64; 3], origin: [f64; 3]| {
        DMat4::from_translation(DVec3::from(origin)) * DMat4::from_scale(DVec3::from(spacing))
    };
    let both = "axis mins: 1 2 3\naxis maxs: 7 4 11";
    assert_eq!(
        place(&format!("{both}\ncenterings: node node node")),
        (at([3.0, 2.0, 8.0], [1.0, 2.0, 3.0]), 0)
    );
    assert_eq!(
        place(&format!("{both}\ncenterings: cell cell cell")),
        (at([2.0, 1.0, 4.0], [2.0, 2.5, 5.0]), 0)
    );
    // Without a word on centres it is said what is taken.
    assert_eq!(place(both), (at([2.0, 1.0, 4.0], [2.0, 2.5, 5.0]), 1));
    assert_eq!(
        place("spacings: 1 2 4\naxis mins: 1 2 nan\ncenterings: cell node cell"),
        (at([1.0, 2.0, 4.0], [1.5, 2.0, 0.0]), 0)
    );
}

#[test]
fn nrrd_voxels_are_read_from_where_they_are() {
    let head = |more: &str| {
        format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n{more}\n\n")
            .into_bytes()
    };
    // Lines before the voxels, bytes behind them.
    let (named, bytes) = file(&[
        ("v.nhdr", head("line skip: 2\ndata file: v.bin")),
        ("v.bin", [b"one\ntwo\n", &counted(12)[..], b"tail"].concat()),
    ])
    .unwrap();
    assert_eq!(bytes, counted(12));
    assert!(named.header().notes[0].contains("4 bytes after"), "{:?}", named.header().notes);
    let short = [head("byte skip: -1"), counted(11)].concat();
    refused(&[("v.nrrd", short)], &["11 bytes of voxels, expected 12"]);
    let list = head("data file: LIST\na.raw\nb.raw");
    refused(&[("v.nhdr", list)], &["several files"]);
    // A key of the user's own says nothing to a reader.
    let (own, _) = file(&[("v.nrrd", [head("spacings:=7 7 7"), counted(12)].concat())]).unwrap();
    assert_eq!(own.header().world_from_index, DMat4::IDENTITY);
    assert_eq!(own.header().metadata, [("spacings".to_owned(), "7 7 7".to_owned())]);
}

fn vti(arrays: &[(&str, &str)], scalars: &str) -> (&'static str, Vec<u8>) {
    let array = |(name, numbers): &(&str, &str)| {
        format!("<DataArray type=\"Int8\" Name=\"{name}\" format=\"ascii\">{numbers}</DataArray>")
    };
    let arrays: String = arrays.iter().map(array).collect();
    let text = format!(
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 0 0 0\"><Piece \
         Extent=\"0 1 0 0 0 0\"><PointData{scalars}>{arrays}</PointData></Piece></ImageData></VTKFile>"
    );
    ("v.vti", text.into_bytes())
}

#[test]
fn vtks_own_arrays_are_not_the_volume() {
    let mask = ("vtkValidPointMask", "1 1");
    for scalars in ["", " Scalars=\"vtkValidPointMask\"", " Scalars=\"density\""] {
        let (file, bytes) = file(&[vti(&[mask, ("density", "3 4")], scalars)]).unwrap();
        assert_eq!((bytes, file.header().notes.len()), (vec![3, 4], 0), "{scalars}");
    }
    let ghosts = vti(&[("vtkGhostType", "0 0"), ("a", "3 4"), ("b", "5 6")], "");
    let (file, bytes) = file(&[ghosts]).unwrap();
    assert_eq!(bytes, [3, 4]);
    assert!(file.header().notes[0].contains("not b (`volume.grid`)"), "{:?}", file.header().notes);
}

#[test]
fn formats_that_are_not_read_say_so() {
    refused(&[("v.vtk", b"# vtk DataFile Version 5.1\n".to_vec())], &["legacy VTK"]);
    refused(&[("v.npz", b"PK\x03\x04rest".to_vec())], &["zip archive"]);
    let marked =
        b"\xef\xbb\xbfObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nElementType = MET_UCHAR\n\
        ElementDataFile = LOCAL\n";
    let (_, bytes) = file(&[("v.mha", [&marked[..], &counted(12)].concat())]).unwrap();
    assert_eq!(bytes, counted(12));
}
