//! File names that hold the number of a frame, such as `smoke.####.vdb` and `smoke.%04d.vdb`.
//! Knows no file system.

use std::path::{Path, PathBuf};

/// A file name with a place for a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NumberedName {
    pattern: PathBuf,
    before: String,
    /// Digits that the number has at least.
    digits: usize,
    after: String,
}

impl NumberedName {
    /// The name in `path`, if it has one place for a number: one or more `#`, each a digit, or `%d`
    /// or `%04d` as in C. `None` for other names, and for those that are not Unicode.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (place, digits) = hashes(name).or_else(|| conversion(name))?;
        let (before, after) = (name[..place.start].to_owned(), name[place.end..].to_owned());
        Some(Self { pattern: path.to_owned(), before, digits, after })
    }

    /// The name with its place for a number.
    pub fn pattern(&self) -> &Path {
        &self.pattern
    }

    /// The folder of the files.
    pub fn folder(&self) -> &Path {
        self.pattern.parent().unwrap_or(Path::new(""))
    }

    /// The name with the number of a frame.
    pub fn at(&self, frame: i64) -> PathBuf {
        let sign = if frame < 0 { "-" } else { "" };
        let (number, digits) = (frame.unsigned_abs(), self.digits);
        self.folder().join(format!("{}{sign}{number:0digits$}{}", self.before, self.after))
    }

    /// Whether `name` would be that of a frame if the number had another number of digits.
    pub fn is_near(&self, name: &str) -> bool {
        let number = name.strip_prefix(&*self.before).and_then(|n| n.strip_suffix(&*self.after));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|byte| byte.is_ascii_digit()))
    }

    /// The frame whose file is called `name`, without a folder; `None` if none is.
    pub fn frame_of(&self, name: &str) -> Option<i64> {
        let number = name.strip_prefix(&self.before)?.strip_suffix(&self.after)?;
        let digits = number.strip_prefix('-').unwrap_or(number);
        let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        let frame: i64 = number.parse().ok().filter(|_| is_number)?;
        (self.at(frame).file_name() == Some(name.as_ref())).then_some(frame)
    }
}

type Place = (std::ops::Range<usize>, usize);

/// The only run of `#`, and its length.
fn hashes(name: &str) -> Option<Place> {
    let begin = name.find('#')?;
    let end = begin + name[begin..].bytes().take_while(|&byte| byte == b'#').count();
    (!name[end..].contains('#')).then_some((begin..end, end - begin))
}

/// The only `%d` or `%0Nd`, and its width.
fn conversion(name: &str) -> Option<Place> {
    let begin = name.find('%')?;
    let rest = &name[begin + 1..];
    let width: String = rest.chars().take_while(char::is_ascii_digit).collect();
    let end = begin + 1 + width.len() + 1;
    let is_one = rest[width.len()..].starts_with('d') && !name[end..].contains('%');
    let digits = if width.is_empty() { 1 } else { width.parse().ok()? };
    (is_one && digits <= 20).then_some((begin..end, digits))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn numbers_take_the_place_of_hashes_and_conversions() {
        for (pattern, frame, name) in [
            ("a/smoke.####.vdb", 7, "a/smoke.0007.vdb"),
            ("smoke.%04d.vdb", 12345, "smoke.12345.vdb"),
            ("#.png", 12, "12.png"),
            ("x_%d", -3, "x_-3"),
            ("p#q/x%03d.deep.exr", 5, "p#q/x005.deep.exr"),
            ("\u{e9}##.vdb", 5, "\u{e9}05.vdb"),
        ] {
            let numbered = NumberedName::of(pattern.as_ref()).unwrap();
            let path = numbered.at(frame);
            assert_eq!(path, Path::new(name));
            let found = numbered.frame_of(path.file_name().unwrap().to_str().unwrap());
            assert_eq!(found, Some(frame));
        }
        for name in ["smoke.vdb", "a#b#.vdb", "100%.vdb", "%d%d", "%x.png", "a#/b.vdb", "..", "%"] {
            assert_eq!(NumberedName::of(name.as_ref()), None, "{name}");
        }
    }

    #[test]
    fn only_names_that_the_pattern_makes_belong_to_it() {
        let numbered = NumberedName::of("smoke.####.vdb".as_ref()).unwrap();
        assert_eq!(numbered.frame_of("smoke.0042.vdb"), Some(42));
        for name in ["smoke.42.vdb", "smoke.00042.vdb", "smoke..vdb", "smoke.+042.vdb", "0042"] {
            assert_eq!(numbered.frame_of(name), None, "{name}");
        }
    }
}
