//! `map`: a volume's shadow map as OpenEXR.

use std::time::Instant;

use clap::Args;

use super::arguments::{OutputArguments, SceneArguments};
use super::job::{Job, default_output};
use crate::error::{Error, Result};
use crate::io::{PendingFile, exr};
use crate::shadow::Map;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, output } = arguments;
    let path = output.out.unwrap_or_else(|| default_output(&scene.input, "exr"));
    if path.extension().is_none_or(|ending| ending != "exr") {
        return Err(Error::contents(path, "a map's name must end in .exr"));
    }
    let job = Job::new(&scene, None)?;
    let file = PendingFile::create(&path)?;
    let begun = Instant::now();
    let map = job.backend.map(&job.scene, &job.settings, &*job.progress)?;
    let time = begun.elapsed();
    let index_from_world = job.scene.volume.world_from_index().inverse();
    let (contents, what) = match &map {
        Map::Threshold(map) => {
            let domain = job.scene.volume.domain();
            (
                exr::encode_threshold_map(map, &index_from_world, &domain)?,
                "threshold map".to_owned(),
            )
        }
        Map::Fragments(_) => return Err(Error::contents(path, "not yet")),
    };
    file.finish_with(&contents)?;
    job.note(&format!(
        "wrote {}: {what} {1}x{1} in {2:.2} s, {3}",
        path.display(),
        job.settings.map_size,
        time.as_secs_f64(),
        job.backend.description(),
    ));
    Ok(())
}
