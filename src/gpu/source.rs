//! The text of shaders, as programs hold it: in browsers, which download them, without comments and
//! indentation.

/// The text of the shader `$name` of `shaders/`.
macro_rules! source {
    ($name:literal) => {{
        const TEXT: &str = include_str!(concat!("../../shaders/", $name, ".wgsl"));
        const LENGTH: usize = $crate::gpu::source::bare::<0>(TEXT).1;
        const BARE: [u8; LENGTH] = $crate::gpu::source::bare::<LENGTH>(TEXT).0;
        const SOURCE: &str = match std::str::from_utf8(&BARE) {
            Ok(bare) if cfg!(target_family = "wasm") => bare,
            _ => TEXT,
        };
        SOURCE
    }};
}
pub(super) use source;

/// The first `N` bytes of a text without comments and indentation, and how many there are in all.
/// Lines keep their numbers.
pub(super) const fn bare<const N: usize>(text: &str) -> ([u8; N], usize) {
    let text = text.as_bytes();
    let (mut kept, mut count) = ([0; N], 0);
    let (mut skips, mut begins, mut i) = (false, true, 0);
    while i < text.len() {
        let byte = text[i];
        if byte == b'\n' {
            (skips, begins) = (false, true);
        } else if byte == b'/' && i + 1 < text.len() && text[i + 1] == b'/' {
            skips = true;
        } else if byte != b' ' {
            begins = false;
        }
        let left_out = skips || (begins && byte == b' ');
        if !left_out {
            if count < N {
                kept[count] = byte;
            }
            count += 1;
        }
        i += 1;
    }
    (kept, count)
}

#[cfg(test)]
mod tests {
    use super::bare;

    #[test]
    fn comments_and_indentation_are_left_out_and_lines_stay() {
        const TEXT: &str = "// one\n    let a = b / c; // two\n\n  }\n";
        const BARE: &str = "\nlet a = b / c; \n\n}\n";
        assert_eq!(bare::<0>(TEXT).1, BARE.len());
        assert_eq!(bare::<20>(TEXT).0, BARE.as_bytes());
    }

    #[test]
    fn no_shader_has_other_comments() {
        for (name, text) in crate::gpu::link::FILES {
            assert!(!text.contains("/*"), "{name}");
        }
    }
}
