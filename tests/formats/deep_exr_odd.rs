//! Deep OpenEXR that is unusual, broken or hostile: an answer or an error, soon, and in little
//! memory.

use std::path::Path;
use std::time::{Duration, Instant};

use deepshadow::io::deep_exr::{Channel, Compression, DeepFile, DeepHeader, SlabChannels, encode};

use super::deep_by_others::FILES;
use super::deep_exr::{COMPRESSIONS, small_image};
use super::vdb_hostile::{Random, mutate, rounds};
use crate::support::fixture;

/// Longest time that a file may take, in an unoptimised build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(5);
const LIMIT: u64 = 1 << 26;

/// Reads all of the bytes; whether that was possible.
fn exercise(bytes: Vec<u8>, what: &str) -> bool {
    let start = Instant::now();
    let read = DeepFile::from_bytes("mutated", bytes, LIMIT).and_then(|mut file| {
        let image = file.read()?;
        assert_eq!(file.statistics().unwrap(), image.statistics(), "{what}");
        assert!(image.flatten().is_ok(), "{what}");
        if let Some(channels) = SlabChannels::of(&image.header) {
            let last = image.rows.len() - 1;
            assert_eq!(
                channels.slabs(&image.rows[last], 0).count(),
                image.rows[last].pixel(0).len()
            );
        }
        Ok(())
    });
    assert!(start.elapsed() < PATIENCE, "{what} took {:?}", start.elapsed());
    read.is_ok()
}

fn refusal(bytes: Vec<u8>) -> String {
    let read = DeepFile::from_bytes("m", bytes, LIMIT).and_then(|mut file| file.read());
    read.err().unwrap().to_string()
}

/// Where `part` begins in `bytes`.
fn find(bytes: &[u8], part: &[u8]) -> usize {
    bytes.windows(part.len()).position(|window| window == part).unwrap()
}

/// Where the value of the attribute `name` of type `of` begins.
fn value_of(bytes: &[u8], name: &str, of: &str) -> usize {
    let mark = format!("{name}\0{of}\0");
    find(bytes, mark.as_bytes()) + mark.len() + 4
}

/// Where the table of offsets begins, and where the first line does.
fn table_of(bytes: &[u8]) -> [usize; 2] {
    // The last attribute is the version, and a zero ends the header.
    let table = value_of(bytes, "version", "int") + 4 + 1;
    let first = u64::from_le_bytes(bytes[table..table + 8].try_into().unwrap());
    [table, first as usize]
}

fn bytes_of(compression: Compression) -> Vec<u8> {
    small_image(compression).encode().unwrap()
}

#[test]
fn mutated_deep_files_give_an_answer_or_an_error() {
    let rounds = rounds(600);
    for (number, compression) in COMPRESSIONS.into_iter().enumerate() {
        let whole = bytes_of(compression);
        assert!(exercise(whole.clone(), compression.name()));
        let mut read = 0;
        for round in 0..rounds {
            let mut random = Random(13 + (number * rounds + round) as u64 * 0x9e37_79b9);
            let mut bytes = whole.clone();
            mutate(&mut bytes, &mut random);
            let what = format!("{}, round {round}", compression.name());
            read += usize::from(exercise(bytes, &what));
        }
        eprintln!("{}: read {read} of {rounds}", compression.name());
    }
}

#[test]
fn mutated_deep_fixtures_give_an_answer_or_an_error() {
    for (name, _) in FILES {
        mutate_file(&fixture(name), rounds(100));
    }
}

/// Mutates a file so many times.
fn mutate_file(path: &Path, rounds: usize) {
    let whole = std::fs::read(path).unwrap();
    for round in 0..rounds {
        let mut random = Random(17 + round as u64 * 0x9e37_79b9);
        let mut bytes = whole.clone();
        mutate(&mut bytes, &mut random);
        exercise(bytes, &format!("{}, round {round}", path.display()));
    }
}

mod outside {
    use super::*;
    use crate::support::data::outside;

    /// Twin: `mutated_deep_fixtures_give_an_answer_or_an_error`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn mutated_published_deep_files_give_an_answer_or_an_error() {
        for name in ["data/exr/LowRes_Balls.exr", "data/exr/LowRes_Trunks.exr"] {
            mutate_file(&outside(name), rounds(10).min(500));
        }
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    for compression in COMPRESSIONS {
        let whole = bytes_of(compression);
        for length in 0..whole.len() {
            assert!(!exercise(whole[..length].to_vec(), "cut"), "cut at {length}");
        }
    }
}

