//! How many steps rays take, how long those may be, and the bricks that they are led by.

use glam::{DVec3, Vec3, Vec4};

use crate::scene::{LightView, Media};
use crate::settings::{Crossing, Settings, Shading, Slices};

/// Steps along a light ray for each voxel length that it crosses at most, and [`Settings::steps`] in all.
pub const LIGHT_STEPS_PER_VOXEL: f32 = 8.0;
/// Steps along a light ray at least, for small volumes.
pub const LIGHT_STEPS_LEAST: u32 = 64;
/// Steps along a camera ray for each voxel length that it crosses at most. (A step takes two samples of
/// density and at most one of the light.)
pub const VIEW_STEPS_PER_VOXEL: f32 = 0.8;
/// Four steps of a camera ray, or two, share one sample of the light if they add no more than this share of
/// the pixel's light.
pub const LOOKUP_WEIGHT: f32 = 1.0 / 16.0;
/// Slabs along a light ray for each voxel length that it crosses at most, and [`Settings::steps`] in all. More
/// than steps of a threshold map: between slabs optical depth is taken to be linear.
pub const SLABS_PER_VOXEL: f32 = 8.0;
/// Steps for each voxel length at least, of any kind.
const LEAST_PER_VOXEL: f64 = 0.125;
/// How far optical depth may bend within a step of a threshold map's light ray: the slope of extinction
/// times an eighth of the length squared.
const LIGHT_BEND: f64 = 0.0025;
/// The same within a slab, as a share of the tolerance.
const SLAB_BEND: f64 = 0.2;
/// The same between two samples of a camera ray.
const VIEW_BEND: f64 = 0.0025;
/// Optical depth of the densest medium over four steps that share a lookup.
const LOOKUP_DEPTH: f64 = 0.3;
/// The same over a step of a camera ray, whatever the slope: one place speaks for the light of all of it.
const VIEW_DEPTH: f64 = 0.15;
/// Voxels that the steps of a batch may cross together; within the bricks that a code speaks for.
const BATCH_VOXELS: f64 = 9.0;
/// Samples in a slab for each voxel length of it, at least one.
pub const SLAB_SAMPLES_PER_VOXEL: f32 = 3.0;
/// Steps along a camera ray at least.
pub const VIEW_STEPS_LEAST: u32 = 72;
/// Steps along a camera ray at most, unless [`Settings::view_steps`] says otherwise.
pub const VIEW_STEPS_MOST: u32 = 8192;

/// Light steps at least and at most, camera steps at least and at most.
pub(super) fn steps(settings: &Settings) -> [u32; 4] {
    let paper = settings.shading == Shading::Paper;
    // The paper marches with a fixed number of steps.
    let view_most = settings.view_steps.unwrap_or(if paper { 512 } else { VIEW_STEPS_MOST });
    let light_most = settings.steps;
    if paper {
        [light_most, light_most, view_most, view_most]
    } else {
        [LIGHT_STEPS_LEAST.min(light_most), light_most, VIEW_STEPS_LEAST.min(view_most), view_most]
    }
}

/// Steps for each voxel length ([`Frame::rates`]) and how long they may be ([`Frame::lengths`],
/// [`Frame::longest`]): as the largest change of extinction asks for, within what always suffices.
pub(super) fn marching(media: &Media, settings: &Settings, tolerance: f64) -> [Vec4; 3] {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let transform = media.world_from_index();
    let voxel = axes
        .map(|axis| transform.transform_vector3(axis).length())
        .into_iter()
        .fold(1e30, f64::min);
    let roughness = media.occupancy().roughness();
    // (most steps for each voxel, bend, samples a step)
    let passes = [
        (LIGHT_STEPS_PER_VOXEL, LIGHT_BEND, 1.0),
        (SLABS_PER_VOXEL, SLAB_BEND * tolerance, 1.0),
        (VIEW_STEPS_PER_VOXEL, VIEW_BEND, 2.0),
    ];
    let [mut rates, mut lengths, mut longest] = [Vec4::ZERO; 3];
    if settings.shading == Shading::Paper || media.plain().is_none() {
        // As many steps as were asked for, or nothing is known of the slopes: all as long as each other.
        let rates = passes.map(|(most, ..)| most);
        return [Vec3::from_array(rates).extend(0.0), lengths, longest];
    }
    for (i, (most, bend, samples)) in passes.into_iter().enumerate() {
        let most = f64::from(most);
        let length = if roughness > 0.0 {
            samples * (8.0 * bend * voxel / roughness).sqrt()
        } else {
            voxel / most
        };
        let rate = (voxel / length.max(1e-3 * voxel)).clamp(LEAST_PER_VOXEL, most);
        (rates[i], lengths[i]) = (rate as f32, length as f32);
    }
    longest = Vec3::splat((0.25 * BATCH_VOXELS * voxel) as f32).extend(0.0);
    let densest = media.first().medium.density_scale * f64::from(media.largest());
    let known = roughness > 0.0 && densest > 0.0;
    if known {
        longest.w = (LOOKUP_DEPTH / densest) as f32;
    }
    if densest > 0.0 {
        lengths.z = lengths.z.min((VIEW_DEPTH / densest) as f32);
    }
    if settings.crossing != Crossing::Exact {
        // Depths are wrong by as much as steps are long.
        (rates.x, lengths.x) = (LIGHT_STEPS_PER_VOXEL, 0.0);
    }
    [rates, lengths, longest]
}

/// [`Frame::brick_scale`], [`Frame::brick_offset`].
pub(super) fn bricks(media: &Media) -> [Vec4; 2] {
    let occupancy = media.occupancy();
    let (origin, edge) = (occupancy.origin(), occupancy.edge());
    // Voxels along a unit, and the index at the origin, of the space that shaders sample in.
    let (unit, start) = match media.plain() {
        Some(_) => (DVec3::from_array(media.dims().map(|n| n as f64)), DVec3::splat(-0.5)),
        None => (DVec3::ONE, DVec3::ZERO),
    };
    let scale = (unit / edge).as_vec3().extend(0.0);
    [scale, ((start - origin) / edge).as_vec3().extend(0.0)]
}

/// How many planes all rays share; 0 for slabs of each ray's own.
pub(super) fn planes(settings: &Settings, light: &LightView, media: &Media) -> u32 {
    match settings.slices {
        Slices::Auto | Slices::Ray => 0,
        Slices::Planes | Slices::Raster => {
            let slabs = light.axial_voxels(media) * f64::from(SLABS_PER_VOXEL);
            (slabs.ceil() as u32).clamp(LIGHT_STEPS_LEAST, u32::MAX).min(settings.steps)
        }
    }
}
