//! Material files of `.obj`: their names, and the materials in them. Knows no geometry.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use glam::DVec3;

use super::input::Input;
use crate::error::Result;
use crate::error::memory;
use crate::io::files;
use crate::surface::Material;

/// The most files that are looked for.
const MOST_FILES: usize = 100;

/// Memory of a material with its name, roughly.
const MATERIAL_BYTES: u64 = 256;

/// The first word of a line, and what follows it.
pub(super) fn split(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    let (word, rest) = line.split_at(end);
    (word, rest.trim_ascii_start())
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A number, if the word is one.
pub(super) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The material files that an `.obj` names, one list for each `mtllib`. A name may have spaces, or
/// be one of several; that which exists decides.
pub(super) fn libraries(input: &Input, bytes: &[u8]) -> Result<Vec<Vec<PathBuf>>> {
    let mut seen = HashSet::new();
    let mut found = Vec::new();
    for line in bytes.split(|&byte| byte == b'\n') {
        let (word, rest) = split(line);
        let rest = rest.trim_ascii_end();
        if word != b"mtllib" || rest.is_empty() || !seen.insert(rest) {
            continue;
        }
        if seen.len() > MOST_FILES {
            return Err(input.bad(format!("it names more than {MOST_FILES} material files")));
        }
        let place = |name: &[u8]| {
            let folder = input.path.parent().unwrap_or_else(|| "".as_ref());
            let file = folder.join(text(name));
            // Some programs of Windows write its separators.
            if files::exists(&file) { file } else { folder.join(text(name).replace('\\', "/")) }
        };
        let whole = place(rest);
        found.push(if files::exists(&whole) {
            vec![whole]
        } else {
            words(rest).take(MOST_FILES).map(place).collect()
        });
    }
    Ok(found)
}

/// Materials by name.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) list: Vec<Material>,
    by_name: HashMap<Vec<u8>, u32>,
    /// How many are used, but defined nowhere.
    undefined: usize,
    textured: usize,
    clamped: usize,
}

impl Materials {
    /// Reads the files that an `.obj` of these bytes names. Those that cannot be read get a note.
    pub(super) fn of(input: &mut Input, bytes: &[u8]) -> Result<Self> {
        let mut materials = Self::default();
        for file in libraries(input, bytes)?.into_iter().flatten() {
            match input.whole(&file) {
                Ok(text) => materials.read(input, &text)?,
                Err(error) => input.notes.push(format!("no materials from {error}")),
            }
        }
        Ok(materials)
    }

    fn read(&mut self, input: &mut Input, bytes: &[u8]) -> Result<()> {
        let mut current = None;
        // `d` and `Tr` say the same; where both stand, `Tr` is the one that programs get wrong.
        let (mut has_dissolve, mut has_texture) = (false, false);
        for line in bytes.split(|&byte| byte == b'\n') {
            let (word, rest) = split(line);
            if word == b"newmtl" {
                current = Some(self.define(input, rest.trim_ascii_end())? as usize);
                (has_dissolve, has_texture) = (false, false);
                continue;
            }
            let Some(material) = current.and_then(|index: usize| self.list.get_mut(index)) else {
                continue;
            };
            let mut values = words(rest).map_while(number::<f64>).take_while(|x| x.is_finite());
            let mut in_unit = |x: f64| {
                self.clamped += usize::from(!(0.0..=1.0).contains(&x));
                x.clamp(0.0, 1.0)
            };
            match word {
                b"Kd" => {
                    // Green and blue are as red, if they are not given.
                    if let Some(r) = values.next() {
                        let mut next = || values.next().unwrap_or(r);
                        let color = DVec3::new(r, next(), next());
                        material.albedo = DVec3::from(color.to_array().map(&mut in_unit));
                    }
                }
                b"d" => {
                    if let Some(opacity) = values.next() {
                        material.opacity = in_unit(opacity);
                        has_dissolve = true;
                    }
                }
                b"Tr" if !has_dissolve => {
                    if let Some(transparency) = values.next() {
                        material.opacity = in_unit(1.0 - transparency);
                    }
                }
                b"map_Kd" | b"map_d" if !has_texture => {
                    has_texture = true;
                    self.textured += 1;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The index of the material `name`, which gets its defaults again.
    fn define(&mut self, input: &mut Input, name: &[u8]) -> Result<u32> {
        let material = Material { name: text(name), ..Material::default() };
        if let Some(&index) = self.by_name.get(name) {
            if let Some(known) = self.list.get_mut(index as usize) {
                *known = material;
            }
            return Ok(index);
        }
        input.take(MATERIAL_BYTES + 2 * name.len() as u64, "materials")?;
        memory::grow(&mut self.list, 1, "materials")?;
        let index = self.list.len() as u32;
        self.list.push(material);
        self.by_name.insert(name.to_vec(), index);
        Ok(index)
    }

    /// The index of the material `name`, which is made if no file defines it.
    pub(super) fn index(&mut self, input: &mut Input, name: &[u8]) -> Result<u32> {
        if let Some(&index) = self.by_name.get(name) {
            return Ok(index);
        }
        self.undefined += usize::from(!name.is_empty());
        self.define(input, name)
    }

    /// Says what is assumed of the materials.
    pub(super) fn note(&self, notes: &mut Vec<String>) {
        if self.undefined > 0 {
            let count = super::counted(self.undefined, "material");
            notes.push(format!("{count} in no file and taken to be light grey"));
        }
        if self.textured > 0 {
            let count = super::counted(self.textured, "texture");
            notes.push(format!("{count} not read; `Kd` and `d` count alone"));
        }
        if self.clamped > 0 {
            let count = super::counted(self.clamped, "number");
            notes.push(format!("{count} clamped to 0..1 in its materials"));
        }
    }
}
