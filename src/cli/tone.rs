//! Options on how radiance is shown on a screen.

use clap::Args;

use super::arguments::{overlay, parse};
use super::job::Job;
use crate::image::{Exposure, Image, Tone, ToneMap};
use crate::scene::file::{ExposureValue, ImageTable};

/// Exposure and tone curve, as options.
#[derive(Debug, Args)]
pub(super) struct ToneArguments {
    /// Factor on radiance before encoding for screens, stops (+1.5ev doubles it one and a half
    /// times), or auto, which makes the brightest hundredth of the picture nearly white [1].
    #[arg(long, value_name = "X|STOPSev|auto", value_parser = parse::<Exposure>, allow_hyphen_values = true, help_heading = "Picture")]
    exposure: Option<Exposure>,
    /// Tone curve for screens: none, aces, agx, khronos-neutral [none; agx if the picture has much
    /// above white].
    #[arg(long, value_name = "NAME", value_parser = parse::<ToneMap>, help_heading = "Picture")]
    tonemap: Option<ToneMap>,
}

impl ToneArguments {
    /// Writes the given options into the table.
    pub(super) fn overlay(&self, image: &mut ImageTable) {
        let exposure = self.exposure.map(|exposure| match exposure {
            Exposure::Factor(factor) => ExposureValue::Factor(factor),
            other => ExposureValue::Text(other.to_string()),
        });
        overlay! {
            image.exposure => exposure,
            image.tonemap => self.tonemap.map(|map| map.name().to_owned()),
        }
    }

    /// Whether an option was given.
    pub(super) fn any(&self) -> bool {
        self.exposure.is_some() || self.tonemap.is_some()
    }
}

/// How `image` is shown; reports what was chosen for it.
pub(super) fn tone(job: &Job, image: &Image) -> Tone {
    let tone = Tone::for_picture(image, job.exposure, job.tone_map);
    if job.exposure == Exposure::Auto {
        job.note(&format!("exposure (--exposure) {} (chosen)", tone.exposure));
    }
    if job.tone_map.is_none() && tone.map != ToneMap::None {
        job.note(&format!("tone curve (--tonemap) {} (chosen)", tone.map.name()));
    }
    tone
}
