//! The formats of pictures, and what each of them can hold. Knows no bytes.

use std::path::Path;

use crate::error::{Error, Result};

/// A format of flat pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PictureFormat {
    /// `.png`: encoded for screens, 8 or 16 bits.
    Png,
    /// `.jpg`, `.jpeg`: encoded for screens, 8 bits, without alpha and not lossless.
    Jpeg,
    /// `.tif`, `.tiff`: encoded for screens in 8 or 16 bits, or linear radiance as 32-bit floats.
    Tiff,
    /// `.webp`: encoded for screens, 8 bits, lossless.
    WebP,
    /// `.exr`: linear radiance as 32-bit floats, or 16-bit ones.
    Exr,
    /// `.hdr`, Radiance's RGBE: linear radiance with a common exponent, without alpha.
    Hdr,
    /// `.npy`: linear radiance as a NumPy array of 32-bit floats, (height, width, 4).
    Npy,
}

/// What a format is called and what it holds.
struct Traits {
    format: PictureFormat,
    /// The endings of names, the first of which is also the format's name.
    endings: &'static [&'static str],
    /// Bits per channel, the default first. Radiance's 32 bits are those of a pixel.
    bits: &'static [u32],
    has_alpha: bool,
}

const TRAITS: [Traits; 7] = {
    use PictureFormat::{Exr, Hdr, Jpeg, Npy, Png, Tiff, WebP};
    [
        Traits { format: Png, endings: &["png"], bits: &[8, 16], has_alpha: true },
        Traits { format: Jpeg, endings: &["jpg", "jpeg"], bits: &[8], has_alpha: false },
        Traits { format: Tiff, endings: &["tiff", "tif"], bits: &[8, 16, 32], has_alpha: true },
        Traits { format: WebP, endings: &["webp"], bits: &[8], has_alpha: true },
        Traits { format: Exr, endings: &["exr"], bits: &[32, 16], has_alpha: true },
        Traits { format: Hdr, endings: &["hdr"], bits: &[32], has_alpha: false },
        Traits { format: Npy, endings: &["npy"], bits: &[32], has_alpha: true },
    ]
};

impl PictureFormat {
    /// All of them.
    pub const ALL: [Self; 7] = {
        let [a, b, c, d, e, f, g] = &TRAITS;
        [a.format, b.format, c.format, d.format, e.format, f.format, g.format]
    };

    fn traits(self) -> &'static Traits {
        &TRAITS[self as usize]
    }

    /// The format's name, which is also the usual ending of a file's name.
    pub fn name(self) -> &'static str {
        self.traits().endings[0]
    }

    /// The format that the ending of a file's name tells, in capitals or not.
    pub fn of_path(path: &Path) -> Option<Self> {
        path.extension()?.to_str().and_then(Self::named)
    }

    fn named(text: &str) -> Option<Self> {
        let is = |ending: &&str| text.eq_ignore_ascii_case(ending);
        TRAITS.iter().find(|one| one.endings.iter().any(is)).map(|one| one.format)
    }

    /// The numbers of bits per channel that the format can have, the default first.
    pub fn bits(self) -> &'static [u32] {
        self.traits().bits
    }

    /// Whether a file can let something behind the picture show through.
    pub fn has_alpha(self) -> bool {
        self.traits().has_alpha
    }

    /// Whether a file with so many bits per channel holds linear radiance, without exposure;
    /// otherwise it is encoded for screens.
    pub fn is_linear(self, bits: u32) -> bool {
        matches!(self, Self::Exr | Self::Hdr | Self::Npy) || bits == 32
    }

    /// The names, as a list for people.
    pub fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }
}

impl std::str::FromStr for PictureFormat {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let why = || format!("'{text}' is not one of {}", Self::names());
        Self::named(text).ok_or_else(|| Error::value("format", why()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_has_its_own_traits_and_is_found_by_each_ending() {
        for format in PictureFormat::ALL {
            assert_eq!(format.traits().format, format);
            for ending in format.traits().endings {
                let path = format!("some.where/x.{}", ending.to_uppercase());
                assert_eq!(PictureFormat::of_path(path.as_ref()), Some(format), "{path}");
            }
        }
        for name in ["png", "x.pnge", ".png", "png/", ""] {
            assert_eq!(PictureFormat::of_path(name.as_ref()), None, "{name}");
        }
    }
}
