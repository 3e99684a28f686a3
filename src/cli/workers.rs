//! The threads of a command, and the report of a panic. Knows no command.

use std::num::NonZero;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Mutex, PoisonError};
use std::thread::{available_parallelism, sleep};
use std::time::Duration;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Error, Result};

/// Location and message of the first panic.
static FAULT: Mutex<Option<String>> = Mutex::new(None);

/// Does `work` with the given number of threads; by default with as many as there are processors,
/// and with fewer if the system allows no more.
///
/// # Errors
/// Those of `work`; if no thread can be started; if a bug of the program, of which there should be
/// none, caused a panic.
pub(super) fn run<T: Send>(
    threads: Option<u32>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let pool = pool(threads.map_or(0, |threads| threads as usize))?;
    panic::set_hook(Box::new(|fault| {
        // It is reported in one line at the end, like any failure.
        FAULT.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(fault.to_string());
    }));
    let done = panic::catch_unwind(AssertUnwindSafe(|| pool.install(work)));
    done.unwrap_or_else(|_| {
        let words = FAULT.lock().unwrap_or_else(PoisonError::into_inner).take();
        let why = words.unwrap_or_default().replace('\n', " ");
        Err(Error::value("a bug in the program, please report it", why))
    })
}

/// A pool of the requested number of threads (0: rayon's default), or of as many as can be started.
fn pool(mut threads: usize) -> Result<ThreadPool> {
    loop {
        let builder = ThreadPoolBuilder::new().num_threads(threads);
        // A single thread is the current one, which exists already.
        let builder = if threads == 1 { builder.use_current_thread() } else { builder };
        threads = match (builder.build(), threads) {
            (Ok(pool), _) => return Ok(pool),
            (Err(error), 1) => return Err(Error::value("threads", error.to_string())),
            (Err(_), 0) => available_parallelism().map_or(1, NonZero::get),
            (Err(_), _) => threads / 2,
        };
        // Threads that were started take a moment to end.
        sleep(Duration::from_millis(20));
    }
}
