//! Pictures as files, by the ending of their name.

use std::path::Path;

use super::output::{Inputs, PendingFile};
use super::{exr, png};
use crate::error::{Error, Result};
use crate::image::Image;

impl Image {
    /// Writes the picture to `path`: `.png` (8 bits a channel, sRGB after `exposure`, a factor
    /// above 0) or `.exr` (f32, linear radiance as it is). The file appears whole, or not at all.
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
