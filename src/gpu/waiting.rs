//! Waiting for a device: for its verdicts on commands, and for word that it has done them. In a
//! browser either comes only after the program has returned to the browser, so all that may take
//! time is a future. Elsewhere these futures are ready at once. Knows nothing of passes.

use std::collections::VecDeque;
use std::fmt;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use wgpu::ErrorFilter;

use crate::error::{Error, Result};

/// The result of a future. There is no such function for browsers, where waiting would never end.
#[cfg(not(target_family = "wasm"))]
pub(super) fn wait<T>(future: impl Future<Output = T>) -> T {
    pollster::block_on(future)
}

/// A verdict that has not come yet.
type Open = Pin<Box<dyn Future<Output = Result<()>> + Send>>;

/// The verdicts that have not come yet, in the order of their commands.
#[derive(Default)]
struct Late {
    open: VecDeque<Open>,
    /// Whether one that came was bad.
    bad: bool,
}

/// Opens error scopes on a device. Clones share what they know.
#[derive(Clone)]
pub(super) struct Scopes {
    device: wgpu::Device,
    late: Arc<Mutex<Late>>,
}

impl fmt::Debug for Scopes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scopes").field("device", &self.device).finish_non_exhaustive()
    }
}

impl Scopes {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self { device: device.clone(), late: Arc::default() }
    }

    fn late(&self) -> MutexGuard<'_, Late> {
        // A thread that panicked left it as it was.
        self.late.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does `work`; an error if the device finds its commands invalid or has not enough memory,
    /// which `explain` makes of the device's message. In a browser that error comes later, from
    /// [`Scopes::settled`]. Error scopes belong to a thread, so they are opened and closed here.
    pub(super) fn scoped<T>(
        &self,
        explain: impl FnOnce(String) -> Error + Send + 'static,
        work: impl FnOnce() -> T,
    ) -> Result<T> {
        let memory = self.device.push_error_scope(ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(ErrorFilter::Validation);
        let done = work();
        let (validation, memory) = (validation.pop(), memory.pop());
        let mut verdict: Open = Box::pin(async move {
            // What there was no memory for is invalid, too.
            let found = [memory.await, validation.await];
            match found.into_iter().flatten().next() {
                Some(error) => Err(explain(error.to_string())),
                None => Ok(()),
            }
        });
        match verdict.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(verdict) => verdict.map(|()| done),
            Poll::Pending => {
                self.late().open.push_back(verdict);
                Ok(done)
            }
        }
    }

    /// Waits for the verdicts that have not come yet.
    ///
    /// # Errors
    /// The first of them.
    pub(super) async fn settled(&self) -> Result<()> {
        let mut first = Ok(());
        loop {
            let next = self.late().open.pop_front();
            let Some(verdict) = next else { return first };
            let verdict = verdict.await;
            self.late().bad |= verdict.is_err();
            first = first.and(verdict);
        }
    }

    /// Whether something turned out to be invalid after it was made, since this was last asked.
    pub(super) fn were_bad(&self) -> bool {
        std::mem::take(&mut self.late().bad)
    }
}

/// What [`Word`] and [`Heard`] share.
struct Shared<T> {
    word: Option<T>,
    /// Whether no word will come any more.
    over: bool,
    waker: Option<Waker>,
}

/// Gives one word.
pub(super) struct Word<T>(Arc<Mutex<Shared<T>>>);

/// The word that a [`Word`] gives; `None` if it was dropped.
pub(super) struct Heard<T>(Arc<Mutex<Shared<T>>>);

/// One word from a callback to a future.
pub(super) fn word<T>() -> (Word<T>, Heard<T>) {
    let shared = Arc::new(Mutex::new(Shared { word: None, over: false, waker: None }));
    (Word(shared.clone()), Heard(shared))
}

impl<T> Word<T> {
    pub(super) fn give(self, word: T) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).word = Some(word);
    }
}

impl<T> Drop for Word<T> {
    fn drop(&mut self) {
        let waker = {
            let mut shared = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            shared.over = true;
            shared.waker.take()
        };
        waker.into_iter().for_each(Waker::wake);
    }
}

impl<T> Future for Heard<T> {
    type Output = Option<T>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<T>> {
        let mut shared = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if shared.over {
            return Poll::Ready(shared.word.take());
        }
        shared.waker = Some(context.waker().clone());
        Poll::Pending
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    #[test]
    fn a_word_is_heard_and_so_is_its_absence() {
        let (speech, heard) = word();
        let speaker = thread::spawn(move || speech.give(7));
        assert_eq!(wait(heard), Some(7));
        assert!(speaker.join().is_ok());
        let (silence, heard) = word::<u8>();
        let speaker = thread::spawn(move || drop(silence));
        assert_eq!(wait(heard), None);
        assert!(speaker.join().is_ok());
    }
}
