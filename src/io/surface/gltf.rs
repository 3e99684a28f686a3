//! glTF 2.0, as `.gltf` (JSON with buffers beside or within it) and `.glb` (both in one file). Units
//! are metres, y is up.
//!
//! Of the crate `gltf` only the types of the JSON are used. Its own checks refuse files that can be
//! read, and without them its accessors panic; so every index is looked up here.

use std::path::PathBuf;

use gltf::json::Root;

use super::gltf_buffers::{Buffers, file_of};
use super::gltf_scene::Assembly;
use super::input::{Input, u32_of};
use super::{name_of, without_unused};
use crate::error::Result;
use crate::error::memory;
use crate::surface::Mesh;

/// The first bytes of a `.glb` file.
pub(super) const MAGIC: &[u8] = b"glTF";

/// Keys of a document, one of which comes first.
const KEYS: [&str; 17] = [
    "accessors",
    "animations",
    "asset",
    "buffers",
    "bufferViews",
    "cameras",
    "extensions",
    "extensionsRequired",
    "extensionsUsed",
    "extras",
    "images",
    "materials",
    "meshes",
    "nodes",
    "scene",
    "scenes",
    "skins",
];

/// Required extensions that change neither positions nor the colours that are read, or are
/// supported. An ending `*` stands for anything.
const HARMLESS: [&str; 7] = [
    "EXT_texture_*",
    "KHR_animation_pointer",
    "KHR_lights_*",
    "KHR_materials_*",
    "KHR_mesh_quantization",
    "KHR_texture_*",
    "KHR_xmp*",
];

/// Extensions without which a mesh looks different, but can be read.
const MISSED: [&str; 3] =
    ["EXT_mesh_gpu_instancing", "KHR_materials_pbrSpecularGlossiness", "KHR_materials_variants"];

/// Whether a file that begins with `start` is one.
pub(super) fn recognizes(start: &[u8]) -> bool {
    if start.starts_with(MAGIC) {
        return true;
    }
    let text = String::from_utf8_lossy(without_mark(start));
    let Some(inner) = text.trim_start().strip_prefix('{') else { return false };
    let key = inner.trim_start().strip_prefix('"').and_then(|rest| rest.split('"').next());
    key.is_some_and(|key| KEYS.contains(&key)) || inner.contains("\"asset\"")
}

/// The bytes behind a byte order mark.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

pub(super) fn read(input: &mut Input) -> Result<Mesh> {
    let bytes = input.whole(input.path)?;
    let (root, bin) = document(input, &bytes)?;
    for name in MISSED.iter().filter(|name| root.extensions_used.iter().any(|one| one == *name)) {
        input.notes.push(format!("its extension {name} is not supported and ignored"));
    }
    if !root.animations.is_empty() {
        input.notes.push("its animations are ignored".to_owned());
    }
    let mut buffers = Buffers::new(&root, bin)?;
    let assembly = Assembly::of(input, &root, &mut buffers)?;
    let Assembly { positions, mut triangles, materials, material_of, normals, has_normals, .. } =
        assembly;
    let normals = has_normals.then_some(normals);
    input.take(4 * positions.len() as u64, "vertices")?;
    let positions = without_unused(positions, &mut triangles)?;
    Mesh::new(name_of(input.path), positions, triangles, materials, material_of, normals)
        .map_err(|error| input.bad(error.to_string()))
}

/// The files beside this one that hold its buffers.
pub(super) fn files(input: &mut Input) -> Result<Vec<PathBuf>> {
    let bytes = input.whole(input.path)?;
    let (root, _) = document(input, &bytes)?;
    let uris = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    uris.filter(|uri| !uri.starts_with("data:")).map(|uri| file_of(input, uri)).collect()
}

/// The JSON, and the binary chunk of a `.glb`.
fn document<'a>(input: &mut Input, bytes: &'a [u8]) -> Result<(Root, Option<&'a [u8]>)> {
    let (json, bin) =
        if bytes.starts_with(MAGIC) { chunks(input, bytes)? } else { (without_mark(bytes), None) };
    let needed = json_bytes(json);
    input.take(needed, "JSON")?;
    memory::check(needed, "JSON")?;
    let root = Root::from_slice(json).map_err(|error| input.bad(format!("its JSON: {error}")))?;
    let version = &root.asset.version;
    if !version.starts_with("2.") {
        return Err(input.bad(format!("glTF of version {version}, but only 2 is supported")));
    }
    let harmless = |name: &str| {
        HARMLESS.iter().any(|known| match known.strip_suffix('*') {
            Some(start) => name.starts_with(start),
            None => name == *known,
        })
    };
    match root.extensions_required.iter().find(|name| !harmless(name)) {
        Some(name) => {
            Err(input.bad(format!("it needs the extension {name}, which is not supported")))
        }
        None => Ok((root, bin)),
    }
}

/// The most memory that JSON takes once it is parsed: an object of up to 256 bytes for each `{`, a
/// value of 32 for each item of a list, each in lists that may have doubled thrice, and its text.
fn json_bytes(json: &[u8]) -> u64 {
    let count = |known: &[u8]| json.iter().filter(|byte| known.contains(byte)).count() as u64;
    2 * json.len() as u64 + 768 * count(b"{") + 96 * count(b",[")
}

/// The JSON and the binary chunk of a `.glb`: a header of 12 bytes, then chunks with their lengths
/// and types. Others than these two are skipped.
fn chunks<'a>(input: &mut Input, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let (version, length) =
        (u32_of(bytes.get(4..).unwrap_or_default()), u32_of(bytes.get(8..).unwrap_or_default()));
    if bytes.len() < 12 {
        return Err(input.bad(format!("{} bytes, but its header has 12", bytes.len())));
    }
    if version != 2 {
        return Err(input.bad(format!("glTF of version {version}, but only 2 is supported")));
    }
    let ends = |size: usize| input.bad(format!("it ends early: {size} bytes of {length}"));
    let Some(mut rest) = bytes.get(12..length as usize) else { return Err(ends(bytes.len())) };
    let (mut json, mut bin) = (None, None);
    while rest.len() >= 8 {
        let (size, kind) = (u32_of(rest) as usize, &rest[4..8]);
        let Some((chunk, behind)) = rest[8..].split_at_checked(size) else {
            let left = rest.len() - 8;
            return Err(input.bad(format!("a chunk of {size} bytes, but {left} are left")));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        rest = behind;
    }
    let surplus = bytes.len() - length as usize + rest.len();
    if surplus > 0 {
        input.notes.push(format!("{surplus} bytes behind its last chunk are ignored"));
    }
    json.map(|json| (json, bin)).ok_or_else(|| input.bad("it has no chunk of JSON"))
}
