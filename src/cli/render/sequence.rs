//! Renders sequences: one picture a frame. What is left out is chosen once, for all frames.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use super::draw::Drawing;
use super::frames::Wanted;
use super::{NO_BACKGROUND, scene_output};
use crate::backend::Stage;
use crate::cli::job::{Crew, Job, Request};
use crate::cli::picture::Target;
use crate::cli::progress::Stopwatch;
use crate::cli::tone::tone;
use crate::error::{Error, Result};
use crate::image::{Exposure, Image, Tone};
use crate::io::output::{is_sealed, sealed};
use crate::io::{ChosenShot, Inputs, SceneLoader, choose_shot, some_of, source_files};
use crate::progress::Silent;
use crate::scene::SceneFile;
use crate::scene::automatic::Surroundings;
use crate::scene::file::ExposureValue;

/// Edge in pixels, and in texels of the map, of the pictures from which a tone is chosen.
const PREVIEW: u32 = 128;

/// A sequence that is being rendered.
struct Sequence<'a> {
    drawing: &'a Drawing<'a>,
    wanted: &'a Wanted,
    target: &'a Target,
    crew: Crew,
    loader: SceneLoader,
    /// What frames have in common.
    file: SceneFile,
    surroundings: Surroundings,
    inputs: Inputs,
}

/// Renders the frames `wanted` of a request.
pub(super) fn render(
    mut request: Request,
    drawing: &Drawing,
    wanted: &Wanted,
    target: &Target,
    save_scene: Option<&Path>,
) -> Result<()> {
    if wanted.all.len() > 1 && !target.is_numbered() {
        let why = format!(
            "'{}' has no place for the number of a frame, as picture.####.png has",
            target.name()
        );
        return Err(Error::value("out", why));
    }
    let mut inputs = request.inputs.clone();
    for &frame in &wanted.all {
        for table in wanted.file_at(&request.file, frame)?.volume.iter() {
            inputs.extend(source_files(table)?);
        }
    }
    for &frame in &wanted.mine {
        target.at(frame).check(&inputs)?;
    }
    let saved = save_scene.map(|path| scene_output(path, &inputs)).transpose()?;
    if saved.is_some() && !wanted.is_in_file() {
        let why = "a scene file cannot list files whose names differ by more than a number";
        return Err(Error::value("save-scene", why));
    }
    let first = wanted.file_at(&request.file, wanted.all[0])?;
    request.stand_up(&first)?;
    let (crew, said) = request.crew();
    let crew = crew.ready(&request.file)?;
    for line in said.iter().chain(&wanted.note) {
        crew.note(line);
    }
    let (file, surroundings, loader) = (request.file, request.surroundings, SceneLoader::default());
    let mut sequence =
        Sequence { drawing, wanted, target, crew, loader, file, surroundings, inputs };
    sequence.choose()?;
    if let Some(saved) = saved {
        let mut file = sequence.file.with_absolute_paths()?;
        // The background follows the light of each frame.
        file.surroundings = Some(sequence.surroundings);
        saved.finish_with(file.to_text()?.as_bytes())?;
        if drawing.scene.source.transparent {
            sequence.crew.note(NO_BACKGROUND);
        }
    }
    sequence.run()
}

