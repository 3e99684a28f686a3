//! What the fuzz targets do with their bytes: one reader per target. The tests run the same
//! functions, so that targets stay in step with the library.

use std::path::Path;

use deepshadow::glam::Vec3;
use deepshadow::io::Format;
use deepshadow::io::ReadOptions;
use deepshadow::io::deep_exr::DeepFile;
use deepshadow::io::dense::DenseFile;
use deepshadow::io::vdb::{IndexBox, SurveyDepth, VdbFile};
use deepshadow::io::{SurfaceFile, read_surface, surface_files};
use deepshadow::scene::SceneFile;

/// Memory that a reader may use for voxels, in bytes.
const LIMIT: u64 = 1 << 26;

type Reader = fn(&[u8]);

/// All targets.
pub const READERS: [(&str, Reader); 17] = [
    ("vdb", vdb),
    ("nanovdb", |bytes| dense(Format::NanoVdb, bytes)),
    ("npy", |bytes| dense(Format::Npy, bytes)),
    ("nrrd", |bytes| dense(Format::Nrrd, bytes)),
    ("metaimage", |bytes| dense(Format::MetaImage, bytes)),
    ("nifti", |bytes| dense(Format::Nifti, bytes)),
    ("vti", |bytes| dense(Format::Vti, bytes)),
    ("pvm", |bytes| dense(Format::Pvm, bytes)),
    ("mitsuba", |bytes| dense(Format::MitsubaVol, bytes)),
    ("den", |bytes| dense(Format::Den, bytes)),
    ("raw", raw),
    ("deep_exr", deep_exr),
    ("hair", surface),
    ("tfx", surface),
    ("obj", obj),
    ("gltf", surface),
    ("scene", scene),
];

/// Reads the bytes with the reader of the target `name`.
pub fn read(name: &str, bytes: &[u8]) {
    let reader = READERS.iter().find(|(known, _)| *known == name);
    reader.unwrap_or_else(|| panic!("no reader for the target {name}")).1(bytes);
}

fn vdb(bytes: &[u8]) {
    let Ok(file) = VdbFile::from_bytes("fuzz", bytes.to_vec()) else { return };
    for index in 0..file.grids().len() {
        let survey = file.survey(index, SurveyDepth::Histogram(16));
        let Ok(grid) = file.load(index) else { continue };
        assert_eq!(survey.unwrap().active_voxels, grid.active_voxel_count());
        if let Some(bounds) = grid.active_bounds() {
            let max = bounds.max.min(bounds.min.saturating_add([16; 3].into()));
            let _ = grid.densify(IndexBox { min: bounds.min, max }.padded(1), LIMIT);
        }
    }
}

/// Reads the file in its detected format and as `format`.
fn dense_file(path: &Path, format: Format) {
    let table = ReadOptions::default().with(|options| options.max_bytes = LIMIT);
    for format in Format::of_file(path).into_iter().chain([format]) {
        let Ok(file) = DenseFile::open(path, format, &table) else { continue };
        let Ok(voxels) = file.voxels() else { continue };
        voxels.for_each(|_, _| ());
        assert_eq!(voxels.density().unwrap().len(), file.header().dims.iter().product::<usize>());
        let _ = file.volume(None, None);
    }
}

fn dense(format: Format, bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fuzz.bin");
    std::fs::write(&path, bytes).unwrap();
    dense_file(&path, format);
}

/// The bytes are a sidecar, a zero byte, and voxels.
fn raw(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |&byte| byte == 0);
    let (sidecar, voxels) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fuzz.raw");
    std::fs::write(path.with_extension("toml"), sidecar).unwrap();
    std::fs::write(&path, voxels).unwrap();
    dense_file(&path, Format::Raw);
}

fn deep_exr(bytes: &[u8]) {
    let Ok(mut file) = DeepFile::from_bytes("fuzz", bytes.to_vec(), LIMIT) else { return };
    let Ok(image) = file.read() else { return };
    assert_eq!(file.statistics().unwrap(), image.statistics());
    image.flatten().unwrap();
    // Names that are not valid UTF-8 become longer when read, possibly longer than a file allows.
    if let Ok(written) = image.encode() {
        let again = DeepFile::from_bytes("again", written, u64::MAX).unwrap().read().unwrap();
        assert_eq!(again.rows.len(), image.rows.len());
    }
}

/// Reads hair or a mesh.
fn surface(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fuzz.bin");
    std::fs::write(&path, bytes).unwrap();
    let Ok((surface, _)) = read_surface(&path, LIMIT) else { return };
    assert!(surface_files(&path).unwrap().contains(&path));
    match surface {
        SurfaceFile::Mesh(mesh) => {
            let mut corners = (0..mesh.triangles().len()).flat_map(|index| mesh.corners(index));
            assert!(corners.all(Vec3::is_finite));
        }
        SurfaceFile::Strands(strands) => {
            let segments = (0..strands.count()).map(|index| strands.strand(index).len() - 1);
            assert_eq!(segments.sum::<usize>(), strands.points().len() - strands.count());
        }
    }
}

/// The bytes are a material file, a zero byte, and a mesh.
fn obj(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |&byte| byte == 0);
    let (materials, mesh) = (parts.next().unwrap_or_default(), parts.next());
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("fuzz.mtl"), materials).unwrap();
    let path = folder.path().join("fuzz.obj");
    let mesh = mesh.unwrap_or(materials);
    std::fs::write(&path, [b"mtllib fuzz.mtl\n", mesh].concat()).unwrap();
    let _ = read_surface(&path, LIMIT);
}

fn scene(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = SceneFile::parse(text, Path::new("fuzz/scene.toml"));
    }
}
