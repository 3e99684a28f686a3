//! Shadow maps as files: OpenEXR in the layout of each kind.

use std::path::{Path, PathBuf};

use super::coded_map::encode_coded_map;
use super::exr;
use super::fragment_map::{encode_fragment_map, encode_fragment_statistics};
use super::output::{Inputs, PendingFile, commit};
use crate::error::{Error, Result};
use crate::scene::Media;
use crate::settings::MapKind;
use crate::shadow::{FragmentMap, Map, Shadow, TexelMap};

/// A map that is to be written.
pub struct NamedMap<'a> {
    /// What distinguishes it from other maps of the same scene
    /// ([`Beam::label`](crate::scene::Beam::label)).
    pub label: Option<String>,
    /// The map.
    pub map: &'a Map,
    /// What was measured of it, for the file's header.
    pub certificate: Option<&'a str>,
}

/// A file that is to be written.
pub struct MapFile {
    /// Its name.
    pub path: PathBuf,
    /// Its bytes.
    pub contents: Vec<u8>,
    /// What it holds, for people.
    pub what: String,
    /// Texels along each edge of its maps.
    pub size: u32,
}

/// The maps of a scene's media as files: threshold maps as layers of one file, others as one file
/// each, with the label in front of the ending. `statistics` are a summary of the lists of fragment
/// maps instead: count, front, back and A.
///
/// # Errors
/// If there are no files for a map's kind ([`check_map_kind`]), or one cannot be encoded.
pub fn encode_maps(
    media: &Media,
    maps: &[NamedMap<'_>],
    path: &Path,
    statistics: bool,
) -> Result<Vec<MapFile>> {
    let (index_from_world, domain) = (media.world_from_index().inverse(), media.domain());
    let layers: Vec<_> = maps
        .iter()
        .filter_map(|NamedMap { label, map, certificate }| match (label, map) {
            (Some(label), Map::Threshold(map)) => Some((label.clone(), map, *certificate)),
            _ => None,
        })
        .collect();
    if layers.len() == maps.len() {
        let contents = exr::encode_threshold_maps(&layers, &index_from_world, &domain)?;
        let what = format!(
            "threshold maps {}",
            layers.iter().map(|l| &*l.0).collect::<Vec<_>>().join(", ")
        );
        let size = layers.first().map_or(0, |(_, map, _)| map.size());
        return Ok(vec![MapFile { path: path.to_owned(), contents, what, size }]);
    }
    let one = |NamedMap { label, map, certificate }: &NamedMap<'_>| {
        let certified = *certificate;
        let (contents, what) = match map {
            Map::Threshold(map) => (
                exr::encode_threshold_map(map, &index_from_world, &domain, certified)?,
                "threshold map".to_owned(),
            ),
            Map::Fragments(map) => {
                let contents = if statistics {
                    encode_fragment_statistics(map)?
                } else {
                    encode_fragment_map(map, &index_from_world, &domain, certified)?
                };
                (contents, format!("fragment map, {}", held(map)))
            }
            Map::Coded(map) => (
                encode_coded_map(map, &index_from_world, &domain, certified)?,
                format!("{} map", map.kind()),
            ),
            Map::Visibility(_) => return Err(unwritten(MapKind::Visibility)),
            Map::Grid(map) => return Err(unwritten(MapKind::Grid(map.longest() as u16))),
        };
        let path = match label {
            Some(label) => path.with_extension(format!("{label}.exr")),
            None => path.to_owned(),
        };
        Ok(MapFile { path, contents, what, size: map.size() })
    };
    maps.iter().map(one).collect()
}

/// Writes files, all of them or none.
///
/// # Errors
/// If one cannot be written, or is one of `inputs`.
pub fn write_maps(files: &[MapFile], inputs: &Inputs) -> Result<()> {
    let pending = files.iter().map(|file| {
        let mut pending = PendingFile::create(&file.path, inputs)?;
        pending.put(&file.contents).map(|()| pending)
    });
    commit(pending.collect::<Result<_>>()?)
}

/// Checks that there are files for maps of `kind`.
///
/// # Errors
/// If not.
pub fn check_map_kind(kind: MapKind) -> Result<()> {
    match kind {
        MapKind::Visibility | MapKind::Grid(_) => Err(unwritten(kind)),
        _ => Ok(()),
    }
}

fn unwritten(kind: MapKind) -> Error {
    let why = "maps can be rendered with, but not written to files";
    Error::value("map", format!("'{kind}' {why}"))
}

/// A description of a fragment map's contents, for people.
fn held(map: &FragmentMap) -> String {
    let runs = map.runs();
    let most = runs.starts().windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
    let mean = runs.nodes().len() as f64 / runs.texels().max(1) as f64;
    let mebibytes = map.bytes() as f64 / f64::from(1 << 20);
    format!("{mean:.1} nodes per texel, at most {most}, {mebibytes:.1} MiB,")
}
