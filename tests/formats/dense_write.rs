//! Dense volumes that are written read back as they were; what is made of them follows closed
//! forms.

use deepshadow::ErrorKind;
use deepshadow::io::ReadOptions;
use deepshadow::io::dense::{DenseFile, DenseGrid, DenseTarget};
use deepshadow::io::number::{Endian, ValueType};
use deepshadow::io::remap::{Remap, Span};
use deepshadow::io::vdb::{Compression, Grid, IndexBox, Metadata, NewGrid, VdbFile, VdbWriter};
use deepshadow::io::{Format, Inputs};
use deepshadow::volume::Axis;
use glam::{DMat4, DVec3, IVec3};
use tempfile::TempDir;

use crate::support::Random;

const TYPES: [ValueType; 11] = [
    ValueType::U8,
    ValueType::I8,
    ValueType::U16,
    ValueType::I16,
    ValueType::U32,
    ValueType::I32,
    ValueType::U64,
    ValueType::I64,
    ValueType::F16,
    ValueType::F32,
    ValueType::F64,
];

/// A turned, stretched and moved grid whose bytes are anything, so also NaN.
fn grid(value_type: ValueType, components: usize) -> DenseGrid {
    let dims = [5, 4, 3];
    let mut random = Random(5 + value_type.size() as u64);
    let count = dims.iter().product::<usize>() * components * value_type.size();
    let bytes = (0..count).map(|_| (random.unit() * 256.0) as u8).collect();
    let turn = DMat4::from_rotation_z(0.3) * DMat4::from_rotation_x(-1.1);
    let stretch = DMat4::from_scale(DVec3::new(0.1, 0.2, -0.7));
    DenseGrid {
        name: "smoke".to_owned(),
        class: None,
        dims,
        components,
        value_type,
        bytes,
        active: None,
        background: None,
        world_from_index: DMat4::from_translation(DVec3::new(1e3, 0.1, -7.3)) * turn * stretch,
        origin: IVec3::new(-3, 0, 77),
        value_scale: [1.0, 0.0],
        space: None,
        up: None,
        metadata: Vec::new(),
    }
}

/// Writes the grid as `name` and reads it.
fn through(grid: &DenseGrid, name: &str, packed: bool) -> (DenseGrid, Vec<String>) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    let target = DenseTarget::of_path(&path).unwrap();
    let written = target.promise(&path, packed, &Inputs::default()).unwrap();
    let written = written.write(grid.clone()).unwrap();
    assert_eq!(written.paths[0], path);
    let mut names: Vec<_> = written.paths.iter().map(|path| path.file_name().unwrap()).collect();
    names.sort();
    let mut found: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    found.sort_by_key(|entry| entry.as_ref().unwrap().file_name());
    let found: Vec<_> = found.iter().map(|entry| entry.as_ref().unwrap().file_name()).collect();
    assert_eq!(found, names);
    let format = Format::of_file(&path).unwrap();
    let file = DenseFile::open(&path, format, &ReadOptions::default()).unwrap();
    (DenseGrid::read(&file).unwrap(), written.lost)
}

fn assert_close(found: DMat4, expected: DMat4, what: &str) {
    let off = (found - expected).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(off <= 1e-12, "{what}: {found} instead of {expected}");
}

#[test]
fn every_format_keeps_every_value_bit_for_bit_and_its_place() {
    for value_type in TYPES {
        for components in [1, 3] {
            let grid = grid(value_type, components);
            for (name, packed) in [
                ("v.npy", false),
                ("v.raw", false),
                ("v.nrrd", false),
                ("v.nrrd", true),
                ("v.nhdr", false),
                ("v.nhdr", true),
                ("v.mha", false),
                ("v.mha", true),
                ("v.mhd", false),
                ("v.mhd", true),
            ] {
                let what = format!("{name}, {} x {components}, {packed}", value_type.name());
                let (found, lost) = through(&grid, name, packed);
                let has_sidecar = !name.contains(['m', 'h']) && name != "v.nrrd";
                if value_type == ValueType::F16 && !has_sidecar {
                    assert!(lost[0].contains("half"), "{what}: {lost:?}");
                    let wide = grid.clone().retyped(ValueType::F32, Remap::Cast).unwrap();
                    assert!(found.bytes == wide.bytes, "{what}");
                    continue;
                }
                assert_eq!(lost, Vec::<String>::new(), "{what}");
                assert_eq!((found.dims, found.components), (grid.dims, components), "{what}");
                assert_eq!((found.value_type, &found.name[..]), (value_type, "smoke"), "{what}");
                assert!(found.bytes == grid.bytes, "{what}");
                if has_sidecar {
                    assert_eq!(found, grid, "{what}");
                } else {
                    assert_close(found.world_from_voxel(), grid.world_from_voxel(), &what);
                }
            }
        }
    }
}

