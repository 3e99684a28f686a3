//! Command `map`: writes a volume's shadow map as OpenEXR.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::arguments::{OutputArguments, SceneArguments};
use super::job::{Request, default_output};
use super::limits::LimitArguments;
use crate::compare::Certified;
use crate::error::{Error, Result};
use crate::io::coded_map::encode_coded_map;
use crate::io::exr;
use crate::io::fragment_map::{encode_fragment_map, encode_fragment_statistics};
use crate::io::output::{PendingFile, commit};
use crate::scene::Media;
use crate::settings::MapKind;
use crate::shadow::{FragmentMap, Map, Shadow, TexelMap};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    limits: LimitArguments,
    #[command(flatten)]
    output: OutputArguments,
    /// Write only a summary of a fragment map's lists, as a flat image: count, front, back, A.
    #[arg(long)]
    statistics: bool,
}

impl Arguments {
    /// The requested number of threads.
    pub(super) fn threads(&self) -> Option<u32> {
        self.scene.source.threads
    }
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, limits, output, statistics } = arguments;
    let path = output.out.unwrap_or_else(|| default_output(&scene.source.input, "exr"));
    if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("exr")) {
        return Err(Error::value("out", format!("'{}' does not end in .exr", path.display())));
    }
    let request = Request::new(&scene, None)?;
    let inputs = request.inputs.clone();
    // If the folder cannot be written, that should be known before the work.
    let tried = PendingFile::create(&path, &inputs)?;
    let mut job = request.load()?;
    if !limits.any() {
        let bare = job.scene.surfaces.is_empty();
        let usual = if bare { MapKind::Threshold } else { MapKind::Fragments };
        job.settings.map.kind.get_or_insert(usual);
    }
    if let Some(kind) = job.settings.map.kind.filter(|&kind| !written(kind)) {
        return Err(unwritten(kind));
    }
    let no_picture = job.settings.with(|s| s.image.size = [1; 2]);
    job.backend.check_room(&no_picture)?;
    let beams = job.scene.beams()?;
    let mut built = Vec::new();
    let begun = Instant::now();
    for beam in &beams {
        let (map, certificate) = match limits.choose(&job, beam, &scene, written)? {
            Some(Certified { map, certificate, .. }) => (map, Some(certificate)),
            None => (job.backend.map(beam, &job.settings, &*job.progress)?, None),
        };
        built.push(Built { label: beam.label(&beams), map, certificate });
    }
    let time = begun.elapsed();
    let files = encode(&job.scene.media, &built, &path, statistics)?;
    drop(tried);
    let pending = files.iter().map(|file| {
        let mut pending = PendingFile::create(&file.path, &inputs)?;
        pending.put(&file.contents).map(|()| pending)
    });
    commit(pending.collect::<Result<_>>()?)?;
    for Encoded { path, what, size, .. } in &files {
        job.note(&format!(
            "wrote {}: {what} {size}x{size} in {:.2} s, {}",
            path.display(),
            time.as_secs_f64(),
            job.backend.description(),
        ));
    }
    for Built { label, certificate, .. } in &built {
        if let Some(certificate) = certificate {
            let label = label.as_ref().map(|label| format!("{label}: ")).unwrap_or_default();
            job.note(&format!("{label}{certificate}"));
        }
    }
    Ok(())
}

/// The map of a beam.
struct Built {
    label: Option<String>,
    map: Map,
    certificate: Option<String>,
}

/// A file to be written.
struct Encoded {
    path: PathBuf,
    contents: Vec<u8>,
    what: String,
    size: u32,
}

/// The maps as files: threshold maps as layers of one file, others as one file each, with the
/// beam's label in front of the ending.
fn encode(media: &Media, built: &[Built], path: &Path, statistics: bool) -> Result<Vec<Encoded>> {
    let (index_from_world, domain) = (media.world_from_index().inverse(), media.domain());
    let layers: Vec<_> = built
        .iter()
        .filter_map(|Built { label, map, certificate }| match (label, map) {
            (Some(label), Map::Threshold(map)) => {
                Some((label.clone(), map, certificate.as_deref()))
            }
            _ => None,
        })
        .collect();
    if layers.len() == built.len() {
        let contents = exr::encode_threshold_maps(&layers, &index_from_world, &domain)?;
        let what = format!(
            "threshold maps {}",
            layers.iter().map(|l| &*l.0).collect::<Vec<_>>().join(", ")
        );
        let size = layers.first().map_or(0, |(_, map, _)| map.size());
        return Ok(vec![Encoded { path: path.to_owned(), contents, what, size }]);
    }
    let one = |Built { label, map, certificate }: &Built| {
        let certified = certificate.as_deref();
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
        Ok(Encoded { path, contents, what, size: map.size() })
    };
    built.iter().map(one).collect()
}

/// Whether maps of `kind` can be written to files.
fn written(kind: MapKind) -> bool {
    !matches!(kind, MapKind::Visibility | MapKind::Grid(_))
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
