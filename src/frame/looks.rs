//! Surfaces as the camera sees them, in f32: their shapes, and what they look like.

use glam::{DVec3, Vec3, Vec4};

use super::FrameSurfaces;
use crate::scene::{Casters, Shape, Surface};

/// All surfaces of a scene, those too that cast no shadow.
#[derive(Clone, Debug, Default)]
pub struct FrameLooks {
    /// Their strands and triangles.
    pub shapes: FrameSurfaces,
    /// For each point of a strand its direction there, of unit length.
    pub tangents: Vec<Vec3>,
    /// For each point of a strand: albedo, linear RGB, and the index of its surface.
    pub albedos: Vec<Vec4>,
    /// For each triangle the normals at its corners, of unit length.
    pub normals: Vec<[Vec3; 3]>,
    /// For each triangle: albedo, linear RGB, and the index of its surface.
    pub triangle_albedos: Vec<Vec4>,
    /// What all strands or triangles of a surface have in common.
    pub coats: Vec<FrameCoat>,
}

/// How light falls on a surface and leaves it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameCoat {
    /// Whether shadows fall on it.
    pub receives: bool,
    /// Radiance in the middle of a strand's highlight, as a share of that of a white surface that
    /// faces the light.
    pub specular: f32,
    /// The power of its highlight.
    pub shininess: f32,
}

impl FrameLooks {
    /// The surfaces of `casters`, in the space of their frame.
    pub fn of(casters: Casters<'_>) -> Self {
        let mut all = Self { shapes: FrameSurfaces::among(casters, |_| true), ..Self::default() };
        for (index, surface) in casters.surfaces.iter().enumerate() {
            all.add(surface, index as f32);
            all.coats.push(FrameCoat {
                receives: surface.receives,
                specular: if surface.reflects { surface.gloss.specular as f32 } else { 0.0 },
                shininess: surface.gloss.shininess as f32,
            });
        }
        all
    }

    fn add(&mut self, surface: &Surface, index: f32) {
        let turned = |direction: Vec3| {
            let world = surface.world_from_object().transform_vector3(direction.as_dvec3());
            world.normalize_or_zero().as_vec3()
        };
        let albedo = |albedo: DVec3| {
            let albedo = if surface.reflects { albedo } else { DVec3::ZERO };
            albedo.as_vec3().extend(index)
        };
        match &surface.shape {
            Shape::Mesh(mesh) => {
                let triangles = 0..mesh.triangles().len();
                self.normals.extend(triangles.clone().map(|i| mesh.normals(i).map(turned)));
                self.triangle_albedos.extend(triangles.map(|i| albedo(mesh.material(i).albedo)));
            }
            Shape::Strands(strands) => {
                self.tangents.extend(strands.tangents().into_iter().map(turned));
                let points = 0..strands.points().len();
                self.albedos.extend(points.map(|i| albedo(strands.albedo().at(i).as_dvec3())));
            }
        }
    }
}
