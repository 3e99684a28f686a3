//! The light that surfaces send to a camera, in f64.
//!
//! Triangles are Lambertian on both sides. Where the normals of their corners differ from those of
//! their planes, they stand for a smooth surface, and shadows fall on that (Hanika 2021, "Hacking the
//! shadow terminator"): a point is raised to the planes through the corners, across their normals.
//! Strands follow Kajiya and
//! Kay 1989, section 4: a diffuse part with the sine of the angle between light and strand, and a
//! highlight. Both parts are scaled as a Lambertian surface's, so that a strand across the light is
//! as bright as a surface of its albedo that faces it.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::crossings::{Crossing, On};
use super::extinction::Extinction;
use crate::scene::{Light, OFF_STRANDS, Scene, Shape, Surface};

/// Points of triangles are moved off them by this share of the scene's diagonal.
const OFF_SURFACE: f64 = 1e-6;

/// What is seen of the surfaces of a scene.
pub(super) struct Shading<'a> {
    scene: &'a Scene,
    /// What casts shadows.
    extinction: &'a Extinction<'a>,
    /// World lengths by which points are moved towards the light.
    bias: f64,
    /// World length by which points of triangles are moved off them.
    off: f64,
    /// The directions of strands at their points, in the world, for each surface.
    tangents: Vec<Vec<DVec3>>,
}

impl<'a> Shading<'a> {
    pub(super) fn of(scene: &'a Scene, extinction: &'a Extinction<'a>, bias: f64) -> Self {
        let casters = crate::scene::Casters { media: &scene.media, surfaces: &scene.surfaces };
        let off = OFF_SURFACE * casters.world_bounds().size().length();
        let tangents = scene.surfaces.iter().map(|surface| match &surface.shape {
            Shape::Mesh(_) => Vec::new(),
            Shape::Strands(strands) => {
                let world = |t: &glam::Vec3| {
                    surface.world_from_object().transform_vector3(t.as_dvec3()).normalize_or_zero()
                };
                strands.tangents().iter().map(world).collect()
            }
        });
        Self { scene, extinction, bias, off, tangents: tangents.collect() }
    }

    /// Radiance per unit of opacity of what a ray (unit `direction`) crosses.
    pub(super) fn radiance(&self, crossing: &Crossing, origin: DVec3, direction: DVec3) -> DVec3 {
        let Some(surface) = self.scene.surfaces.get(crossing.surface) else { return DVec3::ZERO };
        match (&surface.shape, crossing.on) {
            (Shape::Mesh(mesh), On::Triangle(triangle, weights)) => {
                let to = surface.world_from_object();
                let [a, b, c] = mesh.corners(triangle).map(|p| to.transform_point3(p.as_dvec3()));
                let plane = (b - a).cross(c - a).normalize_or_zero();
                let plane = if plane.dot(direction) > 0.0 { -plane } else { plane };
                let mean = |of: &dyn Fn(usize) -> DVec3| (0..3).map(|i| weights[i] * of(i)).sum();
                let normals = mesh
                    .normals(triangle)
                    .map(|normal| to.transform_vector3(normal.as_dvec3()).normalize_or_zero());
                let normal: DVec3 = mean(&|i| normals[i]);
                let normal = normal.try_normalize().unwrap_or(plane);
                let side = if normal.dot(plane) < 0.0 { -1.0 } else { 1.0 };
                let point = origin + crossing.distance * direction;
                let corners = [a, b, c];
                let raised: DVec3 = mean(&|i| {
                    let normal = side * normals[i];
                    point - (point - corners[i]).dot(normal).min(0.0) * normal
                });
                let albedo = mesh.material(triangle).albedo;
                let place = raised + self.off * plane;
                albedo * self.on_triangle(surface, [point, place], side * normal)
            }
            (Shape::Strands(strands), On::Strand(first, share)) => {
                let to = surface.world_from_object();
                let mix = |of: &dyn Fn(usize) -> DVec3| of(first).lerp(of(first + 1), share);
                let point = mix(&|i| to.transform_point3(strands.points()[i].as_dvec3()));
                let albedo = mix(&|i| strands.albedo().at(i).as_dvec3());
                let own = &self.tangents[crossing.surface];
                let tangent = mix(&|i| own[i]).normalize_or_zero();
                let thickness = mix(&|i| DVec3::splat(strands.thickness().at(i).into())).x;
                let off = self.bias.max(OFF_STRANDS * thickness * surface.scale());
                self.on_strand(surface, (point, off), tangent, albedo, -direction)
            }
            _ => DVec3::ZERO,
        }
    }

    /// What arrives on a triangle at `point`, in the shadow at `place`, and from all around, of which
    /// it reflects the share of its albedo.
    fn on_triangle(&self, surface: &Surface, [point, place]: [DVec3; 2], normal: DVec3) -> DVec3 {
        let from = |light: &Light| {
            let to_light = -light.direction_at(point);
            let cosine = normal.dot(to_light);
            if cosine <= 0.0 {
                return DVec3::ZERO;
            }
            let bias = within(light, point, self.bias);
            let arriving = self.arriving(surface, light, point, place + bias * to_light);
            arriving * (cosine * FRAC_1_PI)
        };
        self.scene.lights.iter().map(from).sum::<DVec3>() + self.scene.ambient
    }

    fn on_strand(
        &self,
        surface: &Surface,
        (point, off): (DVec3, f64),
        tangent: DVec3,
        albedo: DVec3,
        to_camera: DVec3,
    ) -> DVec3 {
        let sine = |cosine: f64| (1.0 - cosine * cosine).max(0.0).sqrt();
        let seen = tangent.dot(to_camera);
        let from = |light: &Light| {
            let to_light = -light.direction_at(point);
            let lit = tangent.dot(to_light);
            // The cosine of the angle between the view and the nearest reflected ray.
            let cone = (sine(lit) * sine(seen) - lit * seen).max(0.0);
            let highlight = surface.gloss.specular * cone.powf(surface.gloss.shininess);
            let place = point + within(light, point, off) * to_light;
            let arriving = self.arriving(surface, light, point, place);
            arriving * (albedo * sine(lit) + highlight) * FRAC_1_PI
        };
        self.scene.lights.iter().map(from).sum::<DVec3>() + albedo * self.scene.ambient
    }

    /// Irradiance across the light at `point`, in the shadow that falls on `place`.
    fn arriving(&self, surface: &Surface, light: &Light, point: DVec3, place: DVec3) -> DVec3 {
        let irradiance = light.irradiance_at(point);
        if !surface.receives || irradiance == DVec3::ZERO {
            return irradiance;
        }
        irradiance * self.extinction.light_transmittance(light, place)
    }
}

/// A way towards a light that does not lead past it: at most half of the whole one.
fn within(light: &Light, point: DVec3, way: f64) -> f64 {
    light.position().map_or(way, |position| way.min(0.5 * position.distance(point)))
}
