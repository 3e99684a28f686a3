//! Command `compare`: measures every kind of shadow map against the exact line integral, and writes
//! a report.

use std::path::{Path, PathBuf};

use clap::Args;

use super::arguments::{SourceArguments, above_0, count, size, valid};
use super::backend::BackendChoice;
use super::job::Request;
use super::print_json;
use crate::accuracy::largest_optical_depth;
use crate::compare::report::{FILES, Report};
use crate::compare::{Bench, MOST_POINTS, Method};
use crate::error::{Error, Result};
use crate::io::PendingFolder;
use crate::settings::{Filter, MapKind};

/// Defaults: texels along each edge of the maps, pixels of the pictures, and points of each place.
const MAP_SIZE: u32 = 256;
const IMAGE_SIZE: [u32; 2] = [256, 256];
const POINTS: u32 = 100_000;
/// The default seed of random numbers.
const SEED: u64 = 1;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    source: SourceArguments,
    /// Folder for the report (report.html, results.csv, results.json); the input's name with
    /// -compare in the current folder by default. An older report is replaced.
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also print the results as JSON on stdout.
    #[arg(long)]
    json: bool,
    /// Maps to compare, separated by commas: KIND, KIND:N, threshold@paper, threshold@bucket,
    /// fragments@raw, fragments@TOLERANCE, visibility@TOLERANCE; all kinds and some variants by
    /// default.
    #[arg(long, value_name = "A,B,..", value_parser = known)]
    maps: Option<String>,
    /// Texels along each edge of the maps [256].
    #[arg(long, value_name = "N", value_parser = count(4096))]
    map_size: Option<u32>,
    /// Maximum number of steps along a light ray [512].
    #[arg(long, value_name = "N", value_parser = count(1 << 20))]
    steps: Option<u32>,
    /// How texels are combined: bilinear, nearest, pcf3, pcf5, pcf7 [bilinear].
    #[arg(long, value_name = "HOW", value_parser = valid::<Filter>)]
    filter: Option<String>,
    /// Random points of each kind [100000].
    #[arg(long, value_name = "N", value_parser = count(MOST_POINTS as i64))]
    points: Option<u32>,
    /// Seed of the random numbers [1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Picture size in pixels [256x256].
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Scale the extinction so that the largest optical depth over the map is X.
    #[arg(long, value_name = "X", value_parser = above_0, allow_negative_numbers = true)]
    depth: Option<f64>,
}

fn known(text: &str) -> Result<String, String> {
    Method::list(text).map(|_| text.to_owned()).map_err(|error| error.to_string())
}

impl Arguments {
    /// The requested number of threads.
    pub(super) fn threads(&self) -> Option<u32> {
        self.source.threads
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let mut methods = match &arguments.maps {
        Some(labels) => Method::list(labels)?,
        None => Method::all(),
    };
    let path = arguments.out.clone().unwrap_or_else(|| default_folder(&arguments.source.input));
    let request = open(arguments)?;
    let folder = PendingFolder::create(&path, &FILES, &request.inputs)?;
    let mut job = request.load()?;
    if arguments.maps.is_none() && !job.scene.surfaces.is_empty() {
        job.note("grids of meshes and hair are not built, and not compared");
        methods.retain(|method| !matches!(method.kind, MapKind::Grid(_)));
    }
    let settings = job.settings.clone();
    if let Some(depth) = arguments.depth {
        let beams = job.scene.beams()?.into_iter();
        let deepest = beams.map(|beam| largest_optical_depth(&beam, settings.map.size));
        let scale = depth / deepest.fold(0.0, f64::max);
        if !(scale.is_finite() && scale > 0.0) {
            let why = "no light ray through the map meets a medium to scale";
            return Err(Error::value("depth", why));
        }
        for medium in job.scene.media.mediums_mut() {
            medium.density_scale *= scale;
        }
        if let Some(body) = job.scene.media.first() {
            let scaled = body.medium.density_scale;
            job.note(&format!("density scale {scaled} (--depth {depth})"));
        }
    }
    let count = u64::from(arguments.points.unwrap_or(POINTS));
    let seed = arguments.seed.unwrap_or(SEED);
    let bench = Bench::new(&job.scene, &settings, [count, seed], &*job.progress)?;
    let report = Report::measure(&bench, &methods, &arguments.source.input, &*job.progress)?;
    let (html, csv, json) = (report.html()?, report.csv(), report.json());
    folder.finish_with(&[html.as_bytes(), csv.as_bytes(), json.as_bytes()])?;
    job.note(&format!("wrote {}: {} maps", path.display(), report.rows.len()));
    if arguments.json { print_json(&json) } else { Ok(()) }
}

fn open(arguments: &Arguments) -> Result<Request<'_>> {
    Request::open(&arguments.source, BackendChoice::Cpu, |file| {
        file.shadow.size = Some(arguments.map_size.unwrap_or(MAP_SIZE));
        let [width, height] = arguments.size.unwrap_or(IMAGE_SIZE);
        (file.image.width, file.image.height) = (Some(width), Some(height));
        if let Some(steps) = arguments.steps {
            file.shadow.steps = Some(steps);
        }
        if let Some(filter) = &arguments.filter {
            file.shadow.filter = Some(filter.clone());
        }
    })
}

fn default_folder(input: &str) -> PathBuf {
    let mut name = Path::new(input).file_stem().unwrap_or_default().to_owned();
    name.push("-compare");
    PathBuf::from(name)
}
