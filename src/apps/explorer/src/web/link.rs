//! The state of the page in its address: what is open, and how it is seen; no data.

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use deepshadow::scene::SceneFile;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use web_sys::File;

use crate::document::{Document, check_numbers};

/// What an address says.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct State {
    /// The name of what is open.
    pub input: String,
    /// The scene, as far as it was not chosen.
    scene: toml::Table,
    /// The frame of a sequence.
    #[serde(default)]
    frame: i64,
    /// Whether people were asked for the file.
    #[serde(skip)]
    pub asked: bool,
}

impl State {
    /// Whether these are its files.
    pub fn fits(&self, files: &[File]) -> bool {
        files.iter().any(|file| file.name() == self.input)
    }

    /// Shows a document as it says. Where its files are stays what it is.
    pub fn apply(self, document: &mut Document) {
        let Ok(mut file) = self.scene.try_into::<SceneFile>() else { return };
        if check_numbers(&file).is_err() {
            return;
        }
        let opened = &document.file;
        if file.volume.len() != opened.volume.len() {
            return;
        }
        for (table, own) in file.volume.iter_mut().zip(opened.volume.iter()) {
            table.path.clone_from(&own.path);
        }
        document.file = file;
        if document.frames.as_ref().is_some_and(|frames| frames.contains(&self.frame)) {
            document.frame = self.frame;
        }
    }
}

/// A document as a part of an address.
pub fn text_of(document: &Document) -> String {
    let Ok(scene) = toml::Table::try_from(&document.file) else { return String::new() };
    let (input, frame) = (document.input.clone(), document.frame);
    let state = State { input, scene, frame, asked: false };
    toml::to_string(&state).map_or_else(|_| String::new(), |text| URL_SAFE_NO_PAD.encode(text))
}

/// What the address says, if it says something.
pub fn of_address() -> Option<Result<State, String>> {
    let hash = web_sys::window()?.location().hash().ok()?;
    let text = hash.strip_prefix('#').filter(|text| !text.is_empty())?;
    let damaged = || "this address is damaged: it shows no scene".to_owned();
    let bytes = URL_SAFE_NO_PAD.decode(text).map_err(|_| damaged());
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).map_err(|_| damaged()));
    Some(text.and_then(|text| toml::from_str(&text).map_err(|_| damaged())))
}

/// Writes the state to the address, without another entry in the history.
pub fn write(state: &str) {
    let Some(window) = web_sys::window() else { return };
    let address = format!("#{state}");
    if let Ok(history) = window.history() {
        let _ = history.replace_state_with_url(&JsValue::NULL, "", Some(&address));
    }
}
