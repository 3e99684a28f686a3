//! Where a conversion goes: the format that the name's ending asks for, and its files, all or none.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::dense::{DenseHeader, DenseTarget, OutputFile};
use crate::io::raw::Sidecar;
use crate::io::vdb::Compression;
use crate::io::{Format, PendingFile};

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

/// Makes sure that what is written beside the output leaves the input as it is.
///
/// # Errors
/// If the voxels of a detached header would replace the input, or a sidecar that of the input with
/// something else; `header` is what the input was read by, if it may have one.
pub(super) fn spare_input(
    input: &Path,
    format: Format,
    header: Option<&DenseHeader>,
    files: &[OutputFile],
) -> Result<()> {
    let is = |path: &Path, other: &Path| {
        let [path, other] = [path, other].map(|path| path.canonicalize().ok());
        path.is_some() && path == other
    };
    let Some((asked_for, others)) = files.split_first() else { return Ok(()) };
    let taken = |path: &Path, what: &str| {
        let why =
            format!("{what}, which {} would change; name it otherwise", asked_for.path.display());
        Err(Error::contents(path, why))
    };
    if let Some(file) = others.iter().find(|file| is(&file.path, input)) {
        return taken(&file.path, "the input");
    }
    let may_have_sidecar = matches!(format, Format::Raw | Format::Npy);
    let (Some(header), true, false) = (header, may_have_sidecar, is(&asked_for.path, input)) else {
        return Ok(());
    };
    let beside = Sidecar::path_beside(input);
    let shared = others.iter().find(|file| Some(&file.path) == beside.as_ref());
    match shared {
        Some(file) if !Sidecar::agrees(&file.parts.concat(), header, format == Format::Raw) => {
            taken(&file.path, "the place of the input's sidecar")
        }
        _ => Ok(()),
    }
}