#[test]
fn a_sidecar_keeps_what_numbers_cannot_say() {
    let mut grid = grid(ValueType::F32, 3);
    grid.name = "a \"name\" \u{1e} \\".to_owned();
    grid.class = Some("level set".to_owned());
    grid.background = Some(vec![0.1, f64::INFINITY, -1.0e-300]);
    grid.up = Some(Axis::NegativeZ);
    for name in ["v.npy", "v.raw"] {
        assert_eq!(through(&grid, name, false), (grid.clone(), Vec::new()), "{name}");
    }
    // Numbers with a scale come back as the values that they stand for.
    let mut scaled = self::grid(ValueType::U8, 1);
    scaled.value_scale = [0.5, -3.0];
    let (found, _) = through(&scaled, "v.raw", false);
    assert_eq!(found.value_type, ValueType::F32);
    let first = f32::from_le_bytes(found.bytes[..4].try_into().unwrap());
    assert_eq!(first, f32::from(scaled.bytes[0]) * 0.5 - 3.0);
}

#[test]
fn what_a_format_cannot_hold_is_said() {
    let mut grid = grid(ValueType::F32, 1);
    let mut active = vec![true; 60];
    active[7] = false;
    grid.active = Some(active);
    grid.background = Some(vec![0.25]);
    grid.class = Some("fog volume".to_owned());
    grid.metadata = vec![("creator".to_owned(), "Houdini: 20".to_owned())];
    grid.world_from_index.y_axis.x += 0.5;
    let said = |name: &str| through(&grid, name, false).1.join("; ");
    for (name, words) in [
        ("v.npy", &["59 of 60", "metadata (creator)"][..]),
        ("v.nrrd", &["59 of 60", "0.25", "'fog volume'"]),
        ("v.mhd", &["59 of 60", "0.25", "'fog volume'", "creator", "right angles"]),
    ] {
        let said = said(name);
        assert!(words.iter().all(|word| said.contains(word)), "{name}: {said}");
    }
    let (found, _) = through(&grid, "v.nrrd", false);
    assert_eq!(found.metadata, [("creator".to_owned(), "Houdini: 20".to_owned())]);
    assert_close(found.world_from_voxel(), grid.world_from_voxel(), "sheared nrrd");
    assert_close(
        through(&grid, "v.mhd", false).0.world_from_voxel(),
        grid.world_from_voxel(),
        "mhd",
    );
}

/// All voxels are active unless a background says which are not.
#[test]
fn dense_voxels_become_a_tree_and_dense_again() {
    for (value_type, back) in [
        (ValueType::U8, ValueType::F32),
        (ValueType::I16, ValueType::F32),
        (ValueType::U16, ValueType::F32),
        (ValueType::I32, ValueType::I32),
        (ValueType::U32, ValueType::I64),
        (ValueType::I64, ValueType::I64),
        (ValueType::F32, ValueType::F32),
        (ValueType::F64, ValueType::F64),
    ] {
        for components in [1, 3] {
            let grid = grid(value_type, components);
            let back = match (components, back) {
                (3, ValueType::I64) => continue,
                (_, back) => back,
            };
            let bounds = grid.bounds().unwrap();
            let tree = grid.clone().into_vdb().unwrap();
            assert_eq!((tree.active_voxel_count(), tree.active_bounds()), (60, Some(bounds)));
            let found = DenseGrid::of_vdb(&tree, bounds, DMat4::IDENTITY, 1 << 20).unwrap();
            let expected = grid.retyped(back, Remap::Cast).unwrap();
            assert!(found.bytes == expected.bytes, "{value_type:?} x {components}");
            assert_eq!((found.value_type, found.origin), (back, expected.origin));
        }
    }
    let mut grid = grid(ValueType::I32, 1);
    grid.bytes[..12].copy_from_slice(&[7, 0, 0, 0, 8, 0, 0, 0, 7, 0, 0, 0]);
    grid.background = Some(vec![7.0]);
    let tree = grid.clone().into_vdb().unwrap();
    assert_eq!(tree.active_voxel_count(), 58);
    assert!(tree.get(grid.origin + IVec3::X).1 && !tree.get(grid.origin).1);
    grid.components = 4;
    grid.dims = [5, 1, 3];
    assert!(grid.into_vdb().err().unwrap().to_string().contains("`magnitude`"));
}

