//! What the program does when it is told to end: it takes away what is not in its place yet, then
//! ends as it would have. Knows no command.

use std::io;
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use crate::io::output::abandon;

/// From now on, interrupting or terminating the program leaves nothing half done. Where that cannot
/// be had, signals do what they did.
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

/// The signals that whoever started the program wants ignored, as `nohup` does: a bit each.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
