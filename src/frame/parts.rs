//! The parts of a frame, in uniform-buffer layout: scalars stand in groups of four, or behind
//! vectors of three.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

/// The media's properties and position.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameMedia {
    /// Rows of the affine transform from frame space to voxel index.
    pub index_from_frame: [Vec4; 3],
    /// Lower corner of the medium in index space.
    pub domain_min: Vec3,
    /// Extinction per unit of density, 1 / length; 1 for a [`super::Mixture`], which is sampled as
    /// extinction.
    pub extinction: f32,
    /// Upper corner of the medium in index space.
    pub domain_max: Vec3,
    /// The largest density.
    pub largest: f32,
    /// One over the number of voxels along each axis.
    pub voxel_share: Vec3,
    /// The largest number of voxel lengths that a ray may count.
    pub most_voxels: f32,
    /// Bricks of [`crate::scene::Occupancy`] per unit of the space in which shaders sample media:
    /// texture coordinates for a plain volume, else index space.
    pub brick_scale: Vec3,
    /// The density for which a stored value of 1 stands; 1 if densities are stored unscaled.
    pub stored_one: f32,
    /// The brick coordinates of that space's origin.
    pub brick_offset: Vec3,
    /// 1 if the media emit light, else 0.
    pub emits: u32,
    /// Scattering albedo of a plain medium, linear RGB.
    pub albedo: Vec3,
    /// Henyey-Greenstein g of a plain medium.
    pub phase_g: f32,
    /// Extinction of red, green and blue, as multiples of the media's, at least 1.
    pub ratios: Vec3,
    /// 1 if some ratio is not 1, else 0.
    pub coloured: u32,
}

/// The light: its rays through the map, and its irradiance.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameLight {
    /// Origin of the light ray through map position (0, 0); w is unused, as in the next five
    /// vectors.
    pub origin: Vec4,
    /// Change of the origin over the map's width.
    pub origin_u: Vec4,
    /// Change of the origin over the map's height.
    pub origin_v: Vec4,
    /// Direction of the light ray through (0, 0), not normalised.
    pub direction: Vec4,
    /// Change of the direction over the map's width.
    pub direction_u: Vec4,
    /// Change of the direction over the map's height.
    pub direction_v: Vec4,
    /// Rows of the transform from frame space to (u, v, depth, 1), to be divided by the fourth
    /// component.
    pub from_frame: [Vec4; 4],
    /// Position of a point or spot light.
    pub position: Vec3,
    /// The kind of light: 0 directional, 1 in all directions from its position, 2 to 7 through one
    /// face of a cube around its position ([`crate::scene::LightView::face`] plus 2).
    pub spread: u32,
    /// Axis of a spot light.
    pub axis: Vec3,
    /// Cosine of the angle where the cone begins to fade.
    pub cone_inner: f32,
    /// Irradiance, linear RGB; for a light with a position that at distance 1.
    pub irradiance: Vec3,
    /// Cosine of the angle at the cone's edge.
    pub cone_outer: f32,
}

/// How a ray is cut into steps. Lengths are in frame space.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Marching {
    /// Steps per voxel length.
    pub per_voxel: f32,
    /// Length of steps where the media change most.
    pub rough: f32,
    /// Largest length of a step.
    pub longest: f32,
    /// Steps are shortened if they exceed this. For light rays it is the difference of optical
    /// depth between two adjacent steps, times the light that is left; for camera rays it is the
    /// optical depth of a sample.
    pub limit: f32,
    /// Smallest number of steps.
    pub least: u32,
    /// Largest number of steps.
    pub most: u32,
    /// Camera rays: in a step longer than this, something thick may lie unseen behind its last
    /// sample.
    pub hiding: f32,
    /// Density samples per voxel length in a slab.
    pub samples: f32,
}

/// The ground plane, which receives shadows.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FrameGround {
    /// Its height.
    pub height: f32,
    /// Its albedo, the same for all channels.
    pub albedo: f32,
    /// Half of its edge length; 1e30, the largest value, for an endless plane.
    pub half_extent: f32,
    /// 1 if there is a ground, else 0.
    pub exists: u32,
}

