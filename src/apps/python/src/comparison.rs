//! All kinds of maps of a scene, measured against the truth.

use deepshadow::accuracy::{Errors, Place};
use deepshadow::compare::{Bench, Method, Row, check_filter};
use deepshadow::settings::MapKind;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::raised;
use crate::scene::scene_of;
use crate::work::done;

/// Measures kinds of shadow maps of a scene against the exact line integral, as the program's
/// `compare` does.
///
/// Parameters
/// ----------
/// scene : Scene, Volume, array_like, path-like, str or dict
///     As of `Scene`.
/// maps : str, optional
///     Labels separated by commas, such as "threshold,fragments@0.01"; all kinds by default.
/// map_size : int
///     Texels along each edge of the maps.
/// points : int
///     Random points of each place.
/// seed : int
///     Of the random numbers.
/// progress, **tables :
///     As of `render`; pictures have 256 x 256 pixels unless `size` is given.
///
/// Returns
/// -------
/// list of dict
///     One record for each map, by rising bytes, which pandas takes as they are: "method", "bytes",
///     "bytes_per_texel", "build_seconds", "lookup_nanoseconds"; for each place ("volume",
///     "medium", "rays", "behind") errors of transmittance such as "medium_rms"; "psnr", "ssim" and
///     "flip" of the picture. "exact texels" is the error of the resolution alone.
#[pyfunction]
#[pyo3(signature = (
    scene, *, maps = None, map_size = 256, points = 100_000, seed = 1, progress = None, **tables,
))]
#[allow(clippy::too_many_arguments)]
pub fn compare<'py>(
    scene: &Bound<'py, PyAny>,
    maps: Option<&str>,
    map_size: u32,
    points: u64,
    seed: u64,
    progress: Option<&Bound<'py, PyAny>>,
    tables: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyList>> {
    let py = scene.py();
    let given = maps.map(Method::list).transpose().map_err(raised)?;
    let usual = PyDict::new(py);
    usual.set_item("size", 256)?;
    let scene = Bound::new(py, scene_of(scene, Some(&usual))?)?;
    let request = scene_of(&scene, tables)?.request(py)?;
    let rows = done(py, progress, |watch| {
        let loaded = request.load()?;
        let settings = loaded.settings.with(|settings| settings.map.size = map_size);
        check_filter(&settings)?;
        let has_surfaces = !loaded.scene.surfaces.is_empty();
        let methods = given.unwrap_or_else(|| {
            let mut all = Method::all();
            // Grids of meshes and hair are not built.
            all.retain(|method| !(has_surfaces && matches!(method.kind, MapKind::Grid(_))));
            all
        });
        let bench = Bench::new(&loaded.scene, &settings, [points, seed], watch)?;
        watch.begin("maps", methods.len() as u64 + 1);
        let mut rows = vec![bench.floor()?];
        for method in &methods {
            if watch.cancelled() {
                return Err(deepshadow::ErrorKind::Cancelled.into());
            }
            watch.advance(1);
            rows.push(bench.measure(method)?);
        }
        rows.sort_by_key(|row| row.bytes);
        Ok(rows)
    })?;
    let records = rows.iter().map(|row| record(py, row)).collect::<PyResult<Vec<_>>>()?;
    PyList::new(py, records)
}

fn record<'py>(py: Python<'py>, row: &Row) -> PyResult<Bound<'py, PyDict>> {
    let record = PyDict::new(py);
    record.set_item("method", &row.label)?;
    record.set_item("bytes", row.bytes)?;
    record.set_item("bytes_per_texel", row.bytes_per_texel())?;
    record.set_item("build_seconds", row.build_seconds)?;
    record.set_item("lookup_nanoseconds", row.lookup_nanoseconds)?;
    for place in Place::ALL {
        let Errors { rms, bias, p999, max, visible, .. } = *row.at(place);
        let name = place.name();
        record.set_item(format!("{name}_rms"), rms)?;
        record.set_item(format!("{name}_mean"), bias)?;
        record.set_item(format!("{name}_p99_9"), p999)?;
        record.set_item(format!("{name}_max"), max)?;
        record.set_item(format!("{name}_above_1_255"), visible)?;
    }
    record.set_item("psnr", row.difference.psnr)?;
    record.set_item("ssim", row.difference.ssim)?;
    record.set_item("flip", row.difference.flip)?;
    Ok(record)
}
