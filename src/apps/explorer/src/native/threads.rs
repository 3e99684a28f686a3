//! Work that the window does not wait for.

/// Does `work` on a thread of its own.
///
/// # Errors
/// If the system starts no thread.
pub fn start(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work).map(drop)
}

/// Lets other work of the same thread go on; there is none.
pub async fn pause() {}
