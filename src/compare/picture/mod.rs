//! Chooses how a picture is computed, for an error that it must keep or for a time that it may
//! take, and certifies its error.
//!
//! Two numbers are chosen: the size of the maps and [`Settings::quality`]; the tolerance of pixels
//! follows from the error. Few pixels tell what
//! they do ([`Scouts`]): they are marched with the truth, and through maps of two sizes of which
//! only the needed texels are traced. That gives the error by steps and tolerances, which falls
//! with the square of the quality, that by texels, which falls with the square of the size, and the
//! time of a texel and of a pixel. The picture is then made, and other pixels of it are compared
//! with the truth ([`PictureError`]).

mod certificate;
mod sampled;
mod scouts;

use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::math::three_digits;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::settings::{MapKind, Settings, Shading};
use certificate::certified;
pub use certificate::{PictureError, picture_error};
pub use sampled::Sampled;
use scouts::Scouts;

/// Lit pixels that scouts look at.
const SCOUTED: usize = 40;
/// Share of the allowed error that a choice aims at: scouts are few, and the certificate is the
/// upper end of an interval. The more, the more pictures are made twice; the less, the longer all of
/// them take.
const AIM: f64 = 0.75;
/// The same for another attempt, to the power of its number, after a certificate was too large: at
/// most [`KEPT`]. From what was learned, mostly too much error is expected.
const NEXT_AIM: f64 = 0.9;
/// Share of the allowed error that the certified bound may have after the first attempt: attempts
/// are repeated until one succeeds, so that those whose pixels happen to be good ones are preferred.
const KEPT: f64 = 0.9;
/// Attempts to keep an error.
const ATTEMPTS: i32 = 5;
/// The tolerance of pixels, as a share of the allowed error, and the RMS error that they add, as a
/// share of their tolerance; as measured. Half of it takes up to half as long again, twice as much
/// hardly less.
const PIXELS: f64 = 1.0;
const ADDED: f64 = 0.35;
/// By how much that tolerance shrinks at once for another attempt, if more pixels than expected were
/// wrong: the least and the greatest share that is left.
const LEAST_SHARE: f64 = 0.25;
const MOST_SHARE: f64 = 0.7;
/// The least ratio of a certificate's error to its bound that is believed: the difference of two
/// samples may say that there is no error at all.
const LEAST_RATIO: f64 = 0.25;
/// The allowed qualities.
const QUALITIES: [f64; 2] = [0.125, 8.0];
/// Seed of the pixels' random numbers; each purpose and attempt has its own stream, and later looks
/// are so many streams further.
const SEED: u64 = 1;
const STREAMS: u64 = 100;

/// What a picture is chosen for.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Goal {
    /// The RMS error of radiance over lit pixels must be at most this share of the radiance's 99.9th
    /// percentile, with 95 % confidence; as fast as possible.
    Error(f64),
    /// Map and picture together take about this many seconds; as exact as possible.
    Seconds(f64),
}

/// What is given and not chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Given {
    /// Texels along each edge of the maps are those of the settings.
    pub size: bool,
    /// The quality is that of the settings.
    pub quality: bool,
    /// The tolerance of pixels is that of the settings.
    pub tolerance: bool,
}

/// A picture, and how it was chosen.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Chosen {
    /// The picture, in linear radiance.
    pub image: Image,
    /// The settings that repeat it.
    pub settings: Settings,
    /// Its error, as measured at random pixels.
    pub error: PictureError,
}

/// Makes the picture of `scene` that reaches `goal`. Settings that are `given` stay, and size and
/// quality of the others are where the search begins.
///
/// # Errors
/// If the settings ask for another kind of map than fragments, for the paper's shading or for a
/// wide filter; if no attempt keeps the error; and those of [`Backend::render`].
pub fn choose_picture(
    backend: &dyn Backend,
    scene: &Scene,
    settings: &Settings,
    goal: Goal,
    given: Given,
    progress: &dyn Progress,
) -> Result<Chosen> {
    check(settings)?;
    settings.check()?;
    progress.begin("scouting", 1);
    let mut scouts = Scouts::look(scene, settings, SCOUTED, SEED)?;
    progress.advance(1);
    let mut stage = backend.stage();
    match goal {
        Goal::Seconds(seconds) => {
            let settings = scouts.within(seconds, given)?;
            let image = stage.render(scene, &settings, progress)?;
            let error = certified(&mut *stage, (scene, &settings, &image), 2, None)?;
            Ok(Chosen { image, settings, error })
        }
        Goal::Error(most) => {
            let mut tolerance = if given.tolerance {
                settings.image.tolerance
            } else {
                three_digits(PIXELS * most).min(0.5)
            };
            let mut added = ADDED * tolerance;
            let mut aim = AIM * most;
            let mut closest = None;
            for attempt in 0..ATTEMPTS {
                // If that alone is too much, the certificate will say so.
                let rest = (aim.powi(2) - added.powi(2)).max(0.1 * aim.powi(2)).sqrt();
                let mut settings = scouts.keeping(rest, given)?;
                settings.image.tolerance = tolerance;
                let image = stage.render(scene, &settings, progress)?;
                let made = (scene, &settings, &image);
                let kept = if attempt == 0 { most } else { KEPT * most };
                let limits = Some([kept, most]);
                let error = certified(&mut *stage, made, 2 + attempt as u64, limits)?;
                if error.bound <= kept {
                    return Ok(Chosen { image, settings, error });
                }
                let expected = added;
                if error.interpolated > 0.0 {
                    added = error.interpolated;
                }
                // What was not expected may come from steps or from texels.
                let rest = error.rms.powi(2) - added.powi(2);
                scouts.learn(&settings, rest.max(0.0).sqrt());
                if added > expected && !given.tolerance {
                    let share = (expected / added).clamp(LEAST_SHARE, MOST_SHARE);
                    tolerance = three_digits(share * tolerance);
                    added *= share;
                }
                let ratio = (error.rms / error.bound).max(LEAST_RATIO);
                aim = NEXT_AIM.powi(attempt + 1) * most * ratio;
                closest = Some((settings, error));
            }
            let said = closest.map_or_else(String::new, |(settings, error)| {
                let (size, quality) = (settings.map.size, settings.quality);
                format!("; with maps of {size}x{size} and quality {quality:.3} it is {error}")
            });
            let why = format!("no picture tried keeps {most}{said}");
            Err(Error::value("max-picture-error", why))
        }
    }
}

/// Whether scouts can tell what a picture under `settings` looks like.
fn check(settings: &Settings) -> Result<()> {
    let refused = |why: String| Err(Error::value("max-picture-error or time", why));
    match settings.map.kind {
        None | Some(MapKind::Fragments) => {}
        Some(kind) => return refused(format!("chooses fragment maps, not '{kind}'")),
    }
    if settings.view.shading == Shading::Paper {
        return refused("does not apply to the paper's shading, which is not physical".to_owned());
    }
    if settings.map.filter.window() != (0, false) {
        return refused("does not apply to wide filters, which blur shadows on purpose".to_owned());
    }
    Ok(())
}
