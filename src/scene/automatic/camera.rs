//! The camera: what a scene file says of it, and for the rest a view of everything.

use glam::DVec3;

use super::{Choices, digits, finite, short};
use crate::error::{Error, Result};
use crate::scene::file::CameraTable;
use crate::scene::framing::{frame, middle_of, shown_points};
use crate::scene::{Camera, Ground, Light, Projection};

const FOV_Y_DEGREES: f64 = 32.0;
/// From the target to the eye: a three-quarter view.
const EYE_DIRECTION: DVec3 = DVec3::new(0.36, 0.42, 1.0);

pub(super) fn camera(
    table: &CameraTable,
    visible: &[DVec3],
    light: Option<&Light>,
    ground: Option<Ground>,
    aspect: f64,
    choices: &mut Choices,
) -> Result<Camera> {
    let kind = table.kind.as_deref().unwrap_or("perspective");
    if !matches!(kind, "perspective" | "orthographic") {
        let why = format!("'{kind}' is not one of perspective, orthographic");
        return Err(Error::value("camera.kind", why));
    }
    let fov_y_degrees = table.fov_y_degrees.unwrap_or(FOV_Y_DEGREES);
    if !(fov_y_degrees > 0.0 && fov_y_degrees < 179.0) {
        let why = format!("{fov_y_degrees} is not between 0 and 179");
        return Err(Error::value("camera.fov_y_degrees", why));
    }
    let eye = eye(table)?;
    let up = finite("camera.up", table.up.unwrap_or(upward(eye).to_array()))?;
    let zoom = table.zoom.unwrap_or(1.0);
    if !(zoom > 0.0 && zoom.is_finite()) {
        return Err(Error::value("camera.zoom", format!("{zoom} is not above 0")));
    }
    let shown = shown_points(visible, light, ground);
    let (mut position, mut target) = (table.position, table.target);
    let mut extent_y = table.height;
    let direction = match (position, target) {
        (Some(from), Some(to)) => DVec3::from(to) - DVec3::from(from),
        _ => -eye,
    };
    if position.is_none() || (kind == "orthographic" && extent_y.is_none()) {
        let framed = frame(&shown, direction.normalize_or(-DVec3::Z), up, fov_y_degrees, aspect);
        if kind == "orthographic" && extent_y.is_none() {
            extent_y = Some(framed.height);
            choices.took("camera height (camera.height)", digits(framed.height));
        }
        if position.is_none() {
            // Around a given target, as far away as the framed view is.
            let turned = target.filter(|_| is_turned(table));
            let distance = (framed.position - framed.target).length();
            let framed_position = turned
                .map_or(framed.position, |target| DVec3::from(target) + distance * eye.normalize());
            choices.took("camera position (`camera.position`)", short(framed_position));
            position = Some(framed_position.to_array());
            if target.is_none() {
                choices.took("camera target (`camera.target`)", short(framed.target));
                target = Some(framed.target.to_array());
            }
            if kind == "perspective" && table.fov_y_degrees.is_none() {
                choices
                    .took("camera field of view (`camera.fov_y_degrees`)", digits(fov_y_degrees));
            }
        }
    }
    let position = finite("camera.position", position.unwrap_or_default())?;
    let target = match target {
        Some(target) => finite("camera.target", target)?,
        None => {
            let target = middle_of(visible);
            choices.took("camera target (`camera.target`)", short(target));
            target
        }
    };
    if (target - position).length_squared() == 0.0 {
        return Err(Error::value(
            "camera.target",
            format!("{target} is the camera's own position"),
        ));
    }
    let projection = match (kind, extent_y) {
        ("orthographic", Some(height)) if height > 0.0 && height.is_finite() => {
            Projection::Orthographic { height: height / zoom }
        }
        ("orthographic", height) => {
            let why = format!("{} is not above 0", height.unwrap_or_default());
            return Err(Error::value("camera.height", why));
        }
        _ => {
            let slope = (fov_y_degrees.to_radians() * 0.5).tan() / zoom;
            let zoomed = if zoom == 1.0 { fov_y_degrees } else { 2.0 * slope.atan().to_degrees() };
            Projection::Perspective { fov_y_degrees: zoomed }
        }
    };
    Ok(Camera { projection, position, target, up })
}

/// Whether a table says from where the camera looks by angles.
fn is_turned(table: &CameraTable) -> bool {
    table.azimuth_degrees.is_some() || table.elevation_degrees.is_some()
}

/// The direction from what is seen to the camera; not of unit length.
fn eye(table: &CameraTable) -> Result<DVec3> {
    if !is_turned(table) {
        return Ok(EYE_DIRECTION);
    }
    if table.position.is_some() {
        let why = "angles and a position contradict each other";
        return Err(Error::value("camera.azimuth_degrees or elevation_degrees", why));
    }
    let usual = EYE_DIRECTION.normalize();
    let azimuth = table.azimuth_degrees.unwrap_or(usual.x.atan2(usual.z).to_degrees());
    let elevation = table.elevation_degrees.unwrap_or(usual.y.asin().to_degrees());
    if !azimuth.is_finite() {
        return Err(Error::value("camera.azimuth_degrees", format!("{azimuth} is not finite")));
    }
    if !(-90.0..=90.0).contains(&elevation) {
        let why = format!("{elevation} is not between -90 and 90");
        return Err(Error::value("camera.elevation_degrees", why));
    }
    Ok(direction_of(azimuth, elevation))
}

/// The unit vector at `azimuth` degrees from +z towards +x and `elevation` degrees above the
/// horizon.
pub fn direction_of(azimuth: f64, elevation: f64) -> DVec3 {
    let ((s, c), (y, across)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
    DVec3::new(s * across, y, c * across)
}

/// What is up in a picture from the direction `eye`: y, but seen from straight above or below what
/// is up just beside that.
fn upward(eye: DVec3) -> DVec3 {
    let across = DVec3::new(eye.x, 0.0, eye.z);
    if across.length() > 1e-6 * eye.length() {
        return DVec3::Y;
    }
    -eye.y.signum() * across.try_normalize().unwrap_or(DVec3::Z)
}
