//! Scripts: lines that do what hands do, so that windows can be tested, measured and pictured.
//!
//! ```text
//! open clouds              # as on the command line
//! window 1280 800          # points
//! drag camera 0.4 0.1 20   # shares of the picture's height, in 20 steps, each answered
//! drag light -0.3 0.2 20
//! pan 0.1 0  |  zoom 1.5  |  frame  |  look from light
//! set shadow.map "nested"  # any key of a scene file
//! unset shadow.map
//! device cpu  |  budget 33  |  panels off  |  theme light  |  help on
//! section Picture          # opens a section of the panels
//! compare on  |  wiper 0.4  |  heat on  |  curves 0.5 0.6  |  all kinds on
//! frame 12                 # of a sequence
//! wait                     # until everything is drawn as render draws it
//! screenshot FILE.png  |  picture FILE.png  |  scene FILE.toml
//! ```

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use deepshadow::scene::SceneFile;
use deepshadow::{Error, Result};
use eframe::egui;

use crate::engine::{Device, Times};
use crate::explorer::Explorer;
use crate::hands;
use crate::view::turn_light;

/// A line of a script.
#[derive(Clone, Debug, PartialEq)]
enum Line {
    Open(String),
    Window([f32; 2]),
    Drag { of_light: bool, by: [f64; 2], steps: u32 },
    Pan([f64; 2]),
    Zoom(f64),
    Frame,
    FrameAt(i64),
    LookFromLight,
    Set(String, String),
    Unset(String),
    Device(Device),
    Budget(f64),
    Panels(bool),
    Help(bool),
    Theme(egui::Theme),
    Section(String),
    Compare(bool),
    Wiper(f32),
    Heat(bool),
    Curves([f64; 2]),
    AllKinds(bool),
    Wait,
    Screenshot(PathBuf),
    Picture(PathBuf),
    Scene(PathBuf),
}

/// How long an answer to a drag took.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Answer {
    /// What was dragged.
    pub drag: &'static str,
    /// Seconds from the drag to the picture.
    pub seconds: f64,
    /// How long its parts took.
    pub times: Times,
    /// Its width and height in pixels.
    pub size: [u32; 2],
    /// Texels along the map's edge.
    pub map_size: u32,
}

/// What a script has measured.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Measured {
    /// Seconds from the first frame to the first picture.
    pub first_picture: Option<f64>,
    /// Answers to drags, in order.
    pub answers: Vec<Answer>,
    /// Seconds that each `wait` took.
    pub waits: Vec<f64>,
    /// Seconds of the window's own frames, without the pictures.
    pub frames: Vec<f64>,
    /// What drew the last picture.
    pub device: String,
}

/// What whoever runs a script is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Draw the next frame.
    Go,
    /// Give the window another size in points.
    Window([f32; 2]),
    /// Save what is seen now.
    Screenshot(PathBuf),
    /// The script has ended.
    End,
}

/// A script that is being run.
pub struct Script {
    lines: Vec<Line>,
    next: usize,
    begun: Instant,
    /// When the current line began, and how often it was looked at.
    since: Instant,
    looks: u64,
    drag: Option<Drag>,
    /// What was measured.
    pub measured: Measured,
}

/// A drag whose steps are answered one after another.
struct Drag {
    left: u32,
    asked: Instant,
    serial: u64,
}

/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(600);

