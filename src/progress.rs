//! How long work reports how far it is. Knows neither terminals nor what the work is.

/// Receives the progress of one piece of work after the other; called from many threads.
pub trait Progress: Sync {
    /// A piece of work of `total` equal parts begins; `what` names it for people.
    fn begin(&self, what: &str, total: u64);
    /// `parts` more of it are done.
    fn advance(&self, parts: u64);
}

/// Nobody is watching.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {}
}
