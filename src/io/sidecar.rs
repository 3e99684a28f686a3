//! Sidecars: `NAME.toml` beside `NAME.raw` or `NAME.npy`, which says what the voxels' own file cannot.
//! Knows no voxels.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3, IVec3};
use serde::Deserialize;

use super::dense::{DenseHeader, Lattice, Space};
use super::number::Endian;
use crate::error::{Error, Result};

/// What a sidecar says; every key is optional.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Sidecar {
    /// Voxels along x, y, z.
    pub dims: Option<[usize; 3]>,
    /// Number type, as `u8` or `f32`.
    #[serde(rename = "type")]
    pub value_type: Option<String>,
    /// Numbers in a voxel, beside each other.
    pub components: Option<usize>,
    /// `little` or `big`.
    pub endian: Option<String>,
    pub spacing: Option<[f64; 3]>,
    /// From indices to the world; rows, for column vectors.
    pub world_from_index: Option<[[f64; 4]; 4]>,
    /// Index of the first voxel.
    pub index_origin: Option<[f64; 3]>,
    /// The value around the voxels, where they are part of something larger.
    pub background: Option<Background>,
    /// Slope and intercept: a value is the stored number times the first plus the second.
    pub value_scale: Option<[f64; 2]>,
    /// What the world is: a name of NRRD's, as `left-posterior-superior`.
    pub space: Option<String>,
    /// The axis that points up.
    pub up: Option<String>,
    /// What the grid is called.
    pub name: Option<String>,
    /// OpenVDB's class: `level set`, `fog volume`, `staggered`, `unknown`.
    pub class: Option<String>,
}

/// A number, or one for each component.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum Background {
    Number(f64),
    Vector(Vec<f64>),
}

impl Sidecar {
    /// Where the sidecar of the file `path` lies; `None` where `path` itself ends so.
    pub fn path_beside(path: &Path) -> Option<PathBuf> {
        let beside = path.with_extension("toml");
        (beside != path).then_some(beside)
    }

