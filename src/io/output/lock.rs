//! One run at a time puts files into a folder, so that files which belong together stay together.
//! It knows nothing of what they are.

use std::fs::File;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longest wait for others. They take milliseconds; who holds a folder's lock for longer does so
/// for reasons of his own.
const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(2);

/// A folder that no other run puts files into while this lives; advisory, and gone with the
/// process. Where the system has no such locks there is none.
pub(super) struct FolderLock(Option<File>);

impl FolderLock {
    /// Whether it was to be had.
    pub(super) fn is_held(&self) -> bool {
        self.0.is_some()
    }

    pub(super) fn take(folder: &Path) -> Self {
        let Ok(file) = File::open(folder) else { return Self(None) };
        let begun = Instant::now();
        loop {
            match file.try_lock() {
                Ok(()) => return Self(Some(file)),
                Err(std::fs::TryLockError::WouldBlock) if begun.elapsed() < PATIENCE => {
                    sleep(PAUSE);
                }
                Err(_) => return Self(None),
            }
        }
    }
}
