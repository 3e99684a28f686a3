//! Writes pictures to files in the format that the ending of the name tells.

use std::path::Path;

use super::output::{Inputs, PendingFile};
use super::{exr, png};
use crate::error::{Error, Result};
use crate::image::Image;

impl Image {
    /// Writes the picture to `path`: `.png` (8 bits per channel, sRGB, after multiplication by
    /// `exposure`, which is above 0) or `.exr` (f32, linear radiance, without exposure). The file
    /// appears completely or not at all.
    ///
    /// # Errors
    /// If the name has another ending, or the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>, exposure: f32) -> Result<()> {
        let path = path.as_ref();
        let ending = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
        let contents = match ending.as_ref().and_then(|ending| ending.to_str()) {
            Some("png") => png::encode(self, exposure)?,
            Some("exr") => exr::encode_image(self, None)?,
            _ => return Err(Error::contents(path, "a picture's name must end in .png or .exr")),
        };
        PendingFile::create(path, &Inputs::default())?.finish_with(&contents)
    }
}