#[test]
fn claims_that_the_file_cannot_hold_are_refused_before_memory_is_asked_for() {
    let good = bytes_of(Compression::Zips);
    let window = value_of(&good, "dataWindow", "box2i");
    let [table, first] = table_of(&good);
    let with = |changes: &[(usize, &[u8])]| {
        let mut bytes = good.clone();
        for (at, new) in changes {
            bytes[*at..at + new.len()].copy_from_slice(new);
        }
        bytes
    };
    let most = i32::MAX.to_le_bytes();
    let huge = u64::MAX.to_le_bytes();
    let height = value_of(&good, "chunkCount", "int");
    let high = (i32::MAX - 1).to_le_bytes();
    let tall: [(usize, &[u8]); 3] = [(window + 4, &[0; 4]), (window + 12, &high), (height, &most)];
    let second = u64::from_le_bytes(good[table + 8..table + 16].try_into().unwrap());
    for (changes, word) in [
        // 2^31 lines; pixels; bytes of numbers, of samples packed, of samples unpacked.
        (&tall[..], "2147483647 lines"),
        (&[(window + 8, &(i32::MAX - 4).to_le_bytes()[..])], "limit"),
        (&[(first + 4, &huge)], "expected 18446744073709551615 bytes"),
        (&[(first + 12, &huge)], "expected 18446744073709551615 bytes"),
        (&[(first + 20, &huge)], "the limit is"),
        (&[(first + 20, &[0, 0, 0, 1, 0, 0, 0, 0])], "16777216 bytes for"),
        // Two lines in one place, a line beyond the end, a missing line.
        (&[(table, &second.to_le_bytes())], "line 101 is in its place"),
        (&[(table, &huge)], "line 100: it ends early"),
        (&[(table, &[0; 8])], "line 100: it is missing"),
        (&[(height, &[8, 0, 0, 0])], "chunkCount is 8"),
    ] {
        let error = refusal(with(changes));
        assert!(error.contains(word), "'{word}' is not in: {error}");
    }
}

#[test]
fn lines_that_share_bytes_are_refused() {
    // Each line claims the rest of the file, in which all others lie.
    let header = DeepHeader {
        compression: Compression::None,
        ..DeepHeader::new([1, 64], vec![Channel::float("Z")])
    };
    let bytes = encode(&header, |_, row| {
        (0..1000).for_each(|_| row.push(&[1.0]));
        row.end_pixel();
        Ok(())
    })
    .unwrap();
    let [table, _] = table_of(&bytes);
    let mut shared = bytes.clone();
    let place = |y: usize| -> usize {
        let entry: [u8; 8] = bytes[table + 8 * y..table + 8 * y + 8].try_into().unwrap();
        u64::from_le_bytes(entry) as usize
    };
    for y in 0..32 {
        let samples = (bytes.len() - place(y) - 32) / 4;
        let size = (4 * samples as u64).to_le_bytes();
        shared[place(y) + 12..place(y) + 20].copy_from_slice(&size);
        shared[place(y) + 20..place(y) + 28].copy_from_slice(&size);
        shared[place(y) + 28..place(y) + 32].copy_from_slice(&(samples as u32).to_le_bytes());
    }
    let error = refusal(shared);
    assert!(error.contains("line 1: it ends early"), "{error}");
}

#[test]
fn other_kinds_of_openexr_are_refused_by_name() {
    let good = bytes_of(Compression::Zips);
    let with = |at: usize, new: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    let channel = find(&good, b"A\0\x01\0\0\0");
    for (bytes, word) in [
        (with(4, &[3]), "version 3"),
        (with(5, &[0]), "not deep"),
        (with(6, &[1]), "flags 0x10c02"),
        (with(value_of(&good, "type", "string"), b"deeptile"), "deep tiles are not supported"),
        (with(value_of(&good, "version", "int"), &[2]), "only version 1 is supported"),
        (with(value_of(&good, "compression", "compression"), &[3]), "compression 3"),
        (with(channel + 2, &[9]), "type 9"),
        (with(channel + 10, &[2]), "every [2, 1]th pixel"),
        (with(channel, b"S"), "out of order"),
        (with(find(&good, b"dataWindow"), b"D"), "the attribute dataWindow is missing"),
    ] {
        let error = refusal(bytes);
        assert!(error.contains(word), "'{word}' is not in: {error}");
    }
}

/// Headers one after another, tables one after another, and the part's number before each line.
#[test]
fn the_first_part_of_deep_lines_is_read_of_several() {
    let single = bytes_of(Compression::Zips);
    let [table, first] = table_of(&single);
    let flat_part = {
        let mut part = single[8..table].to_vec();
        let at = value_of(&part, "type", "string");
        // A type of the same length.
        part[at..at + 12].copy_from_slice(b"deepscanlinX");
        part
    };
    let lines = (first - table) / 8;
    let mut bytes = single[..8].to_vec();
    bytes[5] |= 0x10;
    bytes.extend(&flat_part);
    bytes.extend(&single[8..table]);
    bytes.push(0);
    bytes.extend(vec![0; 8 * lines]);
    let table_at = bytes.len();
    bytes.extend(vec![0; 8 * lines]);
    for y in 0..lines {
        let place = |y: usize| -> usize {
            let entry: [u8; 8] = single[table + 8 * y..table + 8 * y + 8].try_into().unwrap();
            u64::from_le_bytes(entry) as usize
        };
        let end = if y + 1 < lines { place(y + 1) } else { single.len() };
        let at = bytes.len() as u64;
        bytes[table_at + 8 * y..table_at + 8 * y + 8].copy_from_slice(&at.to_le_bytes());
        bytes.extend(1_i32.to_le_bytes());
        bytes.extend(&single[place(y)..end]);
    }
    let mut file = DeepFile::from_bytes("parts", bytes, LIMIT).unwrap();
    assert_eq!(file.other_parts(), ["'deep' of type 'deepscanlinX'"]);
    let alone = DeepFile::from_bytes("single", single, LIMIT).unwrap().read().unwrap();
    assert!(file.read().unwrap() == alone);
}
