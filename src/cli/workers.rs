//! The threads that a command works with, and what becomes of a fault in the program itself. Knows
//! no command.

use std::num::NonZero;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Mutex, PoisonError};
use std::thread::{available_parallelism, sleep};
use std::time::Duration;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Error, Result};

/// Where the first panic was, and its words.
static FAULT: Mutex<Option<String>> = Mutex::new(None);

/// Does `work` with so many threads, by default as many as there are processors; with fewer where
/// the system gives no more.
///
/// # Errors
/// Those of `work`; if there is no thread at all; if a fault of the program, of which there should
/// be none, ended the work.
pub(super) fn run<T: Send>(
    threads: Option<u32>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let pool = pool(threads.map_or(0, |threads| threads as usize))?;
    panic::set_hook(Box::new(|fault| {
        // One line says it at the end, as of any failure.
        FAULT.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(fault.to_string());
    }));
    let done = panic::catch_unwind(AssertUnwindSafe(|| pool.install(work)));
    done.unwrap_or_else(|_| {
        let words = FAULT.lock().unwrap_or_else(PoisonError::into_inner).take();
        let why = words.unwrap_or_default().replace('\n', " ");
        Err(Error::value("a fault of the program, please report it", why))
    })
}

/// As many threads as asked for (0: as rayon thinks fit), or as many as there are.
fn pool(mut threads: usize) -> Result<ThreadPool> {
    loop {
        let builder = ThreadPoolBuilder::new().num_threads(threads);
        // One needs no other than this, which there is.
        let builder = if threads == 1 { builder.use_current_thread() } else { builder };
        threads = match (builder.build(), threads) {
            (Ok(pool), _) => return Ok(pool),
            (Err(error), 1) => return Err(Error::value("threads", error.to_string())),
            (Err(_), 0) => available_parallelism().map_or(1, NonZero::get),
            (Err(_), _) => threads / 2,
        };
        // Those that came take a moment to go.
        sleep(Duration::from_millis(20));
    }
}
