//! Work in a browser, where a program has one thread.

use js_sys::{Function, Promise};
use wasm_bindgen::JsCast;
use wasm_bindgen_futures::JsFuture;

/// Does `work` at once: there is no thread for it.
///
/// # Errors
/// None.
pub fn start(_name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    work();
    Ok(())
}

/// Lets the browser go on, so that a worker hears what it is told meanwhile.
pub async fn pause() {
    sleep(0).await;
}

/// Waits for a number of milliseconds.
pub async fn sleep(milliseconds: i32) {
    let global = js_sys::global();
    let promise = Promise::new(&mut |resolve: Function, _| {
        // Pages and workers have it under the same name, in different classes.
        let timer = js_sys::Reflect::get(&global, &"setTimeout".into());
        if let Some(timer) = timer.ok().and_then(|timer| timer.dyn_into::<Function>().ok()) {
            let _ = timer.call2(&global, &resolve, &milliseconds.into());
        }
    });
    let _ = JsFuture::from(promise).await;
}
