//! Command `adapters`: lists what the GPU backend could run on.

use crate::error::Result;

/// Prints one line per adapter.
#[cfg(feature = "gpu")]
pub(super) fn run() -> Result<()> {
    use crate::error::quote::{LONGEST_LINE, one_line};

    let mut lines = crate::gpu::adapters();
    if lines.is_empty() {
        lines.push("no graphics adapter; --backend auto uses the CPU".to_owned());
    }
    let lines = lines.iter().map(|line| one_line(line, LONGEST_LINE) + "\n");
    super::print(&lines.collect::<String>())
}

#[cfg(not(feature = "gpu"))]
pub(super) fn run() -> Result<()> {
    Err(crate::Error::gpu("this build has no GPU backend (feature `gpu`)"))
}
