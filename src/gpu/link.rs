//! Joins shader files. A line `#import kernel/NAME` includes that file; each file is included once.
//! `#import map` includes the file for the kind of shadow map, `#import media` that for the kind of
//! media, `#import density` that for the storage of a plain volume's voxels, `#import fields` that
//! for the number of grids in a mixture, and `#import pieces` and `#import layers` those
//! for surfaces, or for none.

use super::source::source;
use crate::error::{Error, Result};
use crate::settings::MapKind;

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        [$(($name, source!($name))),*]
    };
}

/// The files that can be imported.
pub(super) const FILES: [(&str, &str); 45] = files![
    "kernel/blocks",
    "kernel/casting",
    "kernel/coverage",
    "kernel/curves",
    "kernel/density",
    "kernel/fitting",
    "kernel/fragments",
    "kernel/frame",
    "kernel/heads",
    "kernel/layers",
    "kernel/light",
    "kernel/lists",
    "kernel/march",
    "kernel/media",
    "kernel/medium",
    "kernel/nested",
    "kernel/nested_fit",
    "kernel/no_layers",
    "kernel/no_pieces",
    "kernel/occupancy",
    "kernel/pieces",
    "kernel/raster",
    "kernel/ray",
    "kernel/seeing",
    "kernel/seen",
    "kernel/shadow",
    "kernel/slices",
    "kernel/sorted_lists",
    "kernel/sorting",
    "kernel/surface",
    "kernel/surfaces",
    "kernel/threshold",
    "kernel/tile",
    "kernel/tone",
    "kernel/triangle",
    "kernel/view",
    "map/curves",
    "map/fragments",
    "map/nested",
    "map/texels",
    "map/threshold",
    "media/fields",
    "media/mixture",
    "media/one_field",
    "media/plain",
];

/// The kind of media, which selects shader files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MediaKind {
    /// One volume whose extinction is its density times a constant.
    Plain,
    /// The same, stored in blocks.
    Blocks,
    /// A mixture of a single grid: one volume with a transfer function, or with emission over its
    /// own values.
    OneField,
    /// Everything else.
    Mixed,
}

/// What the names that stand for several files refer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Imports {
    /// The kind of shadow map that is looked up.
    pub map: MapKind,
    /// The kind of media.
    pub media: MediaKind,
    /// Whether there are surfaces among the media.
    pub surfaces: bool,
}

/// Joined shader files, with the origin of each line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Linked {
    /// The joined text, imports first.
    pub text: String,
    /// For each line, the name of its file (empty for the root) and its line number there, from 1.
    lines: Vec<(&'static str, usize)>,
}

impl Linked {
    /// The origin of line `number` of the text, counted from 1: its file below `shaders` without
    /// ending (empty for the root), and its line number there.
    pub fn place(&self, number: usize) -> Option<(&'static str, usize)> {
        self.lines.get(number.checked_sub(1)?).copied()
    }

    /// A compiler's message on the text, with the original file and line added behind each line
    /// number that it mentions; `root` is the root's name.
    pub fn explained(&self, root: &str, message: &str) -> String {
        let number = message.split("wgsl:").nth(1).and_then(|rest| rest.split(':').next());
        match number.and_then(|number| number.parse().ok()).and_then(|number| self.place(number)) {
            Some(("", line)) => format!("shaders/{root}.wgsl, line {line}: {message}"),
            Some((file, line)) => format!("shaders/{file}.wgsl, line {line}: {message}"),
            None => message.to_owned(),
        }
    }
}

/// `root` with everything that it imports in front of it.
///
/// # Errors
/// If it imports a file that does not exist.
pub fn linked(root: &str, imports: Imports) -> Result<Linked> {
    let map = match imports.map {
        MapKind::Threshold => "map/curves",
        MapKind::Coded(_) => "map/nested",
        _ => "map/fragments",
    };
    joined(root, Kinds { map, media: imports.media, surfaces: imports.surfaces })
}

/// [`Imports`] with the file of the map.
#[derive(Clone, Copy)]
struct Kinds {
    map: &'static str,
    media: MediaKind,
    surfaces: bool,
}

impl Kinds {
    /// The file that an imported name refers to.
    fn file<'a>(&self, name: &'a str) -> &'a str {
        match (name, self.media) {
            ("map", _) => self.map,
            ("pieces", _) if self.surfaces => "kernel/pieces",
            ("pieces", _) => "kernel/no_pieces",
            ("layers", _) if self.surfaces => "kernel/layers",
            ("layers", _) => "kernel/no_layers",
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

/// The shadow lookup alone, for other programs.
///
/// # Errors
/// Never with the shaders that are part of the crate.
pub(super) fn lookup(map: MapKind) -> Result<Linked> {
    // Other programs need not bind the curves that passes compute for each other.
    let map = match map {
        MapKind::Threshold => "map/threshold",
        MapKind::Coded(_) => "map/nested",
        _ => "map/fragments",
    };
    joined("#import kernel/shadow\n", Kinds { map, media: MediaKind::Plain, surfaces: false })
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
