//! Voxels in a file of their own beside a header: names that say which voxels they are, so that no
//! header ever finds those of another one.

use std::hash::{DefaultHasher, Hasher};
use std::path::Path;

use super::DenseTarget;
use crate::error::{Error, Result};
use crate::io::output::folder_of;

/// What such names end in.
const ENDINGS: [&str; 3] = ["raw", "raw.gz", "zraw"];

/// The name of the file that holds a header's voxels: what an older header names is not written
/// over.
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
        Error::contents(header, "its header cannot hold a name that is no plain text")
    })?;
    let mut hasher = DefaultHasher::new();
    hasher.write(voxels);
    Ok(format!("{name}.{:016x}.{ending}", hasher.finish()))
}

/// Removes voxels of earlier headers of the same name: files named as [`name`] names them but
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
            // One that stays is a waste of room and no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
