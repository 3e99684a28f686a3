//! The camera: what a scene file says of it, and for the rest a view of everything.

use glam::DVec3;

use super::{Choices, digits, finite, short};
use crate::error::{Error, Result};
use crate::scene::file::CameraTable;
use crate::scene::framing::{frame, middle_of};
use crate::scene::{Camera, Projection};

const FOV_Y_DEGREES: f64 = 32.0;
/// From the target to the eye: a three-quarter view.
pub(super) const EYE_DIRECTION: DVec3 = DVec3::new(0.36, 0.42, 1.0);

/// The camera of `table`. What it leaves out is chosen so that a picture whose width is `aspect`
/// times its height contains all points of `shown`, with those of `visible` around its middle.
pub(super) fn camera(
    table: &CameraTable,
    (visible, shown): (&[DVec3], &[DVec3]),
    aspect: f64,
    choices: &mut Choices,
) -> Result<Camera> {
    let kind = table.kind.as_deref().unwrap_or("perspective");
    if !matches!(kind, "perspective" | "orthographic") {
        let why = format!("'{kind}' is not one of perspective, orthographic");
        return Err(Error::value("camera.kind", why));
    }
    let fov_y_degrees = fov_y_degrees(table)?;
    let eye = eye(table)?;
    let up = up(table, eye)?;
    let zoom = table.zoom.unwrap_or(1.0);
    if !(zoom > 0.0 && zoom.is_finite()) {
        return Err(Error::value("camera.zoom", format!("{zoom} is not above 0")));
    }
    let (mut position, mut target) = (table.position, table.target);
    let mut extent_y = table.height;
    let direction = match (position, target) {
        (Some(from), Some(to)) => DVec3::from(to) - DVec3::from(from),
        _ => -eye,
    };
    if position.is_none() || (kind == "orthographic" && extent_y.is_none()) {
        let framed = frame(shown, direction.normalize_or(-DVec3::Z), up, fov_y_degrees, aspect);
        if kind == "orthographic" && extent_y.is_none() {
            extent_y = Some(framed.height);
            choices.took("camera height (camera.height)", digits(framed.height));
        }
        if position.is_none() {
            // Around a given target, as far away as the framed view is, unless a distance is given.
            let given = distance(table)?;
            let about = match target {
                Some(target) if is_turned(table) || given.is_some() => Some(target.into()),
                Some(_) => None,
                None => given.map(|_| framed.target),
            };
            let distance = given.unwrap_or((framed.position - framed.target).length());
            let framed_position =
                about.map_or(framed.position, |about| about + distance * eye.normalize());
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

/// Whether a chosen view contains shadows.
pub(super) fn fits_shadow(table: &CameraTable) -> Result<bool> {
    match table.fit.as_deref() {
        None | Some("shadow") => Ok(true),
        Some("volume") => Ok(false),
        Some(other) => {
            Err(Error::value("camera.fit", format!("'{other}' is not one of volume, shadow")))
        }
    }
}

/// The angle between the picture's upper and lower edge, in degrees.
pub(super) fn fov_y_degrees(table: &CameraTable) -> Result<f64> {
    let fov_y_degrees = table.fov_y_degrees.unwrap_or(FOV_Y_DEGREES);
    if fov_y_degrees > 0.0 && fov_y_degrees < 179.0 {
        return Ok(fov_y_degrees);
    }
    let why = format!("{fov_y_degrees} is not above 0 and below 179");
    Err(Error::value("camera.fov_y_degrees", why))
}

/// The given distance from the camera to its target.
pub(super) fn distance(table: &CameraTable) -> Result<Option<f64>> {
    match table.distance {
        Some(given) if !(given > 0.0 && given.is_finite()) => {
            Err(Error::value("camera.distance", format!("{given} is not above 0")))
        }
        given => Ok(given),
    }
}

/// What is up in a picture from the direction `eye`.
pub(super) fn up(table: &CameraTable, eye: DVec3) -> Result<DVec3> {
    finite("camera.up", table.up.unwrap_or(upward(eye).to_array()))
}

/// Whether a table says from where the camera looks by angles.
fn is_turned(table: &CameraTable) -> bool {
    table.azimuth_degrees.is_some() || table.elevation_degrees.is_some()
}

/// Degrees of a direction from +z towards +x, and above the horizon.
pub fn angles_of(direction: DVec3) -> [f64; 2] {
    let across = direction.x.hypot(direction.z);
    [direction.x.atan2(direction.z).to_degrees(), direction.y.atan2(across).to_degrees()]
}

/// The direction from what is seen to the camera; not of unit length.
pub(super) fn eye(table: &CameraTable) -> Result<DVec3> {
    let given = [table.azimuth_degrees, table.elevation_degrees, table.distance];
    if table.position.is_some() && given.iter().any(Option::is_some) {
        let why = "angles or a distance and a position contradict each other";
        let keys = "camera.azimuth_degrees or elevation_degrees or distance";
        return Err(Error::value(keys, why));
    }
    if !is_turned(table) {
        return Ok(EYE_DIRECTION);
    }
    let usual = angles_of(EYE_DIRECTION);
    let azimuth = table.azimuth_degrees.unwrap_or(usual[0]);
    let elevation = table.elevation_degrees.unwrap_or(usual[1]);
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
