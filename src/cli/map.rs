//! `map`: a volume's shadow map as OpenEXR.

use std::time::Instant;

use clap::Args;

use super::arguments::{OutputArguments, SceneArguments};
use super::certify::{Certified, LimitArguments, choose};
use super::job::{Job, default_output};
use crate::error::{Error, Result};
use crate::io::coded_map::encode_coded_map;
use crate::io::fragment_map::{encode_fragment_map, encode_fragment_statistics};
use crate::io::{PendingFile, exr};
use crate::settings::MapKind;
use crate::shadow::{FragmentMap, Map, ShadowMap};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    limits: LimitArguments,
    #[command(flatten)]
    output: OutputArguments,
    /// Of a fragment map only what its lists come to, as a flat image: count, front, back, A.
    #[arg(long)]
    statistics: bool,
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, limits, output, statistics } = arguments;
    let path = output.out.unwrap_or_else(|| default_output(&scene.source.input, "exr"));
    if path.extension().is_none_or(|ending| ending != "exr") {
        return Err(Error::contents(path, "a map's name must end in .exr"));
    }
    let job = Job::new(&scene, None)?;
    if let Some(kind) = job.settings.map.filter(|&kind| !written(kind)) {
        return Err(unwritten(kind));
    }
    let file = PendingFile::create(&path)?;
    let begun = Instant::now();
    let (map, certificate) = match choose(&job, &scene, &limits, written)? {
        Some(Certified { map, certificate, .. }) => (map, Some(certificate)),
        None => (job.backend.map(&job.scene, &job.settings, &*job.progress)?, None),
    };
    let certified = certificate.as_deref();
    let time = begun.elapsed();
    let index_from_world = job.scene.volume.world_from_index().inverse();
    let (contents, what) = match &map {
        Map::Threshold(map) => {
            let domain = job.scene.volume.domain();
            (
                exr::encode_threshold_map(map, &index_from_world, &domain, certified)?,
                "threshold map".to_owned(),
            )
        }
        Map::Fragments(map) => {
            let domain = job.scene.volume.domain();
            let contents = if statistics {
                encode_fragment_statistics(map)?
            } else {
                encode_fragment_map(map, &index_from_world, &domain, certified)?
            };
            (contents, format!("fragment map, {}", held(map)))
        }
        Map::Coded(map) => {
            let domain = job.scene.volume.domain();
            (
                encode_coded_map(map, &index_from_world, &domain, certified)?,
                format!("{} map", map.kind()),
            )
        }
        Map::Visibility(_) => return Err(unwritten(MapKind::Visibility)),
        Map::Grid(map) => return Err(unwritten(MapKind::Grid(map.size() as u16))),
    };
    file.finish_with(&contents)?;
    job.note(&format!(
        "wrote {}: {what} {1}x{1} in {2:.2} s, {3}",
        path.display(),
        map.size(),
        time.as_secs_f64(),
        job.backend.description(),
    ));
    if let Some(certificate) = certificate {
        job.note(&certificate);
    }
    Ok(())
}

/// Whether maps of `kind` are written to files.
fn written(kind: MapKind) -> bool {
    !matches!(kind, MapKind::Visibility | MapKind::Grid(_))
}

fn unwritten(kind: MapKind) -> Error {
    let why = "maps are not written to files, only rendered with; every other kind is written";
    Error::value("map", format!("'{kind}' {why}"))
}

/// What a fragment map holds, for people.
fn held(map: &FragmentMap) -> String {
    let runs = map.runs();
    let most = runs.starts().windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
    let mean = runs.nodes().len() as f64 / runs.texels().max(1) as f64;
    let mebibytes = map.bytes() as f64 / f64::from(1 << 20);
    format!("{mean:.1} nodes a texel, at most {most}, {mebibytes:.1} MiB,")
}
