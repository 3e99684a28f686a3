//! Command `probe`: measures the light that arrives at given points.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;

use super::arguments::{SceneArguments, above_0};
use super::job::{Request, default_output};
use crate::error::{Error, Result};
use crate::io::dense::DEFAULT_MAX_BYTES;
use crate::io::{PendingFile, encode_array, read_vectors};
use crate::probe::{Probe, ProbePoint, probe};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// NumPy file with the world positions of points, of shape (n, 3).
    #[arg(long, value_name = "P.npy", help_heading = "Light meter")]
    points: PathBuf,
    /// NumPy file with the normals of the surfaces that the points lie on, of shape (n, 3): light
    /// from behind does not arrive.
    #[arg(long, value_name = "N.npy", help_heading = "Light meter")]
    normals: Option<PathBuf>,
    /// Trace rays in double precision, in place of lookups in shadow maps.
    #[arg(long, help_heading = "Light meter")]
    exact: bool,
    /// Take the mean over a square across the ray with edges of L world lengths.
    #[arg(long, value_name = "L", value_parser = above_0, allow_negative_numbers = true, help_heading = "Light meter")]
    footprint: Option<f64>,
    /// World lengths by which points are moved towards the light [0].
    #[arg(long, value_name = "B", allow_negative_numbers = true, help_heading = "Light meter")]
    bias: Option<f64>,
    /// File to write: transmittance from each light at each point, shape (n, lights, 3), 32-bit
    /// floats [INPUT.npy in the current folder].
    #[arg(short, long, value_name = "T.npy")]
    out: Option<PathBuf>,
}

impl Arguments {
    /// The requested number of threads.
    pub(super) fn threads(&self) -> Option<u32> {
        self.scene.source.threads
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { scene, points, normals, exact, footprint, bias, out } = arguments;
    let path = out.clone().unwrap_or_else(|| default_output(&scene.source.input, "npy"));
    if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("npy")) {
        return Err(Error::value("out", format!("'{}' does not end in .npy", path.display())));
    }
    let mut request = Request::new(scene, None)?;
    request.inputs.extend([points.clone()].into_iter().chain(normals.clone()));
    let pending = PendingFile::create(&path, &request.inputs)?;
    let positions = finite(points)?;
    let directions = match normals {
        Some(normals) => {
            let directions = finite(normals)?;
            if directions.len() != positions.len() {
                let (found, due) = (directions.len(), positions.len());
                return Err(Error::contents(normals, format!("{found} normals for {due} points")));
            }
            if let Some(row) = directions.iter().position(|n| *n == [0.0; 3]) {
                return Err(Error::contents(normals, format!("row {row} has no direction")));
            }
            directions.into_iter().map(|normal| Some(DVec3::from(normal))).collect()
        }
        None => vec![None; positions.len()],
    };
    let places: Vec<ProbePoint> = positions
        .into_iter()
        .zip(directions)
        .map(|(position, normal)| ProbePoint { position: position.into(), normal })
        .collect();
    let job = request.load()?;
    let mut how = Probe::default();
    (how.exact, how.footprint) = (*exact, *footprint);
    how.bias = bias.unwrap_or(job.settings.view.bias);
    let found = probe(&job.scene, &job.settings, job.backend, &places, &how, &*job.progress)?;
    let lights = job.scene.lights.len();
    let values: Vec<f32> = found.iter().flatten().flatten().copied().collect();
    pending.finish_with(&encode_array(&[places.len(), lights, 3], values.into_iter())?)?;
    let by = if *exact { "rays in f64".to_owned() } else { job.backend.description() };
    let lights = if lights == 1 { "1 light".to_owned() } else { format!("{lights} lights") };
    job.note(&format!("wrote {}: {} points, {lights}, {by}", path.display(), places.len()));
    Ok(())
}

/// The vectors in a file.
///
/// # Errors
/// If the file cannot be read, or a number in it is not finite.
fn finite(path: &Path) -> Result<Vec<[f64; 3]>> {
    let vectors = read_vectors(path, DEFAULT_MAX_BYTES)?;
    match vectors.iter().position(|vector| !DVec3::from(*vector).is_finite()) {
        Some(i) => {
            let why = format!("row {i}, {}, is not finite", DVec3::from(vectors[i]));
            Err(Error::contents(path, why))
        }
        None => Ok(vectors),
    }
}
