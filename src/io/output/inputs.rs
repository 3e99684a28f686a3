//! The files that a run reads: none of its outputs may take the place of one. It knows files by
//! what they are and not by name, so links to them are them.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Files that must stay as they are.
#[derive(Clone, Debug, Default)]
pub struct Inputs(Vec<(PathBuf, Identity)>);

/// What tells a file from others, whatever it is called.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

impl Inputs {
    /// The files at `paths`; those that do not exist are no inputs.
    pub fn new(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut inputs = Self::default();
        inputs.extend(paths);
        inputs
    }

    /// Adds the files at `paths`.
    pub fn extend(&mut self, paths: impl IntoIterator<Item = PathBuf>) {
        let known = |path: PathBuf| identity(&path).map(|identity| (path, identity));
        self.0.extend(paths.into_iter().filter_map(known));
    }

    /// Makes sure that `output` is none of these files.
    ///
    /// # Errors
    /// If it is, by this name or another.
    pub fn refuse(&self, output: &Path) -> Result<()> {
        let Some(output_identity) = identity(output) else { return Ok(()) };
        let Some((input, _)) = self.0.iter().find(|(_, own)| *own == output_identity) else {
            return Ok(());
        };
        let why = if input == output {
            "it is read here and stays as it is; give the output another name".to_owned()
        } else {
            let input = input.display();
            format!(
                "it is {input}, which is read here and stays as it is; give the output another name"
            )
        };
        Err(Error::contents(output, why))
    }
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;

    let metadata = std::fs::metadata(path).ok()?;
    // Reading and writing a terminal or a null device do not meet.
    metadata.is_file().then(|| (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    path.canonicalize().ok()
}
