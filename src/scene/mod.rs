//! Scenes: volumes, media, lights, camera, ground and background. Knows no backend. Spaces: index
//! (voxels), world (y up, right-handed), light (map texel, depth), camera (pixel).

pub mod automatic;
mod beams;
mod blackbody;
mod camera;
mod casters;
mod computed;
mod descriptors;
pub mod file;
mod framing;
pub mod keyframes;
mod light;
mod light_view;
mod media;
mod medium;
mod numbered;
mod occupancy;
mod saved;
mod surface_tables;
mod surfaces;
mod tables;
pub mod transfer;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use beams::{Beam, Channels};
pub use camera::{Camera, Projection, ViewRays};
pub use casters::Casters;
pub use descriptors::descriptor;
pub use file::SceneFile;
pub use light::{Light, LightKind};
pub use light_view::LightView;
pub use media::Media;
pub use medium::{Body, Emission, Medium};
pub use numbered::NumberedName;
pub use occupancy::{EMPTY, Occupancy, ROUGHEST};
pub use surfaces::{Gloss, OFF_STRANDS, Shape, Surface, Surfaces};
pub use tables::Tables;
pub use transfer::TransferFunction;

/// Everything that a picture shows.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Scene {
    /// The media that light passes through.
    pub media: Media,
    /// Meshes and strands, which light passes through or not.
    pub surfaces: Surfaces,
    /// The lights that cast shadows. Each pass works on one of them ([`Scene::beams`]).
    pub lights: Vec<Light>,
    /// Ambient radiance from all directions, which is not shadowed, per channel.
    pub ambient: DVec3,
    /// The camera.
    pub camera: Camera,
    /// The plane that receives shadows; `None` for none.
    pub ground: Option<Ground>,
    /// Radiance of the background, per channel; with `None` the picture is transparent there. It
    /// does not follow the lights.
    pub background: Option<DVec3>,
}

/// A horizontal Lambertian plane. A finite one is centred below or above the world's origin.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct Ground {
    /// Height as world y.
    pub height: f64,
    /// Reflectance, 0..1.
    pub albedo: f64,
    /// Half of the edge length along x and z, in world lengths; `None` for an endless plane.
    pub half_extent: Option<f64>,
}

impl Scene {
    /// A scene in front of a black background, without ground and ambient light.
    pub fn new(media: Media, lights: Vec<Light>, camera: Camera) -> Self {
        let background = Some(DVec3::ZERO);
        let (surfaces, ambient) = (Surfaces::default(), DVec3::ZERO);
        Self { media, surfaces, lights, ambient, camera, ground: None, background }
    }
}

impl Ground {
    /// An endless plane at world height `height` that reflects the share `albedo`, 0..1.
    pub fn new(height: f64, albedo: f64) -> Self {
        Self { height, albedo, half_extent: None }
    }

    /// The same plane, ending `half_extent` world lengths from the origin along x and z.
    #[must_use]
    pub fn within(self, half_extent: f64) -> Self {
        Self { half_extent: Some(half_extent), ..self }
    }
}
