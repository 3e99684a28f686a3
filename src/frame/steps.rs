//! How many steps rays take, how long those may be, and the bricks that they are led by.

use glam::{DVec3, Vec3};

use super::Marching;
use crate::scene::{LightView, Media};
use crate::settings::{Crossing, Lookup, Settings, Shading, Slices};

/// Steps along a light ray for each voxel length that it crosses at most, and
/// [`crate::settings::MapSettings::steps`] in all.
pub const LIGHT_STEPS_PER_VOXEL: f32 = 8.0;
/// Steps along a light ray at least, for small volumes.
pub const LIGHT_STEPS_LEAST: u32 = 64;
/// Steps along a camera ray for each voxel length that it crosses at most. (A step takes two
/// samples of density and at most one of the light.)
pub const VIEW_STEPS_PER_VOXEL: f32 = 0.8;
/// Four steps of a camera ray, or two, share one sample of the light if they add no more than this
/// share of the pixel's light.
pub const LOOKUP_WEIGHT: f32 = 1.0 / 16.0;
/// Slabs along a light ray for each voxel length that it crosses at most, and
/// [`crate::settings::MapSettings::steps`] in all. More than steps of a threshold map: between
/// slabs optical depth is taken to be linear.
pub const SLABS_PER_VOXEL: f32 = 8.0;
/// Steps for each voxel length at least, of any kind.
const LEAST_PER_VOXEL: f64 = 0.125;
/// How far optical depth may bend within a step of a threshold map's light ray: the slope of
/// extinction times an eighth of the length squared.
const LIGHT_BEND: f64 = 0.0025;
/// The same within a slab, as a share of the tolerance.
const SLAB_BEND: f64 = 0.2;
/// The same between two samples of a camera ray.
const VIEW_BEND: f64 = 0.0025;
/// Optical depth of the densest medium over four steps that share a lookup.
const LOOKUP_DEPTH: f64 = 0.3;
/// The same over a step of a camera ray, whatever the slope: one place speaks for the light of all
/// of it.
const VIEW_DEPTH: f64 = 0.15;
/// Bend of optical depth within a step of a threshold map's ray, times the light that is left,
/// beyond which steps are cut: four times what they are made for.
const MOST_LIGHT_BEND: f64 = 0.01;
/// The same within a slab, as a share of the tolerance.
const MOST_SLAB_BEND: f64 = 1.0;
/// The tolerance that slabs are cut by where all of them are kept.
const RAW_TOLERANCE: f64 = 0.002;
/// Optical depth of a sample of a camera ray, half a step, beyond which steps are cut, over the
/// root of the light that is left. A lookup in the middle of a step over which light falls by an
/// optical depth errs by a twenty-fourth of its square: .4 % at most where light falls as fast as
/// it is seen, and of what is cut, a ninth of that.
const SAMPLE_DEPTH: f64 = 0.15;
/// Optical depth of a texel's width that is no matter.
const THIN_TEXEL: f64 = 0.25;
/// Voxels that a texel is wide at most to see surfaces between them.
const FINE_TEXEL: f64 = 0.5;
/// Slope against the light of what counts as one surface, in depth over a texel's width.
const STEEPEST_SURFACE: f64 = 6.0;
/// Optical depth of the densest medium over a step of a camera ray beyond which something thick may
/// hide between its last sample and its end.
const HIDDEN_DEPTH: f64 = 0.6;
/// A limit that nothing reaches.
pub(super) const UNLIMITED: f32 = 1e30;
/// Voxels that the steps of a batch may cross together; within the bricks that a code speaks for.
const BATCH_VOXELS: f64 = 9.0;
/// Samples in a slab for each voxel length of it, at least one.
pub const SLAB_SAMPLES_PER_VOXEL: f32 = 3.0;
/// Steps along a camera ray at least.
pub const VIEW_STEPS_LEAST: u32 = 72;
/// Steps along a camera ray at most, unless [`crate::settings::ViewSettings::steps`] says
/// otherwise.
pub const VIEW_STEPS_MOST: u32 = 8192;

/// Steps along a light ray at least and at most, and along a camera ray.
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

