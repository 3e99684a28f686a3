//! What programs that drive pages may do: run scripts, use controls, and ask for what is seen.

use std::path::Path;

use eframe::egui;
use eframe::egui::accesskit::{Action, ActionData, ActionRequest, TreeId};
use serde::Serialize;

use super::controls::{Control, Controls};
use super::page::{self, Page};
use crate::explorer::Explorer;
use crate::script::{Measured, Script, Step};

/// Runs scripts in the page.
pub struct Driver {
    controls: egui::plugin::TypedPluginHandle<Controls>,
    script: Option<Script>,
    /// What the last script has measured, or why it ended.
    outcome: Option<Result<Measured, String>>,
}

/// What is seen.
#[derive(Debug, Serialize)]
struct Seen<'a> {
    is_at_rest: bool,
    is_drawn: bool,
    is_writing: bool,
    looks_into_something: bool,
    runs_script: bool,
    doing: Option<String>,
    input: Option<&'a str>,
    file: Option<toml::Table>,
    messages: Vec<(&'a str, bool)>,
    device: Option<&'a str>,
    size: Option<[u32; 2]>,
    serial: u64,
    holds_light: bool,
    panels: bool,
    frame: Option<i64>,
    difference: Option<[f64; 2]>,
    curves: Option<usize>,
}

impl Driver {
    /// For the page of this context.
    pub fn new(context: &egui::Context) -> Self {
        context.add_plugin(Controls::default());
        let controls = context.plugin::<Controls>();
        Self { controls, script: None, outcome: None }
    }

    /// Goes on with a script.
    pub fn step(&mut self, explorer: &mut Explorer) {
        let Some(script) = &mut self.script else { return };
        explorer.context().request_repaint();
        self.outcome = match script.step(explorer) {
            Ok(Step::End) => Some(Ok(script.measured.clone())),
            Ok(Step::Go) => return,
            Ok(Step::Window(_) | Step::Screenshot(_)) => {
                Some(Err("a page has neither a window nor screenshots".to_owned()))
            }
            Err(error) => Some(Err(error.to_string())),
        };
        self.script = None;
    }
}

/// Begins to run a script; `""` or why it cannot be run.
pub fn run_script(text: &str) -> String {
    let parsed = Script::parse(text, Path::new("script"));
    let begun = page::with(|page| match parsed {
        Ok(script) => {
            page.driver.outcome = None;
            page.driver.script = Some(script);
            page.explorer.context().request_repaint();
            String::new()
        }
        Err(error) => error.to_string(),
    });
    begun.unwrap_or_else(|| "the page is busy".to_owned())
}

/// What the last script has measured, as JSON; `null` while it runs.
pub fn outcome() -> String {
    let outcome = page::with(|page| match &page.driver.outcome {
        Some(Ok(measured)) => serde_json::to_string(measured),
        Some(Err(why)) => serde_json::to_string(&serde_json::json!({ "error": why })),
        None => Ok("null".to_owned()),
    });
    outcome.and_then(Result::ok).unwrap_or_else(|| "null".to_owned())
}

/// What is seen, as JSON.
pub fn seen() -> String {
    page::with(|page| {
        // What has come counts before the window is drawn with it.
        page.explorer.receive();
        let Page { explorer, driver, .. } = page;
        let shown = explorer.shown().map(|shown| &shown.picture);
        let document = explorer.document.as_ref();
        let messages = explorer.messages.iter();
        let seen = Seen {
            is_at_rest: explorer.is_at_rest(),
            is_drawn: explorer.is_drawn(),
            is_writing: explorer.is_writing(),
            looks_into_something: explorer.looks_into_something(),
            runs_script: driver.script.is_some(),
            doing: explorer.doing().map(|doing| doing.what),
            input: document.map(|document| &*document.input),
            file: document.and_then(|document| toml::Table::try_from(&document.file).ok()),
            messages: messages.map(|message| (&*message.text, message.is_error)).collect(),
            device: shown.map(|picture| &*picture.device),
            size: shown.map(|picture| picture.size),
            serial: explorer.last_wish(),
            holds_light: explorer.holds_light,
            panels: explorer.panels,
            frame: document.map(|document| document.frame),
            difference: explorer.looking.difference.as_ref().map(|(d, _)| [d.rms, d.largest]),
            curves: explorer.looking.drawn.as_ref().map(|(drawn, _)| drawn.kinds.len()),
        };
        serde_json::to_string(&seen).unwrap_or_default()
    })
    .unwrap_or_else(|| "null".to_owned())
}

/// The picture of the document as it is shown: width, height, and bytes, red, green, blue and opacity,
/// row by row.
pub fn pixels() -> Option<(u32, u32, Vec<u8>)> {
    page::with(|page| {
        page.explorer.receive();
        let picture = &page.explorer.shown()?.picture;
        let image = picture.image.as_ref()?;
        Some((image.width, image.height, image.to_srgb8(picture.tone)))
    })?
}

/// All controls, as JSON.
pub fn controls() -> String {
    let found = page::with(|page| {
        let context = page.explorer.context().clone();
        context.enable_accesskit();
        context.request_repaint();
        let scale = f64::from(context.pixels_per_point());
        let all: Vec<Control> = page.driver.controls.lock().all(scale);
        serde_json::to_string(&all).unwrap_or_default()
    });
    found.unwrap_or_else(|| "[]".to_owned())
}

/// Presses a control, or gives it a value. Returns whether there is such a control.
pub fn act(id: &str, value: Option<f64>) -> bool {
    let done = page::with(|page| {
        let mut controls = page.driver.controls.lock();
        let Some(target_node) = controls.node(id) else { return false };
        let (action, data) = match value {
            Some(value) => (Action::SetValue, Some(ActionData::NumericValue(value))),
            None => (Action::Click, None),
        };
        controls.ask(ActionRequest { action, target_tree: TreeId::ROOT, target_node, data });
        page.explorer.context().request_repaint();
        true
    });
    done.unwrap_or(false)
}
