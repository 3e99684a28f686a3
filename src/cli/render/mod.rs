//! Command `render`: writes pictures of volumes with their shadows.

mod draw;
mod files;
mod frames;
mod sequence;

use std::path::{Path, PathBuf};

use clap::Args;

use super::arguments::{PictureArguments, SceneArguments};
use super::goal::GoalArguments;
use super::job::Request;
use super::limits::LimitArguments;
use super::picture::FileOptions;
use super::progress::Stopwatch;
use super::tone::tone;
use crate::error::{Error, Result};
use crate::io::{Inputs, PendingFile, is_scene_file};
use draw::Drawing;
use frames::FrameArguments;

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
    #[command(flatten)]
    frames: FrameArguments,
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
    let Arguments { scene, limits, picture, goal, file, frames, save_scene } = arguments;
    let drawing = Drawing { scene: &scene, picture: &picture, limits: &limits, goal: &goal };
    let mut request = Request::new(&scene, Some(&picture))?;
    let wanted = frames.wanted(&scene.source.input, &mut request.file)?;
    let input = wanted.as_ref().map_or(&scene.source.input, |wanted| &wanted.name);
    let target = file.target(input, scene.source.transparent)?;
    let mut targets = wanted.iter().flat_map(|wanted| &wanted.mine).map(|&frame| target.at(frame));
    if let Some(path) = save_scene.as_ref()
        && (target.is(path) || targets.any(|target| target.is(path)))
    {
        let why = format!("'{}' is the picture's own name", path.display());
        return Err(Error::value("save-scene", why));
    }
    drawing.check_options(&target)?;
    if let Some(wanted) = wanted {
        return sequence::render(request, &drawing, &wanted, &target, save_scene.as_deref());
    }
    let file = target.open(&request.inputs)?;
    let saved = save_scene.map(|path| scene_output(&path, &request.inputs)).transpose()?;
    let job = request.load()?;
    if job.scene.ground.is_some_and(|ground| job.scene.camera.position.y < ground.height) {
        job.note("the camera is below the ground, which hides what is above it");
    }
    let watch = Stopwatch::new(&*job.progress);
    let mut lit = drawing.draw(&job, &target, &mut *drawing.stage(job.backend), &watch)?;
    let [map_time, view_time] = ["shadow map", "picture"].map(|work| watch.time(work));
    if target.is_linear() && !target.is_deep() && picture.tone.any() {
        job.note("this format holds linear radiance, without exposure and tone curve");
    }
    let contents = lit.encode(&job, &target, |image| tone(&job, image))?;
    let text = saved.is_some().then(|| job.scene_file(&lit.settings)).transpose()?;
    file.finish_with(&contents)?;
    if let (Some(saved), Some(text)) = (saved, text) {
        saved.finish_with(text.as_bytes())?;
        if job.scene.background.is_none() {
            job.note(NO_BACKGROUND);
        }
    }
    let [width, height] = job.settings.image.size;
    let maps = if lit.maps > 1 { format!("{} maps", lit.maps) } else { "map".to_owned() };
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

/// What is said of a saved scene without background.
const NO_BACKGROUND: &str = "the saved scene needs --transparent as well, and --catch-shadow if it \
                             was given: they are no keys of scene files";

/// The scene file to be written to `path`.
fn scene_output(path: &Path, inputs: &Inputs) -> Result<PendingFile> {
    if is_scene_file(path) {
        return PendingFile::create(path, inputs);
    }
    let path = path.display();
    Err(Error::value("save-scene", format!("'{path}' does not end in .toml, as scene files do")))
}
