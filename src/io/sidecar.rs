//! Sidecars: `NAME.raw.toml` beside `NAME.raw`, `NAME.npy.toml` beside `NAME.npy`, which describe
//! what the voxels' own file cannot. Older sidecars are called `NAME.toml`. Knows no voxels.

use std::fmt::Write;
use std::io::{Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::CrcReader;
use glam::{DMat4, DVec3, IVec3};
use serde::Deserialize;

use super::dense::{DenseHeader, Lattice, Space};
use super::files;
use super::number::ValueType;
use crate::error::{Error, Result};

/// The contents of a sidecar; every key is optional.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Sidecar {
    /// Voxel counts along x, y, z.
    pub dims: Option<[usize; 3]>,
    /// Number type, such as `u8` or `f32`.
    #[serde(rename = "type")]
    pub value_type: Option<String>,
    /// Numbers per voxel, stored next to each other.
    pub components: Option<usize>,
    /// Byte order: `little` or `big`.
    pub endian: Option<String>,
    pub spacing: Option<[f64; 3]>,
    /// Transform from indices to the world: rows of a matrix for column vectors.
    pub world_from_index: Option<[[f64; 4]; 4]>,
    /// Index of the first voxel.
    pub index_origin: Option<[f64; 3]>,
    /// The value outside of the voxels, if they are part of something larger.
    pub background: Option<Background>,
    /// Slope and intercept: a value is the stored number times the first plus the second.
    pub value_scale: Option<[f64; 2]>,
    /// The coordinate system of the world, by NRRD's name, such as `left-posterior-superior`.
    pub space: Option<String>,
    /// The axis that points up, such as `z` or `-y`.
    pub up: Option<String>,
    /// The grid's name.
    pub name: Option<String>,
    /// OpenVDB's class: `level set`, `fog volume`, `staggered` or `unknown`.
    pub class: Option<String>,
    /// CRC-32 of the voxels' bytes, in hexadecimal. A sidecar of other voxels is refused.
    pub crc32: Option<String>,
    /// The sidecar of voxels that are being replaced. If a run is interrupted, the voxels match
    /// either this or the new sidecar.
    pub older: Option<Box<Self>>,
}

/// A single number, or one per component.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum Background {
    Number(f64),
    Vector(Vec<f64>),
}

impl Sidecar {
    /// The path at which the sidecar of the file `path` is written.
    pub fn path_beside(path: &Path) -> PathBuf {
        let mut name = path.as_os_str().to_owned();
        name.push(".toml");
        PathBuf::from(name)
    }

    /// The sidecar of the file `path` with its own path, if there is one.
    ///
    /// # Errors
    /// If there is one that cannot be read, or that may belong to another file.
    pub fn beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        // It lies beside a link, or else beside the link's target.
        let places = [Some(path.to_owned()), files::canonicalize(path).ok()];
        for place in places.into_iter().flatten() {
            let own = Self::path_beside(&place);
            let text = if files::is_file(&own) { Some(read(&own)?) } else { None };
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

    /// This sidecar or the older one in it, whichever describes the file `path`.
    fn of(mut self, path: &Path) -> Self {
        match self.older.take() {
            Some(older) if !self.has_voxels(path) => *older,
            _ => self,
        }
    }

    /// Whether the file `path` ends with the voxels that this sidecar describes; false if that is
    /// not known.
    fn has_voxels(&self, path: &Path) -> bool {
        let has = || {
            let number = self.value_type.as_deref()?.parse::<ValueType>().ok()?.size();
            let counts = self.dims?.into_iter().chain([self.components.unwrap_or(1), number]);
            let bytes = counts.map(|count| count as u64).try_fold(1, u64::checked_mul)?;
            let mut file = files::open(path).ok()?;
            file.seek(SeekFrom::End(-i64::try_from(bytes).ok()?)).ok()?;
            let mut read = CrcReader::new(file);
            std::io::copy(&mut read, &mut std::io::sink()).ok()?;
            Some(self.crc32 == Some(format!("{:08x}", read.crc().sum())))
        };
        has().unwrap_or(false)
    }

    /// A sidecar `NAME.toml` of the file `path`, the name that sidecars had before.
    fn older_beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        let older = path.with_extension("toml");
        if older == path || !files::is_file(&older) {
            return Ok(None);
        }
        // Nobody named this file, so it may be anything.
        let Ok(text) = read(&older) else { return Ok(None) };
        let Ok(sidecar) = Self::parse(&text) else { return Ok(None) };
        let own_ending = path.extension().unwrap_or_default();
        let other = PAYLOAD_ENDINGS.iter().filter(|&&ending| own_ending != ending).find(|ending| {
            let other = path.with_extension(ending);
            files::is_file(&other) && !files::is_file(&Self::path_beside(&other))
        });
        match other {
            // NumPy's files describe themselves, so the sidecar belongs to the other file.
            Some(_) if own_ending == "npy" => return Ok(None),
            Some(&"npy") | None => {}
            Some(ending) => {
                let (this, other) = (path.display(), path.with_extension(ending));
                let own = Self::path_beside(path);
                let why = format!(
                    "it may describe {this} or {}; rename it to {}",
                    other.display(),
                    own.display()
                );
                return Err(Error::contents(older, why));
            }
        }
        Ok(Some((older, sidecar)))
    }

