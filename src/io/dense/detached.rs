//! Files that hold the voxels of a header: their names contain a hash of the voxels, so that no
//! header finds the voxels of another one.

use std::hash::{DefaultHasher, Hasher};
use std::path::Path;

use super::DenseTarget;
use crate::error::{Error, Result};
use crate::io::output::folder_of;

/// The endings of such names.
const ENDINGS: [&str; 3] = ["raw", "raw.gz", "zraw"];

/// The name of the file for a header's voxels. It differs from the name that an older header with
/// other voxels refers to, so that file is not overwritten.
pub(super) fn name(
    format: DenseTarget,
    header: &Path,
    voxels: &[u8],
    packed: bool,
) -> Result<String> {
    let [raw, gzip, zlib] = ENDINGS;
    let ending = match (format, packed) {
        (_, false) => raw,
        (DenseTarget::Nrrd { .. }, true) => gzip,
        (_, true) => zlib,
    };
    let name = header.file_name().and_then(|name| name.to_str());
    let plain = |name: &&str| name.trim() == *name && !name.contains(char::is_control);
    let name = name.filter(plain).ok_or_else(|| {
        Error::contents(header, "its header cannot hold a file name that is not plain text")
    })?;
    let mut hasher = DefaultHasher::new();
    hasher.write(voxels);
    Ok(format!("{name}.{:016x}.{ending}", hasher.finish()))
}

/// Removes the voxel files of earlier headers of the same name: those named by [`name`], except
/// `kept`.
pub(super) fn remove_older(header: &Path, kept: &str) {
    let Some(name) = header.file_name().and_then(|name| name.to_str()) else { return };
    for entry in std::fs::read_dir(folder_of(header)).into_iter().flatten().flatten() {
        let other = entry.file_name();
        let Some(other) = other.to_str() else { continue };
        let hashed = other.strip_prefix(name).and_then(|rest| rest.strip_prefix('.'));
        let is_ours = hashed.and_then(|rest| rest.split_once('.')).is_some_and(|(hash, ending)| {
            let is_hex = hash.bytes().all(|byte| byte.is_ascii_hexdigit());
            hash.len() == 16 && is_hex && ENDINGS.contains(&ending)
        });
        if is_ours && other != kept {
            // A file that cannot be removed wastes space but does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