impl Sequence<'_> {
    /// Chooses what all frames have in common.
    fn choose(&mut self) -> Result<()> {
        let Self { wanted, surroundings, .. } = *self;
        let file_at = |frame| wanted.file_at(&self.file, frame);
        let ChosenShot { file, choices, notes } = choose_shot(
            &self.file,
            &wanted.chosen_for,
            surroundings,
            wanted.turns,
            &mut self.loader,
            &file_at,
        )?;
        for note in &notes {
            self.crew.note(note);
        }
        self.crew.report(choices);
        self.file = file;
        self.choose_tone()
    }

    /// Chooses exposure and tone curve from small pictures of a few frames.
    fn choose_tone(&mut self) -> Result<()> {
        let image = &self.file.image;
        let is_given = image.exposure()? != Exposure::Auto && image.tone_map()?.is_some();
        if self.target.is_linear() || is_given {
            return Ok(());
        }
        let mut stage = self.drawing.stage(self.crew.backend);
        let mut pixels = Vec::new();
        let mut last = None;
        for frame in some_of(&self.wanted.chosen_for) {
            let mut file = self.wanted.file_at(&self.file, frame)?;
            shrink(&mut file);
            let job = self.job(&file)?;
            let picture = stage.render(&job.scene, &job.settings, &Silent)?;
            pixels.extend(picture.pixels);
            last = Some((job, picture.width));
        }
        let Some((job, width)) = last else { return Ok(()) };
        let height = (pixels.len() / width.max(1) as usize) as u32;
        let Tone { exposure, map, .. } = tone(&job, &Image { width, height, pixels });
        if self.file.image.exposure()? == Exposure::Auto {
            self.file.image.exposure = Some(ExposureValue::Factor(exposure.into()));
        }
        self.file.image.tonemap = Some(map.name().to_owned());
        Ok(())
    }

    /// The job of a frame's scene file.
    fn job(&mut self, file: &SceneFile) -> Result<Job> {
        let (loaded, _) = self.loader.load(file, false)?;
        Ok(self.crew.job(file, loaded, self.surroundings)?.0)
    }

    fn run(&mut self) -> Result<()> {
        let begun = Instant::now();
        let mut stage = self.drawing.stage(self.crew.backend);
        let (count, mut kept) = (self.wanted.mine.len(), 0);
        for (index, &frame) in self.wanted.mine.iter().enumerate() {
            let file = self.wanted.file_at(&self.file, frame)?;
            let target = self.target.at(frame);
            let settings = self.settings_text(&file)?;
            if self.wanted.resume && target.path().is_some_and(|path| is_sealed(path, &settings)) {
                kept += 1;
                continue;
            }
            let of_frame = Instant::now();
            let lines = self.frame(&file, &target, &settings, &mut *stage)?;
            self.crew.note(&format!(
                "wrote {}: {} of {count}, in {:.2} s",
                target.name(),
                index + 1,
                of_frame.elapsed().as_secs_f64()
            ));
            for line in &lines {
                self.crew.note(line);
            }
        }
        let kept = if self.wanted.resume { format!(", {kept} kept") } else { String::new() };
        let (seconds, by) = (begun.elapsed().as_secs_f64(), self.crew.backend.description());
        let frames = if count == 1 { "frame" } else { "frames" };
        self.crew.note(&format!("{count} {frames}{kept} in {seconds:.2} s, {by}"));
        Ok(())
    }

    /// Renders a frame and writes it; returns what there is to say of it.
    fn frame(
        &mut self,
        file: &SceneFile,
        target: &Target,
        settings: &str,
        stage: &mut dyn Stage,
    ) -> Result<Vec<String>> {
        let output = target.open(&self.inputs)?;
        let job = self.job(file)?;
        let watch = Stopwatch::new(&*job.progress);
        let mut lit = self.drawing.draw(&job, target, stage, &watch)?;
        // Nothing is left to be chosen.
        let tone = |image: &Image| Tone::for_picture(image, job.exposure, job.tone_map);
        let contents = lit.encode(&job, target, tone)?;
        let has_seal = target.path().is_some();
        let contents = if has_seal { sealed(contents, settings) } else { contents };
        output.finish_with(&contents)?;
        Ok(lit.certificates)
    }

    /// Everything on which the file of a frame depends, as text.
    fn settings_text(&self, file: &SceneFile) -> Result<String> {
        let Drawing { scene, picture, limits, goal } = self.drawing;
        let mut text = format!(
            "{} {:?} {limits:?} {goal:?} {} {}\n{}\n",
            env!("CARGO_PKG_VERSION"),
            self.target.contents(),
            scene.source.transparent,
            picture.stage.catch_shadow,
            file.to_text()?
        );
        for table in file.volume.iter() {
            for path in source_files(table)? {
                let facts = std::fs::metadata(&path).map_err(|error| Error::file(&path, error))?;
                // Written to a text, which never fails.
                let _ = writeln!(text, "{} {:?}", facts.len(), facts.modified().ok());
            }
        }
        Ok(text)
    }
}

/// Makes a picture small, without changing what is seen.
fn shrink(file: &mut SceneFile) {
    let (width, height) = (file.image.width.unwrap_or(512), file.image.height.unwrap_or(512));
    let longest = width.max(height).max(1);
    let shrunk = |edge: u32| {
        let edge = u64::from(edge) * u64::from(PREVIEW) / u64::from(longest);
        (edge as u32).max(1)
    };
    if longest > PREVIEW {
        (file.image.width, file.image.height) = (Some(shrunk(width)), Some(shrunk(height)));
    }
    file.image.samples = None;
    file.shadow.size = file.shadow.size.map(|size| size.min(PREVIEW));
}
