//! Claims about volume files. Each format has files of its own.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod vdb_truth;
