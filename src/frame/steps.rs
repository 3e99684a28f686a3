//! The number and length of steps along rays, and the bricks that guide rays.

use glam::{DVec3, Vec3};

use super::Marching;
use crate::scene::{LightView, Media};
use crate::settings::{Crossing, Lookup, Settings, Shading, Slices};

/// Largest number of steps along a light ray per voxel length;
/// [`crate::settings::MapSettings::steps`] limits them in all.
pub const LIGHT_STEPS_PER_VOXEL: f32 = 8.0;
/// Smallest number of steps along a light ray, for small volumes.
pub const LIGHT_STEPS_LEAST: u32 = 64;
/// Largest number of steps along a camera ray per voxel length. (A step takes two density samples
/// and at most one light sample.)
pub const VIEW_STEPS_PER_VOXEL: f32 = 0.8;
/// Four steps of a camera ray, or two, share one light sample if together they contribute at most
/// this share of the pixel's light.
pub const LOOKUP_WEIGHT: f32 = 1.0 / 16.0;
/// Largest number of slabs along a light ray per voxel length;
/// [`crate::settings::MapSettings::steps`] limits them in all. More would be needed than steps of a
/// threshold map, because optical depth is linear within a slab.
pub const SLABS_PER_VOXEL: f32 = 8.0;
/// Smallest number of steps per voxel length, for all kinds of rays.
const LEAST_PER_VOXEL: f64 = 0.125;
/// How far optical depth may bend within a step of a threshold map's light ray: the slope of
/// extinction times an eighth of the squared length.
const LIGHT_BEND: f64 = 0.0025;
/// The same within a slab, as a share of the tolerance.
const SLAB_BEND: f64 = 0.2;
/// The same between two samples of a camera ray.
const VIEW_BEND: f64 = 0.0025;
/// Largest optical depth, in the densest medium, of four steps that share a lookup.
const LOOKUP_DEPTH: f64 = 0.3;
/// Largest optical depth, in the densest medium, of a step of a camera ray whatever the slope is,
/// because one light sample stands for the whole step.
const VIEW_DEPTH: f64 = 0.15;
/// A step of a threshold map's ray is shortened if optical depth bends by more than this within it,
/// times the light that is left. It is four times the bend that steps are made for.
const MOST_LIGHT_BEND: f64 = 0.01;
/// The same within a slab, as a share of the tolerance.
const MOST_SLAB_BEND: f64 = 1.0;
/// The tolerance by which slabs are shortened if all of them are kept.
const RAW_TOLERANCE: f64 = 0.002;
/// A step of a camera ray is shortened if a sample, which stands for half a step, has a larger
/// optical depth than this divided by the square root of the light that is left. A lookup in the
/// middle of a step over which light falls by an optical depth has an error of a twenty-fourth of
/// that depth squared: at most .4 % where light falls as fast as it is seen, and a ninth of that
/// for shortened steps.
const SAMPLE_DEPTH: f64 = 0.15;
/// Optical depth of a texel's width up to which texels' fronts do not matter.
const THIN_TEXEL: f64 = 0.25;
/// Largest width of a texel, in voxels, for surfaces to be resolved.
const FINE_TEXEL: f64 = 0.5;
/// Steepest slope of a single surface: depth along the light per texel width.
const STEEPEST_SURFACE: f64 = 6.0;
/// Something thick may lie unseen between the last sample and the end of a camera ray's step that
/// has, in the densest medium, a larger optical depth than this.
const HIDDEN_DEPTH: f64 = 0.6;
/// A limit that is never reached.
pub(super) const UNLIMITED: f32 = 1e30;
/// Largest number of voxels that a batch of steps may cross, so that it stays within the bricks
/// that a code accounts for.
const BATCH_VOXELS: f64 = 9.0;
/// Density samples per voxel length of a slab; at least one per slab.
pub const SLAB_SAMPLES_PER_VOXEL: f32 = 3.0;
/// Smallest number of steps along a camera ray.
pub const VIEW_STEPS_LEAST: u32 = 72;
/// Largest number of steps along a camera ray, unless [`crate::settings::ViewSettings::steps`] sets
/// another.
pub const VIEW_STEPS_MOST: u32 = 8192;

