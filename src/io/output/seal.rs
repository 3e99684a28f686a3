//! Seals: a few bytes in a picture's file from which a later run sees that the file is whole and
//! was made with the same settings. Programs that read pictures skip them.

use std::fs::Metadata;
use std::path::Path;

use crate::error::memory;

/// The end of a PNG file: its last chunk, which is empty.
const PNG_END: [u8; 12] = *b"\0\0\0\0IEND\xaeB`\x82";
/// A seal's text in front of its number.
const MARK: &str = "deepshadow\0frame ";
/// Hexadecimal digits of the number.
const DIGITS: usize = 16;

/// `contents` with a seal for `settings`: in a PNG file a text chunk in front of its end, in all
/// others bytes behind the end.
pub fn sealed(mut contents: Vec<u8>, settings: &str) -> Vec<u8> {
    let is_png = contents.ends_with(&PNG_END);
    let seal = seal(number(&contents, settings), is_png);
    let at = contents.len() - if is_png { PNG_END.len() } else { 0 };
    contents.splice(at..at, seal);
    contents
}

/// Whether the file `path` is as [`sealed`] made it for `settings`. False if it cannot be read, is a
/// pipe or a device, or does not fit memory.
pub fn is_sealed(path: &Path, settings: &str) -> bool {
    let fits = |facts: &Metadata| memory::check(facts.len(), "a picture").is_ok();
    let is_picture = |facts: &Metadata| facts.is_file() && fits(facts);
    if !std::fs::metadata(path).is_ok_and(|facts| is_picture(&facts)) {
        return false;
    }
    let Ok(mut contents) = std::fs::read(path) else { return false };
    let is_png = contents.ends_with(&PNG_END);
    let length = seal(0, is_png).len();
    let end = contents.len() - if is_png { PNG_END.len() } else { 0 };
    let Some(begin) = end.checked_sub(length) else { return false };
    let found: Vec<u8> = contents.splice(begin..end, []).collect();
    found == seal(number(&contents, settings), is_png)
}

fn seal(number: u64, is_png: bool) -> Vec<u8> {
    let text = format!("{MARK}{number:0DIGITS$x}").into_bytes();
    if !is_png {
        return text;
    }
    let mut chunk = (text.len() as u32).to_be_bytes().to_vec();
    let mut checked = b"tEXt".to_vec();
    checked.extend(text);
    let mut crc = flate2::Crc::new();
    crc.update(&checked);
    chunk.extend(checked);
    chunk.extend(crc.sum().to_be_bytes());
    chunk
}

/// A number for a file and its settings: FNV-1a with 64 bits (Fowler, Noll and Vo), which every
/// version of the program finds alike. It guards against accidents, not against forgers.
fn number(contents: &[u8], settings: &str) -> u64 {
    let mix = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    settings.as_bytes().iter().chain(&[0]).chain(contents).fold(0xcbf2_9ce4_8422_2325, mix)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::image::Image;
    use crate::io::{PictureFormat, PictureOptions};

    #[test]
    fn a_seal_holds_for_the_whole_file_and_its_settings() {
        let folder = tempfile::tempdir().unwrap();
        let image = Image::filled(9, 5, [0.5, 0.25, 0.125, 1.0]);
        for format in PictureFormat::ALL {
            let path = folder.path().join(format.name());
            let plain = PictureOptions::new(format).encode(&image).unwrap();
            std::fs::write(&path, &plain).unwrap();
            assert!(!is_sealed(&path, "a"), "{format:?}");
            let whole = sealed(plain, "a");
            std::fs::write(&path, &whole).unwrap();
            assert!(is_sealed(&path, "a") && !is_sealed(&path, "b"), "{format:?}");
            for cut in [0, 1, whole.len() / 2, whole.len() - 1] {
                std::fs::write(&path, &whole[..cut]).unwrap();
                assert!(!is_sealed(&path, "a"), "{format:?}, {cut} bytes");
            }
            for at in (0..whole.len()).step_by(7) {
                let mut bent = whole.clone();
                bent[at] ^= 4;
                std::fs::write(&path, &bent).unwrap();
                assert!(!is_sealed(&path, "a"), "{format:?}, byte {at}");
            }
        }
        assert!(!is_sealed(&folder.path().join("none"), "a"));
        // Devices have no end.
        #[cfg(unix)]
        assert!(!is_sealed(Path::new("/dev/zero"), "a"));
    }

    #[test]
    fn a_sealed_png_is_a_valid_one() {
        let image = Image::filled(9, 5, [0.5, 0.25, 0.125, 1.0]);
        let plain = crate::io::png::encode(&image, 1.0).unwrap();
        let whole = sealed(plain.clone(), "a");
        assert!(whole.ends_with(&PNG_END) && whole.len() > plain.len());
        let mut reader = png::Decoder::new(std::io::Cursor::new(&whole)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        reader.finish().unwrap();
        let texts = &reader.info().uncompressed_latin1_text;
        assert!(texts.iter().any(|text| text.keyword == "deepshadow"), "{texts:?}");
    }
}
