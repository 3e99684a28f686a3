//! The camera, which maps picture positions to rays.

use glam::{DMat4, DVec3, DVec4};
use serde::{Deserialize, Serialize};

use crate::math::frame_of;

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct Camera {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// World position of the eye.
    pub position: DVec3,
    /// World position in the middle of the picture; different from `position`.
    pub target: DVec3,
    /// The direction that is up in the picture; need not be perpendicular to the view.
    pub up: DVec3,
}

/// How a camera's rays spread.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub enum Projection {
    /// All rays start at one point.
    Perspective {
        /// Angle between the picture's upper and lower edge, degrees, 0 < angle < 180.
        fov_y_degrees: f64,
    },
    /// Rays are parallel and start on a plane through the camera's position.
    Orthographic {
        /// World lengths between the picture's upper and lower edge.
        height: f64,
    },
}

/// The rays of a picture. The ray through `(x, y)`, each 0..1 from the upper left corner, starts at
/// `origin + x origin_x + y origin_y` and has the direction `direction + x direction_x + y
/// direction_y`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct ViewRays {
    pub origin: DVec3,
    pub origin_x: DVec3,
    pub origin_y: DVec3,
    /// Not normalised, like `direction_x` and `direction_y`.
    pub direction: DVec3,
    pub direction_x: DVec3,
    pub direction_y: DVec3,
}

impl Camera {
    /// A camera at world position `position` that looks at `target`, with y up and an angle of
    /// `fov_y_degrees` between the picture's upper and lower edge.
    pub fn perspective(position: DVec3, target: DVec3, fov_y_degrees: f64) -> Self {
        let projection = Projection::Perspective { fov_y_degrees };
        Self { projection, position, target, up: DVec3::Y }
    }

    /// A camera with parallel rays, and `height` world lengths between the picture's upper and
    /// lower edge.
    pub fn orthographic(position: DVec3, target: DVec3, height: f64) -> Self {
        Self { projection: Projection::Orthographic { height }, position, target, up: DVec3::Y }
    }

    /// The picture's unit vectors: forward, right and up.
    pub fn axes(&self) -> [DVec3; 3] {
        let forward = (self.target - self.position).normalize_or_zero();
        let (right, up) = frame_of(forward, self.up);
        [forward, right, up]
    }

    /// The transform from the world to the camera's space: x to the right, y up and z forward, in
    /// world lengths from the camera's position. It is left-handed, as in OpenEXR and RenderMan.
    pub fn camera_from_world(&self) -> DMat4 {
        let [forward, right, up] = self.axes();
        let row = |axis: DVec3| axis.extend(-axis.dot(self.position));
        DMat4::from_cols(row(right), row(up), row(forward), DVec4::W).transpose()
    }

    /// The transform from the world to a picture whose width is `aspect` times its height. After
    /// division by w, x and y are 0..1 from the picture's upper left to its lower right corner. z
    /// grows with the distance along the camera's axis: it is that distance if rays are parallel,
    /// else 1 - 1 / distance.
    pub fn picture_from_world(&self, aspect: f64) -> DMat4 {
        let (half, is_perspective) = match self.projection {
            Projection::Perspective { fov_y_degrees } => {
                ((fov_y_degrees.to_radians() * 0.5).tan(), true)
            }
            Projection::Orthographic { height } => (height * 0.5, false),
        };
        let [x, y] = [0.5 / (half * aspect), -0.5 / half];
        // The middle of the picture is at (0.5, 0.5) times w.
        let rows = if is_perspective {
            [
                DVec4::new(x, 0.0, 0.5, 0.0),
                DVec4::new(0.0, y, 0.5, 0.0),
                DVec4::new(0.0, 0.0, 1.0, -1.0),
                DVec4::Z,
            ]
        } else {
            [DVec4::new(x, 0.0, 0.0, 0.5), DVec4::new(0.0, y, 0.0, 0.5), DVec4::Z, DVec4::W]
        };
        let [a, b, c, d] = rows;
        DMat4::from_cols(a, b, c, d).transpose() * self.camera_from_world()
    }

    /// The rays of a picture whose width is `aspect` times its height.
    pub fn rays(&self, aspect: f64) -> ViewRays {
        let [forward, right, up] = self.axes();
        match self.projection {
            Projection::Perspective { fov_y_degrees } => {
                let half = (fov_y_degrees.to_radians() * 0.5).tan();
                let (across, down) = (right * (2.0 * half * aspect), -up * (2.0 * half));
                ViewRays {
                    origin: self.position,
                    origin_x: DVec3::ZERO,
                    origin_y: DVec3::ZERO,
                    direction: forward - (across + down) * 0.5,
                    direction_x: across,
                    direction_y: down,
                }
            }
            Projection::Orthographic { height } => {
                let (across, down) = (right * (height * aspect), -up * height);
                ViewRays {
                    origin: self.position - (across + down) * 0.5,
                    origin_x: across,
                    origin_y: down,
                    direction: forward,
                    direction_x: DVec3::ZERO,
                    direction_y: DVec3::ZERO,
                }
            }
        }
    }
}

impl ViewRays {
    /// Origin and unit direction of the ray through `(x, y)`, each 0..1 from the upper left corner.
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let direction = self.direction + x * self.direction_x + y * self.direction_y;
        (self.origin + x * self.origin_x + y * self.origin_y, direction.normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> [Camera; 2] {
        let (position, target) = (DVec3::new(3.0, -2.0, 7.5), DVec3::new(-1.0, 0.25, 0.5));
        let tilted = |camera| Camera { up: DVec3::new(0.3, 1.0, -0.2), ..camera };
        [
            tilted(Camera::perspective(position, target, 41.0)),
            tilted(Camera::orthographic(position, target, 3.5)),
        ]
    }

    /// Every point of a pixel's ray is projected to that pixel, farther ones to a greater z.
    #[test]
    fn points_of_a_ray_are_projected_to_its_pixel() {
        for camera in cameras() {
            let aspect = 1.75;
            let (rays, matrix) = (camera.rays(aspect), camera.picture_from_world(aspect));
            for (x, y) in [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.2, 0.9), (0.75, 0.125)] {
                let (origin, direction) = rays.ray(x, y);
                let mut last = f64::NEG_INFINITY;
                for t in [0.3, 1.0, 8.0, 200.0] {
                    let seen = matrix.project_point3(origin + t * direction);
                    let off = DVec3::new(seen.x - x, seen.y - y, 0.0).length();
                    assert!(off < 1e-12 && seen.z > last, "{camera:?}: {seen} for {x}, {y}");
                    last = seen.z;
                }
            }
        }
    }

    #[test]
    fn the_cameras_space_is_left_handed_with_the_target_on_its_z_axis() {
        for camera in cameras() {
            let matrix = camera.camera_from_world();
            assert!((matrix.determinant() + 1.0).abs() < 1e-12);
            let target = matrix.transform_point3(camera.target);
            let distance = camera.target.distance(camera.position);
            assert!(target.distance(DVec3::Z * distance) < 1e-12, "{target}");
            assert!(matrix.transform_point3(camera.position).length() < 1e-12);
            assert!(matrix.transform_vector3(camera.up).y > 0.0);
        }
    }
}