impl Script {
    /// Parses the text of the script `path`. Files in it are relative to the current folder.
    ///
    /// # Errors
    /// With the number of the first line that means nothing.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let mut lines = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let line = uncommented(line);
            if line.is_empty() {
                continue;
            }
            let parsed = parse(line);
            lines.push(
                parsed.map_err(|why| {
                    Error::contents(path, format!("line {number}: '{line}' {why}"))
                })?,
            );
        }
        Ok(Self::of(lines))
    }

    /// A script that does nothing.
    pub fn nothing() -> Self {
        Self::of(vec![Line::Wait])
    }

    fn of(lines: Vec<Line>) -> Self {
        let now = Instant::now();
        let measured = Measured::default();
        Self { lines, next: 0, begun: now, since: now, looks: 0, drag: None, measured }
    }

    /// The same script with a screenshot of everything at rest in the end.
    pub fn then_screenshot(&mut self, path: PathBuf) {
        self.lines.extend([Line::Wait, Line::Screenshot(path)]);
    }

    /// Goes on; called before every frame.
    ///
    /// # Errors
    /// If a line cannot be done, or takes longer than ten minutes.
    pub fn step(&mut self, explorer: &mut Explorer) -> Result<Step> {
        if let (None, Some(shown)) = (self.measured.first_picture, &explorer.pictures[0]) {
            self.measured.first_picture = Some(self.begun.elapsed().as_secs_f64());
            self.measured.device.clone_from(&shown.picture.device);
        }
        let Some(line) = self.lines.get(self.next).cloned() else {
            if explorer.is_writing() {
                return self.look();
            }
            if let Some(shown) = &explorer.pictures[0] {
                self.measured.device.clone_from(&shown.picture.device);
            }
            return Ok(Step::End);
        };
        let failed = |explorer: &Explorer| {
            let error = explorer.messages.iter().find(|message| message.is_error);
            error.map(|message| Error::value("script", message.text.clone()))
        };
        let step = match line {
            // Everything but these waits for a first picture if something is open.
            Line::Open(input) => {
                explorer.open(&input);
                if let Some(error) = failed(explorer) {
                    return Err(error);
                }
                Step::Go
            }
            Line::Window(size) => Step::Window(size),
            Line::Wait | Line::Screenshot(_) | Line::Picture(_) | Line::Scene(_)
                if !explorer.is_at_rest() || explorer.is_writing() || self.looks < 3 =>
            {
                if let Some(error) = failed(explorer)
                    && explorer.document.is_none()
                {
                    return Err(error);
                }
                return self.look();
            }
            Line::Wait if explorer.looks_into_something() => return self.look(),
            Line::Wait => {
                self.measured.waits.push(self.since.elapsed().as_secs_f64());
                Step::Go
            }
            Line::Screenshot(path) => Step::Screenshot(path),
            Line::Picture(path) => {
                explorer.save_picture(path);
                Step::Go
            }
            Line::Scene(path) => {
                explorer.save_scene(path);
                Step::Go
            }
            other if explorer.document.is_some() && explorer.pictures[0].is_none() => {
                let _ = other;
                return self.look();
            }
            Line::Drag { of_light, by, steps } => return self.drag(explorer, of_light, by, steps),
            other => {
                act(explorer, other)?;
                Step::Go
            }
        };
        self.next += 1;
        (self.since, self.looks) = (Instant::now(), 0);
        Ok(step)
    }

    /// Waits for another frame.
    fn look(&mut self) -> Result<Step> {
        self.looks += 1;
        if self.since.elapsed() > PATIENCE {
            return Err(Error::value("script", "waited for ten minutes"));
        }
        Ok(Step::Go)
    }

    /// One step of a drag after the other, each when the last was answered.
    fn drag(
        &mut self,
        explorer: &mut Explorer,
        of_light: bool,
        by: [f64; 2],
        steps: u32,
    ) -> Result<Step> {
        let answered = explorer.pictures[0].as_ref().filter(|shown| {
            self.drag.as_ref().is_some_and(|drag| shown.picture.serial > drag.serial)
        });
        if let (Some(shown), Some(drag)) = (answered, &self.drag) {
            let picture = &shown.picture;
            self.measured.answers.push(Answer {
                drag: if of_light { "light" } else { "camera" },
                seconds: drag.asked.elapsed().as_secs_f64(),
                times: picture.times,
                size: [picture.image.width, picture.image.height],
                map_size: picture.map_size,
            });
        } else if self.drag.is_some() {
            return self.look();
        }
        let left = self.drag.as_ref().map_or(steps, |drag| drag.left);
        if left == 0 {
            self.drag = None;
            self.next += 1;
            (self.since, self.looks) = (Instant::now(), 0);
            return Ok(Step::Go);
        }
        let share = by.map(|c| c / f64::from(steps));
        if of_light {
            turn_light(explorer, share);
        } else if let Some(scene) = explorer.scene() {
            let mut camera = scene.camera;
            hands::orbit(&mut camera, share);
            if let Some(document) = &mut explorer.document {
                document.place_camera(&camera);
            }
        }
        let serial = explorer.last_wish();
        self.drag = Some(Drag { left: left - 1, asked: Instant::now(), serial });
        self.looks += 1;
        Ok(Step::Go)
    }
}

