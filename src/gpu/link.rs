//! Joins shader files: a line `#import kernel/NAME` stands for that file, each file once;
//! `#import map` for the kind of shadow map that lookups read, `#import media` for the kind of
//! media that rays cross, `#import density` for how a plain volume's voxels are stored,
//! `#import fields` for how many grids a mixture has.

use crate::error::{Error, Result};
use crate::settings::MapKind;

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../shaders/", $name, ".wgsl")))),*]
    };
}

/// The files that can be imported.
const FILES: [(&str, &str); 25] = files![
    "kernel/blocks",
    "kernel/curves",
    "kernel/density",
    "kernel/fitting",
    "kernel/fragments",
    "kernel/frame",
    "kernel/light",
    "kernel/lists",
    "kernel/media",
    "kernel/medium",
    "kernel/occupancy",
    "kernel/ray",
    "kernel/shadow",
    "kernel/slices",
    "kernel/threshold",
    "kernel/tile",
    "kernel/view",
    "map/curves",
    "map/fragments",
    "map/texels",
    "map/threshold",
    "media/fields",
    "media/mixture",
    "media/one_field",
    "media/plain",
];

/// What rays cross, for shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MediaKind {
    /// One volume whose extinction is its density times a number.
    Plain,
    /// The same, stored in blocks.
    Blocks,
    /// One volume and nothing but its numbers: a function of them, or light that it makes.
    OneField,
    /// Everything else.
    Mixed,
}

/// Shader files joined, and where each line comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Linked {
    /// All of them, imports first.
    pub text: String,
    /// Of each line its file's name, empty for the root's, and its number there, from 1.
    lines: Vec<(&'static str, usize)>,
}

impl Linked {
    /// Where line `number` of the text, from 1, stands: its file below `shaders`, without ending
    /// and empty for the root, and its number there.
    pub fn place(&self, number: usize) -> Option<(&'static str, usize)> {
        self.lines.get(number.checked_sub(1)?).copied()
    }

    /// What a compiler says of the text, with the places that a person can open behind the lines
    /// that it names; `root` is the root's name.
    pub fn explained(&self, root: &str, message: &str) -> String {
        let number = message.split("wgsl:").nth(1).and_then(|rest| rest.split(':').next());
        match number.and_then(|number| number.parse().ok()).and_then(|number| self.place(number)) {
            Some(("", line)) => format!("shaders/{root}.wgsl, line {line}: {message}"),
            Some((file, line)) => format!("shaders/{file}.wgsl, line {line}: {message}"),
            None => message.to_owned(),
        }
    }
}

/// `root` with all that it imports in front of it, imports first.
///
/// # Errors
/// If it imports a file that does not exist.
pub fn linked(root: &str, map: MapKind, media: MediaKind) -> Result<Linked> {
    let map = if map == MapKind::Threshold { "map/curves" } else { "map/fragments" };
    joined(root, Kinds { map, media })
}

/// What the names that stand for several files mean.
#[derive(Clone, Copy)]
struct Kinds {
    map: &'static str,
    media: MediaKind,
}

impl Kinds {
    /// The file that an imported name stands for.
    fn file<'a>(&self, name: &'a str) -> &'a str {
        match (name, self.media) {
            ("map", _) => self.map,
            ("media", MediaKind::OneField | MediaKind::Mixed) => "media/mixture",
            ("media", _) => "media/plain",
            ("fields", MediaKind::OneField) => "media/one_field",
            ("fields", _) => "media/fields",
            ("density", MediaKind::Blocks) => "kernel/blocks",
            ("density", _) => "kernel/density",
            _ => name,
        }
    }
}

fn joined(root: &str, kinds: Kinds) -> Result<Linked> {
    let mut linked = Linked::default();
    append(("", root), kinds, &mut Vec::new(), &mut linked)?;
    Ok(linked)
}

/// The WGSL that another wgpu program puts in front of its own shaders to shade its objects with a
/// shadow map: `shadow_at(world: vec3<f32>) -> f32` is the transmittance from the light. Its
/// bindings are in bind group `group`: 0 the uniform buffer ([`super::GpuFrame::buffer`]); for a
/// threshold map 3, the map ([`super::GpuMap::view`], a `texture_2d<f32>` that need not be
/// filterable); for a fragment map 5, 6 and 7, read-only storage buffers ([`super::GpuFragments`]:
/// runs, nodes, links).
///
/// # Errors
/// Never with the shaders that the crate is built with.
pub fn shadow_wgsl(group: u32, map: MapKind) -> Result<String> {
    // Other programs need not bind what passes work out for each other.
    let map = if map == MapKind::Threshold { "map/threshold" } else { "map/fragments" };
    let linked = joined("#import kernel/shadow\n", Kinds { map, media: MediaKind::Plain })?;
    Ok(linked.text.replace("@group(0)", &format!("@group({group})")))
}

fn append(
    (file, source): (&'static str, &str),
    kinds: Kinds,
    done: &mut Vec<&'static str>,
    linked: &mut Linked,
) -> Result<()> {
    for (number, line) in (1..).zip(source.lines()) {
        let Some(name) = line.strip_prefix("#import ") else {
            linked.text.push_str(line);
            linked.text.push('\n');
            linked.lines.push((file, number));
            continue;
        };
        let name = kinds.file(name);
        let imported = FILES.iter().find(|(file, _)| *file == name);
        let &(name, source) = imported
            .ok_or_else(|| Error::value("shader", format!("no file '{name}' to import")))?;
        if !done.contains(&name) {
            done.push(name);
            append((name, source), kinds, done, linked)?;
        }
    }
    Ok(())
}
