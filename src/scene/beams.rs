//! Takes a scene apart into beams, each of which one shadow map can answer for: one light, in one
//! colour channel or in all where extinction is grey, as one of the light's views sees it.
//!
//! Radiance is a sum over lights, and red light is independent of blue light. So a picture of
//! several lights and coloured media is a sum of pictures with one light and grey media, each of
//! which is valid in some channels. A light among the media sees them through the faces of a cube,
//! and each face lights what lies behind it. Every pass works on one such beam; a grey scene with
//! one light is a single beam and costs no more than without colours.
//!
//! Where all media have the same tint, the optical depths of the channels are proportional, and one
//! map and one march can serve all of them ([`Scene::beams_for`]).

use glam::{DVec3, Vec4};

use super::{Body, Camera, Casters, Ground, Light, LightView, Media, Scene, Surfaces};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::settings::{MapKind, Settings, Shading};

/// Largest ratio of the extinctions of two channels that share a beam. Tolerances are divided by it.
const MOST_RATIO: f64 = 16.0;

/// The colour channels in which a picture is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Red, green and blue together.
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

    /// Weight of a picture in each colour channel, 1 or 0, and in alpha: the alpha weights of a
    /// light's channels add up to 1.
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

/// The input of all passes: one light in some channels, as one of its views sees the media, and a
/// camera.
#[derive(Clone, Debug)]
pub struct Beam {
    /// The media, grey.
    pub media: Media,
    /// The surfaces, of which some may cast no shadow.
    pub surfaces: Surfaces,
    /// The light.
    pub light: Light,
    /// The light's view that its map uses.
    pub view: LightView,
    /// Ambient radiance, which is not shadowed, per channel. Ambient radiance, emission and
    /// background need no light, so only the scene's first beam has them.
    pub ambient: DVec3,
    /// The camera.
    pub camera: Camera,
    /// The plane that receives shadows.
    pub ground: Option<Ground>,
    /// Radiance of the background, per channel; `None` for a transparent one.
    pub background: Option<DVec3>,
    /// Index of the light in [`Scene::lights`].
    pub index: usize,
    /// The channels in which the picture is valid.
    pub channels: Channels,
    /// The extinction of each channel, as a multiple of that of `media`, at least 1; 1 for a beam
    /// of grey media or of one channel.
    pub ratios: DVec3,
    /// Weights of the picture in the scene's picture, for each channel and alpha. Opacity is the
    /// same for every light, so only the first light counts; of coloured media it is the mean over
    /// the channels.
    pub weights: Vec4,
}

impl Scene {
    /// Takes the scene apart: into a beam for each light, each of its views (one, or up to six for
    /// a light among the media or close to them) and, where some medium's tint is coloured, each
    /// channel. One parallel light and grey media give a single beam.
    ///
    /// A scene without lights has the beam of a dark one (three where a tint is coloured), for
    /// ambient light, emission and background.
    ///
    /// # Errors
    /// If a light cannot be fitted to the media ([`LightView::of`]).
    pub fn beams(&self) -> Result<Vec<Beam>> {
        let grey = self.media.bodies().iter().all(|body| {
            let tint = body.medium.tint;
            tint.x == tint.y && tint.y == tint.z
        });
        let all = [(0, Channels::All, DVec3::ONE)];
        let each = [0, 1, 2].map(|channel| (channel, Channels::One(channel), DVec3::ONE));
        self.beams_in(if grey { &all } else { &each })
    }

    /// [`Scene::beams`] for pictures under `settings`: with all channels of a light's view in one
    /// beam where that is possible. It is where the media's tints agree up to a factor, no channel
    /// is more than sixteen times as extinct as another, fragment maps are looked up without wide
    /// filters, shading is physical, and no surface casts shadows. The beam's media then are those of the channel with the
    /// least extinction, and [`Beam::ratios`] are those of the others to it.
    ///
    /// # Errors
    /// As [`Scene::beams`].
    pub fn beams_for(&self, settings: &Settings) -> Result<Vec<Beam>> {
        let can_share = settings.map.kind.unwrap_or_default() == MapKind::Fragments
            && settings.map.filter.window() == (0, false)
            && settings.view.shading == Shading::Physical
            // Surfaces take as much of every channel.
            && self.surfaces.iter().all(|surface| !surface.casts);
        match self.common_tint().filter(|_| can_share) {
            Some((least, ratios)) => self.beams_in(&[(least, Channels::All, ratios)]),
            None => self.beams(),
        }
    }

