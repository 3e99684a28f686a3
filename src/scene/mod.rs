//! What is lit, seen and shadowed: volume, medium, light, camera, ground, background.
//! Knows no backend. Spaces: index (voxels), world (y up, right-handed), light (map texel, depth),
//! camera (pixel).

pub mod automatic;
mod beams;
mod blackbody;
mod camera;
mod computed;
mod descriptors;
pub mod file;
mod framing;
mod light;
mod light_view;
mod media;
mod occupancy;
mod tables;
pub mod transfer;

use glam::DVec3;

pub use beams::{Beam, Channels};
pub use camera::{Camera, Projection, ViewRays};
pub use descriptors::descriptor;
pub use file::SceneFile;
pub use light::{Light, LightKind};
pub use light_view::LightView;
pub use media::{Body, Emission, Media, Medium};
pub use occupancy::{EMPTY, Occupancy, ROUGHEST};
pub use tables::Tables;
pub use transfer::TransferFunction;

/// Everything that a picture shows.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What light passes through.
    pub media: Media,
    /// The lights that cast shadows; pass by pass a picture is made of one ([`Scene::beams`]).
    pub lights: Vec<Light>,
    /// Radiance from everywhere, unshadowed, per channel.
    pub ambient: DVec3,
    /// Who looks.
    pub camera: Camera,
    /// The plane that catches the shadow; `None` for none.
    pub ground: Option<Ground>,
    /// Radiance behind everything, per channel; `None` leaves the picture transparent there.
    pub background: Option<DVec3>,
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
