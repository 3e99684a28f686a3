//! The output of a conversion: the format for the name's ending, and its files, which are written
//! all or none.

use std::path::Path;

use crate::error::{Error, Result};
use crate::io::dense::{DenseOutput, DenseTarget};
use crate::io::vdb::Compression;
use crate::io::{Inputs, PendingFile};

/// The endings of all output formats.
const ENDINGS: &str = ".vdb, .npy, .nrrd, .nhdr, .mha, .mhd, .raw";

/// The output format and its compression.
#[derive(Clone, Copy)]
pub(super) enum Target {
    OpenVdb(Compression),
    Dense { format: DenseTarget, packed: bool },
}

impl Target {
    pub(super) fn new(path: &Path, compression: Option<&str>) -> Result<Self> {
        let unknown = |known: &str| {
            let name = compression.unwrap_or_default();
            let why = format!("'{name}' is not one of {known}, the choices for {}", path.display());
            Err(Error::value("compression", why))
        };
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("vdb")) {
            return Ok(Self::OpenVdb(match compression {
                None | Some("blosc") => Compression::BLOSC,
                Some("zip") => Compression::ZIP,
                Some("mask") => Compression::ACTIVE_MASK,
                Some("none") => Compression::NONE,
                Some(_) => return unknown("blosc, zip, mask, none"),
            }));
        }
        let Some(format) = DenseTarget::of_path(path) else {
            let why = format!("the ending of '{}' is not one of {ENDINGS}", path.display());
            return Err(Error::value("output", why));
        };
        match (compression, format.compression()) {
            (None | Some("none"), _) => Ok(Self::Dense { format, packed: false }),
            (Some(name), Some(own)) if name == own => Ok(Self::Dense { format, packed: true }),
            (_, Some(own)) => unknown(&format!("{own}, none")),
            (_, None) => unknown("none"),
        }
    }
}

/// Output files that are prepared.
pub(super) enum Output {
    OpenVdb(PendingFile, Compression),
    Dense(DenseOutput, DenseTarget),
}

impl Output {
    /// Checks, before the work, that all files of a conversion can be written, and that none of
    /// them is one of the `inputs`.
    pub(super) fn promise(path: &Path, target: Target, inputs: &Inputs) -> Result<Self> {
        Ok(match target {
            Target::OpenVdb(compression) => {
                Self::OpenVdb(PendingFile::create(path, inputs)?, compression)
            }
            Target::Dense { format, packed } => {
                Self::Dense(format.promise(path, packed, inputs)?, format)
            }
        })
    }
}
