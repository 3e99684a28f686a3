//! Draws the picture of a job, with everything that the options ask for.

use crate::backend::{Backend, ShadowCatcher, Stage};
use crate::cli::arguments::{PictureArguments, SceneArguments};
use crate::cli::deep;
use crate::cli::goal::GoalArguments;
use crate::cli::job::Job;
use crate::cli::limits::LimitArguments;
use crate::cli::picture::Target;
use crate::cli::progress::Stopwatch;
use crate::cli::stage::GroundChoice;
use crate::compare::{Certified, Chosen};
use crate::cpu::DeepView;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::{Image, Tone};
use crate::progress::Progress;
use crate::scene::Beam;
use crate::settings::{Settings, Shading};

/// The options on how pictures are drawn.
pub(super) struct Drawing<'a> {
    pub scene: &'a SceneArguments,
    pub picture: &'a PictureArguments,
    pub limits: &'a LimitArguments,
    pub goal: &'a GoalArguments,
}

/// A picture that is drawn.
pub(super) struct Lit {
    pub image: Image,
    /// The bytes of a deep image.
    deep: Option<Vec<u8>>,
    /// The settings of the last map, and of the picture.
    pub settings: Settings,
    /// The number of maps.
    pub maps: usize,
    /// Certificates of all maps that keep a limit.
    pub certificates: Vec<String>,
}

impl Drawing<'_> {
    /// Checks options that contradict each other.
    ///
    /// # Errors
    /// With the reason.
    pub(super) fn check_options(&self, target: &Target) -> Result<()> {
        let stage = &self.picture.stage;
        let transparent = self.scene.source.transparent;
        if target.is_deep() && self.goal.goal().is_some() {
            return Err(Error::value(
                "format",
                "a deep image is not chosen for an error or a time",
            ));
        }
        if transparent && stage.ground.is_some() && !stage.catch_shadow {
            let why = "there is none with --transparent, except for --catch-shadow";
            return Err(Error::value("ground", why));
        }
        if stage.catch_shadow && matches!(stage.ground, Some(GroundChoice::None)) {
            return Err(Error::value("catch-shadow", "there is no ground"));
        }
        let needs_maps = target.is_deep() || self.goal.goal().is_some() || self.limits.any();
        if stage.catch_shadow && needs_maps {
            let why = "is not possible with deep images, goals and limits";
            return Err(Error::value("catch-shadow", why));
        }
        Ok(())
    }

    /// A stage for the pictures.
    pub(super) fn stage<'b>(&self, backend: &'b dyn Backend) -> Box<dyn Stage + 'b> {
        if self.picture.stage.catch_shadow {
            Box::new(ShadowCatcher::new(backend))
        } else {
            backend.stage()
        }
    }

    /// Draws `job` for `target`, on `stage` if that suits.
    pub(super) fn draw(
        &self,
        job: &Job,
        target: &Target,
        stage: &mut dyn Stage,
        watch: &Stopwatch<'_>,
    ) -> Result<Lit> {
        check(job, target)?;
        if self.picture.stage.catch_shadow && job.scene.ground.is_none() {
            return Err(Error::value(
                "catch-shadow",
                "there is no ground, or it is seen from below",
            ));
        }
        if let Some(chosen) = self.goal.picture(job, (self.scene, self.picture), watch)? {
            let Chosen { image, settings, error, .. } = chosen;
            let (size, quality) = (settings.map.size, settings.quality);
            let tolerance = settings.image.tolerance;
            let certificates = vec![format!(
                "error {error}; repeated by --map-size {size} --quality {quality} \
                 --picture-tolerance {tolerance}"
            )];
            let maps = job.scene.beams_for(&settings)?.len();
            Ok(Lit { image, deep: None, settings, maps, certificates })
        } else if target.is_deep() || self.limits.any() {
            beam_by_beam((job, &job.scene.beams()?), self.scene, self.limits, target, watch)
        } else {
            let image = stage.render(&job.scene, &job.settings, watch)?;
            let settings = job.settings.clone();
            let maps = job.scene.beams_for(&settings)?.len();
            Ok(Lit { image, deep: None, settings, maps, certificates: Vec::new() })
        }
    }
}

impl Lit {
    /// The bytes of the file `target`. `tone` says how the picture is shown on a screen.
    ///
    /// # Errors
    /// If an encoder fails.
    pub(super) fn encode(
        &mut self,
        job: &Job,
        target: &Target,
        tone: impl FnOnce(&Image) -> Tone,
    ) -> Result<Vec<u8>> {
        if let Some(contents) = self.deep.take() {
            return Ok(contents);
        }
        let certificate = (!self.certificates.is_empty()).then(|| self.certificates.join("\n"));
        target.encode(&self.image, |options| {
            if !target.is_linear() {
                options.tone = tone(&self.image);
            }
            options.certificate = certificate;
            options.camera = Some(job.scene.camera);
        })
    }
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
    let (settings, maps) = (job.settings.clone(), beams.len());
    let mut lit = Lit { image, deep: None, settings, maps, certificates: Vec::new() };
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
            let view = DeepView::new(beam.casters(), &frame, &map)?;
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

/// Checks that there is room for the picture of `job`, and that it can be a deep image if `target`
/// is one.
///
/// # Errors
/// With the reason why it is not.
fn check(job: &Job, target: &Target) -> Result<()> {
    job.backend.check_room(&job.settings)?;
    if !target.is_deep() {
        return Ok(());
    }
    // With surfaces, samples are those of their edges.
    if job.settings.image.samples != ONE_RAY.0 && job.scene.surfaces.is_empty() {
        return Err(Error::value("image.samples", "a deep image needs one ray per pixel"));
    }
    if job.settings.view.shading != ONE_RAY.1 {
        return Err(Error::value("shadow.shading", "a deep image needs physical shading"));
    }
    if job.scene.beams()?.len() > 1 {
        let why = "a deep image needs a single light and grey extinction";
        return Err(Error::value("format", why));
    }
    Ok(())
}
