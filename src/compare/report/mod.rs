//! A report of all measurements of a scene: one page of HTML that needs no other file, and the
//! numbers as CSV and JSON.

mod axis;
mod curves;
mod heat;
mod labels;
mod machine;
mod page;
mod plot;
mod results;
mod tables;

use super::bench::{Bench, Row};
use super::method::Method;
use crate::error::{ErrorKind, Result};
use crate::progress::Progress;
use crate::scene::{Light, LightKind, Scene};

/// The names of a report's files: the page, the CSV and the JSON.
pub const FILES: [&str; 3] = ["report.html", "results.csv", "results.json"];

/// The measurements of one scene's maps, and the circumstances.
pub struct Report<'a> {
    /// The scene and its truth.
    pub bench: &'a Bench<'a>,
    /// The error of the map's resolution alone.
    pub floor: Row,
    /// A row for each method, by rising bytes.
    pub rows: Vec<Row>,
    about: About,
}

/// The circumstances of the measurement.
struct About {
    program: &'static str,
    date: String,
    machine: String,
    input: String,
    light: String,
    largest_optical_depth: f64,
}

impl<'a> Report<'a> {
    /// Measures the maps of all `methods`. `input` is the scene's name, for people.
    ///
    /// # Errors
    /// If one cannot be built, or if the work is cancelled.
    pub fn measure(
        bench: &'a Bench<'a>,
        methods: &[Method],
        input: &str,
        progress: &dyn Progress,
    ) -> Result<Self> {
        progress.begin("maps", methods.len() as u64 + 1);
        let floor = bench.floor()?;
        let mut rows = Vec::new();
        for method in methods {
            progress.advance(1);
            if progress.cancelled() {
                return Err(ErrorKind::Cancelled.into());
            }
            rows.push(bench.measure(method)?);
        }
        progress.advance(1);
        rows.sort_by_key(|row| row.bytes);
        let about = About {
            program: concat!("deepshadow ", env!("CARGO_PKG_VERSION")),
            date: machine::now(),
            machine: machine::processor(),
            input: input.to_owned(),
            light: light(bench.scene),
            largest_optical_depth: bench.largest_optical_depth(),
        };
        Ok(Self { bench, floor, rows, about })
    }

    /// The report as HTML.
    ///
    /// # Errors
    /// If a picture cannot be encoded.
    pub fn html(&self) -> Result<String> {
        page::html(self)
    }

    /// One line for each method; the first one is the floor.
    pub fn csv(&self) -> String {
        results::csv(self)
    }

    /// Everything except pictures and curves. JSON has no infinity, so the PSNR of equal pictures is
    /// "inf".
    pub fn json(&self) -> String {
        results::json(self)
    }
}

/// Description of the lights, for people.
fn light(scene: &Scene) -> String {
    let short = |v: glam::DVec3| format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z);
    let light = |light: &Light| match light.kind {
        LightKind::Directional { direction } => {
            format!("directional, travelling along {}", short(direction.normalize_or_zero()))
        }
        LightKind::Point { position } => format!("point at {}", short(position)),
        LightKind::Spot { position, .. } => format!("spot at {}", short(position)),
    };
    scene.lights.iter().map(light).collect::<Vec<_>>().join("; ")
}
