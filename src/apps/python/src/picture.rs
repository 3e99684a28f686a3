//! Pictures of scenes.

use std::path::PathBuf;

use deepshadow::Error;
use deepshadow::image::{Exposure, Tone, ToneMap};
use deepshadow::io::{Inputs, PendingFile, PictureFormat, PictureOptions};
use deepshadow::scene::SceneFile;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::{raised, value};
use crate::numbers::{as_numpy, shape_of};
use crate::scene::{in_memory, scene_of};
use crate::work::done;

/// Renders a scene.
///
/// Parameters
/// ----------
/// scene : Scene, Volume, array_like of shape (z, y, x), path-like, str or dict
///     As of `Scene`.
/// backend : {"auto", "gpu", "cpu"}
///     A hardware GPU if there is one, any GPU, or the processor.
/// progress : callable, optional
///     Called as ``progress(what, done, total)`` while it works. If it raises, the work ends.
/// **tables :
///     Tables and short forms, as of `Scene`: ``light=(-1, -1, 0)``, ``size=512``,
///     ``camera={"azimuth_degrees": 30}``, ``shadow={"map": "threshold"}``, and ``frame=7`` of a
///     sequence.
///
/// Returns
/// -------
/// Image
#[pyfunction]
#[pyo3(signature = (scene, *, backend = "auto", progress = None, **tables))]
pub fn render(
    scene: &Bound<'_, PyAny>,
    backend: &str,
    progress: Option<&Bound<'_, PyAny>>,
    tables: Option<&Bound<'_, PyDict>>,
) -> PyResult<Image> {
    let py = scene.py();
    let scene = scene_of(scene, tables)?;
    let has_arrays = scene.has_arrays();
    let request = scene.request(py)?;
    let (picture, loaded, by) = done(py, progress, |watch| {
        let mut loaded = request.load()?;
        let backend = loaded.backend(backend, loaded.settings.map.kind)?;
        let picture = backend.render(&loaded.scene, &loaded.settings, watch)?;
        loaded.notes.extend(backend.said());
        Ok((picture, loaded, backend.description()))
    })?;
    let file = &loaded.file;
    let repeated = file.saved(&loaded.windows, &loaded.scene, &loaded.settings).map_err(raised)?;
    let [width, height] = loaded.settings.image.size;
    let flat = PyArray1::from_vec(py, picture.pixels.as_flattened().to_vec());
    let array = flat.call_method1("reshape", ((height, width, 4),))?.unbind();
    let choices = PyDict::new(py);
    for choice in &loaded.choices {
        choices.set_item(choice.what, &choice.value)?;
    }
    Ok(Image {
        array,
        choices: choices.unbind(),
        notes: loaded.notes,
        backend: by,
        exposure: file.image.exposure().map_err(raised)?,
        tone_map: file.image.tone_map().map_err(raised)?,
        repeated: if has_arrays { None } else { Some(repeated) },
        camera: loaded.scene.camera,
    })
}

/// A picture in linear light.
#[pyclass(module = "deepshadow", frozen)]
pub struct Image {
    /// Radiance R, G, B, premultiplied by opacity A: float32 of shape (height, width, 4), row 0 on
    /// top.
    #[pyo3(get)]
    array: Py<PyAny>,
    /// What was chosen for the scene, by the name of the value and the key that sets it.
    #[pyo3(get)]
    choices: Py<PyDict>,
    /// Remarks on the scene's files, one line each.
    #[pyo3(get)]
    notes: Vec<String>,
    /// What drew the picture: the processor or the graphics adapter. If a GPU failed while nobody
    /// had asked for it, that is the processor, and `notes` says why.
    #[pyo3(get)]
    backend: String,
    exposure: Exposure,
    tone_map: Option<ToneMap>,
    /// None if a volume is in memory.
    repeated: Option<SceneFile>,
    camera: deepshadow::scene::Camera,
}

#[pymethods]
impl Image {
    /// The text of a scene file (TOML) that repeats the picture, with everything that was chosen. For
    /// scenes of files: a volume in memory has no name there.
    fn to_toml(&self) -> PyResult<String> {
        let file = self.repeated.as_ref().ok_or_else(in_memory)?;
        file.to_text().map_err(raised)
    }

    /// The bytes of a PNG file.
    ///
    /// Parameters
    /// ----------
    /// exposure : float or str, optional
    ///     Factor on radiance, stops such as "+1ev", or "auto"; the scene's by default, else 1.
    /// tonemap : {"none", "aces", "agx", "khronos-neutral"}, optional
    ///     Tone curve; the scene's by default, else chosen for the picture.
    #[pyo3(signature = (*, exposure = None, tonemap = None))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        exposure: Option<&Bound<'py, PyAny>>,
        tonemap: Option<&str>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let picture = self.picture(py)?;
        let tone = self.tone(&picture, exposure, tonemap)?;
        let options = PictureOptions::new(PictureFormat::Png).with(|options| options.tone = tone);
        let bytes = done(py, None, |_| options.encode(&picture))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes the picture in the format that the ending of the name tells: .png, .jpg, .tiff and
    /// .webp for screens, .exr, .hdr and .npy with linear radiance. The file appears whole or not
    /// at all. `exposure` and `tonemap` as of `png`.
    #[pyo3(signature = (path, *, exposure = None, tonemap = None))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        exposure: Option<&Bound<'_, PyAny>>,
        tonemap: Option<&str>,
    ) -> PyResult<()> {
        let picture = self.picture(py)?;
        let tone = self.tone(&picture, exposure, tonemap)?;
        let format = PictureFormat::of_path(&path).ok_or_else(|| {
            let why = format!("a picture's name must end in one of {}", PictureFormat::names());
            raised(Error::contents(&path, why))
        })?;
        let options = PictureOptions::new(format).with(|options| {
            options.tone = tone;
            options.camera = Some(self.camera);
        });
        done(py, None, |_| {
            let file = PendingFile::create(&path, &Inputs::default())?;
            file.finish_with(&options.encode(&picture)?)
        })
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.png(py, None, None)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let picture = self.picture(py)?;
        Ok(format!("<Image {} x {} by {}>", picture.width, picture.height, self.backend))
    }

    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        as_numpy(self.array.bind(py), dtype, copy)
    }
}

impl Image {
    /// The picture of the array as it is now.
    fn picture(&self, py: Python<'_>) -> PyResult<deepshadow::Image> {
        let array = self.array.bind(py);
        let shape = shape_of(array)?;
        let [height, width, 4] = shape[..] else {
            return Err(value("array", format!("has shape {shape:?}, expected (h, w, 4)")));
        };
        let plain = py.import("numpy")?.call_method1("ascontiguousarray", (array, "f4"))?;
        let flat = plain.call_method1("reshape", (-1,))?;
        let numbers = flat.cast::<PyArray1<f32>>()?.to_vec()?;
        let pixels = numbers.as_chunks().0.to_vec();
        Ok(deepshadow::Image { width: width as u32, height: height as u32, pixels })
    }

    fn tone(
        &self,
        picture: &deepshadow::Image,
        exposure: Option<&Bound<'_, PyAny>>,
        tonemap: Option<&str>,
    ) -> PyResult<Tone> {
        let exposure = match exposure {
            None => self.exposure,
            Some(given) => {
                let text: String = given.str()?.extract()?;
                text.parse().map_err(raised)?
            }
        };
        let map = match tonemap {
            None => self.tone_map,
            Some(name) => Some(name.parse().map_err(raised)?),
        };
        Ok(Tone::for_picture(picture, exposure, map))
    }
}
