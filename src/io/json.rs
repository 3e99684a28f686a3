//! What JSON has no number for.

use serde_json::Value;

/// A number, or its name if JSON cannot represent it: "nan", "inf", "-inf".
pub(crate) fn number(value: f64) -> Value {
    if value.is_nan() {
        "nan".into()
    } else if value.is_infinite() {
        if value > 0.0 { "inf".into() } else { "-inf".into() }
    } else {
        value.into()
    }
}
