//! `render`: a picture of a volume with its shadows.

use std::path::Path;
use std::time::Instant;

use clap::Args;

use super::arguments::{OutputArguments, PictureArguments, SceneArguments};
use super::certify::{Certified, LimitArguments, choose};
use super::job::{Job, default_output};
use crate::cpu::DeepView;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::io::deep_exr::{self, Channel, DeepHeader};
use crate::io::{PendingFile, exr, png};
use crate::settings::Shading;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    limits: LimitArguments,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    output: OutputArguments,
}

/// The picture formats, by the ending of the output's name.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Deep,
    Png,
    Exr,
}

fn format(path: &Path) -> Result<Format> {
    if path.to_string_lossy().ends_with(".deep.exr") {
        return Ok(Format::Deep);
    }
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("png") => Ok(Format::Png),
        Some("exr") => Ok(Format::Exr),
        _ => Err(Error::contents(path, "a picture's name must end in .png, .exr or .deep.exr")),
    }
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, limits, picture, output } = arguments;
    let path = output.out.unwrap_or_else(|| default_output(&scene.source.input, "png"));
    let format = format(&path)?;
    let mut job = Job::new(&scene, Some(&picture))?;
    if format == Format::Deep && (job.settings.samples, job.settings.shading) != ONE_RAY {
        let why = "a deep image takes one sample a pixel and physical shading";
        return Err(Error::contents(path, why));
    }
    let file = PendingFile::create(&path)?;

    let begun = Instant::now();
    let (map, certificate) = match choose(&job, &scene, &limits, |_| true)? {
        Some(Certified { map, settings, certificate }) => {
            job.settings = settings;
            (map, Some(certificate))
        }
        None => (job.backend.map(&job.scene, &job.settings, &*job.progress)?, None),
    };
    let certified = certificate.as_deref();
    let (settings, progress) = (&job.settings, &*job.progress);
    let map_time = begun.elapsed();
    let frame = Frame::with_light_view(&job.scene, settings, map.view())?;
    let volume = &job.scene.volume;
    let contents = if format == Format::Deep {
        encode_deep(&DeepView::new(volume, &frame, &map), settings.image_size, certified)?
    } else {
        let image = job.backend.march_view(volume, &frame, &map, progress)?;
        match format {
            Format::Png => png::encode(&image, settings.exposure as f32)?,
            Format::Exr | Format::Deep => exr::encode_image(&image, certified)?,
        }
    };
    let view_time = begun.elapsed().saturating_sub(map_time);
    file.finish_with(&contents)?;
    let [width, height] = settings.image_size;
    job.note(&format!(
        "wrote {}: {width}x{height}, map {1}x{1} in {2:.2} s, view in {3:.2} s, {4}",
        path.display(),
        settings.map_size,
        map_time.as_secs_f64(),
        view_time.as_secs_f64(),
        job.backend.description(),
    ));
    if let Some(certificate) = certificate {
        job.note(&certificate);
    }
    Ok(())
}

/// What a deep image is made of: a ray a pixel, and single scattering.
const ONE_RAY: (u32, Shading) = (1, Shading::Physical);

/// The camera's own deep image: R, G, B (radiance, premultiplied), A, Z and ZBack (distances from the
/// camera along the ray, world lengths), f32, marched by the processor.
fn encode_deep(
    view: &DeepView<'_>,
    [width, height]: [u32; 2],
    certificate: Option<&str>,
) -> Result<Vec<u8>> {
    let channels = ["A", "B", "G", "R", "Z", "ZBack"].map(Channel::float).into();
    let mut header = DeepHeader::new([width, height], channels)
        .with("software", concat!("deepshadow ", env!("CARGO_PKG_VERSION")))
        .with("kind", "camera")
        .with("depth_unit", "world")
        .with("depth_from", "camera, along the ray");
    if let Some(certificate) = certificate {
        header = header.with("certificate", certificate);
    }
    deep_exr::encode(&header, |y, row| {
        for x in 0..width {
            for sample in view.pixel(x, y) {
                let [r, g, b] = sample.radiance.to_array();
                row.push(&[sample.alpha, b, g, r, sample.front, sample.back]);
            }
            row.end_pixel();
        }
        Ok(())
    })
}
