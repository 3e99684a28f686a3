//! Cleans up when the program is asked to terminate: deletes temporary files, then ends with the
//! signal's default action. Knows no command.

use std::io;
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use crate::io::output::abandon;

/// From now on, interrupting or terminating the program leaves nothing incomplete. If that cannot
/// be set up, signals keep their previous effect.
pub(super) fn clean_up_after() {
    let _ = watch();
}

fn watch() -> io::Result<()> {
    let ignored = ignored();
    let heeded = |signal: &&i32| ignored >> (**signal - 1) & 1 == 0;
    let wanted: Vec<i32> = [SIGINT, SIGTERM, SIGHUP].iter().filter(heeded).copied().collect();
    let mut signals = Signals::new(wanted)?;
    thread::Builder::new().name("signals".to_owned()).spawn(move || {
        if let Some(signal) = signals.forever().next() {
            abandon();
            let _ = emulate_default_handler(signal);
        }
    })?;
    Ok(())
}

/// A mask of the signals that the parent process wants ignored, as `nohup` does.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
