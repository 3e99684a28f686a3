//! Every way to store the values of a node reads as the same voxels.

use deepshadow::io::vdb::{AnyValue, Grid, VdbFile};
use glam::IVec3;
use half::f16;

use super::vdb_bytes::{OneGrid, raw_frame, zip_frame};

/// Active voxels 0 and 63 with 1 and 2, everything else inactive.
const MASK: u64 = 1 | 1 << 63;
/// Of the inactive voxels, every second one is selected.
const SELECTED: u64 = 0xaaaa_aaaa_aaaa_aaaa;

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn halves(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|&value| f16::from_f32(value).to_le_bytes()).collect()
}

fn load(bytes: Vec<u8>) -> Grid {
    VdbFile::from_bytes("memory", bytes).unwrap().load(0).unwrap_or_else(|error| panic!("{error}"))
}

/// Index of voxel `slot` of the leaf at the origin.
fn index(slot: i32) -> IVec3 {
    IVec3::new(slot >> 4, slot >> 2 & 3, slot & 3)
}

/// Checks the leaf: 1 and 2 where active, elsewhere the two inactive values by selection.
fn check_leaf(grid: &Grid, off: f32, on: f32) {
    for slot in 0..64 {
        let expected = match slot {
            0 => 1.0,
            63 => 2.0,
            _ if SELECTED >> slot & 1 == 1 => on,
            _ => off,
        };
        let (value, active) = grid.get(index(slot));
        assert_eq!((value, active), (AnyValue::Float(expected), slot == 0 || slot == 63), "{slot}");
    }
}

/// The head of a leaf's block for each code, with the inactive values that it means where the
/// background is 0.25.
fn codes() -> [(Vec<u8>, f32, f32); 6] {
    let selection = SELECTED.to_le_bytes().to_vec();
    let head = |code: u8, values: &[f32], selection: &[u8]| {
        [&[code][..], &floats(values), selection].concat()
    };
    [
        (head(0, &[], &[]), 0.25, 0.25),
        (head(1, &[], &[]), -0.25, -0.25),
        (head(2, &[5.0], &[]), 5.0, 5.0),
        (head(3, &[], &selection), -0.25, 0.25),
        (head(4, &[5.0], &selection), 5.0, 0.25),
        (head(5, &[5.0, 6.0], &selection), 5.0, 6.0),
    ]
}

#[test]
fn every_code_gives_its_inactive_values() {
    for (head, off, on) in codes() {
        let rest = [head, floats(&[1.0, 2.0])].concat();
        check_leaf(&load(OneGrid::float(MASK, rest).bytes()), off, on);
    }
}

#[test]
fn every_code_gives_its_inactive_values_in_half_files() {
    for (head, off, on) in codes() {
        let rest = [head, halves(&[1.0, 2.0])].concat();
        let mut file = OneGrid::float(MASK, rest);
        file.type_name = "Tree_float_2_2_2_HalfFloat";
        let block = [vec![0], halves(&[7.0])].concat();
        file.branch_blocks = Some([block.clone(), block]);
        check_leaf(&load(file.bytes()), off, on);
    }
}

#[test]
fn all_values_are_stored_with_code_6_or_without_the_mask_flag() {
    let all: Vec<f32> = (0..64).map(|slot| slot as f32).collect();
    let blocks = |code: u8| [&[code][..], &floats(&all)].concat();
    for (flags, code) in [(2, 6), (0, 0), (0, 6), (0, 1)] {
        let mut file = OneGrid::float(MASK, blocks(code));
        file.flags = flags;
        file.branch_blocks = Some([blocks(6), blocks(6)]);
        let grid = load(file.bytes());
        for slot in 0..64 {
            let active = slot == 0 || slot == 63;
            assert_eq!(grid.get(index(slot)), (AnyValue::Float(slot as f32), active));
        }
        // Slot 1 of the lower branch lies next to the leaf along z, slot 2 is inactive.
        assert_eq!(grid.get(IVec3::new(3, 3, 7)), (AnyValue::Float(1.0), true));
        assert_eq!(grid.get(IVec3::new(3, 3, 8)), (AnyValue::Float(2.0), false));
        assert_eq!(grid.get(IVec3::new(0, 0, 16)), (AnyValue::Float(1.0), true));
    }
}

#[test]
fn zip_and_raw_frames_hold_the_same_values() {
    type Frame = fn(&[u8]) -> Vec<u8>;
    let frames: [(u32, Frame); 3] = [(3, zip_frame), (3, raw_frame), (6, raw_frame)];
    for (flags, frame) in frames {
        for (head, off, on) in codes() {
            let rest = [head, frame(&floats(&[1.0, 2.0]))].concat();
            let mut file = OneGrid::float(MASK, rest);
            file.flags = flags;
            let block = [vec![0], frame(&floats(&[7.0]))].concat();
            file.branch_blocks = Some([block.clone(), block]);
            check_leaf(&load(file.bytes()), off, on);
        }
    }
}

