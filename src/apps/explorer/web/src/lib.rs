//! The doors between a page's JavaScript and the explorer. It knows nothing else.
#![cfg(target_family = "wasm")]

use deepshadow_explorer::host::{automation, page, work as begin};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// Shows the explorer in the canvas with this identifier; workers run `module`, this program compiled.
/// Whether a processor draws the window decides how often that is done.
#[wasm_bindgen]
pub async fn show(canvas: String, module: JsValue, is_software: bool) -> Result<(), JsValue> {
    page::show(&canvas, module, is_software).await
}

/// Begins to work for the page, in a worker.
#[wasm_bindgen]
pub fn work() -> Result<(), JsValue> {
    begin()
}

/// Begins to run a script; returns `""`, or why it cannot be run.
#[wasm_bindgen]
pub fn script(text: &str) -> String {
    automation::run_script(text)
}

/// What the last script has measured, as JSON; `null` while it runs.
#[wasm_bindgen]
pub fn outcome() -> String {
    automation::outcome()
}

/// What is seen, as JSON.
#[wasm_bindgen]
pub fn seen() -> String {
    automation::seen()
}

/// All controls as screen readers hear them, as JSON.
#[wasm_bindgen]
pub fn controls() -> String {
    automation::controls()
}

/// Presses a control, or gives it a value; returns whether there is such a control.
#[wasm_bindgen]
pub fn act(id: &str, value: Option<f64>) -> bool {
    automation::act(id, value)
}

/// The whole picture as it is shown: width, height, and bytes, red, green, blue and opacity.
#[wasm_bindgen]
pub fn pixels() -> js_sys::Array {
    let Some((width, height, bytes)) = automation::pixels() else { return js_sys::Array::new() };
    js_sys::Array::of3(&width.into(), &height.into(), &js_sys::Uint8Array::from(&bytes[..]))
}