/// Smallest and largest number of steps, along a light ray and along a camera ray.
fn counts(settings: &Settings) -> [[u32; 2]; 2] {
    let paper = settings.view.shading == Shading::Paper;
    // The paper marches with a fixed number of steps.
    let view = settings.view.steps.unwrap_or(if paper { 512 } else { VIEW_STEPS_MOST });
    let light = settings.map.steps;
    let counts = if paper {
        [[light, light], [view, view]]
    } else {
        [[LIGHT_STEPS_LEAST.min(light), light], [VIEW_STEPS_LEAST.min(view), view]]
    };
    counts.map(|range| range.map(|count| settings.more(count)))
}

/// How light rays of threshold maps, those of fragment maps, and camera rays are cut into steps: by
/// the largest change of extinction, within limits that always suffice.
pub(super) fn marching(media: &Media, settings: &Settings, tolerance: f64) -> [Marching; 3] {
    let quality = settings.quality;
    let [light, view] = counts(settings);
    let limits = limits(settings, tolerance);
    // (most steps per voxel, bend, samples per step)
    let passes = [
        (LIGHT_STEPS_PER_VOXEL, settings.finer(LIGHT_BEND), 1.0),
        (SLABS_PER_VOXEL, SLAB_BEND * tolerance, 1.0),
        (VIEW_STEPS_PER_VOXEL, settings.finer(VIEW_BEND), 2.0),
    ];
    let most = passes.map(|(most, ..)| quality * f64::from(most));
    let mut marching = [light, light, view].map(|[least, most]| Marching {
        least,
        most,
        samples: (quality * f64::from(SLAB_SAMPLES_PER_VOXEL)) as f32,
        ..Marching::default()
    });
    for ((marching, most), limit) in marching.iter_mut().zip(most).zip(limits) {
        // The largest number of steps, unless more is known below.
        (marching.per_voxel, marching.limit) = (most as f32, limit);
    }
    let thickest = media.densest() * media.unit() * quality;
    marching[2].hiding = (HIDDEN_DEPTH / thickest.max(1e-30)) as f32;
    if settings.view.shading == Shading::Paper || media.graded().is_none() {
        // The slopes are not known, so all steps have the same length.
        return marching;
    }
    let voxel = smallest_voxel(media) / media.unit();
    let roughness = media.roughness() * media.unit();
    for (i, (_, bend, samples)) in passes.into_iter().enumerate() {
        let length = if roughness > 0.0 {
            samples * (8.0 * bend * voxel / roughness).sqrt()
        } else {
            voxel / most[i]
        };
        let rate =
            (voxel / length.max(1e-3 * voxel)).clamp(quality * LEAST_PER_VOXEL, most[i]) as f32;
        (marching[i].per_voxel, marching[i].rough) = (rate, length as f32);
        marching[i].longest = (0.25 * BATCH_VOXELS * voxel / quality) as f32;
    }
    let densest = media.densest() * media.unit();
    let view = &mut marching[2];
    if densest > 0.0 {
        view.rough = view.rough.min((VIEW_DEPTH / densest / quality) as f32);
    }
    if media.plain().is_none() {
        // The slopes of emission and colours are not known, so camera rays take equal steps.
        (view.per_voxel, view.rough, view.longest) = (most[2] as f32, 0.0, 0.0);
    }
    if settings.map.threshold.crossing != Crossing::Exact {
        // Depths have errors of a step's length.
        (marching[0].per_voxel, marching[0].rough) = (most[0] as f32, 0.0);
    }
    marching
}

