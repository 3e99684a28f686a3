//! Command `map`: writes a volume's shadow map as OpenEXR.

use std::time::Instant;

use clap::Args;

use super::arguments::{OutputArguments, SceneArguments};
use super::job::{Request, default_output};
use super::limits::LimitArguments;
use crate::compare::Certified;
use crate::error::{Error, Result};
use crate::io::map_files::{MapFile, NamedMap, check_map_kind, encode_maps, write_maps};
use crate::io::output::PendingFile;
use crate::settings::MapKind;

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
    if let Some(kind) = job.settings.map.kind {
        check_map_kind(kind)?;
    }
    let no_picture = job.settings.with(|s| s.image.size = [1; 2]);
    job.backend.check_room(&no_picture)?;
    let beams = job.scene.beams()?;
    let mut built = Vec::new();
    let begun = Instant::now();
    for beam in &beams {
        let (map, certificate) =
            match limits.choose(&job, beam, &scene, |kind| check_map_kind(kind).is_ok())? {
                Some(Certified { map, certificate, .. }) => (map, Some(certificate)),
                None => (job.backend.map(beam, &job.settings, &*job.progress)?, None),
            };
        built.push((beam.label(&beams), map, certificate));
    }
    let time = begun.elapsed();
    let maps = built.iter().map(|(label, map, certificate)| NamedMap {
        label: label.clone(),
        map,
        certificate: certificate.as_deref(),
    });
    let maps: Vec<_> = maps.collect();
    let files = encode_maps(&job.scene.media, &maps, &path, statistics)?;
    drop(tried);
    write_maps(&files, &inputs)?;
    for MapFile { path, what, size, .. } in &files {
        job.note(&format!(
            "wrote {}: {what} {size}x{size} in {:.2} s, {}",
            path.display(),
            time.as_secs_f64(),
            job.backend.description(),
        ));
    }
    for NamedMap { label, certificate, .. } in &maps {
        if let Some(certificate) = certificate {
            let label = label.as_ref().map(|label| format!("{label}: ")).unwrap_or_default();
            job.note(&format!("{label}{certificate}"));
        }
    }
    Ok(())
}
