//! Base64 as files embed it. Knows no format.

use crate::error::{Result, memory};

/// Decodes `text`; white space is skipped. After padding another run may follow, because some files
/// encode the lengths of arrays separately. The error says what is wrong with the text.
pub(super) fn decode(text: &[u8]) -> Result<Vec<u8>, String> {
    let room: Result<Vec<u8>> = memory::room(text.len() / 4 * 3 + 3, "base64");
    let mut bytes = room.map_err(|error| error.to_string())?;
    let (mut group, mut count, mut padding) = (0_u32, 0, 0);
    for &byte in text {
        let digit = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                padding += 1;
                0
            }
            byte if byte.is_ascii_whitespace() => continue,
            other => return Err(format!("byte {other} is not base64")),
        };
        (group, count) = (group << 6 | u32::from(digit), count + 1);
        if count == 4 {
            let [_, a, b, c] = group.to_be_bytes();
            bytes.extend([a, b, c].iter().take(3_usize.saturating_sub(padding)));
            (group, count, padding) = (0, 0, 0);
        }
    }
    if count == 0 { Ok(bytes) } else { Err("its base64 ends early".to_owned()) }
}
