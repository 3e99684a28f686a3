//! What hands do to a camera and to a light. All lengths are world lengths, all drags are in shares
//! of the picture's height.

use deepshadow::glam::{DQuat, DVec3};
use deepshadow::math::Aabb;
use deepshadow::scene::automatic::{angles_of, direction_of};
use deepshadow::scene::{Camera, Light, LightKind, Projection};

/// Degrees of a drag over the picture's height.
const DEGREES: f64 = 180.0;
/// How near to straight up or down a camera is turned, in degrees.
const HIGHEST: f64 = 89.5;
/// The nearest that a camera comes to what it looks at, in world lengths.
const LEAST_DISTANCE: f64 = 1e-9;

/// Turns a camera around what it looks at, about its own up.
pub fn orbit(camera: &mut Camera, [x, y]: [f64; 2]) {
    let up = camera.up.normalize_or(DVec3::Y);
    let upright = DQuat::from_rotation_arc(up, DVec3::Y);
    let eye = upright * (camera.position - camera.target);
    let [azimuth, elevation] = angles_of(eye);
    let elevation = (elevation + y * DEGREES).clamp(-HIGHEST, HIGHEST);
    let turned = direction_of(azimuth - x * DEGREES, elevation);
    camera.position = camera.target + upright.inverse() * turned * eye.length();
}

/// Moves a camera and what it looks at across the picture, so that the target follows the pointer.
pub fn pan(camera: &mut Camera, [x, y]: [f64; 2]) {
    let away = camera.target - camera.position;
    let forward = away.normalize_or(DVec3::NEG_Z);
    let right = forward.cross(camera.up).normalize_or(DVec3::X);
    let up = right.cross(forward);
    let height = match camera.projection {
        Projection::Perspective { fov_y_degrees } => {
            2.0 * away.length() * (0.5 * fov_y_degrees.to_radians()).tan()
        }
        Projection::Orthographic { height } => height,
        _ => return,
    };
    let moved = (up * y - right * x) * height;
    camera.position += moved;
    camera.target += moved;
}

/// Makes what a camera looks at appear `factor` times as large.
pub fn zoom(camera: &mut Camera, factor: f64) {
    if !(factor > 0.0 && factor.is_finite()) {
        return;
    }
    let eye = camera.position - camera.target;
    let nearer = eye / factor;
    if nearer.length() > LEAST_DISTANCE && nearer.length() < 1e12 {
        camera.position = camera.target + nearer;
    }
    if let Projection::Orthographic { height } = &mut camera.projection {
        *height /= factor;
    }
}

/// Turns a light on the sphere around what is seen: right and left about the vertical as they are
/// seen, up and down towards the zenith. A light with a position keeps its distance from `middle`.
pub fn turn_light(light: &mut Light, middle: DVec3, [x, y]: [f64; 2]) {
    let from = match light.kind {
        LightKind::Directional { direction } => -direction,
        LightKind::Point { position } | LightKind::Spot { position, .. } => position - middle,
        _ => return,
    };
    let [azimuth, elevation] = angles_of(from);
    let elevation = (elevation - y * DEGREES).clamp(-HIGHEST, HIGHEST);
    let turned = direction_of(azimuth + x * DEGREES, elevation);
    match &mut light.kind {
        LightKind::Directional { direction } => *direction = -turned,
        LightKind::Point { position } => *position = middle + turned * from.length(),
        LightKind::Spot { position, direction, .. } => {
            *position = middle + turned * from.length();
            *direction = -turned;
        }
        _ => {}
    }
}

/// A light of another kind that shines on `bounds` from where `light` shines.
pub fn light_of_kind(light: &Light, kind: &str, bounds: &Aabb) -> LightKind {
    let (middle, size) = (bounds.center(), bounds.size().length().max(1e-6));
    let direction = light.direction_at(middle).normalize_or(DVec3::NEG_Y);
    let position = light.position().unwrap_or(middle - direction * size);
    match kind {
        "point" => LightKind::Point { position },
        "spot" => LightKind::Spot { position, direction, cone_degrees: 30.0, cone_softness: 0.2 },
        _ => LightKind::Directional { direction },
    }
}

#[cfg(test)]
mod tests {
    use deepshadow::glam::dvec3;

    use super::*;

    fn camera() -> Camera {
        Camera::perspective(dvec3(0.0, 0.0, 5.0), dvec3(0.0, 0.0, 1.0), 90.0)
    }

    #[test]
    fn a_drag_to_the_right_turns_what_is_seen_to_the_right() {
        let mut turned = camera();
        orbit(&mut turned, [0.5, 0.0]);
        // A quarter turn: the camera goes to the left, at the same distance.
        assert!((turned.position - dvec3(-4.0, 0.0, 1.0)).length() < 1e-12);
        orbit(&mut turned, [0.0, 3.0]);
        let eye = (turned.position - turned.target).normalize();
        assert!((eye.y.asin().to_degrees() - HIGHEST).abs() < 1e-9);
        assert!((turned.position - turned.target).length() - 4.0 < 1e-12);
    }

    #[test]
    fn a_camera_with_another_up_turns_about_that() {
        let mut turned = camera();
        (turned.up, turned.position) = (DVec3::Z, dvec3(3.0, 0.0, 2.0));
        turned.target = dvec3(0.0, 0.0, 2.0);
        orbit(&mut turned, [0.25, 0.0]);
        assert!((turned.position.z - 2.0).abs() < 1e-12, "{}", turned.position);
        assert!((turned.position.truncate().length() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn the_target_follows_the_pointer_when_the_camera_is_moved() {
        let mut moved = camera();
        // At distance 4 under 90 degrees the picture is 8 high.
        pan(&mut moved, [0.25, 0.5]);
        assert!((moved.target - dvec3(-2.0, 4.0, 1.0)).length() < 1e-12);
        assert!((moved.position - dvec3(-2.0, 4.0, 5.0)).length() < 1e-12);
    }

    #[test]
    fn zooming_halves_the_distance_or_the_height() {
        let mut near = camera();
        zoom(&mut near, 2.0);
        assert_eq!(near.position, dvec3(0.0, 0.0, 3.0));
        near.projection = Projection::Orthographic { height: 6.0 };
        zoom(&mut near, 2.0);
        assert!(matches!(near.projection, Projection::Orthographic { height } if height == 3.0));
        zoom(&mut near, f64::NAN);
        assert_eq!(near.position, dvec3(0.0, 0.0, 2.0));
    }

    #[test]
    fn a_light_turns_about_the_vertical_and_keeps_its_distance() {
        let mut light = Light::directional(dvec3(0.0, 0.0, -1.0));
        turn_light(&mut light, DVec3::ZERO, [0.5, 0.0]);
        let LightKind::Directional { direction } = light.kind else { return };
        // It comes from +x now.
        assert!((direction - dvec3(-1.0, 0.0, 0.0)).length() < 1e-12, "{direction}");
        light.kind = LightKind::Point { position: dvec3(1.0, 1.0, 3.0) };
        turn_light(&mut light, dvec3(1.0, 1.0, 1.0), [0.0, -0.25]);
        let LightKind::Point { position } = light.kind else { return };
        let from = position - dvec3(1.0, 1.0, 1.0);
        assert!((from.length() - 2.0).abs() < 1e-12);
        assert!((from.y - 2.0 * 45_f64.to_radians().sin()).abs() < 1e-12, "{from}");
    }
}