/// A line without its comment. A `#` within quotes is none, nor one within a word.
fn uncommented(line: &str) -> &str {
    let mut quoted = false;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        match c {
            '"' | '\'' => quoted = !quoted,
            '#' if !quoted && before.is_whitespace() => return line[..at].trim(),
            _ => {}
        }
        before = c;
    }
    line.trim()
}

fn parse(line: &str) -> std::result::Result<Line, String> {
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let rest = rest.trim();
    let number =
        |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or("needs numbers");
    let numbers = |text: &str| {
        let all = text.split_whitespace().map(number);
        all.collect::<std::result::Result<Vec<f64>, _>>()
    };
    let pair = |text: &str| match numbers(text)?[..] {
        [x, y] => Ok([x, y]),
        _ => Err("needs two numbers"),
    };
    let on = |text: &str| match text {
        "on" | "" => Ok(true),
        "off" => Ok(false),
        _ => Err("needs on or off"),
    };
    let path = |text: &str| {
        if text.is_empty() { Err("needs a file") } else { Ok(PathBuf::from(text)) }
    };
    Ok(match (word, rest) {
        ("open", "") => return Err("needs an input".to_owned()),
        ("open", input) => Line::Open(input.to_owned()),
        ("window", size) => {
            let size = pair(size)?;
            if size.iter().any(|n| !(64.0..=16384.0).contains(n)) {
                return Err("needs a width and a height from 64 to 16384".to_owned());
            }
            Line::Window(size.map(|n| n as f32))
        }
        ("drag", rest) => {
            let (what, rest) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            let of_light = match what {
                "light" => true,
                "camera" => false,
                _ => return Err("drags neither camera nor light".to_owned()),
            };
            match numbers(rest)?[..] {
                [x, y] => Line::Drag { of_light, by: [x, y], steps: 1 },
                [x, y, steps] if (1.0..=1e5).contains(&steps) => {
                    Line::Drag { of_light, by: [x, y], steps: steps as u32 }
                }
                _ => return Err("needs two shares and a number of steps".to_owned()),
            }
        }
        ("pan", by) => Line::Pan(pair(by)?),
        ("zoom", by) => Line::Zoom(number(by)?),
        ("frame", "") => Line::Frame,
        ("frame", number) => {
            Line::FrameAt(number.parse().map_err(|_| "needs a frame's number".to_owned())?)
        }
        ("look", "from light") => Line::LookFromLight,
        ("set", rest) => {
            let (key, value) = rest.split_once(char::is_whitespace).ok_or("needs key and value")?;
            Line::Set(key.to_owned(), value.trim().to_owned())
        }
        ("unset", key) => Line::Unset(key.to_owned()),
        ("device", name) => {
            Line::Device(name.parse().map_err(|_| "is not one of auto, gpu, cpu".to_owned())?)
        }
        ("budget", milliseconds) => Line::Budget(number(milliseconds)?.clamp(1.0, 1e5)),
        ("panels", word) => Line::Panels(on(word)?),
        ("help", word) => Line::Help(on(word)?),
        ("theme", "light") => Line::Theme(egui::Theme::Light),
        ("theme", "dark") => Line::Theme(egui::Theme::Dark),
        ("section", name) => Line::Section(name.to_owned()),
        ("compare", word) => Line::Compare(on(word)?),
        ("wiper", share) => Line::Wiper(number(share)?.clamp(0.0, 1.0) as f32),
        ("heat", word) => Line::Heat(on(word)?),
        ("curves", at) => Line::Curves(pair(at)?),
        ("all", rest) if rest.starts_with("kinds") => {
            Line::AllKinds(on(rest.trim_start_matches("kinds").trim())?)
        }
        ("wait", "") => Line::Wait,
        ("screenshot", file) => Line::Screenshot(path(file)?),
        ("picture", file) => Line::Picture(path(file)?),
        ("scene", file) => Line::Scene(path(file)?),
        _ => return Err("is no command".to_owned()),
    })
}

