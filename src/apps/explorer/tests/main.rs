//! Tests of the explorer without a window: its panels are driven through what they tell screen
//! readers, its hands through pointers and keys. The processor draws.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod files;
mod hands;
mod messages;
mod panels;
mod pictures;
mod scripts;
mod support;
