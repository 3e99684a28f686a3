//! Sorts the attributes in OpenEXR headers by name. The `exr` crate keeps them in a hash table,
//! whose order differs from run to run, but the same input shall give the same bytes. Attributes
//! only change places, so no offset changes. Knows nothing of their meaning.

/// Bytes before the first header: the magic number and the version with its flags.
const START: usize = 8;

/// The flag in the version field of multi-part files, whose headers end with an empty one.
const SEVERAL_PARTS: u8 = 0x10;

/// Sorts the attributes of every header in the file `bytes`; incomplete headers stay as they are.
pub(super) fn sort_attributes(bytes: &mut [u8]) {
    let several = bytes.get(5).is_some_and(|flags| flags & SEVERAL_PARTS != 0);
    let mut at = START;
    while let Some(spans) = header(bytes, at).filter(|spans| !spans.is_empty()) {
        let end = spans.last().map_or(at, |span| span.end);
        let mut attributes: Vec<&[u8]> = spans.into_iter().map(|span| &bytes[span]).collect();
        // Attributes begin with their names, which end with a zero.
        attributes.sort_unstable();
        let sorted = attributes.concat();
        bytes[at..end].copy_from_slice(&sorted);
        at = end + 1;
        if !several {
            break;
        }
    }
}

/// The ranges of the attributes of the header at `at`. Each attribute is a name, a type (both end
/// with a zero), a length of four bytes and as many bytes. A zero follows the last one.
fn header(bytes: &[u8], mut at: usize) -> Option<Vec<std::ops::Range<usize>>> {
    let mut spans = Vec::new();
    while *bytes.get(at)? != 0 {
        let mut length_at = at;
        for _ in 0..2 {
            length_at += 1 + bytes.get(length_at..)?.iter().position(|&byte| byte == 0)?;
        }
        let length = bytes.get(length_at..length_at + 4)?.first_chunk()?;
        let end = (length_at + 4).checked_add(u32::from_le_bytes(*length) as usize)?;
        bytes.get(at..end)?;
        spans.push(at..end);
        at = end;
    }
    Some(spans)
}

#[cfg(test)]
mod tests {
    use super::sort_attributes;

    #[test]
    fn attributes_of_all_parts_are_sorted_and_nothing_else_moves() {
        let file = |attributes: [&[u8]; 4]| {
            let [a, b, c, d] = attributes;
            [b"\x76\x2f\x31\x01\x02\x10\0\0", a, b, b"\0", c, d, b"\0", b"\0", b"zyx"].concat()
        };
        let [b, ab]: [&[u8]; 2] = [b"b\0int\0\x01\0\0\0\x07", b"ab\0string\0\x02\0\0\0hi"];
        let mut bytes = file([b, ab, ab, b]);
        sort_attributes(&mut bytes);
        assert_eq!(bytes, file([ab, b, ab, b]));
        // Truncated headers stay as they are.
        for end in 0..bytes.len() - 5 {
            let mut part = file([b, ab, b, ab])[..end].to_vec();
            sort_attributes(&mut part);
            assert_eq!(part.len(), end);
        }
    }
}
