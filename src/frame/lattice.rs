//! How far apart the pixels may be that are marched first.

use super::steps::smallest_voxel;
use crate::scene::Beam;
use crate::settings::{Settings, Shading};

/// The largest distance, in pixels.
const MOST: u32 = 8;
/// The same as a multiple of a voxel's edge as it appears in the picture, at a tolerance of [`FINE`]
/// and below. What a single voxel adds to a picture is two voxels wide, so some of these pixels see
/// it. The more a picture may be wrong, the more of its single voxels it may miss: the multiple
/// grows with the tolerance, up to the second one.
const VOXELS: [f64; 2] = [1.5, 6.0];
const FINE: f64 = 0.002;

/// The distance of those pixels, a power of two; 1 marches all. Shadows of surfaces may be as thin
/// as a pixel.
pub(super) fn spacing(beam: &Beam, settings: &Settings) -> u32 {
    let (media, camera) = (&beam.media, &beam.camera);
    let marches_all = settings.image.tolerance <= 0.0 || settings.view.shading == Shading::Paper;
    if marches_all || !beam.surfaces.is_empty() {
        return 1;
    }
    let [width, height] = settings.image.size.map(f64::from);
    let rays = camera.rays(width / height);
    let [forward, ..] = camera.axes();
    let depths = media.world_bounds().corners().map(|corner| (corner - rays.origin).dot(forward));
    let farthest = depths.into_iter().fold(0.0, f64::max);
    let pixel = (rays.origin_y.length() + rays.direction_y.length() * farthest) / height;
    let [least, most] = VOXELS;
    let voxels = (least * settings.image.tolerance / FINE).clamp(least, most);
    let widest = voxels * smallest_voxel(media) / pixel;
    let powers = (0..=MOST.ilog2()).rev().map(|power| 1_u32 << power);
    powers.into_iter().find(|&power| f64::from(power) <= widest).unwrap_or(1)
}
