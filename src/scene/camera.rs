//! The camera, which maps picture positions to rays.

use glam::DVec3;

use crate::math::frame_of;

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
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
