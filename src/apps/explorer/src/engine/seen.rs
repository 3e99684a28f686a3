//! What the window knows of a scene: everything but its voxels, strands and triangles, which stay with
//! what draws.

use deepshadow::Scene;
use deepshadow::glam::DVec3;
use deepshadow::math::Aabb;
use deepshadow::scene::{Body, Camera, Ground, Light};
use serde::{Deserialize, Serialize};

/// A scene without what is in it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Seen {
    /// Where it is seen from.
    pub camera: Camera,
    /// Its lights.
    pub lights: Vec<Light>,
    /// Ambient radiance per channel.
    pub ambient: DVec3,
    /// Radiance of the background per channel; `None` where the picture is transparent there.
    pub background: Option<DVec3>,
    /// The plane that receives shadows.
    pub ground: Option<Ground>,
    /// Its volumes.
    pub bodies: Vec<SeenBody>,
    /// Whether there are meshes or hair.
    pub has_surfaces: bool,
    /// The box around everything.
    pub bounds: Option<Aabb>,
}

/// A volume without its voxels, and its medium.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct SeenBody {
    /// The name of the grid.
    pub name: String,
    /// The number of voxels along x, y and z.
    pub dims: [usize; 3],
    /// Bytes of its voxels.
    pub bytes: u64,
    /// The corners of its box in the world, with x varying fastest.
    pub corners: [DVec3; 8],
    /// Extinction of density 1, per world length.
    pub density_scale: f64,
    /// Albedo per channel.
    pub albedo: DVec3,
    /// Henyey and Greenstein's g.
    pub phase_g: f64,
    /// What emission is multiplied by, per world length.
    pub emission_scale: Option<f64>,
}

impl Seen {
    /// What is known of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let bodies = scene.media.bodies();
        let media = (!bodies.is_empty()).then(|| scene.media.world_bounds());
        let all = media.into_iter().chain(scene.surfaces.world_bounds());
        Self {
            camera: scene.camera,
            lights: scene.lights.clone(),
            ambient: scene.ambient,
            background: scene.background,
            ground: scene.ground,
            bodies: bodies.iter().map(SeenBody::of).collect(),
            has_surfaces: !scene.surfaces.is_empty(),
            bounds: all.reduce(|a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) }),
        }
    }
}

impl SeenBody {
    fn of(Body { volume, medium, .. }: &Body) -> Self {
        Self {
            name: volume.name.clone(),
            dims: volume.dims(),
            bytes: volume.voxels().bytes() as u64,
            corners: volume.world_corners(),
            density_scale: medium.density_scale,
            albedo: medium.albedo,
            phase_g: medium.phase_g,
            emission_scale: medium.emission.as_ref().map(|emission| emission.scale),
        }
    }
}
