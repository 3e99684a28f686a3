//! The program: a window, or one that nobody sees.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use deepshadow::io::{Inputs, PendingFile};
use deepshadow::{Error, Result};
use deepshadow_explorer::Explorer;
use deepshadow_explorer::host::Screen;
use deepshadow_explorer::host::offscreen::{OffScreen, save_screenshot, setup};
use deepshadow_explorer::script::{Script, Step};
use eframe::egui;

/// Turn volumes, hair and meshes and their light, and see their shadows.
#[derive(Debug, Parser)]
#[command(name = "deepshadow-explorer", version)]
struct Arguments {
    /// Preset (box, bucky, rods, clouds), volume, hair, mesh or scene file (.toml).
    input: Option<String>,
    /// File with lines that do what hands do; see the explorer's README.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Save what is seen in the end as a PNG.
    #[arg(long, value_name = "OUT.png")]
    screenshot: Option<PathBuf>,
    /// Save how long answers to drags took, as JSON.
    #[arg(long, value_name = "OUT.json")]
    times: Option<PathBuf>,
    /// Show no window, as where there is no display.
    #[arg(long)]
    off_screen: bool,
    /// Width and height of the window in points.
    #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = size)]
    size: [f32; 2],
    /// Pixels for each point of a window that nobody sees.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = scale)]
    scale: f32,
}

fn size(text: &str) -> std::result::Result<[f32; 2], String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parsed
        .filter(|size: &[u32; 2]| size.iter().all(|n| (64..=16384).contains(n)))
        .map(|size| size.map(|n| n as f32))
        .ok_or_else(|| "expected WIDTHxHEIGHT, each from 64 to 16384".to_owned())
}

fn scale(text: &str) -> std::result::Result<f32, String> {
    let parsed = text.parse().ok().filter(|x| (0.5..=4.0).contains(x));
    parsed.ok_or_else(|| "expected a number from 0.5 to 4".to_owned())
}

#[allow(clippy::print_stderr)]
fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("deepshadow-explorer: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let mut script = match &arguments.script {
        Some(path) => {
            let text = std::fs::read_to_string(path).map_err(|error| Error::file(path, error))?;
            Some(Script::parse(&text, path)?)
        }
        None => None,
    };
    if let Some(path) = &arguments.screenshot {
        if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            let path = path.display();
            return Err(Error::value("screenshot", format!("'{path}' does not end in .png")));
        }
        let script = script.get_or_insert_with(Script::nothing);
        script.then_screenshot(path.clone());
    }
    if arguments.times.is_some() {
        script.get_or_insert_with(Script::nothing);
    }
    if arguments.off_screen || (script.is_some() && !has_display()) {
        let Some(script) = script else {
            let why = "needs a script, a screenshot or times: nobody sees the window";
            return Err(Error::value("off-screen", why));
        };
        off_screen(arguments, script)
    } else {
        window(arguments, script)
    }
}

/// Whether there is a display to show a window on.
fn has_display() -> bool {
    let unix = cfg!(all(unix, not(target_vendor = "apple")));
    !unix || ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some())
}

fn no_threads(error: &std::io::Error) -> Error {
    Error::value("explorer", format!("the system starts no thread: {error}"))
}

/// Runs a script where nobody sees it.
fn off_screen(arguments: &Arguments, mut script: Script) -> Result<()> {
    let mut host = OffScreen::new(arguments.size, arguments.scale)?;
    let mut explorer = Explorer::new(&host.context, Some(&Screen(host.screen.clone())))
        .map_err(|error| no_threads(&error))?;
    if let Some(input) = &arguments.input {
        explorer.open(input);
    }
    loop {
        let step = script.step(&mut explorer)?;
        if let Step::Window(size) = step {
            host.resize(size);
        }
        let begun = Instant::now();
        let output = host.frame(Vec::new(), |ui| explorer.show(ui));
        script.measured.frames.push(begun.elapsed().as_secs_f64());
        match step {
            Step::End => break,
            Step::Screenshot(path) => {
                let inputs = explorer.inputs(script.inputs());
                save_screenshot(&host.seen(output)?, &path, &inputs)?;
            }
            Step::Go | Step::Window(_) => {}
        }
        // The engine's thread works meanwhile.
        std::thread::sleep(Duration::from_micros(200));
    }
    write_times(arguments, &script, &explorer.inputs(script.inputs()))
}

