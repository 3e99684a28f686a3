//! Progress bars on stderr, for work that takes over a second, only on a terminal; and a stopwatch
//! for work.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::progress::Progress;

/// Work that takes less time shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Draws a bar for each piece of work that takes long.
#[derive(Default)]
pub(super) struct Bars {
    current: Mutex<Option<Current>>,
}

struct Current {
    bar: ProgressBar,
    begun: Instant,
    shown: bool,
}

impl Progress for Bars {
    fn begin(&self, what: &str, total: u64) {
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{msg:>12} [{bar:40}] {percent:>3} % {eta}")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(what.to_owned());
        if let Ok(mut current) = self.current.lock() {
            *current = Some(Current { bar, begun: Instant::now(), shown: false });
        }
    }

    fn advance(&self, parts: u64) {
        let Ok(mut current) = self.current.lock() else { return };
        let Some(current) = current.as_mut() else { return };
        current.bar.inc(parts);
        if !current.shown && current.begun.elapsed() > PATIENCE {
            // indicatif draws nothing if stderr is not a terminal.
            current.bar.set_draw_target(ProgressDrawTarget::stderr());
            current.shown = true;
        }
        if current.bar.length() == Some(current.bar.position()) {
            current.bar.finish_and_clear();
        }
    }
}

/// Forwards progress, and measures the time of work by name: from its begin to the begin of other
/// work, or to the query.
pub(super) struct Stopwatch<'a> {
    shown: &'a dyn Progress,
    begun: Mutex<Vec<(String, Instant)>>,
}

impl<'a> Stopwatch<'a> {
    pub(super) fn new(shown: &'a dyn Progress) -> Self {
        Self { shown, begun: Mutex::default() }
    }

    /// Total time so far of all work called `what`.
    pub(super) fn time(&self, what: &str) -> Duration {
        let now = Instant::now();
        let Ok(begun) = self.begun.lock() else { return Duration::ZERO };
        let ends = begun.iter().skip(1).map(|(_, next)| *next).chain([now]);
        begun
            .iter()
            .zip(ends)
            .filter(|((name, _), _)| name == what)
            .map(|((_, at), end)| end - *at)
            .sum()
    }
}

impl Progress for Stopwatch<'_> {
    fn begin(&self, what: &str, total: u64) {
        if let Ok(mut begun) = self.begun.lock() {
            begun.push((what.to_owned(), Instant::now()));
        }
        self.shown.begin(what, total);
    }

    fn advance(&self, parts: u64) {
        self.shown.advance(parts);
    }
}
