//! What was chosen because it was not given, and how its numbers are told.

use glam::DVec3;

/// A value that was chosen because it was not given.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Name of the value, and the key that sets it.
    pub what: &'static str,
    /// The chosen value as text.
    pub value: String,
}

#[derive(Default)]
pub(super) struct Choices(pub Vec<Choice>);

impl Choices {
    pub(super) fn took(&mut self, what: &'static str, value: String) {
        self.0.push(Choice { what, value });
    }
}

/// A number with six significant digits, which is enough to reproduce the picture.
pub(super) fn digits(x: f64) -> String {
    let magnitude = if x == 0.0 { 0.0 } else { x.abs().log10().floor() };
    if (-5.0..15.0).contains(&magnitude) {
        format!("{x:.*}", (5.0 - magnitude).max(0.0) as usize)
    } else {
        format!("{x:.5e}")
    }
}

pub(super) fn short(v: DVec3) -> String {
    v.to_array().map(digits).join(", ")
}
