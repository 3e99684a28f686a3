//! Joins shader files: a line `#import kernel/NAME` stands for that file, each file once; `#import map`
//! for the kind of shadow map that lookups read, `#import media` for the kind of media that rays cross,
//! `#import density` for how a plain volume's voxels are stored, `#import fields` for how many grids a mixture has.

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

/// `root` with all that it imports in front of it, imports first.
///
/// # Errors
/// If it imports a file that does not exist.
pub fn linked(root: &str, map: MapKind, media: MediaKind) -> Result<String> {
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

fn joined(root: &str, kinds: Kinds) -> Result<String> {
    let mut text = String::new();
    append(root, kinds, &mut Vec::new(), &mut text)?;
    Ok(text)
}

/// The WGSL that another wgpu program puts in front of its own shaders to shade its objects with a
/// shadow map: `shadow_at(world: vec3<f32>) -> f32` is the transmittance from the light. Its bindings are
/// in bind group `group`: 0 the uniform buffer ([`super::GpuFrame::buffer`]); for a threshold map 3, the
/// map ([`super::GpuMap::view`], a `texture_2d<f32>` that need not be filterable); for a fragment map 5,
/// 6 and 7, read-only storage buffers ([`super::GpuFragments`]: runs, nodes, links).
///
/// # Errors
/// Never with the shaders that the crate is built with.
pub fn shadow_wgsl(group: u32, map: MapKind) -> Result<String> {
    // Other programs need not bind what passes work out for each other.
    let map = if map == MapKind::Threshold { "map/threshold" } else { "map/fragments" };
    let text = joined("#import kernel/shadow\n", Kinds { map, media: MediaKind::Plain })?;
    Ok(text.replace("@group(0)", &format!("@group({group})")))
}

fn append<'a>(
    source: &'a str,
    kinds: Kinds,
    done: &mut Vec<&'a str>,
    text: &mut String,
) -> Result<()> {
    for line in source.lines() {
        let Some(name) = line.strip_prefix("#import ") else {
            text.push_str(line);
            text.push('\n');
            continue;
        };
        let name = kinds.file(name);
        if done.contains(&name) {
            continue;
        }
        done.push(name);
        let file = FILES.iter().find(|(file, _)| *file == name);
        let (_, source) =
            file.ok_or_else(|| Error::value("shader", format!("no file '{name}' to import")))?;
        append(source, kinds, done, text)?;
    }
    Ok(())
}
