//! Pass `shade_view`: the pixels that see surfaces. Strands and triangles are lit through the map,
//! as the medium is, and lie in front of each other in order of distance, with the medium between
//! them.

use std::ops::Range;

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::bins::Lists;
use super::layers::Scratch;
use super::march_view::View;
use super::raster_surfaces::Part;
use super::raster_view::{Hit, ViewRaster};
use super::tiles;
use crate::error::{Result, memory};
use crate::frame::{FrameCoat, pixel_offset};
use crate::kernel::light::{irradiance_at, light_coordinates, light_direction_at};
use crate::kernel::ray::Ray;
use crate::kernel::surface::{
    OFF_RADII, corner_weights, off_plane, smooth_place, strand_reflectance, triangle_reflectance,
};
use crate::progress::Progress;

/// How far a pixel has been shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Shaded {
    /// It sees no surface.
    #[default]
    Not,
    /// With its central ray, which is enough unless the picture bends there.
    Once,
    Fully,
}

/// The shadow of the surfaces of a ray that was looked up last. Strands that add little to a pixel
/// share it: nearly half of those that are seen in hair add less than 1/256.
pub(super) struct Shared {
    shadow: Vec3,
    /// The share of the ray's light that strands have taken since.
    since: f32,
    /// Strands that together take less share a lookup.
    limit: f32,
}

impl Shared {
    /// For strands of which up to `limit` of a ray's light may share a lookup.
    pub(super) fn new(limit: f32) -> Self {
        Self { shadow: Vec3::ONE, since: f32::INFINITY, limit }
    }

    /// Takes note of a strand that takes the share `weight` of the light. Returns whether its shadow
    /// is looked up, if it is not lit yet (`dark`).
    pub(super) fn pass(&mut self, weight: f32, dark: bool) -> bool {
        self.since += weight;
        let own = dark && self.since >= self.limit;
        if own {
            self.since = 0.0;
        }
        own
    }
}

/// The pixels of a picture that see surfaces.
pub(super) struct Overlay<'a> {
    view: &'a View<'a>,
    raster: &'a ViewRaster,
    width: usize,
    pixels: Vec<(Vec4, Shaded)>,
}

impl<'a> Overlay<'a> {
    /// Shades them, with all `samples` of a pixel where `all` of them are wanted or one ray does not
    /// see what the others do.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub(super) fn new(
        view: &'a View<'a>,
        raster: &'a ViewRaster,
        samples: u32,
        all: bool,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let [width, height] = [view.frame.view.width, view.frame.view.height].map(|n| n as usize);
        progress.begin("picture", height as u64);
        let none = (Vec4::ZERO, Shaded::Not);
        let mut pixels = memory::filled(width * height, none, "a picture of surfaces")?;
        tiles::fill_tiles(&mut pixels, width, progress, |columns, rows| {
            view.tile(raster, (&columns, &rows), samples, all)
        });
        Ok(Self { view, raster, width, pixels })
    }

    /// The pixel (x, y) with a number of rays; `None` if it sees no surface.
    pub(super) fn pixel(&self, [x, y]: [usize; 2], samples: u32) -> Option<Vec4> {
        let (colour, shaded) = self.pixels[y * self.width + x];
        match (shaded, samples) {
            (Shaded::Not, _) => None,
            (Shaded::Once, 2..) => self.view.seen_at(self.raster, [x, y], samples),
            _ => Some(colour),
        }
    }
}

