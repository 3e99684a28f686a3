//! The parts of a frame, in uniform-buffer layout: scalars in fours, or behind three of a vector.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

/// What the media are, and where.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameMedia {
    /// Rows of the affine map from frame space to voxel index.
    pub index_from_frame: [Vec4; 3],
    /// Lower corner of the medium in index space.
    pub domain_min: Vec3,
    /// Extinction per unit of density; 1 for a [`super::Mixture`], which is sampled as extinction.
    pub extinction: f32,
    /// Upper corner of the medium in index space.
    pub domain_max: Vec3,
    /// The largest density.
    pub largest: f32,
    /// One over the number of voxels along each axis.
    pub voxel_share: Vec3,
    /// Voxel lengths that a ray may cross at most.
    pub most_voxels: f32,
    /// Bricks of [`crate::scene::Occupancy`] along a unit of the space that shaders sample media
    /// in: texture coordinates of a plain volume, else index space.
    pub brick_scale: Vec3,
    /// The density that a stored value of 1 stands for, 1 where densities are stored as they are.
    pub stored_one: f32,
    /// Brick at that space's origin.
    pub brick_offset: Vec3,
    /// 1 if they emit light, else 0.
    pub emits: u32,
    /// Scattering albedo of a plain medium, linear RGB.
    pub albedo: Vec3,
    /// Its Henyey-Greenstein g.
    pub phase_g: f32,
}

/// The light: its rays through the map, and how bright it is.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameLight {
    /// Origin of the light ray through map position (0, 0); w unused, here and in the next five.
    pub origin: Vec4,
    /// Its change over the map's width.
    pub origin_u: Vec4,
    /// Its change over the map's height.
    pub origin_v: Vec4,
    /// Direction of the light ray through (0, 0), not normalised.
    pub direction: Vec4,
    /// Its change over the map's width.
    pub direction_u: Vec4,
    /// Its change over the map's height.
    pub direction_v: Vec4,
    /// Rows of the map from frame space to (u, v, depth, 1) times the fourth.
    pub from_frame: [Vec4; 4],
    /// Position of a point or spot light.
    pub position: Vec3,
    /// Where light goes: 0 all one way (a directional light), 1 everywhere from its position, 2 to
    /// 7 through a face of a cube around it ([`crate::scene::LightView::face`]).
    pub spread: u32,
    /// Axis of a spot light.
    pub axis: Vec3,
    /// Cosine where its cone begins to fade.
    pub cone_inner: f32,
    /// Irradiance, linear RGB, at distance 1 where the light has a position.
    pub irradiance: Vec3,
    /// Cosine at the cone's edge.
    pub cone_outer: f32,
}

/// How a ray is cut into steps. Lengths are those of frame space.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Marching {
    /// Steps for each voxel length that it crosses.
    pub per_voxel: f32,
    /// Length that steps may have where the media change most.
    pub rough: f32,
    /// Length that no step may exceed.
    pub longest: f32,
    /// What steps are cut beyond: of light rays, the difference of optical depth between two of
    /// them, times the light that is left; of camera rays, the optical depth of a sample.
    pub limit: f32,
    /// Steps at least.
    pub least: u32,
    /// Steps at most.
    pub most: u32,
    /// Length of a camera ray's step beyond which something thick may hide behind its last sample.
    pub hiding: f32,
    /// Samples of density for each voxel length in a slab.
    pub samples: f32,
}

/// The plane that shadows fall on.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FrameGround {
    /// Its height.
    pub height: f32,
    /// Its albedo, of all channels.
    pub albedo: f32,
    /// Half of its edge; 1e30 at most, for an endless one.
    pub half_extent: f32,
    /// 1 if there is one, else 0.
    pub exists: u32,
}

/// The picture: its rays, what they meet beside the media, and how they are marched.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameView {
    /// Origin of the camera ray through the picture's upper left corner; w unused, here and in the
    /// next five.
    pub origin: Vec4,
    /// Its change over the picture's width.
    pub origin_x: Vec4,
    /// Its change over the picture's height.
    pub origin_y: Vec4,
    /// Direction of that ray, not normalised.
    pub direction: Vec4,
    /// Its change over the picture's width.
    pub direction_x: Vec4,
    /// Its change over the picture's height.
    pub direction_y: Vec4,
    /// The world's origin in frame space, below which the ground is centred.
    pub world_origin: Vec3,
    /// Units of frame space along a world length.
    pub per_world: f32,
    /// Ambient radiance, linear RGB.
    pub ambient: Vec3,
    /// Octaves of multiple scattering, 0 for none.
    pub octaves: u32,
    /// xyz: background radiance; w: its opacity, 1 if there is one.
    pub background: Vec4,
    /// The ground.
    pub ground: FrameGround,
    /// Pixels along a row.
    pub width: u32,
    /// Pixels along a column.
    pub height: u32,
    /// Camera rays a pixel.
    pub samples: u32,
    /// How shadow becomes colour: 0 physical, 1 as in the paper.
    pub shading: u32,
    /// Lookups along a ray of the paper's shading.
    pub light_samples: u32,
    /// Transmittance below which a ray ends.
    pub opaque: f32,
    /// Share of a pixel's light that several steps have one lookup for.
    pub shared_weight: f32,
    /// Length of four steps that share a lookup at most.
    pub shared_length: f32,
    /// Its rays.
    pub march: Marching,
}

/// The shadow map: how it is made and read.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameMap {
    /// Light rays of threshold maps.
    pub rays: Marching,
    /// Light rays of fragment maps, whose steps are slabs.
    pub slabs: Marching,
    /// The opacities whose depths a threshold map keeps.
    pub thresholds: Vec3,
    /// How steep exponential shadow tests are, 1 / length, 0 for exact ones.
    pub sharpness: f32,
    /// Optical depths of those opacities.
    pub threshold_depths: Vec3,
    /// How far apart in depth the fronts of neighbouring texels' shadows are still those of one
    /// surface, 0 where media are too thin for that to matter.
    pub surface_reach: f32,
    /// Texels along its edge.
    pub size: u32,
    /// Where in a step a threshold is crossed: 0 exact, 1 smoothstep, 2 bucket.
    pub crossing: u32,
    /// How a threshold map is read: 0 the default, 1 the paper's.
    pub lookup: u32,
    /// Texels along the edge of the filter's window, 0 for bilinear.
    pub window: u32,
    /// Distance of the first plane between slabs along the axis of the light's view.
    pub near: f32,
    /// Distance of the last one.
    pub far: f32,
    /// Tolerance of fits, of transmittance; 0 keeps every fragment.
    pub tolerance: f32,
    /// Truncation of raw lists, of transmittance.
    pub truncation: f32,
    /// Planes between slabs, 0 for slabs of each ray's own.
    pub planes: u32,
    /// 1 if wide filters follow links between texels' lists, else 0.
    pub follows_links: u32,
    /// How much nearer to the light than they are surfaces are looked up.
    pub bias: f32,
    /// Nothing.
    pub unused: u32,
}
