//! Command `render`: writes a picture of a volume with its shadows.

use std::path::{Path, PathBuf};

use clap::Args;

use super::arguments::{PictureArguments, SceneArguments};
use super::deep;
use super::goal::GoalArguments;
use super::job::{Job, Request};
use super::limits::LimitArguments;
use super::picture::{FileOptions, Target};
use super::progress::Stopwatch;
use super::tone::tone;
use crate::compare::{Certified, Chosen};
use crate::cpu::DeepView;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::io::{Inputs, PendingFile};
use crate::progress::Progress;
use crate::scene::Beam;
use crate::settings::{Settings, Shading};

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
    file: FileOptions,
    /// Also write a scene file (.toml) that repeats the picture, with everything that was chosen.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["max_error", "max_map_bytes"], help_heading = "Scene")]
    save_scene: Option<PathBuf>,
}

impl Arguments {
    /// The requested number of threads.
    pub(super) fn threads(&self) -> Option<u32> {
        self.scene.source.threads
    }
}

pub(super) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { scene, limits, picture, goal, file, save_scene } = arguments;
    let target = file.target(&scene.source.input, scene.source.transparent)?;
    if target.is_deep() && goal.goal().is_some() {
        return Err(Error::value("format", "a deep image is not chosen for an error or a time"));
    }
    if let Some(path) = save_scene.as_ref().filter(|path| target.is(path)) {
        let why = format!("'{}' is the picture's own name", path.display());
        return Err(Error::value("save-scene", why));
    }
    let request = Request::new(&scene, Some(&picture))?;
    let file = target.open(&request.inputs)?;
    let saved = save_scene.map(|path| scene_output(&path, &request.inputs)).transpose()?;
    let job = request.load()?;
    if target.is_deep() {
        if job.settings.image.samples != ONE_RAY.0 {
            return Err(Error::value("image.samples", "a deep image needs one ray per pixel"));
        }
        if job.settings.view.shading != ONE_RAY.1 {
            return Err(Error::value("shadow.shading", "a deep image needs physical shading"));
        }
    }
    let beams = job.scene.beams()?;
    if target.is_deep() && beams.len() > 1 {
        let why = "a deep image needs a single light and grey extinction";
        return Err(Error::value("format", why));
    }
    job.backend.check_room(&job.settings)?;
    let watch = Stopwatch::new(&*job.progress);
    let lit = if let Some(chosen) = goal.picture(&job, (&scene, &picture), &watch)? {
        let Chosen { image, settings, error, .. } = chosen;
        let (size, quality) = (settings.map.size, settings.quality);
        let tolerance = settings.image.tolerance;
        let certificates = vec![format!(
            "error {error}; repeated by --map-size {size} --quality {quality} \
             --picture-tolerance {tolerance}"
        )];
        Lit { image, deep: None, settings, certificates }
    } else if target.is_deep() || limits.any() {
        beam_by_beam((&job, &beams), &scene, &limits, &target, &watch)?
    } else {
        let image = job.backend.render(&job.scene, &job.settings, &watch)?;
        Lit { image, deep: None, settings: job.settings.clone(), certificates: Vec::new() }
    };
    let [map_time, view_time] = ["shadow map", "picture"].map(|work| watch.time(work));
    let certificate = (!lit.certificates.is_empty()).then(|| lit.certificates.join("\n"));
    let contents = match lit.deep {
        Some(contents) => contents,
        None => target.encode(&lit.image, |options| {
            if target.is_linear() && picture.tone.any() {
                job.note("this format holds linear radiance, without exposure and tone curve");
            } else if !target.is_linear() {
                options.tone = tone(&job, &lit.image);
            }
            options.certificate = certificate;
            options.camera = Some(job.scene.camera);
        })?,
    };
    let text = saved.is_some().then(|| job.scene_file(&lit.settings)).transpose()?;
    file.finish_with(&contents)?;
    if let (Some(saved), Some(text)) = (saved, text) {
        saved.finish_with(text.as_bytes())?;
        if job.scene.background.is_none() {
            job.note("the saved scene needs --transparent as well, which is no key of scene files");
        }
    }
    let [width, height] = job.settings.image.size;
    let maps = if beams.len() > 1 { format!("{} maps", beams.len()) } else { "map".to_owned() };
    job.note(&format!(
        "wrote {}: {width}x{height}, {maps} {1}x{1} in {2:.2} s, view in {3:.2} s, {4}",
        target.name(),
        lit.settings.map.size,
        map_time.as_secs_f64(),
        view_time.as_secs_f64(),
        job.backend.description(),
    ));
    for certificate in &lit.certificates {
        job.note(certificate);
    }
    Ok(())
}

/// The scene file to be written to `path`.
fn scene_output(path: &Path, inputs: &Inputs) -> Result<PendingFile> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return PendingFile::create(path, inputs);
    }
    let path = path.display();
    Err(Error::value("save-scene", format!("'{path}' does not end in .toml, as scene files do")))
}

/// The result of rendering.
struct Lit {
    image: Image,
    /// The bytes of a deep image.
    deep: Option<Vec<u8>>,
    /// The settings of the last map, and of the picture.
    settings: Settings,
    /// Certificates of all maps that keep a limit.
    certificates: Vec<String>,
}

/// A picture through maps on the host, either because they must keep limits or because a deep image
/// is marched through them.
fn beam_by_beam(
    (job, beams): (&Job, &[Beam]),
    arguments: &SceneArguments,
    limits: &LimitArguments,
    target: &Target,
    watch: &Stopwatch<'_>,
) -> Result<Lit> {
    let [width, height] = job.settings.image.size;
    let image = Image::filled(width, height, [0.0; 4]);
    let mut lit =
        Lit { image, deep: None, settings: job.settings.clone(), certificates: Vec::new() };
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
        if target.is_deep() {
            let frame = Frame::new(beam, &settings)?;
            let certificate = lit.certificates.first().map(String::as_str);
            let view = DeepView::new(&beam.media, &frame, &map);
            let (camera, size) = (&job.scene.camera, settings.image.size);
            lit.deep = Some(deep::encode(&view, camera, size, target.deep_z(), certificate)?);
        } else {
            let picture = job.backend.view(beam, &settings, &map, watch)?;
            beam.add(&picture, &mut lit.image);
        }
        lit.settings = settings;
    }
    job.scene.check_radiance(&lit.image)?;
    Ok(lit)
}

/// What a deep image requires: one ray per pixel, and single scattering.
const ONE_RAY: (u32, Shading) = (1, Shading::Physical);