fn write_times(arguments: &Arguments, script: &Script, inputs: &Inputs) -> Result<()> {
    let Some(path) = &arguments.times else { return Ok(()) };
    let text = serde_json::to_string_pretty(&script.measured)
        .map_err(|error| Error::value("times", error.to_string()))?;
    PendingFile::create(path, inputs)?.finish_with(text.as_bytes())
}

/// The window's contents, with the script that moves them.
struct Window {
    explorer: Explorer,
    script: Option<Script>,
    /// A screenshot that was asked for.
    screenshot: Option<(PathBuf, std::sync::mpsc::Receiver<std::sync::Arc<egui::ColorImage>>)>,
    /// Where the outcome goes.
    outcome: std::sync::Arc<std::sync::Mutex<Outcome>>,
}

/// What a window leaves when it closes.
#[derive(Default)]
struct Outcome {
    error: Option<Error>,
    script: Option<Script>,
    /// What must not be written to.
    inputs: Option<Inputs>,
}

impl Window {
    fn end(&mut self, error: Option<Error>, context: &egui::Context) {
        let mut outcome = self.outcome.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        outcome.error = error;
        let script = self.script.take();
        outcome.inputs = script.as_ref().map(|script| self.explorer.inputs(script.inputs()));
        outcome.script = script;
        context.send_viewport_cmd(egui::ViewportCommand::Close);
    }

    fn step(&mut self, context: &egui::Context) {
        if let Some((path, receiver)) = &self.screenshot {
            context.request_repaint();
            let Ok(seen) = receiver.try_recv() else { return };
            let inputs = self.explorer.inputs(self.script.iter().flat_map(Script::inputs));
            let saved = save_screenshot(&seen, path, &inputs);
            self.screenshot = None;
            if let Err(error) = saved {
                return self.end(Some(error), context);
            }
        }
        let Some(script) = &mut self.script else { return };
        context.request_repaint();
        match script.step(&mut self.explorer) {
            Ok(Step::Go) => {}
            Ok(Step::Window(size)) => {
                context.send_viewport_cmd(egui::ViewportCommand::InnerSize(size.into()));
            }
            Ok(Step::Screenshot(path)) => {
                let (sender, receiver) = std::sync::mpsc::channel();
                context.request_screenshot(move |seen| _ = sender.send(seen));
                self.screenshot = Some((path, receiver));
            }
            Ok(Step::End) => self.end(None, context),
            Err(error) => self.end(Some(error), context),
        }
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.step(ui.ctx());
        let begun = Instant::now();
        self.explorer.show(ui);
        if let Some(script) = &mut self.script {
            script.measured.frames.push(begun.elapsed().as_secs_f64());
        }
    }
}

/// Shows a window until it is closed.
fn window(arguments: &Arguments, script: Option<Script>) -> Result<()> {
    let outcome = std::sync::Arc::<std::sync::Mutex<Outcome>>::default();
    let mut options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("deepshadow")
            .with_app_id("deepshadow-explorer")
            .with_inner_size(arguments.size)
            .with_drag_and_drop(true),
        // Pictures are shown as they are.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let usual = std::mem::take(&mut options.wgpu_options);
    let display = usual.wgpu_setup.clone();
    options.wgpu_options =
        eframe::egui_wgpu::WgpuConfiguration { wgpu_setup: setup(Some(display)), ..usual };
    let own = outcome.clone();
    let input = arguments.input.clone();
    let make: eframe::AppCreator<'_> = Box::new(move |creation| {
        let screen = creation.wgpu_render_state.clone().map(Screen);
        let mut explorer = Explorer::new(&creation.egui_ctx, screen.as_ref())?;
        if let Some(input) = input {
            explorer.open(&input);
        }
        Ok(Box::new(Window { explorer, script, screenshot: None, outcome: own }))
    });
    let ran = eframe::run_native("deepshadow-explorer", options, make);
    ran.map_err(|error| Error::value("window", error.to_string()))?;
    let mut outcome = outcome.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let (Some(script), Some(inputs)) = (&outcome.script, &outcome.inputs) {
        write_times(arguments, script, inputs)?;
    }
    outcome.error.take().map_or(Ok(()), Err)
}
