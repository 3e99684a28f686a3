//! Compares ways to make shadow maps with each other and with the truth: measurements of each
//! ([`Bench`]), and the choice of the one that keeps a limit ([`choose`]).

mod bench;
mod budget;
mod choose;
mod method;

pub use bench::{Bench, Curve, Row};
pub use budget::Budget;
pub use choose::{Certified, Limits, choose};
pub use method::{Method, check_filter};
