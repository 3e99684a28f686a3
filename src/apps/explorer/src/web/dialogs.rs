//! The browser's file chooser, and names for what it saves.

use std::path::PathBuf;

use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::Closure;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{File, HtmlInputElement};

use super::engine::hands;
use super::files::keep_text;
use super::page;
use crate::explorer::{Dialog, Explorer};
use crate::output::Found;

/// What is said where a name is typed.
pub const WHERE: &str = "The browser saves it among its downloads, under this name.";

/// Asks for a file; the explorer hears the answer later.
///
/// # Errors
/// If the browser has no chooser.
pub fn ask(explorer: &Explorer, dialog: Dialog) -> Result<(), String> {
    if !matches!(dialog, Dialog::Open | Dialog::ImportTransfer) {
        // A name is all that there is to choose.
        let _ = explorer.found().send((dialog, Found::NoDialog));
        return Ok(());
    }
    let (sender, context) = (explorer.found(), explorer.context().clone());
    let chosen = move |files: Vec<File>| {
        if dialog == Dialog::Open {
            page::take_files(files);
        } else if let Some(file) = files.into_iter().next() {
            let (sender, context) = (sender.clone(), context.clone());
            spawn_local(async move {
                let path = PathBuf::from(file.name());
                let text = JsFuture::from(file.text()).await;
                if let Some(text) = text.ok().and_then(|text| text.as_string()) {
                    keep_text(&path, text);
                }
                if let Some(hands) = hands() {
                    hands.mount(&[(file.name(), file)]);
                }
                let _ = sender.send((dialog, Found::Path(Some(path))));
                context.request_repaint();
            });
        }
        context.request_repaint();
    };
    choose(dialog == Dialog::Open, chosen).ok_or_else(|| "the browser has no chooser".to_owned())
}

/// Shows the browser's chooser.
fn choose(several: bool, chosen: impl Fn(Vec<File>) + 'static) -> Option<()> {
    let document = web_sys::window()?.document()?;
    let input: HtmlInputElement = document.create_element("input").ok()?.dyn_into().ok()?;
    input.set_type("file");
    input.set_multiple(several);
    // Programs that drive pages look for it.
    input.set_id("chooser");
    input.set_hidden(true);
    if let Some(before) = document.get_element_by_id("chooser") {
        before.remove();
    }
    document.body()?.append_child(&input).ok()?;
    let own = input.clone();
    let changed = Closure::<dyn FnMut()>::new(move || {
        let files = own.files();
        let files = files.iter().flat_map(|files| (0..files.length()).filter_map(|i| files.get(i)));
        chosen(files.collect());
    });
    input.set_onchange(Some(changed.as_ref().unchecked_ref()));
    changed.forget();
    input.click();
    Some(())
}
