//! A scene taken apart into what one shadow map can answer: one light in one colour channel, or in all
//! of them where extinction is grey.
//!
//! Radiance is a sum over lights, and what happens to red light does not depend on blue light. So a
//! picture of many lights and coloured media is a sum of pictures of one light in grey media, of which
//! each gives the channels that it is right in. Every pass works on such a scene alone; a grey scene with
//! one light is one of them and costs what it did before there were colours.

use glam::{DVec3, Vec4};

use super::{Body, Scene};
use crate::error::{Error, Result};
use crate::image::Image;

/// The colour channels that a picture is right in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Red, green and blue.
    All,
    /// One of them: 0 is red, 1 green, 2 blue.
    One(usize),
}

impl Channels {
    /// `rgb`, `red`, `green` or `blue`.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "rgb",
            Self::One(0) => "red",
            Self::One(1) => "green",
            Self::One(_) => "blue",
        }
    }

    /// 1 for each of them, alpha in shares that add up to 1 over the channels of a light.
    fn weights(self) -> Vec4 {
        match self {
            Self::All => Vec4::ONE,
            Self::One(channel) => {
                let mut weights = Vec4::new(0.0, 0.0, 0.0, 1.0 / 3.0);
                weights[channel.min(2)] = 1.0;
                weights
            }
        }
    }
}

/// One light in some channels of a scene.
#[derive(Clone, Debug)]
pub struct Beam {
    /// The scene as this light's map and picture see it: of one light and with grey media. What needs no
    /// light of its own (ambient light, emission, background) is in the first light's beams alone.
    pub scene: Scene,
    /// Which of the scene's lights, from 0.
    pub light: usize,
    /// Where its picture is right.
    pub channels: Channels,
}

impl Scene {
    /// The scene taken apart; one beam, which equals it, of a scene with one light and grey media.
    pub fn beams(&self) -> Vec<Beam> {
        let grey = self.media.bodies().iter().all(|body| {
            let tint = body.medium.tint;
            tint.x == tint.y && tint.y == tint.z
        });
        let channels: &[Channels] = if grey {
            &[Channels::All]
        } else {
            &[Channels::One(0), Channels::One(1), Channels::One(2)]
        };
        let lights = 0..self.lights.len();
        lights.flat_map(|light| channels.iter().map(move |&c| self.beam(light, c))).collect()
    }

    /// Makes sure that a picture of the scene holds numbers alone.
    ///
    /// # Errors
    /// If a radiance does not fit f32: whose it is.
    pub fn check_radiance(&self, picture: &Image) -> Result<()> {
        if picture.pixels.iter().flatten().all(|value| value.is_finite()) {
            return Ok(());
        }
        let emission =
            |body: &Body| body.medium.emission.as_ref().map_or(0.0, |emission| emission.scale);
        let emitted = self.media.bodies().iter().map(emission).fold(0.0, f64::max);
        let emitted = emitted * self.media.world_bounds().size().length();
        let center = self.media.world_bounds().center();
        let arriving = self.lights.iter().map(|light| light.irradiance_at(center).max_element());
        let arriving = arriving.fold(0.0, f64::max);
        let others = self.ambient.max(self.background.unwrap_or_default()).max_element();
        let (what, radiance) = if emitted >= arriving.max(others) {
            ("emission", emitted)
        } else if arriving >= others {
            ("light", arriving)
        } else {
            ("ambient or background", others)
        };
        Err(Error::value(what, format!("its radiance (about {radiance:e}) does not fit f32")))
    }

    fn beam(&self, light: usize, channels: Channels) -> Beam {
        let mut scene = Self { lights: vec![self.lights[light]], ..self.clone() };
        let channel = match channels {
            Channels::All => 0,
            Channels::One(channel) => channel,
        };
        for medium in scene.media.mediums_mut() {
            medium.density_scale *= medium.tint[channel];
            medium.tint = DVec3::ONE;
            if light > 0 {
                medium.emission = None;
            }
        }
        if light > 0 {
            scene.ambient = DVec3::ZERO;
            scene.background = scene.background.map(|_| DVec3::ZERO);
        }
        Beam { scene, light, channels }
    }
}

impl Beam {
    /// Shares of this beam's picture in that of the scene, for each channel and for alpha: opacity is the same for
    /// every light, and of coloured media the mean over the channels.
    pub fn weights(&self) -> Vec4 {
        self.channels.weights() * Vec4::new(1.0, 1.0, 1.0, f32::from(self.light == 0))
    }

    /// Adds this beam's picture to `sum`.
    pub fn add(&self, picture: &Image, sum: &mut Image) {
        let weights = self.weights();
        for (sum, pixel) in sum.pixels.iter_mut().zip(&picture.pixels) {
            *sum = (Vec4::from(*sum) + weights * Vec4::from(*pixel)).to_array();
        }
    }

    /// What its map is called among those of a scene: nothing if there is no other.
    pub fn label(&self, all: &[Self]) -> Option<String> {
        let several = all.iter().any(|beam| beam.light > 0);
        match (several, self.channels) {
            (false, Channels::All) => None,
            (false, one) => Some(one.name().to_owned()),
            (true, Channels::All) => Some(format!("light{}", self.light + 1)),
            (true, one) => Some(format!("light{}.{}", self.light + 1, one.name())),
        }
    }
}