#[test]
fn a_blosc_chunk_gives_the_values_of_a_leaf() {
    let numbers: Vec<f32> = (0..64).map(|slot| slot as f32).collect();
    let bytes = floats(&numbers);
    // Too few numbers to split: one stream of all shuffled bytes, as an LZ4 block of literals.
    let shuffled: Vec<u8> =
        (0..4).flat_map(|byte| bytes.iter().skip(byte).step_by(4)).copied().collect();
    let packed = [&[0xf0, 241][..], &shuffled].concat();
    let mut chunk = vec![2, 1, 0x21, 4];
    for size in [256, 256, 20 + 4 + packed.len() as u32, 20, packed.len() as u32] {
        chunk.extend(size.to_le_bytes());
    }
    chunk.extend(packed);
    let frame = [&(chunk.len() as i64).to_le_bytes()[..], &chunk].concat();
    let mut file = OneGrid::float(u64::MAX, [vec![0], frame].concat());
    file.flags = 6;
    let block = [vec![0], raw_frame(&floats(&[7.0]))].concat();
    file.branch_blocks = Some([block.clone(), block]);
    let grid = load(file.bytes());
    for slot in 0..64 {
        assert_eq!(grid.get(index(slot)), (AnyValue::Float(slot as f32), true));
    }
}

#[test]
fn a_half_block_of_no_values_has_no_frame_and_any_other_has() {
    let mut file = OneGrid::float(0, vec![0]);
    file.type_name = "Tree_float_2_2_2_HalfFloat";
    file.flags = 3;
    let block = [vec![0], zip_frame(&halves(&[7.0]))].concat();
    file.branch_blocks = Some([block.clone(), block]);
    assert_eq!(load(file.bytes()).get(IVec3::ZERO), (AnyValue::Float(0.25), false));

    let mut file = OneGrid::float(0, [vec![0], raw_frame(&[])].concat());
    file.flags = 3;
    let block = [vec![0], zip_frame(&floats(&[7.0]))].concat();
    file.branch_blocks = Some([block.clone(), block]);
    assert_eq!(load(file.bytes()).get(IVec3::ZERO), (AnyValue::Float(0.25), false));
}

#[test]
fn the_half_value_type_of_version_225_reads() {
    let mut file = OneGrid::float(MASK, [vec![1], halves(&[1.0, 2.0])].concat());
    (file.version, file.type_name) = (225, "Tree_half_2_2_2");
    file.background = halves(&[0.25]);
    let block = [vec![0], halves(&[7.0])].concat();
    file.branch_blocks = Some([block.clone(), block]);
    let grid = load(file.bytes());
    assert_eq!(grid.get(index(63)), (AnyValue::Half(f16::from_f32(2.0)), true));
    assert_eq!(grid.get(index(1)), (AnyValue::Half(f16::from_f32(-0.25)), false));
    assert_eq!(grid.get(IVec3::new(0, 0, 16)), (AnyValue::Half(f16::from_f32(7.0)), true));
}

#[test]
fn integers_and_vectors_negate_their_background() {
    let mut file = OneGrid::float(1, [vec![1], 9_i64.to_le_bytes().to_vec()].concat());
    file.type_name = "Tree_int64_2_2_2";
    file.background = i64::MIN.to_le_bytes().to_vec();
    let block = [vec![0], 7_i64.to_le_bytes().to_vec()].concat();
    file.branch_blocks = Some([block.clone(), block]);
    let grid = load(file.bytes());
    assert_eq!(grid.get(index(0)), (AnyValue::Int64(9), true));
    // The least integer has no opposite; it stays.
    assert_eq!(grid.get(index(1)), (AnyValue::Int64(i64::MIN), false));

    let mut file = OneGrid::float(1, [vec![1], floats(&[7.0, 8.0, 9.0])].concat());
    file.type_name = "Tree_vec3s_2_2_2";
    file.background = floats(&[1.0, -2.0, 0.0]);
    let block = [vec![0], floats(&[7.0, 7.0, 7.0])].concat();
    file.branch_blocks = Some([block.clone(), block]);
    let grid = load(file.bytes());
    assert_eq!(grid.get(index(0)), (AnyValue::Vec3s([7.0, 8.0, 9.0]), true));
    assert_eq!(grid.get(index(1)), (AnyValue::Vec3s([-1.0, 2.0, -0.0]), false));
}

#[test]
fn a_bool_leaf_keeps_values_and_activity_apart() {
    let rest = [vec![0; 12], SELECTED.to_le_bytes().to_vec()].concat();
    let mut file = OneGrid::float(MASK, rest);
    (file.type_name, file.background) = ("Tree_bool_2_2_2", vec![1]);
    file.branch_blocks = Some([vec![0, 0], vec![0, 0]]);
    let grid = load(file.bytes());
    for slot in 0..64 {
        let expected = (AnyValue::Bool(SELECTED >> slot & 1 == 1), MASK >> slot & 1 == 1);
        assert_eq!(grid.get(index(slot)), expected);
    }
    assert_eq!(grid.get(IVec3::new(0, 0, 4)), (AnyValue::Bool(false), true));
    assert_eq!(grid.get(IVec3::new(0, 0, 8)), (AnyValue::Bool(true), false));
}
