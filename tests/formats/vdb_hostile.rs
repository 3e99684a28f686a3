//! Whatever the bytes are: an answer or an error, soon, and in little memory.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use deepshadow::io::vdb::{IndexBox, SurveyDepth, VdbFile};

use super::vdb_bytes::{Bytes, OneGrid, file_header, zip_frame};
use super::vdb_fixtures::{FILES, fixture};

/// Longest time that a file may take, in an unoptimised build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(5);
/// Bytes of a densified box at most.
const DENSE_LIMIT: u64 = 1 << 20;

/// Marsaglia's xorshift64.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// Opens the bytes and uses everything in them; returns the number of grids that loaded.
fn exercise(bytes: Vec<u8>, what: &str) -> usize {
    let start = Instant::now();
    let mut loaded = 0;
    if let Ok(file) = VdbFile::from_bytes("mutated", bytes) {
        for (index, header) in file.grids().iter().enumerate() {
            let _ = (header.class(), file.find(&header.name));
            let survey = file.survey(index, SurveyDepth::Topology);
            let Ok(grid) = file.load(index) else { continue };
            loaded += 1;
            assert!(survey.is_ok(), "{what}: loads and cannot be surveyed");
            let survey = file.survey(index, SurveyDepth::Histogram(5)).unwrap();
            assert_eq!(survey.active_voxels, grid.active_voxel_count(), "{what}");
            assert_eq!(survey.memory_bytes, grid.memory_bytes(), "{what}");
            if let Some(bounds) = grid.active_bounds() {
                let _ = grid.get(bounds.min);
                let max = bounds.max.min(bounds.min.saturating_add(glam::IVec3::splat(40)));
                let part = IndexBox { min: bounds.min, max };
                let _ = grid.densify(part.padded(1), DENSE_LIMIT);
            }
        }
    }
    assert!(start.elapsed() < PATIENCE, "{what} took {:?}", start.elapsed());
    loaded
}

/// One to three changes: cut, flip, overwrite with a telling number, copy a piece elsewhere,
/// insert.
pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    const NUMBERS: [u64; 10] = [
        0,
        1,
        0xff,
        0x7fff_ffff,
        0x8000_0000,
        0xffff_ffff,
        0x7fff_ffff_ffff_ffff,
        0x8000_0000_0000_0000,
        0xffff_ffff_ffff_ffff,
        1 << 40,
    ];
    for _ in 0..=random.below(3) {
        let length = bytes.len();
        // Headers come first and deserve more than their share.
        let within = if random.below(4) == 0 { length.min(400) } else { length };
        let at = random.below(within);
        match random.below(16) {
            0 => bytes.truncate(random.below(length)),
            1..=8 if length > 0 => bytes[at] ^= 1 << random.below(8),
            9..=12 => {
                let number = NUMBERS[random.below(NUMBERS.len())].to_le_bytes();
                let width = [1, 4, 8][random.below(3)].min(length - at);
                bytes[at..at + width].copy_from_slice(&number[..width]);
            }
            13 | 14 => {
                let from = random.below(length);
                let piece =
                    bytes[from..].iter().take(random.below(64)).copied().collect::<Vec<_>>();
                let end = (at + piece.len()).min(length);
                bytes[at..end].copy_from_slice(&piece[..end - at]);
            }
            _ => {
                let piece: Vec<u8> = (0..random.below(16)).map(|_| random.next() as u8).collect();
                bytes.splice(at..at, piece);
            }
        }
    }
}