/// Arithmetic leaves -0 where nothing is; it is no voxel of its own, and stays what it is.
#[test]
fn minus_zero_is_the_background_zero() {
    let numbers = |at: DVec3| [-0.0, 0.0, f64::NAN, 1e-300][at.x as usize];
    for background in [0.0, -0.0] {
        let mut grid = floats([4, 3, 2], numbers);
        grid.background = Some(vec![background]);
        let bytes = grid.bytes.clone();
        let bounds = grid.bounds().unwrap();
        let mut writer = VdbWriter::new(&["g"], Compression::BLOSC, &Metadata::default());
        writer.add(NewGrid::new(grid.into_vdb().unwrap(), &DMat4::IDENTITY)).unwrap();
        let file = VdbFile::from_bytes("memory", writer.finish().unwrap()).unwrap();
        let tree = file.load(0).unwrap();
        assert_eq!(tree.active_voxel_count(), 12, "NaN and the least number");
        let found = DenseGrid::of_vdb(&tree, bounds, DMat4::IDENTITY, 1 << 20).unwrap();
        assert!(found.bytes == bytes, "{background}");
    }
}

fn floats(dims: [usize; 3], value: impl Fn(DVec3) -> f64) -> DenseGrid {
    let mut grid = grid(ValueType::F64, 1);
    let [nx, ny, nz] = dims;
    let voxels =
        (0..nx * ny * nz).map(|at| [at % nx, at / nx % ny, at / nx / ny].map(|n| n as f64));
    grid.bytes = voxels.flat_map(|voxel| value(voxel.into()).to_le_bytes()).collect();
    (grid.dims, grid.origin) = (dims, IVec3::ZERO);
    grid
}

fn values(grid: &DenseGrid) -> Vec<f64> {
    grid.value_type.decode(&grid.bytes, Endian::Little)
}

/// The corners of the box in the world.
fn corners(grid: &DenseGrid) -> [DVec3; 2] {
    let far = DVec3::from(grid.dims.map(|n| n as f64 - 0.5));
    [DVec3::splat(-0.5), far].map(|corner| grid.world_from_voxel().transform_point3(corner))
}

#[test]
fn resampling_keeps_place_means_and_slopes() {
    let ramp = |at: DVec3| 2.0 * at.x - 3.0 * at.y + at.z + 5.0;
    let old = floats([6, 4, 8], ramp);
    let half = old.clone().resampled(0.5, 1 << 30).unwrap();
    assert_eq!(half.dims, [3, 2, 4]);
    assert!((corners(&half)[0] - corners(&old)[0]).length() < 1e-9);
    assert!((corners(&half)[1] - corners(&old)[1]).length() < 1e-9);
    // The mean of eight voxels of a ramp is the ramp in their middle.
    assert!((values(&half)[0] - ramp(DVec3::splat(0.5))).abs() < 1e-12);
    let mean = |grid: &DenseGrid| values(grid).iter().sum::<f64>() / grid.voxels() as f64;
    assert!((mean(&half) - mean(&old)).abs() < 1e-12);

    let double = old.clone().resampled(2.0, 1 << 30).unwrap();
    assert_eq!(double.dims, [12, 8, 16]);
    assert!((corners(&double)[1] - corners(&old)[1]).length() < 1e-9);
    // Between centres the ramp goes on; voxel (5, 3, 7) lies at (2.25, 1.25, 3.25).
    let at = (7 * 8 + 3) * 12 + 5;
    assert!((values(&double)[at] - ramp(DVec3::new(2.25, 1.25, 3.25))).abs() < 1e-12);
    // Beyond the outermost centres it is held.
    assert!((values(&double)[0] - ramp(DVec3::ZERO)).abs() < 1e-12);

    for factor in [0.1, 0.37, 1.0, 1.7] {
        let same = floats([6, 4, 8], |_| 4.25).resampled(factor, 1 << 30).unwrap();
        assert!(values(&same).iter().all(|value| (value - 4.25).abs() < 1e-12), "{factor}");
    }
    let error = old.clone().resampled(1000.0, 1 << 30).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Limit { .. }), "{error}");
    assert!(old.resampled(0.0, 1 << 30).is_err());
}

