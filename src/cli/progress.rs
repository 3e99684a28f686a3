//! Progress bars on stderr, for work over a second, on a terminal only.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::progress::Progress;

/// Work shorter than this shows nothing.
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
            // indicatif itself draws nothing where stderr is no terminal.
            current.bar.set_draw_target(ProgressDrawTarget::stderr());
            current.shown = true;
        }
        if current.bar.length() == Some(current.bar.position()) {
            current.bar.finish_and_clear();
        }
    }
}