    /// Why a file `NAME.toml` that may be meant as the sidecar of `path` is not read as one.
    pub(super) fn unread_beside(path: &Path) -> Option<String> {
        let older = path.with_extension("toml");
        let text = read(&older).ok()?;
        let why = Self::parse(&text).err()?;
        let table = text.parse::<toml::Table>();
        let is_meant = table.map_or(true, |table| {
            ["dims", "type", "spacing"].iter().any(|key| table.contains_key(*key))
        });
        is_meant.then(|| format!("{} is not read as a sidecar: {why}", older.display()))
    }

    /// Parses the text of a sidecar; the error says why it is not one.
    fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.message().replace('\n', " "))
    }

    /// Checks that writing the sidecar of the file `path` would replace nothing but a sidecar.
    ///
    /// # Errors
    /// If there is something else in its place.
    pub fn refuse_other_beside(path: &Path) -> Result<()> {
        let beside = Self::path_beside(path);
        if files::exists(&beside) && read(&beside).map(|text| Self::parse(&text).is_ok())? {
            return Ok(());
        }
        if files::exists(&beside) {
            let why = "not a sidecar, but it has the name of the output's sidecar; left unchanged";
            return Err(Error::contents(beside, why));
        }
        Ok(())
    }

    /// Transform from voxel index to the file's own world; `None` if the sidecar has none.
    pub fn world_from_index(&self) -> Option<DMat4> {
        let origin = DVec3::from(self.index_origin.unwrap_or_default());
        Some(self.world_from_lattice()? * DMat4::from_translation(origin))
    }

    /// Transform from the indices in which `index_origin` is given.
    fn world_from_lattice(&self) -> Option<DMat4> {
        match (self.world_from_index, self.spacing) {
            (Some(rows), _) => Some(DMat4::from_cols_array_2d(&rows).transpose()),
            (None, Some(spacing)) => Some(DMat4::from_scale(spacing.into())),
            (None, None) => self.index_origin.map(|_| DMat4::IDENTITY),
        }
    }

    /// Copies into `header` what does not depend on how the voxels are stored.
    ///
    /// # Errors
    /// If `up` is not an axis, `space` is unknown or `crc32` is not a number.
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
                let why = format!("'{text}' is not one of {}", Space::names());
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

    /// Whether it can be a sidecar of voxels with this `header`, as far as its keys tell.
    pub(super) fn fits(&self, header: &DenseHeader) -> bool {
        self.dims.is_none_or(|dims| dims == header.dims)
            && self
                .value_type
                .as_deref()
                .is_none_or(|name| name.parse().ok() == Some(header.value_type))
            && self.components.is_none_or(|count| count == header.components)
    }

    /// The sidecar as TOML text.
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
    files::read_to_string(path).map_err(|error| Error::file(path, error))
}

/// Whether the text is a scene file, which is not a sidecar although it may have the same name.
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
