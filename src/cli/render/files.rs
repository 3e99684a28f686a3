//! The files of a sequence: which there are, and what they are called.

use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::scene::NumberedName;

/// What to say of numbers between the first and the last for which there is no file, if there is
/// one for every other number or more.
pub(super) fn gaps(numbers: &[i64]) -> Option<String> {
    let steps = numbers.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
    let step = steps.clone().min()?;
    let (at, _) = steps.enumerate().find(|(_, gap)| *gap != step)?;
    let (from, to) = (numbers[at].saturating_add(step), numbers[at + 1].saturating_sub(step));
    let which = if from == to { from.to_string() } else { format!("{from} to {to}") };
    Some(format!("no file for frame {which}, which stays out of the sequence"))
}

/// Checks that the file of every frame is there. `known` are the frames that have one.
pub(super) fn check_files(
    name: &NumberedName,
    frames: &[i64],
    known: Option<&[i64]>,
) -> Result<()> {
    let mut missing = frames.iter().map(|&frame| name.at(frame)).filter(|path| !path.exists());
    match missing.next() {
        None => Ok(()),
        Some(first) => {
            let count = 1 + missing.count();
            let of_all = match count {
                1 => String::new(),
                _ => format!("; {count} of {} frames have none", frames.len()),
            };
            let there_are = known.and_then(|known| known.first().zip(known.last()));
            let there_are = there_are.map_or_else(String::new, |(first, last)| {
                format!("; there are files from frame {first} to {last}")
            });
            let why = format!("no such file{of_all}{there_are}");
            Err(Error::contents(first, why))
        }
    }
}

/// The numbered name that all of `paths` have in common, and their numbers.
pub(super) fn common_name(paths: &[PathBuf]) -> Option<(PathBuf, Vec<i64>)> {
    let first = paths.first()?;
    let name = first.file_name()?.to_str()?;
    let digit = |at: usize| name.as_bytes()[at].is_ascii_digit();
    let mut end = name.len();
    // From the last run of digits to the first.
    while let Some(last) = (0..end).rev().find(|&at| digit(at)) {
        let begin = (0..=last).rev().take_while(|&at| digit(at)).last()?;
        for count in [last + 1 - begin, 1] {
            let hashes = "#".repeat(count);
            let pattern = format!("{}{hashes}{}", &name[..begin], &name[last + 1..]);
            let pattern = first.with_file_name(pattern);
            let numbered = NumberedName::of(&pattern);
            let numbers: Option<Vec<i64>> = paths
                .iter()
                .map(|path| {
                    let numbered = numbered.as_ref()?;
                    let in_folder = path.parent() == first.parent();
                    numbered.frame_of(path.file_name()?.to_str()?).filter(|_| in_folder)
                })
                .collect();
            if let Some(numbers) = numbers {
                return Some((pattern, numbers));
            }
        }
        end = begin;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_files_have_a_numbered_name_if_only_a_number_differs() {
        let common =
            |names: &[&str]| common_name(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        let named = |name: &str, numbers: &[i64]| Some((PathBuf::from(name), numbers.to_vec()));
        assert_eq!(common(&["a/x.08.vdb", "a/x.11.vdb"]), named("a/x.##.vdb", &[8, 11]));
        assert_eq!(common(&["x10.vdb", "x9.vdb"]), named("x#.vdb", &[10, 9]));
        assert_eq!(common(&["2s_1.nrrd", "3s_1.nrrd"]), named("#s_1.nrrd", &[2, 3]));
        assert_eq!(common(&["a/x1.vdb", "b/x2.vdb"]), None);
        assert_eq!(common(&["a.vdb", "b.vdb"]), None);
    }

    #[test]
    fn gaps_in_numbers_are_told() {
        assert_eq!(gaps(&[1, 2, 3]), None);
        assert_eq!(gaps(&[2, 4, 6]), None);
        assert_eq!(gaps(&[5]), None);
        assert!(gaps(&[1, 2, 4]).is_some_and(|note| note.contains("frame 3,")));
        assert!(gaps(&[1, 2, 6, 7]).is_some_and(|note| note.contains("3 to 5")));
    }
}