impl View<'_> {
    /// One pixel with all its rays; `None` if it sees no surface.
    pub(super) fn seen_at(
        &self,
        raster: &ViewRaster,
        [x, y]: [usize; 2],
        samples: u32,
    ) -> Option<Vec4> {
        let found = self.tile(raster, (&(x..x + 1), &(y..y + 1)), samples, true);
        found.first().filter(|(_, shaded)| *shaded != Shaded::Not).map(|(colour, _)| *colour)
    }

    /// The pixels in some columns and rows, which lie in one tile.
    fn tile(
        &self,
        raster: &ViewRaster,
        (columns, rows): (&Range<usize>, &Range<usize>),
        samples: u32,
        all: bool,
    ) -> Vec<(Vec4, Shaded)> {
        let seen = raster.tile(columns, rows);
        let mut scratch = Scratch::default();
        let places = rows.clone().flat_map(|y| columns.clone().map(move |x| [x, y]));
        let pixel = |(i, place): (usize, [usize; 2])| {
            let of = |lists: &Lists<Part>| lists.of(i).len();
            if of(&seen.strands) + seen.triangles.of(i).len() == 0 {
                return (Vec4::ZERO, Shaded::Not);
            }
            scratch.set_strands(seen.strands.of(i));
            self.shade((raster, &mut scratch), seen.triangles.of(i), place, (samples, all))
        };
        places.enumerate().map(pixel).collect()
    }

    /// The pixel (x, y), whose strands are in `scratch`, and of whose rays some meet some of the
    /// `triangles`, with `all` of its samples or with as many as it needs.
    fn shade(
        &self,
        (raster, scratch): (&ViewRaster, &mut Scratch),
        triangles: &[u32],
        [x, y]: [usize; 2],
        (samples, all): (u32, bool),
    ) -> (Vec4, Shaded) {
        let mut rays = samples;
        if scratch.strands.is_empty() {
            let nearest = (0..samples).map(|sample| {
                let of_ray = (pixel_offset(sample, samples), u64::MAX);
                scratch.hits.clear();
                raster.meet(triangles, [x, y], of_ray, &mut scratch.hits);
                scratch.hits.first().map(|hit| hit.triangle)
            });
            let nearest: Vec<Option<u32>> = nearest.collect();
            if nearest.iter().all(Option::is_none) {
                return (Vec4::ZERO, Shaded::Not);
            }
            if !all && nearest.iter().all(|own| *own == nearest[0]) {
                rays = 1;
            }
        }
        let shaded = if rays < samples { Shaded::Once } else { Shaded::Fully };
        let (mut sum, mut weights) = (Vec4::ZERO, 0.0);
        for sample in 0..rays {
            scratch.hits.clear();
            let of_ray = (pixel_offset(sample, rays), u64::MAX);
            raster.meet(triangles, [x, y], of_ray, &mut scratch.hits);
            let ray = self.ray([x, y], [sample, rays]);
            let weight = scratch.go_on(sample, rays);
            sum += weight * self.composed(raster, scratch, &ray);
            weights += weight;
        }
        (sum / weights, shaded)
    }

    /// Radiance per unit of opacity of a part of a strand, in its own shadow or in the one that is
    /// `shared`.
    pub(super) fn strand_radiance(
        &self,
        raster: &ViewRaster,
        part: &Part,
        direction: Vec3,
        (own, shared): (bool, &mut Shared),
    ) -> Vec3 {
        let looks = &raster.looks;
        let (point, share) = part.place();
        let [a, b] = [point as usize, point as usize + 1];
        let place = looks.shapes.points[a].lerp(looks.shapes.points[b], share);
        let (position, radius) = (place.xyz(), place.w);
        let tangent = looks.tangents[a].lerp(looks.tangents[b], share).normalize_or_zero();
        let albedo = looks.albedos[a].xyz().lerp(looks.albedos[b].xyz(), share);
        let coat = &looks.coats[looks.albedos[a].w as usize];
        let to_light = -light_direction_at(self.frame, position);
        let off = self.within(position, self.frame.map.bias.max(OFF_RADII * radius));
        let gloss = [coat.specular, coat.shininess];
        let reflected = strand_reflectance(tangent, [to_light, -direction], albedo, gloss);
        let places = [position, position + off * to_light];
        let arriving = self.arriving_at(coat, places, reflected, (own, shared));
        arriving + albedo * self.frame.view.ambient
    }

    /// The opacity of a triangle, and its radiance per unit of it.
    pub(super) fn triangle_radiance(
        &self,
        raster: &ViewRaster,
        hit: &Hit,
        ray: &Ray,
        shared: &mut Shared,
    ) -> (f32, Vec3) {
        let (looks, index) = (&raster.looks, hit.triangle as usize);
        let corners = looks.shapes.triangles[index];
        let alpha = -(-corners[0].w).exp_m1();
        let corners = corners.map(Vec4Swizzles::xyz);
        let [a, b, c] = corners;
        let plane = (b - a).cross(c - a).normalize_or_zero();
        let plane = if plane.dot(ray.direction) > 0.0 { -plane } else { plane };
        let position = ray.at(hit.depth);
        let weights = corner_weights(corners, position);
        let [na, nb, nc] = looks.normals[index];
        let normal = na * weights.x + nb * weights.y + nc * weights.z;
        let normal = normal.try_normalize().unwrap_or(plane);
        // Both sides are alike.
        let side = if normal.dot(plane) < 0.0 { -1.0 } else { 1.0 };
        let place =
            smooth_place(corners, looks.normals[index].map(|n| side * n), weights, position);
        let albedo = looks.triangle_albedos[index].xyz();
        let coat = &looks.coats[looks.triangle_albedos[index].w as usize];
        let to_light = -light_direction_at(self.frame, position);
        let reflected = albedo * triangle_reflectance(side * normal, to_light);
        let off = off_plane(self.frame, position, plane, to_light);
        let bias = self.within(position, self.frame.map.bias);
        let place = place + off * plane + bias * to_light;
        let arriving = self.arriving_at(coat, [position, place], reflected, (true, shared));
        (alpha, arriving + albedo * self.frame.view.ambient)
    }

    /// A way towards the light that does not lead past it: at most half of the whole one.
    fn within(&self, position: Vec3, way: f32) -> f32 {
        let light = &self.frame.light;
        if light.spread == 0 { way } else { way.min(0.5 * light.position.distance(position)) }
    }

    /// The light that arrives at one place, in the shadow that falls on another or in the `shared`
    /// one, times the share that is `reflected`.
    fn arriving_at(
        &self,
        coat: &FrameCoat,
        [position, place]: [Vec3; 2],
        reflected: Vec3,
        (own, shared): (bool, &mut Shared),
    ) -> Vec3 {
        let unshadowed = irradiance_at(self.frame, position) * reflected;
        if !coat.receives || unshadowed == Vec3::ZERO {
            return unshadowed;
        }
        if own {
            let light = light_coordinates(self.frame, place);
            shared.shadow = if self.frame.media.coloured == 1 {
                self.colours_at(light)
            } else {
                Vec3::splat(self.lookup(light))
            };
        }
        unshadowed * shared.shadow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strands_share_a_shadow_until_they_add_up() {
        let mut shared = Shared::new(0.125);
        let own = [0.001, 0.05, 0.05, 0.0625, 0.2, 0.1].map(|weight| shared.pass(weight, true));
        // The first has nothing to share; 0.05 twice and 0.0625 exceed the limit; 0.2 does alone.
        assert_eq!(own, [true, false, false, true, true, false]);
        // Strands that are lit already bring no shadow that others could share.
        let mut shared = Shared::new(0.125);
        let own = [(0.5, false), (0.001, true), (0.5, false), (0.001, true), (0.001, true)]
            .map(|(weight, dark)| shared.pass(weight, dark));
        assert_eq!(own, [false, true, false, true, false]);
    }
}
