//! `adapters`: what the GPU backend could run on.

use crate::error::Result;

/// Prints one line an adapter.
#[cfg(feature = "gpu")]
pub(super) fn run() -> Result<()> {
    use std::io::Write;

    let mut lines = crate::gpu::adapters();
    if lines.is_empty() {
        lines.push("no graphics adapter; --backend auto takes the CPU".to_owned());
    }
    let text = lines.join("\n") + "\n";
    std::io::stdout()
        .write_all(text.as_bytes())
        .map_err(|error| crate::Error::file("standard output", error))
}

#[cfg(not(feature = "gpu"))]
pub(super) fn run() -> Result<()> {
    Err(crate::Error::gpu("this build has no GPU backend (feature `gpu`)"))
}
