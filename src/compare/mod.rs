//! Ways to make shadow maps held against each other and against the truth: what each comes to
//! ([`Bench`]), and the one that keeps a limit ([`choose`]).

mod bench;
mod budget;
mod choose;
mod method;

pub use bench::{Bench, Curve, Row};
pub use budget::Budget;
pub use choose::{Certified, Limits, choose};
pub use method::{Method, check_filter};
