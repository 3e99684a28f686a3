//! Pictures as files: one module a format that is too small for one of its own. Knows nothing of
//! how pictures are made.

mod format;
mod hdr;
mod jpeg;
mod npy;
mod tiff;
mod webp;

use std::path::Path;

pub use format::PictureFormat;

use super::output::{Inputs, PendingFile};
use super::{exr, png};
use crate::error::{Error, Result};
use crate::image::{Image, Tone};
use crate::scene::Camera;

/// How a picture is written.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PictureOptions {
    /// The file's format.
    pub format: PictureFormat,
    /// Bits per channel, one of [`PictureFormat::bits`]; `None` for the first of them.
    pub bits: Option<u32>,
    /// How radiance is shown where it is encoded for screens; by default as it is, and 1 where it
    /// is above 1.
    pub tone: Tone,
    /// A text on the measured errors of the picture's shadows, for OpenEXR files.
    pub certificate: Option<String>,
    /// What the picture was seen by, for OpenEXR files.
    pub camera: Option<Camera>,
}

impl PictureOptions {
    /// A picture in `format` with defaults for everything else.
    pub fn new(format: PictureFormat) -> Self {
        Self { format, bits: None, tone: 1.0.into(), certificate: None, camera: None }
    }

    /// A copy with a change.
    #[must_use]
    pub fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }

    /// Checks that the format can have so many bits, and returns them.
    ///
    /// # Errors
    /// [`ErrorKind::Value`](crate::ErrorKind::Value) about `bits`.
    pub fn checked_bits(&self) -> Result<u32> {
        let possible = self.format.bits();
        let bits = self.bits.unwrap_or(possible[0]);
        if possible.contains(&bits) {
            return Ok(bits);
        }
        let name = self.format.name();
        let possible: Vec<String> = possible.iter().map(u32::to_string).collect();
        let why = format!("{bits} is none of those of {name}, which are {}", possible.join(", "));
        Err(Error::value("bits", why))
    }

    /// The bytes of a file with this picture. Linear formats hold radiance as it is, premultiplied
    /// by alpha; the others are encoded for screens after exposure and tone curve, with straight
    /// alpha. A format without alpha shows the picture in front of black.
    ///
    /// # Errors
    /// If the format cannot have that many bits or pixels, or if its encoder fails.
    pub fn encode(&self, image: &Image) -> Result<Vec<u8>> {
        let bits = self.checked_bits()?;
        let tone = self.tone;
        match self.format {
            PictureFormat::Png if bits == 16 => png::encode16(image, tone),
            PictureFormat::Png => png::encode(image, tone),
            PictureFormat::Jpeg => jpeg::encode(image, tone),
            PictureFormat::Tiff => tiff::encode(image, tone, bits),
            PictureFormat::WebP => webp::encode(image, tone),
            PictureFormat::Exr => {
                let (certificate, camera) = (self.certificate.as_deref(), self.camera.as_ref());
                exr::encode_image(image, &exr::PictureFacts { certificate, camera }, bits == 16)
            }
            PictureFormat::Hdr => Ok(hdr::encode(image)),
            PictureFormat::Npy => npy::encode(image),
        }
    }
}

/// An encoder's failure, with the format's name.
fn failed(format: PictureFormat) -> impl Fn(&dyn std::fmt::Display) -> Error {
    move |error| Error::value(format!("{} picture", format.name()), error.to_string())
}

impl Image {
    /// Writes the picture to `path`, in the format that the ending of its name tells
    /// ([`PictureFormat`]) and with that format's default number of bits: `.png`, `.jpg`, `.tiff`
    /// and `.webp` for screens, through `tone`, which may be an exposure; `.exr`, `.hdr` and
    /// `.npy` with linear radiance, without that. The file appears completely or not
    /// at all. [`PictureOptions`] can do more.
    ///
    /// # Errors
    /// If the name has another ending, or the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>, tone: impl Into<Tone>) -> Result<()> {
        let path = path.as_ref();
        let format = PictureFormat::of_path(path).ok_or_else(|| {
            let why = format!("a picture's name must end in one of {}", PictureFormat::names());
            Error::contents(path, why)
        })?;
        let options = PictureOptions { tone: tone.into(), ..PictureOptions::new(format) };
        let contents = options.encode(self)?;
        PendingFile::create(path, &Inputs::default())?.finish_with(&contents)
    }
}