/// A sparse grid's surroundings take part, and all grids of a file keep one lattice.
#[test]
fn resampling_a_part_of_something_larger_mixes_in_the_background() {
    let mut one = floats([1, 1, 1], |_| 8.0);
    (one.background, one.origin) = (Some(vec![0.0]), IVec3::new(3, 2, -1));
    let half = one.clone().resampled(0.5, 1 << 20).unwrap();
    assert_eq!((half.origin, half.dims), (IVec3::new(1, 1, -1), [1, 1, 1]));
    assert_eq!(values(&half), [1.0]);
    one.active = Some(vec![true]);
    let double = one.resampled(2.0, 1 << 20).unwrap();
    assert_eq!((double.origin, double.dims), (IVec3::new(6, 4, -2), [2, 2, 2]));
    assert!(values(&double).iter().all(|value| (value - 8.0 * 0.75_f64.powi(3)).abs() < 1e-12));
    assert_eq!(double.active, Some(vec![true; 8]));
}

#[test]
fn numbers_get_other_types_exactly_or_by_a_map_that_is_known() {
    let span = |values: &[f64]| values.iter().copied().fold(Span::EMPTY, Span::with);
    let u8s = ValueType::U8;
    assert_eq!(Remap::choose(span(&[0.0, 255.0]), u8s, None), Remap::Cast);
    let remap = Remap::choose(span(&[-1.0, 255.0]), u8s, None);
    assert_eq!(remap, Remap::Affine { from: [-1.0, 255.0], to: [0.0, 255.0] });
    let remap = Remap::choose(span(&[0.5, 1.0]), ValueType::I16, None);
    assert_eq!([remap.apply(0.5, true), remap.apply(1.0, true)], [-32768.0, 32767.0]);
    let [slope, intercept] = remap.value_scale();
    for value in [0.5, 0.7, 0.9, 1.0] {
        let again = remap.apply(value, true) * slope + intercept;
        assert!((again - value).abs() <= 0.5001 * slope, "{value}: {again}");
    }
    let remap = Remap::choose(span(&[7.0]), ValueType::F32, Some([-1000.0, 1000.0]));
    assert_eq!([-2000.0, 0.0, 1000.0].map(|v| remap.apply(v, false)), [0.0, 0.5, 1.0]);
    assert_eq!(Remap::choose(span(&[0.5, f64::NAN]), ValueType::F16, None), Remap::Cast);
    // A cast keeps the last digits of 64-bit integers.
    let mut grid = grid(ValueType::I64, 1);
    grid.bytes[..8].copy_from_slice(&(i64::MAX - 1).to_le_bytes());
    let bytes = grid.retyped(ValueType::U64, Remap::Cast).unwrap().bytes;
    assert_eq!(bytes[..8], (i64::MAX as u64 - 1).to_le_bytes());
}

#[test]
fn crop_and_threshold_take_what_they_say() {
    let old = floats([6, 4, 8], |at| at.x + 10.0 * at.y + 100.0 * at.z);
    let bounds = IndexBox { min: IVec3::new(2, -5, 7), max: IVec3::new(3, 1, 99) };
    let part = old.clone().cropped(bounds).unwrap();
    assert_eq!((part.dims, part.origin), ([2, 2, 1], IVec3::new(2, 0, 7)));
    assert_eq!(values(&part), [702.0, 703.0, 712.0, 713.0]);
    assert!(old.clone().cropped(IndexBox { min: IVec3::splat(8), ..bounds }).is_err());
    let high = part.without_below(703.5).unwrap();
    assert_eq!(values(&high), [0.0, 0.0, 712.0, 713.0]);
    assert_eq!(high.active, Some(vec![false, false, true, true]));
    let Grid::Double(tree) = high.into_vdb().unwrap() else { panic!("doubles") };
    assert_eq!(tree.active_voxel_count(), 2);
}
