//! What a file says of its grids is listed, used or refused with a reason.

use deepshadow::io::vdb::{Transform, VdbFile};
use glam::{DVec3, IVec3};

use super::vdb_bytes::{Bytes, OneGrid, descriptor, file_header, numbers};

fn one_grid() -> OneGrid {
    let values = [vec![0], 3.0_f32.to_le_bytes().to_vec()].concat();
    OneGrid::float(1, values)
}

fn open(bytes: Vec<u8>) -> VdbFile {
    VdbFile::from_bytes("memory", bytes).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: Vec<u8>) -> String {
    match VdbFile::from_bytes("memory", bytes) {
        Ok(_) => panic!("not refused"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn versions_outside_of_222_to_225_are_refused() {
    for version in 222..=225 {
        let mut file = one_grid();
        file.version = version;
        assert!(open(file.bytes()).load(0).unwrap().get(IVec3::ZERO).1);
    }
    for version in [0, 221, 226, u32::MAX] {
        let mut file = one_grid();
        file.version = version;
        let error = refusal(file.bytes());
        assert!(error.contains(&format!("version {version}")), "{error}");
    }
    assert!(VdbFile::recognizes(&one_grid().bytes()));
    assert!(!VdbFile::recognizes(b"PNG and nothing else"));
    assert!(refusal(b"PNG and nothing else".to_vec()).contains("not an OpenVDB file"));
    assert!(refusal(Vec::new()).contains("ends early"));
}

#[test]
fn a_translation_and_a_mirroring_scale_place_the_grid() {
    let mut file = one_grid();
    let scale = [[-2.0, 3.0, 4.0], [2.0, 3.0, 4.0]].concat();
    let all = [vec![10.0, 20.0, 30.0], scale, vec![0.0; 9]].concat();
    file.map = ("ScaleTranslateMap", numbers(&all));
    let Transform::Affine(world_from_index) = open(file.bytes()).grids()[0].transform else {
        panic!("refused")
    };
    let world = world_from_index.transform_point3(DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(world, DVec3::new(8.0, 26.0, 42.0));
}

#[test]
fn an_affine_map_is_transposed_to_column_vectors() {
    let mut file = one_grid();
    // Row vectors: x goes to y, y to z, z to x, then the translation (1, 2, 3).
    let rows = [[0., 1., 0., 0.], [0., 0., 1., 0.], [1., 0., 0., 0.], [1., 2., 3., 1.]].concat();
    file.map = ("AffineMap", numbers(&rows));
    let Transform::Affine(world_from_index) = open(file.bytes()).grids()[0].transform else {
        panic!("refused")
    };
    let world = world_from_index.transform_point3(DVec3::new(10.0, 20.0, 30.0));
    assert_eq!(world, DVec3::new(31.0, 12.0, 23.0));
}

#[test]
fn a_transform_that_cannot_be_used_is_refused_and_the_voxels_load() {
    let mut nan = vec![1.0; 15];
    nan[1] = f64::NAN;
    let mut flat = vec![1.0; 15];
    flat[2] = 0.0;
    let mut frustum = Bytes(numbers(&[0.0; 8]));
    frustum.text("AffineMap").put(&numbers(&[1.0; 16]));
    for (map, rest, word) in [
        ("ScaleMap", numbers(&nan), "not an affine matrix"),
        ("ScaleMap", numbers(&flat), "no inverse"),
        ("AffineMap", numbers(&[1.0; 16]), "not an affine matrix"),
        ("NonlinearFrustumMap", frustum.0, "frustum"),
    ] {
        let mut file = one_grid();
        file.map = (map, rest);
        let file = open(file.bytes());
        let Transform::Refused(why) = &file.grids()[0].transform else { panic!("not refused") };
        assert!(why.contains(word), "{why}");
        assert!(file.load(0).is_ok());
    }
}

#[test]
fn an_unknown_map_or_tree_or_type_is_listed_with_the_reason() {
    let mut map = one_grid();
    map.map = ("PaintedMap", Vec::new());
    let mut tree = one_grid();
    tree.type_name = "Tree_float_9_9_9";
    let mut value = one_grid();
    value.type_name = "Tree_quaternion_5_4_3";
    let mut flags = one_grid();
    flags.flags = 8;
    for (file, word) in
        [(map, "PaintedMap"), (tree, "9_9_9"), (value, "quaternion"), (flags, "flags 0x8")]
    {
        let file = open(file.bytes());
        let refused = file.grids()[0].refused.as_deref().unwrap();
        assert!(refused.contains(word), "{refused}");
        assert!(file.load(0).err().unwrap().to_string().contains(word));
    }
}

/// Two grids that are instances of the named parents.
fn instances(first: &str, second: &str) -> VdbFile {
    let mut file = file_header(224, true, 2);
    for (name, parent) in [("a", first), ("b", second)] {
        let start = file.0.len();
        descriptor(&mut file, name, "Tree_float_2_2_2", parent, [0; 3]);
        let grid = file.0.len();
        let mut body = Bytes::default();
        body.u32(2).u32(0).text("TranslationMap").put(&numbers(&[1.0, 2.0, 3.0]));
        let end = (grid + body.0.len()) as i64;
        file.0.truncate(start);
        descriptor(&mut file, name, "Tree_float_2_2_2", parent, [grid as i64, 0, end]);
        file.put(&body.0);
    }
    open(file.0)
}

#[test]
fn instances_without_a_proper_parent_are_refused() {
    for (first, second) in [("nobody", "b"), ("b", "a"), ("a", "a")] {
        let file = instances(first, second);
        for index in 0..2 {
            let refused = file.grids()[index].refused.as_deref().unwrap();
            assert!(refused.contains("an instance of"), "{refused}");
            assert!(file.load(index).is_err());
        }
    }
}

#[test]
fn a_grid_that_is_not_there_is_an_error() {
    let file = open(one_grid().bytes());
    assert!(file.load(1).err().unwrap().to_string().contains("no grid 1"));
}

#[test]
fn offsets_out_of_order_are_refused() {
    let bytes = one_grid().bytes();
    let at = bytes.windows(7).position(|window| window == b"density").unwrap() + 7;
    let offsets = at + 4 + "Tree_float_2_2_2".len() + 4;
    let file_end = bytes.len() as i64;
    for place in 0..3 {
        for offset in [-1, 0, i64::MIN, i64::MAX, bytes.len() as i64 + 1] {
            let mut bytes = bytes.clone();
            let at = offsets + 8 * place;
            bytes[at..at + 8].copy_from_slice(&offset.to_le_bytes());
            let error = refusal(bytes);
            // Where everything else is in order, the end is missing.
            let is_short = place == 2 && offset > file_end;
            let due = if is_short { "cut short" } else { "not in order" };
            assert!(error.contains(due), "{error}");
        }
    }
}
