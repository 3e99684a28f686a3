//! An interface for long work to report its progress, and to be told that nobody wants it any more.
//! Knows neither terminals nor what the work is.

/// Receives the progress of one piece of work after another; called from many threads.
pub trait Progress: Sync {
    /// Called when a piece of work of `total` equal parts begins; `what` names it for people.
    fn begin(&self, what: &str, total: u64);
    /// Called when `parts` more of them are done.
    fn advance(&self, parts: u64);
    /// Whether the result is not wanted any more. Maps and pictures on the processor then end
    /// within some milliseconds with the error `ErrorKind::Cancelled`; work that has been handed to a
    /// device is finished. Asked often: it must be quick, and once it has said yes, it must not say
    /// no again.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {}
}

/// Part of a piece of work that does not count in its progress, but can be cancelled with it.
#[derive(Clone, Copy)]
pub(crate) struct Uncounted<'a>(pub &'a dyn Progress);

impl Progress for Uncounted<'_> {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
