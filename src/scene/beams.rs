//! A scene taken apart into what one shadow map can answer: one light in one colour channel, or in
//! all of them where extinction is grey, as one of the light's views sees it.
//!
//! Radiance is a sum over lights, and what happens to red light does not depend on blue light. So a
//! picture of many lights and coloured media is a sum of pictures of one light in grey media, of
//! which each gives the channels that it is right in. A light among what it shines on sees it
//! through the faces of a cube, each of which lights what lies behind it. Every pass works on such
//! a beam alone; a grey scene with one light is one of them and costs what it did before there were
//! colours.

use glam::{DVec3, Vec4};

use super::{Body, Camera, Ground, Light, LightView, Media, Scene};
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

/// What passes take: one light in some channels, as one of its views sees what it shines on, and
/// who looks.
#[derive(Clone, Debug)]
pub struct Beam {
    /// What light passes through, grey.
    pub media: Media,
    /// The light.
    pub light: Light,
    /// How its map lies in the world.
    pub view: LightView,
    /// Radiance from everywhere, unshadowed, per channel. What needs no light of its own (this,
    /// emission, the background) is in a scene's first beam alone.
    pub ambient: DVec3,
    /// Who looks.
    pub camera: Camera,
    /// The plane that catches the shadow.
    pub ground: Option<Ground>,
    /// Radiance behind everything, per channel.
    pub background: Option<DVec3>,
    /// Which of the scene's lights, from 0.
    pub index: usize,
    /// Where its picture is right.
    pub channels: Channels,
    /// Shares of its picture in that of the scene, for each channel and for alpha: opacity is the
    /// same for every light, and of coloured media the mean over the channels.
    pub weights: Vec4,
}

impl Scene {
    /// The scene taken apart: one beam where it has one light and grey media.
    ///
    /// # Errors
    /// If a light cannot be fitted to the media ([`LightView::of`]).
    pub fn beams(&self) -> Result<Vec<Beam>> {
        let grey = self.media.bodies().iter().all(|body| {
            let tint = body.medium.tint;
            tint.x == tint.y && tint.y == tint.z
        });
        let channels: &[Channels] = if grey {
            &[Channels::All]
        } else {
            &[Channels::One(0), Channels::One(1), Channels::One(2)]
        };
        let mut beams = Vec::new();
        // Without any light there is still what needs none.
        let dark = [Light::DARK];
        let lights = if self.lights.is_empty() { &dark[..] } else { &self.lights };
        for (index, light) in lights.iter().enumerate() {
            for (number, view) in LightView::of(light, &self.media)?.into_iter().enumerate() {
                let first = index == 0 && number == 0;
                beams.extend(
                    channels.iter().map(|&own| self.beam((index, *light), &view, own, first)),
                );
            }
        }
        Ok(beams)
    }

    /// The only beam.
    ///
    /// # Errors
    /// If there are several, and as [`Scene::beams`].
    pub fn only_beam(&self) -> Result<Beam> {
        let mut beams = self.beams()?;
        match (beams.pop(), beams.len()) {
            (Some(only), 0) => Ok(only),
            (_, more) => {
                let why = format!("{} beams of light where one is meant", more + 1);
                Err(Error::value("scene", why))
            }
        }
    }

    /// `first`: of its channels, the scene's first.
    fn beam(
        &self,
        (index, light): (usize, Light),
        view: &LightView,
        channels: Channels,
        first: bool,
    ) -> Beam {
        let mut media = self.media.clone();
        media.make_grey(match channels {
            Channels::All => 0,
            Channels::One(channel) => channel,
        });
        if !first {
            media.remove_emission();
        }
        let (ambient, background) = if first {
            (self.ambient, self.background)
        } else {
            (DVec3::ZERO, self.background.map(|_| DVec3::ZERO))
        };
        let weights = channels.weights() * Vec4::new(1.0, 1.0, 1.0, f32::from(first));
        let (camera, ground) = (self.camera, self.ground);
        Beam {
            media,
            light,
            view: *view,
            ambient,
            camera,
            ground,
            background,
            index,
            channels,
            weights,
        }
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
}

impl Beam {
    /// Adds this beam's picture to `sum`.
    pub fn add(&self, picture: &Image, sum: &mut Image) {
        for (sum, pixel) in sum.pixels.iter_mut().zip(&picture.pixels) {
            *sum = (Vec4::from(*sum) + self.weights * Vec4::from(*pixel)).to_array();
        }
    }

    /// What its map is called among those of a scene: nothing if there is no other.
    pub fn label(&self, all: &[Self]) -> Option<String> {
        let several = all.iter().any(|beam| beam.index > 0);
        let light = several.then(|| format!("light{}", self.index + 1));
        let face = self.view.face.map(|face| format!("face{}", face + 1));
        let channel = (self.channels != Channels::All).then(|| self.channels.name().to_owned());
        let parts: Vec<String> = [light, face, channel].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join("."))
    }
}
