//! Pipes and devices as destinations of outputs. Knows nothing of files.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use web_time::Instant;

/// Longest wait for a program that reads from a pipe.
const PATIENCE: Duration = Duration::from_secs(10);
const PAUSE: Duration = Duration::from_millis(10);

/// Opens the pipe or device `path` if that is possible without waiting; `None` for a pipe without a
/// reader.
pub(super) fn open_now(path: &Path) -> io::Result<Option<File>> {
    let mut options = OpenOptions::new();
    options.write(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};

        use rustix::fs::OFlags;
        use rustix::io::Errno;

        let is_pipe = std::fs::metadata(path)?.file_type().is_fifo();
        if is_pipe {
            let mut at_once = options.clone();
            at_once.custom_flags(OFlags::NONBLOCK.bits() as i32);
            let reader = match at_once.open(path) {
                Err(error) if Errno::from_io_error(&error) == Some(Errno::NXIO) => return Ok(None),
                reader => reader?,
            };
            // Opened again without NONBLOCK, so that writing waits while the pipe is full. Until
            // then the first handle keeps the reader from seeing the end.
            let file = options.open(path).map(Some);
            drop(reader);
            return file;
        }
    }
    options.open(path).map(Some)
}

/// The program's own standard output, wherever it leads.
pub(super) fn stdout() -> io::Result<File> {
    #[cfg(unix)]
    let handle = std::os::fd::AsFd::as_fd(&io::stdout()).try_clone_to_owned()?;
    #[cfg(windows)]
    let handle = std::os::windows::io::AsHandle::as_handle(&io::stdout()).try_clone_to_owned()?;
    #[cfg(any(unix, windows))]
    return Ok(File::from(handle));
    #[cfg(not(any(unix, windows)))]
    Err(io::Error::from(io::ErrorKind::Unsupported))
}

/// Opens the pipe or device `path`, waiting for a reader.
pub(super) fn open(path: &Path) -> io::Result<File> {
    let begun = Instant::now();
    loop {
        if let Some(file) = open_now(path)? {
            return Ok(file);
        }
        if begun.elapsed() > PATIENCE {
            return Err(io::Error::other("no program is reading from this pipe"));
        }
        sleep(PAUSE);
    }
}