/// World length of a voxel's shortest edge.
pub(super) fn smallest_voxel(media: &Media) -> f64 {
    [DVec3::X, DVec3::Y, DVec3::Z]
        .map(|axis| media.world_from_index().transform_vector3(axis).length())
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// The limits of [`Marching::limit`], beyond which a batch of steps is repeated with shorter ones.
/// That happens in media so dense that steps by voxels are too long. The first two limit how far
/// optical depth may bend within a step of a threshold map's ray and within a slab, as a share of
/// the light that is left; the third limits the optical depth of a sample of a camera ray.
fn limits(settings: &Settings, tolerance: f64) -> [f32; 3] {
    if settings.view.shading == Shading::Paper {
        return [UNLIMITED; 3];
    }
    let bend = match settings.map.threshold.crossing {
        Crossing::Exact => settings.finer(MOST_LIGHT_BEND) as f32,
        Crossing::Smoothstep | Crossing::Bucket => UNLIMITED,
    };
    let slab = if tolerance > 0.0 { tolerance } else { settings.finer(RAW_TOLERANCE) };
    // As differences between the optical depths of two adjacent steps, which are eight times the
    // error of a line.
    let (bend, slab) = (8.0 * bend, 8.0 * MOST_SLAB_BEND * slab);
    [bend, slab as f32, (SAMPLE_DEPTH / settings.quality) as f32]
}

/// See [`super::FrameView::shared_weight`].
pub(super) fn shared_weight(settings: &Settings) -> f32 {
    settings.finer(f64::from(LOOKUP_WEIGHT)) as f32
}

/// See [`super::FrameView::shared_length`]; 0, so that no steps share a lookup, if nothing is known
/// about the media's slopes.
pub(super) fn shared_length(media: &Media, settings: &Settings) -> f32 {
    let densest = media.densest() * media.unit();
    let known = settings.view.shading != Shading::Paper
        && media.plain().is_some()
        && media.roughness() > 0.0
        && densest > 0.0;
    if known { (LOOKUP_DEPTH / densest / settings.quality) as f32 } else { 0.0 }
}

/// The largest difference in depth of the fronts of neighbouring texels' shadows that belong to one
/// surface: a few texels' widths. It is 0 where a texel's width of the densest medium is so thin
/// that there are no fronts, and for lookups that do not use exact depths.
pub(super) fn reach(settings: &Settings, light: &LightView, media: &Media) -> f64 {
    let exponential = settings.map.filter.window() != (0, false);
    if exponential
        || settings.map.threshold.lookup == Lookup::Paper
        || settings.view.shading == Shading::Paper
    {
        return 0.0;
    }
    let [_, far] = light.axial_extent(media);
    let across = |origin: DVec3, direction: DVec3| match light.position {
        Some(_) => direction.length() * far,
        None => origin.length(),
    };
    let width =
        across(light.origin_u, light.direction_u).max(across(light.origin_v, light.direction_v));
    let texel = width / f64::from(settings.map.size);
    // Texels that are as coarse as voxels show no surface, only separate voxels.
    let voxel = smallest_voxel(media);
    let seen = texel < FINE_TEXEL * voxel && media.densest() * texel > THIN_TEXEL;
    if seen { STEEPEST_SURFACE * texel } else { 0.0 }
}

/// See [`super::FrameMedia::brick_scale`] and [`super::FrameMedia::brick_offset`].
pub(super) fn bricks(media: &Media) -> [Vec3; 2] {
    let occupancy = media.occupancy();
    let (origin, edge) = (occupancy.origin(), occupancy.edge());
    // For the space in which shaders sample: voxels per unit, and the index at its origin.
    let (unit, start) = match media.plain() {
        Some(_) => (DVec3::from_array(media.dims().map(|n| n as f64)), DVec3::splat(-0.5)),
        None => (DVec3::ONE, DVec3::ZERO),
    };
    [(unit / edge).as_vec3(), ((start - origin) / edge).as_vec3()]
}

/// The number of planes that all rays share; 0 if each ray has its own slabs.
pub(super) fn planes(settings: &Settings, light: &LightView, media: &Media) -> u32 {
    match settings.map.fragments.slices {
        Slices::Auto | Slices::Ray => 0,
        Slices::Planes | Slices::Raster => {
            let slabs = light.axial_voxels(media) * f64::from(SLABS_PER_VOXEL);
            let slabs =
                (slabs.ceil() as u32).clamp(LIGHT_STEPS_LEAST, u32::MAX).min(settings.map.steps);
            settings.more(slabs)
        }
    }
}