/// How light rays of threshold maps, those of fragment maps and camera rays are cut: as the largest
/// change of extinction asks for, within what always suffices.
pub(super) fn marching(media: &Media, settings: &Settings, tolerance: f64) -> [Marching; 3] {
    let quality = settings.quality;
    let [light, view] = counts(settings);
    let limits = limits(settings, tolerance);
    // (most steps for each voxel, bend, samples a step)
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
        // As many steps as were asked for, unless more is known.
        (marching.per_voxel, marching.limit) = (most as f32, limit);
    }
    let thickest = media.densest() * media.unit() * quality;
    marching[2].hiding = (HIDDEN_DEPTH / thickest.max(1e-30)) as f32;
    if settings.view.shading == Shading::Paper || media.graded().is_none() {
        // Nothing is known of the slopes: all steps are as long as each other.
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
        // Of emission and of colours nothing is known: camera rays take equal steps.
        (view.per_voxel, view.rough, view.longest) = (most[2] as f32, 0.0, 0.0);
    }
    if settings.map.threshold.crossing != Crossing::Exact {
        // Depths are wrong by as much as steps are long.
        (marching[0].per_voxel, marching[0].rough) = (most[0] as f32, 0.0);
    }
    marching
}

/// World length of a voxel's shortest edge.
fn smallest_voxel(media: &Media) -> f64 {
    [DVec3::X, DVec3::Y, DVec3::Z]
        .map(|axis| media.world_from_index().transform_vector3(axis).length())
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// What a batch of steps may hold before it is taken again with shorter ones ([`Marching::limit`]),
/// which happens where a medium is so dense that steps by its voxels are too long: how far optical
/// depth may bend within a step of a threshold map's ray and a slab, as a share of the light that
/// is left, and the optical depth of a sample of a camera ray.
fn limits(settings: &Settings, tolerance: f64) -> [f32; 3] {
    if settings.view.shading == Shading::Paper {
        return [UNLIMITED; 3];
    }
    let bend = match settings.map.threshold.crossing {
        Crossing::Exact => settings.finer(MOST_LIGHT_BEND) as f32,
        Crossing::Smoothstep | Crossing::Bucket => UNLIMITED,
    };
    let slab = if tolerance > 0.0 { tolerance } else { settings.finer(RAW_TOLERANCE) };
    // As differences of the optical depths of two steps side by side: eight times what a line errs
    // by.
    let (bend, slab) = (8.0 * bend, 8.0 * MOST_SLAB_BEND * slab);
    [bend, slab as f32, (SAMPLE_DEPTH / settings.quality) as f32]
}

/// [`super::FrameView::shared_weight`].
pub(super) fn shared_weight(settings: &Settings) -> f32 {
    settings.finer(f64::from(LOOKUP_WEIGHT)) as f32
}

/// [`super::FrameView::shared_length`]: 0, so that no steps share a lookup, where nothing is known
/// of the media.
pub(super) fn shared_length(media: &Media, settings: &Settings) -> f32 {
    let densest = media.densest() * media.unit();
    let known = settings.view.shading != Shading::Paper
        && media.plain().is_some()
        && media.roughness() > 0.0
        && densest > 0.0;
    if known { (LOOKUP_DEPTH / densest / settings.quality) as f32 } else { 0.0 }
}

/// How far apart in depth the fronts of neighbouring texels' shadows are those of one surface: some
/// texels' width; 0 where a texel's width of the densest medium is so thin that none has a front to
/// speak of, and where lookups are not of depths that are exact.
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
    // Texels that are no finer than voxels see no surface, but one voxel beside another.
    let voxel = smallest_voxel(media);
    let seen = texel < FINE_TEXEL * voxel && media.densest() * texel > THIN_TEXEL;
    if seen { STEEPEST_SURFACE * texel } else { 0.0 }
}

/// [`super::FrameMedia::brick_scale`], [`super::FrameMedia::brick_offset`].
pub(super) fn bricks(media: &Media) -> [Vec3; 2] {
    let occupancy = media.occupancy();
    let (origin, edge) = (occupancy.origin(), occupancy.edge());
    // Voxels along a unit, and the index at the origin, of the space that shaders sample in.
    let (unit, start) = match media.plain() {
        Some(_) => (DVec3::from_array(media.dims().map(|n| n as f64)), DVec3::splat(-0.5)),
        None => (DVec3::ONE, DVec3::ZERO),
    };
    [(unit / edge).as_vec3(), ((start - origin) / edge).as_vec3()]
}

/// How many planes all rays share; 0 for slabs of each ray's own.
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