/// Mutates each file `rounds` times.
fn mutate_files(paths: &[PathBuf], rounds: usize) {
    for (number, path) in paths.iter().enumerate() {
        let whole = std::fs::read(path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let mut loaded = 0;
        for round in 0..rounds {
            let mut random = Random(1 + (number * rounds + round) as u64 * 0x9e37_79b9);
            let mut bytes = whole.clone();
            mutate(&mut bytes, &mut random);
            loaded += exercise(bytes, &format!("{name}, round {round}"));
        }
        eprintln!("{name}: {loaded} grids loaded in {rounds} rounds");
    }
}

pub fn fixtures() -> Vec<PathBuf> {
    FILES.map(fixture).to_vec()
}

/// Rounds for each file: `DEEPSHADOW_MUTATIONS`, or a number that suits every test run.
pub fn rounds(usual: usize) -> usize {
    let asked = std::env::var("DEEPSHADOW_MUTATIONS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn mutated_fixtures_give_an_answer_or_an_error() {
    mutate_files(&fixtures(), rounds(400));
}

mod outside {
    use super::*;
    use crate::support::data::outside_grids;

    /// Twin: `mutated_fixtures_give_an_answer_or_an_error`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn mutated_files_of_the_real_library_give_an_answer_or_an_error() {
        mutate_files(&outside_grids("vdb"), rounds(10));
    }
}

#[test]
fn a_file_cut_anywhere_in_its_voxels_is_an_error() {
    for path in fixtures() {
        let whole = std::fs::read(&path).unwrap();
        let what = path.display().to_string();
        for length in (0..whole.len()).step_by(23) {
            let bytes = whole[..length].to_vec();
            let Ok(file) = VdbFile::from_bytes("cut", bytes) else { continue };
            let complete = (0..file.grids().len()).all(|index| file.load(index).is_ok());
            assert!(!complete || file.unreachable().is_some(), "{what} cut at {length}");
        }
        assert!(exercise(whole, &what) > 0);
    }
}

#[test]
fn counts_that_the_file_cannot_hold_are_refused_before_memory_is_asked_for() {
    // Metadata entries, grids, string lengths: all as large as they go.
    let mut metadata = file_header(224, true, 1);
    let at = metadata.0.len() - 8;
    metadata.0[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let grids = file_header(224, true, i32::MAX as u32);
    let mut name = file_header(224, true, 1);
    name.u32(u32::MAX);
    for Bytes(bytes) in [metadata, grids, name] {
        let error = VdbFile::from_bytes("memory", bytes).err().unwrap().to_string();
        assert!(error.contains("ends early"), "{error}");
    }
    // Root tiles and children.
    let mut file = OneGrid::float(1, [vec![0], 3.0_f32.to_le_bytes().to_vec()].concat()).bytes();
    let counts = file.len() - (4 + 4 + 12 + 2 * 21 + 8 + 8 + 5);
    assert_eq!(file[counts..counts + 8], [0, 0, 0, 0, 1, 0, 0, 0]);
    file[counts..counts + 8].fill(0xff);
    let error = VdbFile::from_bytes("memory", file).unwrap().load(0).err().unwrap().to_string();
    assert!(error.contains("density"), "{error}");
}

#[test]
fn a_zip_bomb_ends_at_the_size_that_is_due() {
    let bomb = zip_frame(&vec![0; 1 << 24]);
    let mut file = OneGrid::float(u64::MAX, [vec![0], bomb].concat());
    file.flags = 3;
    let block = [vec![0], zip_frame(&7.0_f32.to_le_bytes())].concat();
    file.branch_blocks = Some([block.clone(), block]);
    let error = VdbFile::from_bytes("m", file.bytes()).unwrap().load(0).err().unwrap().to_string();
    assert!(error.contains("of 256 bytes"), "{error}");
}

#[test]
fn a_tree_that_contradicts_itself_is_refused() {
    let good = OneGrid::float(1, [vec![0], 3.0_f32.to_le_bytes().to_vec()].concat());
    let tile = 1.0_f32.to_le_bytes().to_vec();
    let mut twice = good.clone();
    twice.root_tiles = vec![([0; 3], tile.clone(), true)];
    let mut skewed = good.clone();
    skewed.root_tiles = vec![([64, 0, 1], tile, true)];
    let mut code = good.clone();
    code.leaf_rest[0] = 7;
    let mut bytes = good.bytes();
    // The upper branch's mask of active tiles lies behind its mask of children.
    let upper = bytes.len() - (2 * 21 + 8 + 8 + 5);
    bytes[upper + 8] |= 1;
    let cases = [
        (twice.bytes(), "two root entries"),
        (skewed.bytes(), "not a multiple of 64"),
        (code.bytes(), "code 7"),
        (bytes, "both a child and an active tile"),
    ];
    for (bytes, word) in cases {
        let error = VdbFile::from_bytes("m", bytes).unwrap().load(0).err().unwrap().to_string();
        assert!(error.contains(word), "{error}");
    }
}
