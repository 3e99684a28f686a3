//! Compares ways to make shadow maps with each other and with the truth: measurements of each
//! ([`Bench`]), a report of them ([`report::Report`]), the choice of the map that keeps a limit ([`choose`]), and that of a picture
//! ([`choose_picture`]).

mod bench;
mod budget;
mod choose;
mod method;
mod picture;
#[cfg(feature = "io")]
pub mod report;

pub use bench::{Bench, Curve, MOST_POINTS, Row};
pub use budget::Budget;
pub use choose::{Certified, Limits, choose};
pub use method::{Method, check_filter};
pub use picture::{Chosen, Given, Goal, PictureError, Sampled, choose_picture, picture_error};
