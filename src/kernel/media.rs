//! Samples what a ray meets: a plain volume or a mixture. On the GPU each of the two has a file of
//! its own in `shaders/media/` with functions of the same names.

use std::cell::Cell;

use glam::{Vec3, Vec4};

use super::density::{Density, four_densities, sample_density};
use super::light::{irradiance_at, irradiance_over, light_direction_at};
use super::medium::{octaves, phase};
use super::mixture::{
    Met, MixedMedia, four_classified, mixture_density, mixture_emission, mixture_source,
};
use super::ray::Ray;
use crate::frame::Frame;
use crate::math::Each;
use crate::scene::{Media, Occupancy};

/// Media ready to be sampled.
#[derive(Clone, Debug)]
pub struct Sampler<'a> {
    content: Content<'a>,
    /// Which parts of the media are empty, and how long steps may be elsewhere.
    pub occupancy: &'a Occupancy,
}

#[derive(Clone, Debug)]
enum Content<'a> {
    /// One volume whose extinction is its density times a constant, which the frame holds.
    Plain(Density<'a>),
    /// For light rays, which need extinction only: one volume whose extinction is its density times
    /// this number.
    Scaled(Density<'a>, f32),
    /// For light rays: one volume whose extinction is a function of its density.
    Classified(Box<MixedMedia<'a>>),
    /// Everything else.
    Mixed(Box<MixedMedia<'a>>),
    /// For light rays: `content`, one of the two above, within a part of the media's box, and
    /// `mixed` where pieces reach beyond that part.
    Within(Box<Within<'a>>),
}

#[derive(Clone, Debug)]
struct Within<'a> {
    content: Content<'a>,
    mixed: MixedMedia<'a>,
    /// That part, in the media's index space.
    bounds: [Vec3; 2],
}

/// A piece of a ray in index space, around a distance along it.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a> {
    /// The ray, in the media's index space.
    pub ray: &'a Ray,
    /// Distance to its middle.
    pub at: f32,
    /// Half of its length.
    pub half: f32,
}

impl<'a> Sampler<'a> {
    /// A sampler of extinction, scattering and emission of `media`.
    pub fn of(media: &'a Media) -> Self {
        let content = match media.plain() {
            Some(volume) => Content::Plain(Density::of(volume)),
            None => Content::Mixed(Box::new(MixedMedia::of(media))),
        };
        Self { content, occupancy: media.occupancy() }
    }

    /// A sampler for light rays, which need the extinction of `media` only: the same extinction as
    /// [`Sampler::of`] has, but faster. Scattering and emission are not available.
    pub fn of_extinction(media: &'a Media) -> Self {
        let Some(body) = media.graded().filter(|_| media.plain().is_none()) else {
            return Self::of(media);
        };
        let content = match &body.medium.transfer {
            Some(_) => Content::Classified(Box::new(MixedMedia::of(media))),
            None => {
                let scale = (body.medium.density_scale * media.unit()) as f32;
                Content::Scaled(Density::of(&body.volume), scale)
            }
        };
        let domain = body.volume.domain();
        let content = if domain == media.domain() {
            content
        } else {
            let bounds = [domain.min.as_vec3(), domain.max.as_vec3()];
            Content::Within(Box::new(Within { content, mixed: MixedMedia::of(media), bounds }))
        };
        Self { content, occupancy: media.occupancy() }
    }
}

/// Mean density over the piece of `ray` that extends by `half` before and behind distance `at`;
/// times the frame's extinction per density it is extinction.
#[inline]
pub fn density_along(sampler: &Sampler<'_>, ray: &Ray, at: f32, half: f32) -> f32 {
    match &sampler.content {
        Content::Plain(density) => sample_density(density, ray.at(at)),
        Content::Scaled(density, scale) => scale * sample_density(density, ray.at(at)),
        Content::Mixed(media) | Content::Classified(media) => {
            mixture_density(media, &Piece { ray, at, half })
        }
        Content::Within(within) => mixture_density(&within.mixed, &Piece { ray, at, half }),
    }
}

/// [`density_along`] over four pieces of a ray, one behind the other. `met` is the cache of this
/// ray.
#[inline]
pub fn four_along(sampler: &Sampler<'_>, ray: &Ray, at: Vec4, half: Vec4, met: &Cell<Met>) -> Vec4 {
    let content = match &sampler.content {
        Content::Within(within) => {
            let ends = [ray.at(at.x - half.x), ray.at(at.w + half.w)];
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            let [min, max] = within.bounds;
            if high.cmplt(min).any() || low.cmpgt(max).any() {
                return Vec4::ZERO;
            }
            if low.cmplt(min).any() || high.cmpgt(max).any() {
                return four_mixed(&within.mixed, ray, at, half);
            }
            &within.content
        }
        content => content,
    };
    match content {
        Content::Plain(density) => four_densities(density, ray, at),
        Content::Scaled(density, scale) => *scale * four_densities(density, ray, at),
        Content::Classified(media) => four_classified(media, ray, at, half, met),
        Content::Mixed(media) => four_mixed(media, ray, at, half),
        Content::Within(within) => four_mixed(&within.mixed, ray, at, half),
    }
}

fn four_mixed(media: &MixedMedia<'_>, ray: &Ray, at: Vec4, half: Vec4) -> Vec4 {
    let piece = |i: usize| Piece { ray, at: at[i], half: half[i] };
    Vec4::from_array([0, 1, 2, 3].each(|i| mixture_density(media, &piece(i))))
}

/// Unshadowed light that arrives at a point of a camera ray.
#[derive(Clone, Copy, Debug)]
pub struct Arriving {
    /// Irradiance on a plane that faces the light.
    irradiance: Vec3,
    /// Cosine of the angle between the directions of light before and after it scatters towards the
    /// camera.
    cosine: f32,
    /// Light that a plain medium scatters to the camera, per unit of optical depth and albedo.
    scattered: Vec3,
}

/// Unshadowed light that arrives at `point`, in frame space, on the camera ray `ray`.
#[inline]
pub fn arriving(frame: &Frame, ray: &Ray, point: Vec3) -> Arriving {
    let cosine = -ray.direction.dot(light_direction_at(frame, point));
    let irradiance = irradiance_at(frame, point);
    Arriving { irradiance, cosine, scattered: irradiance * phase(frame.media.phase_g, cosine) }
}

/// Unshadowed light that arrives over the piece of a camera ray within `half` of distance `at`. It
/// is that at the piece's middle, except for a light among the media: its squared distance may
/// change much over the piece, so its irradiance is a mean.
#[inline]
pub fn arriving_over(frame: &Frame, ray: &Ray, [at, half]: [f32; 2]) -> Arriving {
    if frame.light.spread < 2 {
        return arriving(frame, ray, ray.at(at));
    }
    let cosine = -ray.direction.dot(light_direction_at(frame, ray.at(at)));
    let irradiance = irradiance_over(frame, [at - half, at, at + half].each(|t| ray.at(t)));
    Arriving { irradiance, cosine, scattered: irradiance * phase(frame.media.phase_g, cosine) }
}

/// Radiance that a piece of a ray scatters towards the camera per unit of opacity, where
/// `transmittance` of the light arrives.
#[inline]
pub fn source_along(
    sampler: &Sampler<'_>,
    frame: &Frame,
    piece: &Piece<'_>,
    light: &Arriving,
    transmittance: f32,
) -> Vec3 {
    let ambient = frame.view.ambient;
    let more = frame.view.octaves;
    match &sampler.content {
        Content::Plain(_) | Content::Scaled(..) => {
            let lit = if more == 0 {
                light.scattered * transmittance
            } else {
                light.irradiance * octaves(more, frame.media.phase_g, light.cosine, transmittance)
            };
            frame.media.albedo * (lit + ambient)
        }
        Content::Mixed(media) | Content::Classified(media) => {
            let (scattered, albedo) =
                mixture_source(media, piece, |g| octaves(more, g, light.cosine, transmittance));
            light.irradiance * scattered + ambient * albedo
        }
        // This content is made for light rays, which need no scattering.
        Content::Within(_) => Vec3::ZERO,
    }
}

/// Radiance that a piece of a ray emits per world length.
#[inline]
pub fn emission_along(sampler: &Sampler<'_>, piece: &Piece<'_>) -> Vec3 {
    match &sampler.content {
        Content::Plain(_) | Content::Scaled(..) | Content::Within(_) => Vec3::ZERO,
        Content::Mixed(media) | Content::Classified(media) => mixture_emission(media, piece),
    }
}
