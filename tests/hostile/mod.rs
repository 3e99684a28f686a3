//! The program and what people or files do to it: messages that steer no terminal, memory within
//! bounds, the same bytes for the same input.

mod memory;
mod messages;
#[cfg(target_os = "linux")]
mod mutations;
mod repeated;
