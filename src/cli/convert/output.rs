//! Where a conversion goes: the format that the name's ending asks for, and its files, all or none.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::PendingFile;
use crate::io::dense::{DenseTarget, OutputFile};
use crate::io::raw::Sidecar;
use crate::io::vdb::Compression;

/// The endings of all formats that are written.
const ENDINGS: &str = ".vdb, .npy, .nrrd, .nhdr, .mha, .mhd, .raw";

/// The format of the output, and how it is packed.
#[derive(Clone, Copy)]
pub(super) enum Target {
    OpenVdb(Compression),
    Dense { format: DenseTarget, packed: bool },
}

/// What came out.
pub(super) struct Converted {
    pub files: Vec<OutputFile>,
    /// What is in it, for people.
    pub what: String,
}

impl Target {
    pub(super) fn new(path: &Path, compression: Option<&str>) -> Result<Self> {
        let unknown = |known: &str| {
            let name = compression.unwrap_or_default();
            let why = format!("'{name}' is none of {known}, which {} has", path.display());
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
            return Err(Error::contents(path, format!("its ending is none of {ENDINGS}")));
        };
        match (compression, format.compression()) {
            (None | Some("none"), _) => Ok(Self::Dense { format, packed: false }),
            (Some(name), Some(own)) if name == own => Ok(Self::Dense { format, packed: true }),
            (_, Some(own)) => unknown(&format!("{own}, none")),
            (_, None) => unknown("none"),
        }
    }
}

/// Files that are promised, the one that was asked for first.
pub(super) struct Output {
    files: Vec<(PathBuf, PendingFile)>,
}

impl Output {
    /// Makes sure, before the work, that there is a place for all files of a conversion.
    pub(super) fn promise(path: &Path, target: Target) -> Result<Self> {
        let paths = match target {
            Target::OpenVdb(_) => vec![path.to_owned()],
            Target::Dense { format, packed } => format.paths(path, packed),
        };
        if matches!(target, Target::Dense { format: DenseTarget::Npy | DenseTarget::Raw, .. }) {
            Sidecar::refuse_scene_beside(path)?;
        }
        let promised = paths.into_iter().map(|path| {
            let pending = PendingFile::create(&path)?;
            Ok((path, pending))
        });
        Ok(Self { files: promised.collect::<Result<_>>()? })
    }

    /// Puts all files in their places, the one that was asked for last.
    pub(super) fn finish(self, contents: &[OutputFile]) -> Result<()> {
        let mut files = Vec::new();
        for (path, pending) in self.files.into_iter().rev() {
            let parts = contents.iter().filter(|file| file.path == path);
            let parts = parts.flat_map(|file| file.parts.iter().map(Vec::as_slice)).collect();
            files.push((pending, parts));
        }
        PendingFile::finish_together(&files)
    }
}