/// The picture: its rays, their surroundings, and how they are marched.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameView {
    /// Origin of the camera ray through the picture's upper left corner; w is unused, as in the
    /// next five vectors.
    pub origin: Vec4,
    /// Change of the origin over the picture's width.
    pub origin_x: Vec4,
    /// Change of the origin over the picture's height.
    pub origin_y: Vec4,
    /// Direction of that ray, not normalised.
    pub direction: Vec4,
    /// Change of the direction over the picture's width.
    pub direction_x: Vec4,
    /// Change of the direction over the picture's height.
    pub direction_y: Vec4,
    /// The world's origin in frame space; the ground is centred below or above it.
    pub world_origin: Vec3,
    /// Units of frame space per world length.
    pub per_world: f32,
    /// Ambient radiance, linear RGB.
    pub ambient: Vec3,
    /// Octaves that imitate multiple scattering; 0 for none.
    pub octaves: u32,
    /// xyz: background radiance; w: 1 if there is a background, else 0.
    pub background: Vec4,
    /// The ground.
    pub ground: FrameGround,
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Camera rays per pixel.
    pub samples: u32,
    /// How shadow becomes colour: 0 physical, 1 as in the paper.
    pub shading: u32,
    /// Lookups along a ray for the paper's shading.
    pub light_samples: u32,
    /// A ray ends where its transmittance falls below this.
    pub opaque: f32,
    /// Several steps share one lookup if together they contribute at most this share of a pixel's
    /// light.
    pub shared_weight: f32,
    /// Four steps may share one lookup if together they are at most this long.
    pub shared_length: f32,
    /// Largest error of a pixel that is not marched, or not with all of its rays, as a share of the
    /// picture's 99.9th percentile of radiance; 0 if all are.
    pub tolerance: f32,
    /// Distance in pixels of those that are marched first, a power of two.
    pub spacing: u32,
    /// The first row of pixels that a pass works on; on a GPU, large pictures are made in parts.
    pub first_row: u32,
    /// Padding.
    pub unused: u32,
    /// How camera rays are cut into steps.
    pub march: Marching,
}

impl FrameView {
    /// Whether the processor marches pixels with all of their rays only where the picture bends.
    pub fn refines(&self) -> bool {
        self.spacing > 1 || (self.samples > 1 && self.tolerance > 0.0)
    }
}

/// The shadow map: how it is built and read.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameMap {
    /// How light rays of threshold maps are cut into steps.
    pub rays: Marching,
    /// How light rays of fragment maps are cut into slabs.
    pub slabs: Marching,
    /// The opacities whose depths a threshold map keeps.
    pub thresholds: Vec3,
    /// Steepness of exponential shadow tests, 1 / length; 0 for exact tests.
    pub sharpness: f32,
    /// The optical depths of those opacities.
    pub threshold_depths: Vec3,
    /// Fronts of neighbouring texels' shadows that lie no further apart in depth than this belong
    /// to one surface; 0 where media are too thin for that to matter.
    pub surface_reach: f32,
    /// Texels along each edge of the map.
    pub size: u32,
    /// Where in a step a threshold is crossed: 0 exact, 1 smoothstep, 2 bucket.
    pub crossing: u32,
    /// How a threshold map is read: 0 by default, 1 as in the paper.
    pub lookup: u32,
    /// Width of the filter's window in texels; 0 for bilinear.
    pub window: u32,
    /// Distance of the first plane between slabs along the axis of the light's view.
    pub near: f32,
    /// Distance of the last one.
    pub far: f32,
    /// Largest error of transmittance of fits; 0 keeps every fragment.
    pub tolerance: f32,
    /// Largest error of transmittance by truncation of raw lists.
    pub truncation: f32,
    /// Number of planes between slabs; 0 if each ray has its own slabs.
    pub planes: u32,
    /// 1 if wide filters follow links between texels' lists, else 0.
    pub follows_links: u32,
    /// Surfaces are looked up this much nearer to the light than they are.
    pub bias: f32,
    /// 1 if strands leave fragments by their coverage of a texel, 0 if by its central ray.
    pub covers: u32,
}
