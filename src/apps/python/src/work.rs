//! Long work beside the interpreter: without the GIL, on a pool of threads of this process, with
//! progress, and ended by Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use deepshadow::Result;
use deepshadow::progress::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::raised;

/// Signals and progress are looked at so often.
const PAUSE: Duration = Duration::from_millis(20);

/// Does `work` on another thread while this one waits for it, without the GIL. `progress`, if
/// given, is called as `progress(what, done, total)` from this thread while it works; an exception
/// that it raises ends the work and is raised here, as is Ctrl-C's.
pub fn done<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&dyn Progress) -> Result<T> + Send,
) -> PyResult<T> {
    let pool = pool()?;
    let watch = Watch::default();
    let mut told = Told::default();
    let mut fault = None;
    let result = thread::scope(|scope| {
        let worker = thread::Builder::new().spawn_scoped(scope, || {
            let _end = End(&watch);
            pool.install(|| work(&watch))
        });
        let worker = worker.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        loop {
            let ended = py.detach(|| watch.wait());
            let now = watch.told();
            let heard = match progress {
                Some(call) if fault.is_none() && now != told && !now.what.is_empty() => {
                    let heard = call.call1((&now.what, now.done, now.total)).map(drop);
                    told = now;
                    heard
                }
                _ => Ok(()),
            };
            if let Err(error) = heard.and_then(|()| py.check_signals()) {
                watch.cancelled.store(true, Ordering::Relaxed);
                fault.get_or_insert(error);
            }
            if ended {
                // A thread that is ending may still want nothing but itself.
                return Ok::<_, PyErr>(worker.join());
            }
        }
    })?;
    match (fault, result) {
        (Some(fault), _) => Err(fault),
        (None, Ok(result)) => result.map_err(raised),
        (None, Err(_)) => Err(PyRuntimeError::new_err("a fault in deepshadow; please report it")),
    }
}

/// What the worker says, and what it is told.
#[derive(Default)]
struct Watch {
    told: Mutex<Told>,
    cancelled: AtomicBool,
    ended: Mutex<bool>,
    end: Condvar,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Told {
    what: String,
    done: u64,
    total: u64,
}

impl Watch {
    /// Waits a moment for the end, and returns whether it has come.
    fn wait(&self) -> bool {
        let ended = locked(&self.ended);
        let waited = self.end.wait_timeout_while(ended, PAUSE, |ended| !*ended);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }

    fn told(&self) -> Told {
        locked(&self.told).clone()
    }
}

impl Progress for Watch {
    fn begin(&self, what: &str, total: u64) {
        *locked(&self.told) = Told { what: what.to_owned(), done: 0, total };
    }

    fn advance(&self, parts: u64) {
        let mut told = locked(&self.told);
        told.done = (told.done + parts).min(told.total);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Tells of the end, however it comes.
struct End<'a>(&'a Watch);

impl Drop for End<'_> {
    fn drop(&mut self) {
        *locked(&self.0.ended) = true;
        self.0.end.notify_all();
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The threads of this process. Those of a parent do not live on in a forked child, so the child
/// makes its own.
fn pool() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let own = std::process::id();
    let mut known = locked(&POOL);
    if let Some((process, pool)) = &*known
        && *process == own
    {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().thread_name(|i| format!("deepshadow {i}")).build();
    let pool = Arc::new(pool.map_err(|error| PyRuntimeError::new_err(error.to_string()))?);
    if let Some(parents) = known.replace((own, pool.clone())) {
        // Its threads are not there to be waited for.
        std::mem::forget(parents);
    }
    Ok(pool)
}
