//! The files that a run reads, which no output may overwrite. Files are identified by device and
//! inode instead of by name, so links to a file count as that file.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Files that must not be changed.
#[derive(Clone, Debug, Default)]
pub struct Inputs(Vec<(PathBuf, Identity)>);

/// Device and inode number, which identify a file whatever its name.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

impl Inputs {
    /// The files at `paths`; paths that do not exist are ignored.
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

    /// Checks that `output` is none of these files.
    ///
    /// # Errors
    /// If it is one of them, under this name or another.
    pub fn refuse(&self, output: &Path) -> Result<()> {
        let Some(output_identity) = identity(output) else { return Ok(()) };
        let Some((input, _)) = self.0.iter().find(|(_, own)| *own == output_identity) else {
            return Ok(());
        };
        let why = if input == output {
            "it is an input and stays unchanged; give the output another name".to_owned()
        } else {
            let input = input.display();
            format!(
                "it is {input}, which is an input and stays unchanged; give the output another name"
            )
        };
        Err(Error::contents(output, why))
    }
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;

    let metadata = std::fs::metadata(path).ok()?;
    // Only regular files can conflict; a terminal or a null device may be both read and written.
    metadata.is_file().then(|| (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    path.canonicalize().ok()
}
