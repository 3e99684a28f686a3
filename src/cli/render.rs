//! `render`: a picture of a volume with its shadows.

use std::path::Path;
use std::time::Instant;

use clap::Args;

use super::arguments::{OutputArguments, PictureArguments, SceneArguments};
use super::job::{Job, default_output};
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::io::{PendingFile, exr, png};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    output: OutputArguments,
}

/// The picture formats, by the ending of the output's name.
enum Format {
    Png,
    Exr,
}

fn format(path: &Path) -> Result<Format> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("png") => Ok(Format::Png),
        Some("exr") => Ok(Format::Exr),
        _ => Err(Error::contents(path, "a picture's name must end in .png or .exr")),
    }
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, picture, output } = arguments;
    let path = output.out.unwrap_or_else(|| default_output(&scene.input, "png"));
    let format = format(&path)?;
    let job = Job::new(&scene, Some(&picture))?;
    let file = PendingFile::create(&path)?;

    let begun = Instant::now();
    let (settings, progress) = (&job.settings, &*job.progress);
    let map = job.backend.map(&job.scene, settings, progress)?;
    let map_time = begun.elapsed();
    let frame = Frame::with_light_view(&job.scene, settings, map.view())?;
    let image = job.backend.march_view(&job.scene.volume, &frame, &map, progress)?;
    let view_time = begun.elapsed().saturating_sub(map_time);

    match format {
        Format::Png => file.finish_with(&png::encode(&image, settings.exposure as f32)?)?,
        Format::Exr => file.finish_with(&exr::encode_image(&image)?)?,
    }
    let [width, height] = settings.image_size;
    job.note(&format!(
        "wrote {}: {width}x{height}, map {1}x{1} in {2:.2} s, view in {3:.2} s, {4}",
        path.display(),
        settings.map_size,
        map_time.as_secs_f64(),
        view_time.as_secs_f64(),
        job.backend.description(),
    ));
    Ok(())
}
