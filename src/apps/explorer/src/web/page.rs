//! The page: the explorer in a canvas, with its state in the address.

use std::cell::RefCell;
use std::time::Duration;

use eframe::egui;
use eframe::{App, WebOptions, WebRunner};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{File, HtmlCanvasElement};
use web_time::Instant;

use super::automation::Driver;
use super::engine::{hands, keep_module};
use super::files::take;
use super::link;
use crate::explorer::Explorer;

thread_local! {
    /// The running page.
    static RUNNER: RefCell<Option<WebRunner>> = const { RefCell::new(None) };
    /// Files that wait for the next frame.
    static FILES: RefCell<Vec<File>> = const { RefCell::new(Vec::new()) };
}

/// What is open if the address says nothing: what a browser makes in no time.
const EXAMPLE: &str = "bucky";

/// How long nothing must have changed before the address says what is seen.
const SETTLED: Duration = Duration::from_millis(400);

/// The page's contents.
pub struct Page {
    /// What they are.
    pub explorer: Explorer,
    /// What drives them, if a program does.
    pub driver: Driver,
    /// The state that the address has, and since when another one waits.
    written: String,
    changed: Option<(String, Instant)>,
    /// The scene of the address, until its files are there.
    awaited: Option<link::State>,
    /// Whether people know what draws.
    told: bool,
}

/// Frames a second of a window that a processor draws: more would take it from the worker.
const SLOW: u32 = 15;

/// Shows the explorer in the canvas with this identifier; workers run `module`.
///
/// # Errors
/// If there is no such canvas, or if the browser cannot draw into it.
pub async fn show(canvas: &str, module: JsValue, is_software: bool) -> Result<(), JsValue> {
    keep_module(module);
    let document = web_sys::window().and_then(|window| window.document());
    let canvas = document.and_then(|document| document.get_element_by_id(canvas));
    let canvas: HtmlCanvasElement = canvas.ok_or("there is no canvas")?.dyn_into()?;
    // Pictures are shown as they are.
    let max_fps = is_software.then_some(SLOW);
    let options = WebOptions { dithering: false, max_fps, ..WebOptions::default() };
    let runner = WebRunner::new();
    let make: eframe::AppCreator<'static> = Box::new(|creation| {
        let context = &creation.egui_ctx;
        context.set_fonts(fonts());
        let mut explorer = Explorer::new(context, None)?;
        let state = link::of_address();
        let mut awaited = None;
        match state {
            Some(Ok(state)) => {
                explorer.open(&state.input);
                awaited = Some(state);
            }
            Some(Err(why)) => explorer.complain(&why),
            None => explorer.open(EXAMPLE),
        }
        let driver = Driver::new(context);
        let (written, changed, told) = (String::new(), None, false);
        Ok(Box::new(Page { explorer, driver, written, changed, awaited, told }))
    });
    runner.start(canvas, options, make).await?;
    RUNNER.set(Some(runner));
    Ok(())
}

/// The fonts of latin text and of egui's own signs: for others egui asks the browser. One for code
/// would be a twentieth of all that is downloaded.
fn fonts() -> egui::FontDefinitions {
    let mut fonts = egui::FontDefinitions::empty();
    let all = [
        ("Ubuntu-Light", epaint_default_fonts::UBUNTU_LIGHT),
        ("egui-icons", epaint_default_fonts::EGUI_ICONS),
    ];
    for family in [egui::FontFamily::Proportional, egui::FontFamily::Monospace] {
        fonts.families.insert(family, all.map(|(name, _)| name.to_owned()).to_vec());
    }
    for (name, font) in all {
        fonts.font_data.insert(name.to_owned(), egui::FontData::from_static(font).into());
    }
    fonts
}

/// Takes files that people chose.
pub fn take_files(files: Vec<File>) {
    FILES.with_borrow_mut(|all| all.extend(files));
    with(|page| page.explorer.context().request_repaint());
}

/// Does something with the page, unless it is being drawn.
pub fn with<T>(work: impl FnOnce(&mut Page) -> T) -> Option<T> {
    RUNNER.with_borrow(|runner| {
        let mut page = runner.as_ref()?.app_mut::<Page>()?;
        Some(work(&mut page))
    })
}

impl App for Page {
    fn as_any_mut(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(self)
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        // What is below the window is seen where it draws nothing.
        [0.0; 4]
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let files = FILES.take();
        if !files.is_empty() {
            self.awaited = self.awaited.take().filter(|state| state.fits(&files));
            take(&mut self.explorer, files);
        }
        self.driver.step(&mut self.explorer);
        self.explorer.show(ui);
        self.recall();
        self.say_what_draws();
        self.write_address(ui.ctx());
    }
}

impl Page {
    /// Shows the scene of the address as soon as its files are open.
    fn recall(&mut self) {
        if self.explorer.is_opening() || self.awaited.is_none() {
            return;
        }
        if let Some(document) = &mut self.explorer.document {
            if let Some(state) = self.awaited.take_if(|state| state.input == document.input) {
                state.apply(document);
            }
        } else if let Some(state) = self.awaited.as_mut().filter(|state| !state.asked) {
            state.asked = true;
            self.explorer.messages.clear();
            let text = format!("drop {} here to see what this address shows", state.input);
            self.explorer.say(&text);
        }
    }

    /// Says once what draws.
    fn say_what_draws(&mut self) {
        if self.told || !self.explorer.is_drawn() || self.explorer.document.is_none() {
            return;
        }
        self.told = true;
        let text = match hands().and_then(|hands| hands.gpu()) {
            Some((name, true)) => format!("drawn by the {name}"),
            _ => "drawn by the processor: this browser offers no WebGPU with a graphics card"
                .to_owned(),
        };
        self.explorer.say(&text);
    }

    /// Keeps the state in the address.
    fn write_address(&mut self, context: &egui::Context) {
        let Some(document) = self.explorer.document.as_ref().filter(|_| self.awaited.is_none())
        else {
            return;
        };
        let state = link::text_of(document);
        if state == self.written {
            self.changed = None;
            return;
        }
        match &self.changed {
            Some((waiting, since)) if *waiting == state => {
                if since.elapsed() >= SETTLED {
                    link::write(&state);
                    (self.written, self.changed) = (state, None);
                    return;
                }
            }
            _ => self.changed = Some((state, Instant::now())),
        }
        context.request_repaint_after(SETTLED);
    }
}