    /// The channel with the least extinction, and the ratios of all channels to it, which are the
    /// same in all media and moderate.
    fn common_tint(&self) -> Option<(usize, DVec3)> {
        let tint = self.media.first()?.medium.tint;
        let least = tint.to_array().into_iter().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let ratios = tint / least.1;
        let is_moderate = ratios.max_element() <= MOST_RATIO;
        let agree = self.media.bodies().iter().all(|body| {
            let other = body.medium.tint / body.medium.tint[least.0];
            (other - ratios).abs().max_element() <= 1e-9
        });
        (is_moderate && agree).then_some((least.0, ratios))
    }

    /// The beams with the given channels: for each the channel whose extinction its media have, the
    /// channels, and the ratios of their extinctions.
    fn beams_in(&self, channels: &[(usize, Channels, DVec3)]) -> Result<Vec<Beam>> {
        let mut beams = Vec::new();
        // Ambient radiance, emission and background need a beam even if there is no light.
        let dark = [Light::DARK];
        let lights = if self.lights.is_empty() { &dark[..] } else { &self.lights };
        let casters = Casters { media: &self.media, surfaces: &self.surfaces };
        for (index, light) in lights.iter().enumerate() {
            for (number, view) in LightView::of(light, casters)?.into_iter().enumerate() {
                let first = index == 0 && number == 0;
                let beam = |&own: &_| {
                    let beam = self.beam((index, *light), &view, own, first);
                    Beam { surfaces: self.surfaces.clone(), ..beam }
                };
                beams.extend(channels.iter().map(beam));
            }
        }
        Ok(beams)
    }

    /// The scene's beam, if there is only one.
    ///
    /// # Errors
    /// If there are several, and those of [`Scene::beams`].
    pub fn only_beam(&self) -> Result<Beam> {
        let mut beams = self.beams()?;
        match (beams.pop(), beams.len()) {
            (Some(only), 0) => Ok(only),
            (_, more) => {
                let why = format!("{} beams of light, expected one", more + 1);
                Err(Error::value("scene", why))
            }
        }
    }

    /// One beam; `first` says that it is the scene's first one with these channels.
    fn beam(
        &self,
        (index, light): (usize, Light),
        view: &LightView,
        (channel, channels, ratios): (usize, Channels, DVec3),
        first: bool,
    ) -> Beam {
        let mut media = self.media.clone();
        media.make_grey(channel);
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
            surfaces: Surfaces::default(),
            light,
            view: *view,
            ambient,
            camera,
            ground,
            background,
            index,
            channels,
            ratios,
            weights,
        }
    }

    /// Checks that a picture of the scene holds finite numbers only.
    ///
    /// # Errors
    /// If it does not: then some radiance does not fit f32, and the error names what emits it.
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
        Err(Error::value(what, format!("its radiance (about {radiance:e}) does not fit in f32")))
    }
}

impl Beam {
    /// The media and surfaces in this beam.
    pub fn casters(&self) -> Casters<'_> {
        Casters { media: &self.media, surfaces: &self.surfaces }
    }

    /// The media with the extinction of the channel that has the most.
    pub fn thickest(&self) -> Media {
        let most = self.ratios.max_element();
        let mut media = self.media.clone();
        media.make_thicker(most);
        media
    }

    /// Adds this beam's `picture`, times the beam's weights, to `sum`, a picture of the same size.
    pub fn add(&self, picture: &Image, sum: &mut Image) {
        for (sum, pixel) in sum.pixels.iter_mut().zip(&picture.pixels) {
            *sum = (Vec4::from(*sum) + self.weights * Vec4::from(*pixel)).to_array();
        }
    }

    /// The name of the beam's map among the beams `all` of a scene, made of light, face and
    /// channel; `None` if it is the only one.
    pub fn label(&self, all: &[Self]) -> Option<String> {
        let several = all.iter().any(|beam| beam.index > 0);
        let light = several.then(|| format!("light{}", self.index + 1));
        let face = self.view.face.map(|face| format!("face{}", face + 1));
        let channel = (self.channels != Channels::All).then(|| self.channels.name().to_owned());
        let parts: Vec<String> = [light, face, channel].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join("."))
    }
}
