//! Lights: their kind, position, direction and intensity.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A light that casts a shadow map.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct Light {
    /// Kind and position.
    pub kind: LightKind,
    /// Irradiance on a plane that faces the light, per channel, without shadows. For a point or
    /// spot light it is that at world distance 1; it falls with the square of the distance.
    pub irradiance: DVec3,
}

/// Kinds of light sources.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub enum LightKind {
    /// Parallel light from infinitely far away.
    Directional {
        /// The direction in which the light travels; any length but zero.
        direction: DVec3,
    },
    /// Light from a point in all directions.
    Point {
        /// World position.
        position: DVec3,
    },
    /// Light from a point within a cone.
    Spot {
        /// World position.
        position: DVec3,
        /// The direction of the cone's axis, away from the light; any length but zero.
        direction: DVec3,
        /// Angle between the axis and the edge, in degrees, 0 < angle < 90.
        cone_degrees: f64,
        /// Share of the cone's angle over which the light fades to zero towards the edge, 0..1.
        cone_softness: f64,
    },
}

impl Light {
    /// The irradiance that gives a fully lit, white, opaque, isotropic medium the radiance 1.
    pub const UNIT_IRRADIANCE: f64 = 4.0 * std::f64::consts::PI;

    /// A light of a kind, with an irradiance as of [`Light::irradiance`].
    pub fn new(kind: LightKind, irradiance: DVec3) -> Self {
        Self { kind, irradiance }
    }

    /// White light that travels along `direction` (of any length but zero), under which a fully
    /// lit, white, opaque, isotropic medium has the radiance 1.
    pub fn directional(direction: DVec3) -> Self {
        Self::new(LightKind::Directional { direction }, DVec3::splat(Self::UNIT_IRRADIANCE))
    }

    /// A light without intensity.
    pub(super) const DARK: Self =
        Self { kind: LightKind::Directional { direction: DVec3::NEG_Y }, irradiance: DVec3::ZERO };

    /// World position; `None` for a directional light.
    pub fn position(&self) -> Option<DVec3> {
        match self.kind {
            LightKind::Directional { .. } => None,
            LightKind::Point { position } | LightKind::Spot { position, .. } => Some(position),
        }
    }

    /// The direction in which light travels at world position `point`, of unit length.
    pub fn direction_at(&self, point: DVec3) -> DVec3 {
        match self.kind {
            LightKind::Directional { direction } => direction.normalize_or_zero(),
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                (point - position).normalize_or_zero()
            }
        }
    }

    /// Cosines of the angles from the axis where a spot light begins to fade and where it ends. For
    /// other lights a pair that every direction satisfies.
    pub fn cone_cosines(&self) -> [f64; 2] {
        match self.kind {
            LightKind::Spot { cone_degrees, cone_softness, .. } => {
                let edge = cone_degrees.to_radians();
                [(edge * (1.0 - cone_softness)).cos(), edge.cos()]
            }
            _ => [-2.0, -3.0],
        }
    }

    /// Unshadowed radiance of a white ground at world position `point`, per channel.
    pub fn on_ground_at(&self, point: DVec3) -> DVec3 {
        let cosine = (-self.direction_at(point).y).max(0.0);
        self.irradiance_at(point) * (cosine / std::f64::consts::PI)
    }

    /// Unshadowed irradiance at world position `point`, on a plane that faces the light, per
    /// channel.
    pub fn irradiance_at(&self, point: DVec3) -> DVec3 {
        let Some(position) = self.position() else { return self.irradiance };
        let squared = (point - position).length_squared();
        let axis = match self.kind {
            LightKind::Spot { direction, .. } => direction.normalize_or_zero(),
            _ => DVec3::ZERO,
        };
        let [inner, outer] = self.cone_cosines();
        let x = (self.direction_at(point).dot(axis) - outer) / (inner - outer).max(1e-6);
        let x = x.clamp(0.0, 1.0);
        self.irradiance * (x * x * (3.0 - 2.0 * x)) / squared.max(f64::MIN_POSITIVE)
    }
}
