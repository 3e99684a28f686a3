//! Sidecars: `NAME.raw.toml` beside `NAME.raw`, `NAME.npy.toml` beside `NAME.npy`, which say what
//! the voxels' own file cannot. Older ones are called `NAME.toml`. Knows no voxels.

use std::fmt::Write;
use std::fs;
use std::io::{Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::CrcReader;
use glam::{DMat4, DVec3, IVec3};
use serde::Deserialize;

use super::dense::{DenseHeader, Lattice, Space};
use super::number::ValueType;
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
    /// CRC-32 of the voxels' bytes, in hexadecimal: a sidecar of other voxels is refused.
    pub crc32: Option<String>,
    /// That of the voxels which are being replaced: what an ended run leaves speaks of them, or of
    /// the new ones.
    pub older: Option<Box<Self>>,
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
    /// Where the sidecar of the file `path` is written.
    pub fn path_beside(path: &Path) -> PathBuf {
        let mut name = path.as_os_str().to_owned();
        name.push(".toml");
        PathBuf::from(name)
    }

    /// The sidecar of the file `path`, if there is one, and its own path.
    ///
    /// # Errors
    /// If there is one that cannot be read, or that may as well be another file's.
    pub fn beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        // Beside a link, or else beside what it leads to.
        let places = [Some(path.to_owned()), path.canonicalize().ok()];
        for place in places.into_iter().flatten() {
            let own = Self::path_beside(&place);
            let text = if own.is_file() { Some(read(&own)?) } else { None };
            if let Some(text) = text.filter(|text| !is_scene(text)) {
                let sidecar = Self::parse(&text).map_err(|why| Error::contents(&own, why))?;
                return Ok(Some((own, sidecar.of(&place))));
            }
            if let Some(found) = Self::older_beside(&place)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Of this one and the older one in it, that of the file `path`.
    fn of(mut self, path: &Path) -> Self {
        match self.older.take() {
            Some(older) if !self.has_voxels(path) => *older,
            _ => self,
        }
    }

    /// Whether the file `path` ends with the voxels that this is of; unknown is no.
    fn has_voxels(&self, path: &Path) -> bool {
        let has = || {
            let number = self.value_type.as_deref()?.parse::<ValueType>().ok()?.size();
            let counts = self.dims?.into_iter().chain([self.components.unwrap_or(1), number]);
            let bytes = counts.map(|count| count as u64).try_fold(1, u64::checked_mul)?;
            let mut file = fs::File::open(path).ok()?;
            file.seek(SeekFrom::End(-i64::try_from(bytes).ok()?)).ok()?;
            let mut read = CrcReader::new(file);
            std::io::copy(&mut read, &mut std::io::sink()).ok()?;
            Some(self.crc32 == Some(format!("{:08x}", read.crc().sum())))
        };
        has().unwrap_or(false)
    }

    /// A sidecar `NAME.toml` of the file `path`, as they were called before.
    fn older_beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        let older = path.with_extension("toml");
        if older == path || !older.is_file() {
            return Ok(None);
        }
        let text = read(&older)?;
        if is_scene(&text) {
            return Ok(None);
        }
        let own_ending = path.extension().unwrap_or_default();
        let other = PAYLOAD_ENDINGS.iter().filter(|&&ending| own_ending != ending).find(|ending| {
            let other = path.with_extension(ending);
            other.is_file() && !Self::path_beside(&other).is_file()
        });
        match other {
            // NumPy's files say what they hold; what else lies there needs the sidecar.
            Some(_) if own_ending == "npy" => return Ok(None),
            Some(&"npy") | None => {}
            Some(ending) => {
                let (this, other) = (path.display(), path.with_extension(ending));
                let own = Self::path_beside(path);
                let why = format!(
                    "it may describe {this} or {}; call it {}",
                    other.display(),
                    own.display()
                );
                return Err(Error::contents(older, why));
            }
        }
        let sidecar = Self::parse(&text).map_err(|why| Error::contents(&older, why))?;
        Ok(Some((older, sidecar)))
    }

    /// What the text of a sidecar says; else why it is none.
    fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.message().replace('\n', " "))
    }

    /// Makes sure that the sidecar of the file `path` would replace nothing but a sidecar.
    ///
    /// # Errors
    /// If there is something else in its place.
    pub fn refuse_other_beside(path: &Path) -> Result<()> {
        let beside = Self::path_beside(path);
        if beside.exists() && read(&beside).map(|text| Self::parse(&text).is_ok())? {
            return Ok(());
        }
        if beside.exists() {
            let why = "no sidecar, where that of the output belongs; left as it is";
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
    /// If `up` is no axis, `space` no space or `crc32` no number.
    pub(super) fn describe(&self, header: &mut DenseHeader) -> Result<()> {
        header.crc32 = match &self.crc32 {
            Some(text) => Some(u32::from_str_radix(text, 16).map_err(|_| {
                Error::value(
                    "crc32",
                    format!("'{text}' is not a number of up to 8 hexadecimal digits"),
                )
            })?),
            None => None,
        };
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

    /// Whether it can be a sidecar of voxels with this `header`, as far as it says.
    pub(super) fn fits(&self, header: &DenseHeader) -> bool {
        self.dims.is_none_or(|dims| dims == header.dims)
            && self.value_type.as_deref().is_none_or(|name| name == header.value_type.name())
            && self.components.is_none_or(|count| count == header.components)
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
        line("crc32", quoted(&self.crc32));
        if let Some(older) = &self.older {
            let _ = write!(text, "[older]\n{}", older.text());
        }
        text
    }
}

/// Endings of files that a sidecar called `NAME.toml` may describe.
const PAYLOAD_ENDINGS: [&str; 5] = ["raw", "npy", "bin", "dat", "img"];

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).map_err(|error| Error::file(path, error))
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
