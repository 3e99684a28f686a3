//! What is lit, seen and shadowed: volume, medium, light, camera, ground, background.
//! Knows no backend. Spaces: index (voxels), world (y up, right-handed), light (map texel, depth),
//! camera (pixel).

pub mod automatic;
mod camera;
mod computed;
mod descriptors;
pub mod file;
mod framing;
mod light;
mod light_view;

use std::sync::Arc;

use glam::DVec3;

use crate::volume::Volume;
pub use camera::{Camera, Projection, ViewRays};
pub use descriptors::descriptor;
pub use file::SceneFile;
pub use light::{Light, LightKind};
pub use light_view::LightView;

/// Everything that a picture shows.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The volume, shared: scenes are cheap to copy and change.
    pub volume: Arc<Volume>,
    /// What its densities are made of.
    pub medium: Medium,
    /// The one light that casts shadows.
    pub light: Light,
    /// Radiance from everywhere, unshadowed, per channel.
    pub ambient: DVec3,
    /// Who looks.
    pub camera: Camera,
    /// The plane that catches the shadow; `None` for none.
    pub ground: Option<Ground>,
    /// Radiance behind everything, per channel; `None` leaves the picture transparent there.
    pub background: Option<DVec3>,
}

/// From density to light: extinction and what it scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Extinction per unit of density, 1 / world length; at least 0.
    pub density_scale: f64,
    /// Share of the extinguished light that is scattered, per channel, 0..1.
    pub albedo: DVec3,
    /// Henyey and Greenstein's g, the mean cosine of scattering, -1 < g < 1; 0 is isotropic.
    pub phase_g: f64,
}

/// A horizontal Lambertian plane, centred under the world's origin where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// World y.
    pub height: f64,
    /// Reflectance, 0..1.
    pub albedo: f64,
    /// Half of its edge length along x and z; `None` for an endless plane.
    pub half_extent: Option<f64>,
}