/// Does what takes no time.
fn act(explorer: &mut Explorer, line: Line) -> Result<()> {
    match line {
        Line::Pan(by) => move_camera(explorer, |camera| hands::pan(camera, by)),
        Line::Zoom(by) => move_camera(explorer, |camera| hands::zoom(camera, by)),
        Line::Frame => explorer.frame(),
        Line::FrameAt(frame) => {
            let document = explorer.document.as_mut();
            let frames = document.as_ref().and_then(|document| document.frames.clone());
            match (document, frames) {
                (Some(document), Some(frames)) if frames.contains(&frame) => document.frame = frame,
                _ => return Err(Error::value("frame", format!("there is no frame {frame}"))),
            }
        }
        Line::LookFromLight => explorer.look_from_light = true,
        Line::Set(key, value) => change(explorer, &key, Some(&value))?,
        Line::Unset(key) => change(explorer, &key, None)?,
        Line::Device(device) => explorer.device = device,
        Line::Budget(milliseconds) => {
            explorer.budget = Duration::from_secs_f64(milliseconds / 1e3);
        }
        Line::Panels(on) => explorer.panels = on,
        Line::Help(on) => explorer.help = on,
        Line::Theme(theme) => explorer.context().set_theme(theme),
        Line::Section(name) => explorer.toggled.push(name),
        Line::Compare(on) => {
            let now = explorer.document.as_ref().and_then(|document| document.now().ok());
            explorer.beside = now.filter(|_| on);
            explorer.pictures[1] = None;
        }
        Line::Wiper(share) => explorer.wiper = share,
        Line::Heat(on) => (explorer.looking.heat, explorer.looking.curves) = (on, false),
        Line::Curves(at) => {
            (explorer.looking.curves, explorer.looking.heat) = (true, false);
            explorer.looking.at = Some(at);
        }
        Line::AllKinds(on) => explorer.looking.all = on,
        _ => {}
    }
    Ok(())
}

fn move_camera(explorer: &mut Explorer, change: impl FnOnce(&mut deepshadow::scene::Camera)) {
    let Some(mut camera) = explorer.scene().map(|scene| scene.camera) else { return };
    change(&mut camera);
    if let Some(document) = &mut explorer.document {
        document.place_camera(&camera);
    }
}

/// Sets a key of the scene file to a TOML value, or removes it.
fn change(explorer: &mut Explorer, key: &str, value: Option<&str>) -> Result<()> {
    let Some(document) = &mut explorer.document else {
        return Err(Error::value("script", "nothing is open"));
    };
    document.file = changed(&document.file, key, value)?;
    Ok(())
}

/// The scene file with another value of a key, such as `shadow.map`.
///
/// # Errors
/// If there is no such key, or if the value is not one of it.
pub fn changed(file: &SceneFile, key: &str, value: Option<&str>) -> Result<SceneFile> {
    let wrong = |why: String| Error::value(key, why);
    let mut table = toml::Table::try_from(file).map_err(|error| wrong(error.to_string()))?;
    let mut names: Vec<&str> = key.split('.').collect();
    let last = names.pop().unwrap_or_default();
    let mut at = &mut table;
    for name in names {
        let entry = at.entry(name).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        // The first of several tables of one name.
        let entry = match entry {
            toml::Value::Array(tables) => tables.first_mut(),
            one => Some(one),
        };
        at = entry
            .and_then(toml::Value::as_table_mut)
            .ok_or_else(|| wrong(format!("'{name}' is no table")))?;
    }
    match value {
        None => _ = at.remove(last),
        Some(value) => {
            let parsed: toml::Table = toml::from_str(&format!("value = {value}"))
                .map_err(|error| wrong(format!("'{value}': {}", error.message())))?;
            let parsed = parsed.get("value").cloned();
            let parsed = parsed.ok_or_else(|| wrong("needs a value".to_owned()))?;
            at.insert(last.to_owned(), parsed);
        }
    }
    table.try_into().map_err(|error: toml::de::Error| wrong(error.message().to_owned()))
}
