//! Rods: two crossed solid rods in empty space, with edges that are 1.5 voxels soft.

use glam::DVec3;
use ndarray::Array3;

const RADIUS: f64 = 0.18;
const HALF_LENGTH: f64 = 0.85;
const DENSITY: f64 = 0.9;
const AXES: [DVec3; 2] = [DVec3::new(1.0, 1.0, 0.15), DVec3::new(1.0, -1.0, -0.15)];

/// The larger of the two rods' densities at each voxel.
pub(super) fn voxels(n: usize) -> Array3<f32> {
    let soft_edge = 1.5 * 2.0 / n as f64;
    let inside = |distance: f64| (distance / soft_edge + 0.5).clamp(0.0, 1.0);
    let axes = AXES.map(DVec3::normalize);
    super::cube(n, |p| {
        let p = DVec3::from_array(p);
        let rod = |axis: &DVec3| {
            let along = p.dot(*axis);
            let from_axis = (p - along * axis).length();
            inside(RADIUS - from_axis) * inside(HALF_LENGTH - along.abs())
        };
        axes.iter().map(rod).fold(0.0, f64::max) * DENSITY
    })
}
