//! An interface for long work to report its progress. Knows neither terminals nor what the work is.

/// Receives the progress of one piece of work after another; called from many threads.
pub trait Progress: Sync {
    /// Called when a piece of work of `total` equal parts begins; `what` names it for people.
    fn begin(&self, what: &str, total: u64);
    /// Called when `parts` more of them are done.
    fn advance(&self, parts: u64);
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {}
}
