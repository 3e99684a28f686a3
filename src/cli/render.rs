//! Command `render`: writes a picture of a volume with its shadows.

use std::path::Path;

use clap::Args;

use super::arguments::{OutputArguments, PictureArguments, SceneArguments};
use super::goal::GoalArguments;
use super::job::{Job, Request, default_output};
use super::limits::LimitArguments;
use super::progress::Stopwatch;
use crate::compare::{Certified, Chosen};
use crate::cpu::DeepView;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::io::deep_exr::{self, Channel, DeepHeader};
use crate::io::{PendingFile, exr, png};
use crate::progress::Progress;
use crate::scene::Beam;
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
    goal: GoalArguments,
    #[command(flatten)]
    output: OutputArguments,
}

/// The picture formats, which the ending of the output's name selects.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Deep,
    Png,
    Exr,
}

fn format(path: &Path) -> Result<Format> {
    let name = path.to_string_lossy().to_ascii_lowercase();
    if name.ends_with(".deep.exr") {
        return Ok(Format::Deep);
    }
    match Path::new(&name).extension().and_then(|ending| ending.to_str()) {
        Some("png") => Ok(Format::Png),
        Some("exr") => Ok(Format::Exr),
        _ => Err(Error::contents(path, "a picture's name must end in .png, .exr or .deep.exr")),
    }
}

impl Arguments {
    /// The requested number of threads.
    pub(super) fn threads(&self) -> Option<u32> {
        self.scene.source.threads
    }
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, limits, picture, goal, output } = arguments;
    let path = output.out.unwrap_or_else(|| default_output(&scene.source.input, "png"));
    let format = format(&path)?;
    let request = Request::new(&scene, Some(&picture))?;
    let file = PendingFile::create(&path, &request.inputs)?;
    let job = request.load()?;
    if format == Format::Deep && (job.settings.image.samples, job.settings.view.shading) != ONE_RAY
    {
        let why = "a deep image needs one sample per pixel and physical shading";
        return Err(Error::contents(path, why));
    }
    let beams = job.scene.beams()?;
    if format == Format::Deep && beams.len() > 1 {
        let why = "a deep image needs a single light and grey extinction";
        return Err(Error::contents(path, why));
    }
    job.backend.check_room(&job.settings)?;
    let watch = Stopwatch::new(&*job.progress);
    if format == Format::Deep && goal.goal().is_some() {
        let why = "a deep image is not chosen for an error or a time";
        return Err(Error::contents(path, why));
    }
    let lit = if let Some(chosen) = goal.picture(&job, (&scene, &limits, &picture), &watch)? {
        let Chosen { image, settings, error, .. } = chosen;
        let (size, quality) = (settings.map.size, settings.quality);
        let tolerance = settings.image.tolerance;
        let certificates = vec![format!(
            "error {error}; repeated by --map-size {size} --quality {quality} --picture-tolerance {tolerance}"
        )];
        Lit { image, deep: None, map_size: size, certificates }
    } else if format == Format::Deep || limits.any() {
        beam_by_beam((&job, &beams), &scene, &limits, format, &watch)?
    } else {
        let image = job.backend.render(&job.scene, &job.settings, &watch)?;
        Lit { image, deep: None, map_size: job.settings.map.size, certificates: Vec::new() }
    };
    let [map_time, view_time] = ["shadow map", "picture"].map(|work| watch.time(work));
    let exposure = job.settings.image.exposure as f32;
    let certificate = (!lit.certificates.is_empty()).then(|| lit.certificates.join("\n"));
    let contents = match (format, lit.deep) {
        (Format::Deep, Some(contents)) => contents,
        (Format::Png, _) => png::encode(&lit.image, exposure)?,
        (Format::Exr | Format::Deep, _) => exr::encode_image(&lit.image, certificate.as_deref())?,
    };
    file.finish_with(&contents)?;
    let [width, height] = job.settings.image.size;
    let maps = if beams.len() > 1 { format!("{} maps", beams.len()) } else { "map".to_owned() };
    job.note(&format!(
        "wrote {}: {width}x{height}, {maps} {1}x{1} in {2:.2} s, view in {3:.2} s, {4}",
        path.display(),
        lit.map_size,
        map_time.as_secs_f64(),
        view_time.as_secs_f64(),
        job.backend.description(),
    ));
    for certificate in &lit.certificates {
        job.note(certificate);
    }
    Ok(())
}

/// The result of rendering.
struct Lit {
    image: Image,
    /// The bytes of a deep image.
    deep: Option<Vec<u8>>,
    /// Size of the last map.
    map_size: u32,
    /// Certificates of all maps that keep a limit.
    certificates: Vec<String>,
}

/// A picture through maps on the host, either because they must keep limits or because a deep image
/// is marched through them.
fn beam_by_beam(
    (job, beams): (&Job, &[Beam]),
    arguments: &SceneArguments,
    limits: &LimitArguments,
    format: Format,
    watch: &Stopwatch<'_>,
) -> Result<Lit> {
    let [width, height] = job.settings.image.size;
    let image = Image::filled(width, height, [0.0; 4]);
    let mut lit = Lit { image, deep: None, map_size: 0, certificates: Vec::new() };
    for beam in beams {
        watch.begin("shadow map", 1);
        let (map, settings) = match limits.choose(job, beam, arguments, |_| true)? {
            Some(Certified { map, settings, certificate }) => {
                lit.certificates.push(match beam.label(beams) {
                    Some(label) => format!("{label}: {certificate}"),
                    None => certificate,
                });
                (map, settings)
            }
            None => (job.backend.map(beam, &job.settings, watch)?, job.settings.clone()),
        };
        watch.begin("picture", 1);
        if format == Format::Deep {
            let frame = Frame::new(beam, &settings)?;
            let certificate = lit.certificates.first().map(String::as_str);
            let view = DeepView::new(&beam.media, &frame, &map);
            lit.deep = Some(encode_deep(&view, settings.image.size, certificate)?);
        } else {
            let picture = job.backend.view(beam, &settings, &map, watch)?;
            beam.add(&picture, &mut lit.image);
        }
        lit.map_size = settings.map.size;
    }
    job.scene.check_radiance(&lit.image)?;
    Ok(lit)
}

/// What a deep image requires: one ray per pixel, and single scattering.
const ONE_RAY: (u32, Shading) = (1, Shading::Physical);

/// Encodes the camera's view as a deep image, marched on the processor: R, G, B (radiance,
/// premultiplied), A, Z and ZBack (distances from the camera along the ray, world lengths), f32.
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