    /// The sidecar of the file `path`, if there is one, and its own path.
    ///
    /// # Errors
    /// If there is one that cannot be read.
    pub fn beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        let Some(beside) = Self::path_beside(path).filter(|beside| beside.is_file()) else {
            return Ok(None);
        };
        let text = fs::read_to_string(&beside).map_err(|error| Error::file(&beside, error))?;
        if is_scene(&text) {
            return Ok(None);
        }
        let sidecar = Self::parse(&text).map_err(|why| Error::contents(&beside, why))?;
        Ok(Some((beside, sidecar)))
    }

    /// What the text of a sidecar says; else why it is none.
    fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.message().replace('\n', " "))
    }

    /// Whether the sidecar `text` says of a file's voxels what their `header` does: of their place and
    /// scale and, if `stored`, of how they lie in the file.
    pub fn agrees(text: &[u8], header: &DenseHeader, stored: bool) -> bool {
        let text = String::from_utf8_lossy(text);
        let Ok(sidecar) = Self::parse(&text) else { return false };
        let little = sidecar.endian.as_deref().is_none_or(|endian| endian == "little");
        let one_byte = header.value_type.size() == 1;
        let same_place = sidecar.world_from_index().unwrap_or(DMat4::IDENTITY)
            == header.world_from_index
            && sidecar.space.as_deref() == header.space.map(Space::name)
            && sidecar.value_scale.unwrap_or([1.0, 0.0]) == header.scale;
        let same_storage = sidecar.dims == Some(header.dims)
            && sidecar.value_type.as_deref() == Some(header.value_type.name())
            && sidecar.components.unwrap_or(1) == header.components
            && (one_byte || little == (header.endian == Endian::Little));
        same_place && (same_storage || !stored)
    }

    /// Makes sure that the sidecar of the file `path` would not replace a scene file.
    ///
    /// # Errors
    /// If it would.
    pub fn refuse_scene_beside(path: &Path) -> Result<()> {
        let Some(beside) = Self::path_beside(path) else { return Ok(()) };
        if fs::read_to_string(&beside).is_ok_and(|text| is_scene(&text)) {
            let why = "a scene file, where the sidecar of the output belongs";
            return Err(Error::contents(beside, why));
        }
        Ok(())
    }

    /// From voxel index to the file's own world; `None` if the sidecar does not say.
    pub fn world_from_index(&self) -> Option<DMat4> {
        let origin = DVec3::from(self.index_origin.unwrap_or_default());
        Some(self.world_from_lattice()? * DMat4::from_translation(origin))
    }

    /// From the indices that `index_origin` is one of.
    fn world_from_lattice(&self) -> Option<DMat4> {
        match (self.world_from_index, self.spacing) {
            (Some(rows), _) => Some(DMat4::from_cols_array_2d(&rows).transpose()),
            (None, Some(spacing)) => Some(DMat4::from_scale(spacing.into())),
            (None, None) => self.index_origin.map(|_| DMat4::IDENTITY),
        }
    }

    /// Puts into `header` what does not depend on how the voxels are stored.
    ///
    /// # Errors
    /// If `up` is no axis or `space` no space.
    pub(super) fn describe(&self, header: &mut DenseHeader) -> Result<()> {
        header.world_from_index = self.world_from_index().unwrap_or(DMat4::IDENTITY);
        let origin = DVec3::from(self.index_origin.unwrap_or_default());
        let whole = origin.as_ivec3();
        if whole.as_dvec3() == origin && whole != IVec3::ZERO {
            let world_from_index = self.world_from_lattice().unwrap_or(DMat4::IDENTITY);
            header.lattice = Some(Lattice { world_from_index, origin: whole });
        }
        if let Some(text) = &self.space {
            let Some((space, ours_from_its)) = Space::named(text) else {
                let why = format!("'{text}' is none of {}", Space::names());
                return Err(Error::value("space", why));
            };
            header.space = Some(space);
            header.world_from_index = ours_from_its * header.world_from_index;
            if let Some(lattice) = &mut header.lattice {
                lattice.world_from_index = ours_from_its * lattice.world_from_index;
            }
        }
        header.background = self.background.as_ref().map(|background| match background {
            Background::Number(number) => vec![*number; header.components.min(16)],
            Background::Vector(numbers) => numbers.clone(),
        });
        header.scale = self.value_scale.unwrap_or([1.0, 0.0]);
        header.up = self.up.as_deref().map(str::parse).transpose()?;
        header.name.clone_from(&self.name);
        header.class.clone_from(&self.class);
        Ok(())
    }

    /// The sidecar's text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |key: &str, value: Option<String>| {
            if let Some(value) = value {
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{key} = {value}");
            }
        };
        let quoted = |text: &Option<String>| text.as_deref().map(quoted);
        line("dims", self.dims.map(|dims| format!("{dims:?}")));
        line("type", quoted(&self.value_type));
        line("components", self.components.map(|count| count.to_string()));
        line("endian", quoted(&self.endian));
        line("spacing", self.spacing.map(|spacing| list(&spacing)));
        let rows = |rows: [[f64; 4]; 4]| {
            let rows: Vec<String> = rows.iter().map(|row| format!("  {},", list(row))).collect();
            format!("[ # rows, for column vectors\n{}\n]", rows.join("\n"))
        };
        line("world_from_index", self.world_from_index.map(rows));
        line("index_origin", self.index_origin.map(|origin| list(&origin)));
        let background = |background: &Background| match background {
            Background::Number(value) => number(*value),
            Background::Vector(values) => list(values),
        };
        line("background", self.background.as_ref().map(background));
        line("value_scale", self.value_scale.map(|scale| list(&scale)));
        line("space", quoted(&self.space));
        line("up", quoted(&self.up));
        line("name", quoted(&self.name));
        line("class", quoted(&self.class));
        text
    }
}

/// Whether the text is a scene file, which is no sidecar though it may have its name.
fn is_scene(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("volume"))
}

fn number(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { format!("{value:?}") }
}

fn list(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|&value| number(value)).collect();
    format!("[{}]", values.join(", "))
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
