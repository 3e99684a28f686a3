//! Where a camera must stand to see a volume and its shadow.

use glam::DVec3;

use super::{Ground, Light};
use crate::math::{Aabb, frame_of};

/// Share of the picture's height and width that stays free at each edge.
const MARGIN: f64 = 0.08;

/// Shadows count up to this far from what casts them, in heights of the volume.
const FARTHEST_SHADOW: f64 = 3.0;

/// The points that a first picture must contain: the volume's outline and its shadow on the ground.
/// Shadows under a low light are long, so what is further away than three heights of the volume
/// does not count.
pub(super) fn shown_points(
    visible: &[DVec3],
    light: Option<&Light>,
    ground: Option<Ground>,
) -> Vec<DVec3> {
    let (Some(light), Some(ground)) = (light, ground) else { return visible.to_vec() };
    let height = Aabb::around(visible.iter().copied()).map_or(0.0, |bounds| bounds.size().y);
    let farthest = FARTHEST_SHADOW * height;
    let (mut shadows, mut near) = (Vec::new(), false);
    for &point in visible {
        let direction = light.direction_at(point);
        let distance = (ground.height - point.y) / direction.y;
        // Zero on the ground itself.
        if !(distance >= 0.0 && direction.y < 0.0) {
            continue;
        }
        let along = DVec3::new(direction.x, 0.0, direction.z);
        let away = along.length() * distance;
        near |= away <= farthest;
        let foot = DVec3::new(point.x, ground.height, point.z);
        shadows.push(foot + along.normalize_or_zero() * away.min(farthest));
    }
    if !near {
        shadows.clear();
    }
    visible.iter().copied().chain(shadows).collect()
}

/// The position of a camera that sees everything.
pub(super) struct Framed {
    /// World position of the eye.
    pub position: DVec3,
    /// World position in the middle of the picture.
    pub target: DVec3,
    /// World lengths between the upper and lower edge at the target, for orthographic views.
    pub height: f64,
}

/// Finds the camera that looks along `forward` and sees all of `points`, as close as the margin
/// allows. Along each image axis the points restrict the camera to a wedge; the apex of the
/// narrower wedge is its position.
pub(super) fn frame(
    points: &[DVec3],
    forward: DVec3,
    up: DVec3,
    fov_y_degrees: f64,
    aspect: f64,
) -> Framed {
    let (right, up) = frame_of(forward, up);
    let slope_y = (fov_y_degrees.to_radians() * 0.5).tan() * (1.0 - 2.0 * MARGIN);
    let wedge = |axis: DVec3, slope: f64| {
        let edge = |sign: f64| {
            points
                .iter()
                .map(|p| sign * p.dot(axis) + slope * p.dot(forward))
                .fold(f64::MAX, f64::min)
        };
        let (low, high) = (edge(1.0), edge(-1.0));
        // The wedge's apex: (position along the axis, position along the view).
        ((low - high) * 0.5, (low + high) * 0.5 / slope)
    };
    let (x, depth_x) = wedge(right, slope_y * aspect);
    let (y, depth_y) = wedge(up, slope_y);
    let position = right * x + up * y + forward * depth_x.min(depth_y);
    let middle = middle_of(points);
    let target = position + forward * (middle - position).dot(forward);
    let reach = |axis: DVec3| {
        points.iter().map(|p| (p - target).dot(axis).abs()).fold(f64::MIN_POSITIVE, f64::max)
    };
    let height = 2.0 * reach(up).max(reach(right) / aspect) / (1.0 - 2.0 * MARGIN);
    Framed { position, target, height }
}

/// The smallest distance from `target` at which a camera, turned to any of `eyes` (unit vectors
/// from the target to the camera, and what is up there), sees all of `points`; and the world
/// lengths between the picture's edges for parallel rays.
pub(super) fn orbit(
    points: &[DVec3],
    target: DVec3,
    eyes: &[(DVec3, DVec3)],
    fov_y_degrees: f64,
    aspect: f64,
) -> (f64, f64) {
    let free = 1.0 - 2.0 * MARGIN;
    let slope = (fov_y_degrees.to_radians() * 0.5).tan() * free;
    let (mut distance, mut half) = (f64::MIN_POSITIVE, f64::MIN_POSITIVE);
    for &(eye, up) in eyes {
        let (right, up) = frame_of(-eye, up);
        for point in points {
            let from = *point - target;
            let reach = (from.dot(right).abs() / aspect).max(from.dot(up).abs());
            half = half.max(reach);
            distance = distance.max(reach / slope + from.dot(eye));
        }
    }
    (distance, 2.0 * half / free)
}

/// The height of a target at which [`orbit`] comes closest, above or below `middle`, within the
/// points' own extent.
pub(super) fn orbit_target(
    points: &[DVec3],
    middle: DVec3,
    eyes: &[(DVec3, DVec3)],
    fov_y_degrees: f64,
    aspect: f64,
) -> DVec3 {
    let Some(bounds) = Aabb::around(points.iter().copied()) else { return middle };
    let at = |height: f64| DVec3::new(middle.x, height, middle.z);
    let distance = |height| orbit(points, at(height), eyes, fov_y_degrees, aspect).0;
    // The distance is a convex function of the height: a largest of linear ones.
    let (mut low, mut high) = (bounds.min.y, bounds.max.y);
    for _ in 0..40 {
        let third = (high - low) / 3.0;
        if distance(low + third) < distance(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    at((low + high) * 0.5)
}

/// The centre of the bounding box of `points`.
pub(super) fn middle_of(points: &[DVec3]) -> DVec3 {
    Aabb::around(points.iter().copied()).map_or(DVec3::ZERO, |bounds| bounds.center())
}
