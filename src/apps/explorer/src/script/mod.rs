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

mod act;
mod line;

use std::path::{Path, PathBuf};
use std::time::Duration;

use act::act;
pub use act::changed;
use deepshadow::{Error, Result};
use line::{Line, parse, uncommented};
use web_time::Instant;

use crate::engine::Times;
use crate::explorer::Explorer;
use crate::hands;
use crate::view::turn_light;

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
    /// Seconds that the window's contents took in each frame, without the pictures.
    pub frames: Vec<f64>,
    /// Seconds from the beginning of each frame to that of the next.
    pub intervals: Vec<f64>,
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
    /// Its name.
    path: PathBuf,
    /// Numbers of lines in the file, and what they say.
    lines: Vec<(usize, Line)>,
    next: usize,
    begun: Instant,
    /// When the current line began, and how often it was looked at.
    since: Instant,
    looks: u64,
    /// When the last frame began.
    framed: Instant,
    drag: Option<Drag>,
    /// What was measured.
    pub measured: Measured,
}

/// What the window says that went wrong.
fn complaint(explorer: &Explorer) -> Option<Error> {
    let error = explorer.messages.iter().find(|message| message.is_error);
    error.map(|message| Error::value("explorer", message.text.clone()))
}

/// A drag whose steps are answered one after another.
struct Drag {
    left: u32,
    asked: Instant,
    serial: u64,
}

/// How long anything may take.
const PATIENCE: Duration = Duration::from_mins(10);

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
            let wrong = |why| Error::contents(path, format!("line {number}: '{line}' {why}"));
            lines.push((number, parsed.map_err(wrong)?));
        }
        Ok(Self::of(path, lines))
    }

    /// A script that does nothing.
    pub fn nothing() -> Self {
        Self::of(Path::new("explorer"), vec![(0, Line::Wait)])
    }

    fn of(path: &Path, lines: Vec<(usize, Line)>) -> Self {
        let now = Instant::now();
        let measured = Measured::default();
        let (begun, since, framed) = (now, now, now);
        let path = path.to_owned();
        Self { path, lines, next: 0, begun, since, looks: 0, framed, drag: None, measured }
    }

    /// The same script with a screenshot of everything at rest in the end.
    pub fn then_screenshot(&mut self, path: PathBuf) {
        self.lines.extend([(0, Line::Wait), (0, Line::Screenshot(path))]);
    }

    /// The files that it reads and must not write.
    pub fn inputs(&self) -> [PathBuf; 1] {
        [self.path.clone()]
    }

    /// Goes on; called before every frame.
    ///
    /// # Errors
    /// With the number of the line, if one cannot be done or takes longer than ten minutes, or if the
    /// window says that something went wrong.
    pub fn step(&mut self, explorer: &mut Explorer) -> Result<Step> {
        self.measured.intervals.push(self.framed.elapsed().as_secs_f64());
        self.framed = Instant::now();
        if let (None, Some(shown)) = (self.measured.first_picture, explorer.shown()) {
            self.measured.first_picture = Some(self.begun.elapsed().as_secs_f64());
            self.measured.device.clone_from(&shown.picture.device);
        }
        let at = self.next;
        self.do_line(explorer).map_err(|error| {
            // Lines that stand in no file have no number.
            match self.lines.get(at).or(self.lines.last()) {
                Some((number @ 1.., _)) => {
                    Error::contents(&self.path, format!("line {number}: {error}"))
                }
                _ => error,
            }
        })
    }

    /// Does the next line, or a part of it.
    fn do_line(&mut self, explorer: &mut Explorer) -> Result<Step> {
        if explorer.is_opening() {
            return self.look();
        }
        let Some((_, line)) = self.lines.get(self.next).cloned() else {
            return self.end(explorer);
        };
        let waits =
            matches!(line, Line::Wait | Line::Screenshot(_) | Line::Picture(_) | Line::Scene(_));
        let still = explorer.is_at_rest() && !explorer.is_writing() && self.looks >= 3;
        let seen = explorer.document.is_none() || explorer.shown().is_some();
        let step = match line {
            // Everything but these waits for a first picture if something is open.
            Line::Open(input) => {
                explorer.open(&input);
                Step::Go
            }
            Line::Window(size) => Step::Window(size),
            _ if waits && !still => return self.look(),
            // What went wrong would go on.
            _ if waits && explorer.document.is_none() && complaint(explorer).is_some() => {
                return self.end(explorer);
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
            _ if !seen => return self.look(),
            Line::Drag { of_light, by, steps } => return self.drag(explorer, of_light, by, steps),
            Line::Set(..) | Line::Unset(_) => {
                act(explorer, line)?;
                // Those that follow each other count together.
                while let Some((_, more @ (Line::Set(..) | Line::Unset(_)))) =
                    self.lines.get(self.next + 1).cloned()
                {
                    self.next += 1;
                    act(explorer, more)?;
                }
                Step::Go
            }
            other => {
                act(explorer, other)?;
                Step::Go
            }
        };
        self.next += 1;
        (self.since, self.looks) = (Instant::now(), 0);
        Ok(step)
    }

    /// Ends when everything is written, with what went wrong.
    fn end(&mut self, explorer: &Explorer) -> Result<Step> {
        if explorer.is_writing() {
            return self.look();
        }
        if let Some(shown) = explorer.shown() {
            self.measured.device.clone_from(&shown.picture.device);
        }
        complaint(explorer).map_or(Ok(Step::End), Err)
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
        let answered = explorer.shown().filter(|shown| {
            self.drag.as_ref().is_some_and(|drag| shown.picture.serial > drag.serial)
        });
        if let (Some(shown), Some(drag)) = (answered, &self.drag) {
            let picture = &shown.picture;
            let answered_after = shown.since.unwrap_or_else(Instant::now) - drag.asked;
            self.measured.answers.push(Answer {
                drag: if of_light { "light" } else { "camera" },
                seconds: answered_after.as_secs_f64(),
                times: picture.times,
                size: picture.size,
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
