//! All kinds of maps of a scene, measured against the truth.

use std::path::PathBuf;

use deepshadow::accuracy::{Errors, Place};
use deepshadow::compare::report::{FILES, Report};
use deepshadow::compare::{Bench, Method, Row};
use deepshadow::io::{Inputs, PendingFolder};
use deepshadow::settings::MapKind;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList};

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
/// Comparison
///     One record (a dict) for each map, by rising bytes: "method", "bytes",
///     "bytes_per_texel", "build_seconds", "lookup_nanoseconds"; for each place ("volume",
///     "medium", "rays", "behind") errors of transmittance such as "medium_rms"; "psnr", "ssim" and
///     "flip" of the picture. "exact texels" is the error of the resolution alone.
#[pyfunction]
#[pyo3(signature = (
    scene, *, maps = None, map_size = 256, points = 100_000, seed = 1, progress = None, **tables,
))]
#[allow(clippy::too_many_arguments)]
pub fn compare(
    scene: &Bound<'_, PyAny>,
    maps: Option<&str>,
    map_size: u32,
    points: u64,
    seed: u64,
    progress: Option<&Bound<'_, PyAny>>,
    tables: Option<&Bound<'_, PyDict>>,
) -> PyResult<Comparison> {
    let py = scene.py();
    let given = maps.map(Method::list).transpose().map_err(raised)?;
    let usual = PyDict::new(py);
    usual.set_item("size", 256)?;
    let scene = Bound::new(py, scene_of(scene, Some(&usual))?)?;
    let request = scene_of(&scene, tables)?.request(py)?;
    let found = done(py, progress, |watch| {
        let loaded = request.load()?;
        let settings = loaded.settings.with(|settings| settings.map.size = map_size);
        let has_surfaces = !loaded.scene.surfaces.is_empty();
        let methods = given.unwrap_or_else(|| {
            let mut all = Method::all();
            // Grids of meshes and hair are not built.
            all.retain(|method| !(has_surfaces && matches!(method.kind, MapKind::Grid(_))));
            all
        });
        let bench = Bench::new(&loaded.scene, &settings, [points, seed], watch)?;
        let name = loaded.scene.media.name();
        let report = Report::measure(&bench, &methods, &name, watch)?;
        let (html, csv, json) = (report.html()?, report.csv(), report.json());
        let Report { floor, rows, .. } = report;
        let mut rows: Vec<Row> = std::iter::once(floor).chain(rows).collect();
        rows.sort_by_key(|row| row.bytes);
        Ok((rows, html, csv, json))
    })?;
    let (rows, html, csv, json) = found;
    let records = rows.iter().map(|row| record(py, row)).collect::<PyResult<Vec<_>>>()?;
    Ok(Comparison { records: PyList::new(py, records)?.unbind(), html, csv, json })
}

/// Kinds of shadow maps of a scene, measured: a sequence of records, which ``pandas.DataFrame`` takes
/// as it is, and a report that notebooks show.
#[pyclass(module = "deepshadow", frozen, sequence)]
pub struct Comparison {
    records: Py<PyList>,
    /// The report: a page of HTML that needs no other file.
    #[pyo3(get)]
    html: String,
    /// The numbers as CSV.
    #[pyo3(get)]
    csv: String,
    /// The numbers as JSON.
    #[pyo3(get)]
    json: String,
}

#[pymethods]
impl Comparison {
    /// Writes the report as the program does: report.html, results.csv and results.json in the
    /// folder `path`. An older report there is replaced.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        done(py, None, |_| {
            let folder = PendingFolder::create(&path, &FILES, &Inputs::default())?;
            folder.finish_with(&[self.html.as_bytes(), self.csv.as_bytes(), self.json.as_bytes()])
        })
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.records.bind(py).len()
    }

    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        index: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.records.bind(py).as_any().get_item(index)
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        self.records.bind(py).try_iter()
    }

    /// The report in a frame, which keeps its style from the page around it.
    fn _repr_html_(&self) -> String {
        let page = self.html.replace('&', "&amp;").replace('"', "&quot;");
        format!(
            "<iframe srcdoc=\"{page}\" width=\"100%\" height=\"720\" frameborder=\"0\"></iframe>"
        )
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<Comparison of {} maps>", self.records.bind(py).len())
    }
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
