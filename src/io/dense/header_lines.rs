//! Text headers of lines with a key and a value each, in front of the voxels: those of NRRD and
//! MetaImage. Knows no particular key.

use super::input::Input;
use crate::error::Result;

/// The syntax of a format's lines.
pub(super) struct Style {
    /// Separators between key and value; of those in a line, the one listed first counts.
    pub separators: &'static [&'static str],
    /// The separator behind user-defined keys.
    pub key_separator: Option<&'static str>,
    /// Number of lines before the first key.
    pub skipped_lines: usize,
    /// The key of the header's last line. If `None`, the header ends at an empty line or at the
    /// file's end, and lines that begin with `#` are comments.
    pub last_key: Option<&'static str>,
    /// Whether keys are case-insensitive.
    pub any_case: bool,
    /// The form of a line, for error messages.
    pub form: &'static str,
}

/// The byte order mark that some editors write at the beginning of a text.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The lines of a header, and where the header ends.
pub(super) struct HeaderLines {
    lines: Vec<(String, String)>,
    /// Whether each line has a user-defined key, which readers ignore.
    keys: Vec<bool>,
    end: usize,
    any_case: bool,
}

impl HeaderLines {
    pub(super) fn read(input: &Input, style: &Style) -> Result<Self> {
        let mut header =
            Self { lines: Vec::new(), keys: Vec::new(), end: 0, any_case: style.any_case };
        for (number, line) in input.head.split_inclusive(|&byte| byte == b'\n').enumerate() {
            header.end += line.len();
            // Some editors write a byte order mark first.
            let line =
                if number == 0 { line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line) } else { line };
            let line = String::from_utf8_lossy(line);
            let line = line.trim_end();
            match (line.trim().is_empty(), style.last_key) {
                (true, None) => return Ok(header),
                (true, Some(_)) => continue,
                (false, None) if line.starts_with('#') => continue,
                _ if number < style.skipped_lines => continue,
                _ => {}
            }
            let parts = style
                .separators
                .iter()
                .find_map(|separator| line.split_once(separator).map(|parts| (*separator, parts)));
            let names_files = |(_, value): &(String, String)| value.starts_with("LIST");
            if parts.is_none() && header.lines.last().is_some_and(names_files) {
                // Only names of further files follow.
                return Ok(header);
            }
            let Some((separator, (key, value))) = parts else {
                return Err(input.bad(format!("line {} is not '{}'", number + 1, style.form)));
            };
            let key = key.trim().to_owned();
            let is_last = style.last_key.is_some_and(|last| key == last);
            header.lines.push((key, value.trim().to_owned()));
            header.keys.push(style.key_separator == Some(separator));
            if is_last {
                return Ok(header);
            }
        }
        match style.last_key {
            Some(key) => Err(input.bad(format!("its header does not end with '{key}'"))),
            None => Ok(header),
        }
    }

    /// The value of the first line with one of these keys.
    pub(super) fn get(&self, names: &[&str]) -> Option<&str> {
        let named = |key: &str| {
            let same = |name: &&str| {
                if self.any_case { key.eq_ignore_ascii_case(name) } else { key == *name }
            };
            names.iter().any(same)
        };
        let fields = self.lines.iter().zip(&self.keys).filter(|(_, own)| !**own);
        fields.map(|(line, _)| line).find(|(key, _)| named(key)).map(|(_, value)| value.as_str())
    }

    /// All lines except the fields with these names.
    pub(super) fn without(&self, fields: &[&str]) -> Vec<(String, String)> {
        let kept = self.lines.iter().zip(&self.keys).filter(|((key, _), own)| {
            let same = |name: &&str| {
                if self.any_case { key.eq_ignore_ascii_case(name) } else { key == *name }
            };
            **own || !fields.iter().any(same)
        });
        kept.map(|(line, _)| line.clone()).collect()
    }

    /// Bytes of the header.
    pub(super) fn end(&self) -> usize {
        self.end
    }
}
