//! Lets one run at a time put files into a folder, so that files which belong together stay
//! together. Knows nothing of their contents.

use std::fs::File;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use web_time::Instant;

/// Longest wait for other runs. They hold a lock for milliseconds; whoever holds it for longer does
/// so for another reason.
const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(2);

/// A lock on a folder: no other run puts files into it while this exists. It is advisory and ends
/// with the process. It may not be held if the system has no such locks.
pub(super) struct FolderLock(Option<File>);

impl FolderLock {
    /// Whether the lock was obtained.
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
