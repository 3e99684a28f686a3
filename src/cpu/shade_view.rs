//! Pass `shade_view`: the pixels that see surfaces. Strands and triangles are lit through the map,
//! as the medium is, and lie in front of each other in order of distance, with the medium between
//! them.

use std::ops::Range;

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::bins::Lists;
use super::march_view::View;
use super::raster_surfaces::Part;
use super::raster_view::{Hit, ViewRaster};
use super::tiles;
use crate::frame::FrameCoat;
use crate::kernel::light::{irradiance_at, light_coordinates, light_direction_at};
use crate::kernel::ray::Ray;
use crate::kernel::surface::{
    corner_weights, off_plane, smooth_place, strand_reflectance, triangle_reflectance,
};
use crate::kernel::view::{ground_distance, pixel_offset};
use crate::progress::Progress;

/// Surfaces hide the ground up to this share of its distance behind it.
const ON_GROUND: f32 = 1e-5;

/// A surface along a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub depth: f32,
    pub alpha: f32,
    /// The share of light that the surfaces in front of it let through.
    pub clear: f32,
    /// Radiance per unit of opacity.
    pub radiance: Vec3,
}

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
    pub(super) fn new(
        view: &'a View<'a>,
        raster: &'a ViewRaster,
        samples: u32,
        all: bool,
        progress: &dyn Progress,
    ) -> Self {
        let [width, height] = [view.frame.view.width, view.frame.view.height].map(|n| n as usize);
        progress.begin("picture", height as u64);
        let mut pixels = vec![(Vec4::ZERO, Shaded::Not); width * height];
        tiles::fill_tiles(&mut pixels, width, progress, |columns, rows| {
            view.tile(raster, (&columns, &rows), samples, all)
        });
        Self { view, raster, width, pixels }
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
            scratch.strands(seen.strands.of(i));
            self.shade(
                (raster, &mut scratch),
                seen.triangles.of(i),
                place,
                [samples, u32::from(all)],
            )
        };
        places.enumerate().map(pixel).collect()
    }

    /// The pixel (x, y), whose strands are in `scratch`, and of whose rays some meet some of the
    /// `triangles`; `all` of its samples are wanted if that is 1.
    fn shade(
        &self,
        (raster, scratch): (&ViewRaster, &mut Scratch),
        triangles: &[u32],
        [x, y]: [usize; 2],
        [samples, all]: [u32; 2],
    ) -> (Vec4, Shaded) {
        let mut one_surface = scratch.strands.is_empty();
        let (mut first, mut met) = (None, !scratch.strands.is_empty());
        for sample in 0..samples {
            raster.meet(triangles, [x, y], pixel_offset(sample, samples), &mut scratch.hits);
            let nearest = scratch.hits.first().map(|hit| hit.triangle);
            met |= nearest.is_some();
            one_surface &= *first.get_or_insert(nearest) == nearest;
        }
        if !met {
            return (Vec4::ZERO, Shaded::Not);
        }
        let (rays, shaded) = match (samples, all) {
            (2.., 0) if one_surface => (1, Shaded::Once),
            _ => (samples, Shaded::Fully),
        };
        let mut sum = Vec4::ZERO;
        for sample in 0..rays {
            let offset = pixel_offset(sample, rays);
            raster.meet(triangles, [x, y], offset, &mut scratch.hits);
            let ray = self.ray([x, y], [sample, rays]);
            sum += self.composed(raster, scratch, &ray);
        }
        (sum / rays as f32, shaded)
    }

    /// What a ray sees of the strands and hits in `scratch`, and of everything else.
    fn composed(&self, raster: &ViewRaster, scratch: &mut Scratch, ray: &Ray) -> Vec4 {
        let ground = ground_distance(self.frame, ray);
        let end = if ground > 0.0 { ground } else { f32::INFINITY };
        let (clear, end) = self.find_layers(raster, scratch, ray, end);
        self.among(ray, &scratch.layers, (clear, end, ground))
    }

    /// Replaces the layers in `scratch` by those of its strands and hits in front of `end`. Returns
    /// what they let through, and where nothing behind is seen.
    fn find_layers(
        &self,
        raster: &ViewRaster,
        scratch: &mut Scratch,
        ray: &Ray,
        mut end: f32,
    ) -> (f32, f32) {
        let Scratch { strands, colours, hits, layers } = scratch;
        layers.clear();
        let (mut clear, mut strand, mut hit) = (1.0, 0, 0);
        // As much as is left behind them can be seen.
        while clear >= self.frame.view.opaque {
            let depth = |of: Option<f32>| of.unwrap_or(f32::INFINITY);
            let of_strand = depth(strands.get(strand).map(Part::depth));
            let of_hit = depth(hits.get(hit).map(|hit| hit.depth));
            let next = of_strand.min(of_hit);
            // A surface on the ground hides it, whatever rounding says.
            if next >= end * (1.0 + ON_GROUND) {
                break;
            }
            let (alpha, radiance) = if of_strand <= of_hit {
                let part = &strands[strand];
                let colour = *colours[strand]
                    .get_or_insert_with(|| self.strand_radiance(raster, part, ray.direction));
                strand += 1;
                (part.alpha(), colour)
            } else {
                hit += 1;
                self.triangle_radiance(raster, &hits[hit - 1], ray)
            };
            layers.push(Layer { depth: next, alpha, clear, radiance });
            clear *= 1.0 - alpha;
        }
        if clear < self.frame.view.opaque {
            (clear, end) = (0.0, layers.last().map_or(end, |layer| layer.depth));
        }
        (clear, end)
    }

    /// The layers in front of `end` along the central ray of each pixel of a row, in some columns of
    /// one tile, and where nothing behind them is seen.
    pub(super) fn layers_of_row(
        &self,
        raster: &ViewRaster,
        columns: &Range<usize>,
        y: usize,
        end: impl Fn(&Ray) -> f32,
    ) -> Vec<(Vec<Layer>, f32)> {
        let seen = raster.tile(columns, &(y..y + 1));
        let mut scratch = Scratch::default();
        let pixel = |(i, x): (usize, usize)| {
            let (place, ray) = ([x, y], self.ray([x, y], [0, 1]));
            scratch.strands(seen.strands.of(i));
            raster.meet(seen.triangles.of(i), place, pixel_offset(0, 1), &mut scratch.hits);
            let (_, end) = self.find_layers(raster, &mut scratch, &ray, end(&ray));
            (scratch.layers.clone(), end)
        };
        columns.clone().enumerate().map(pixel).collect()
    }

    /// Radiance and opacity along a ray: of `layers`, of the medium up to `end`, and of what is
    /// behind them as far as layers leave it `clear`. The ground's distance is at least 0 if it is
    /// met.
    fn among(&self, ray: &Ray, layers: &[Layer], (clear, end, ground): (f32, f32, f32)) -> Vec4 {
        let coloured = self.frame.media.coloured == 1;
        // Per channel, from the transmittance of the least extinct one.
        let channels = |through: f32| {
            if coloured && through > 0.0 { self.colours(through) } else { Vec3::splat(through) }
        };
        let before = |depth: f32| layers.partition_point(|layer| layer.depth < depth);
        let clear_at = |layer: usize| layers.get(layer).map_or(clear, |layer| layer.clear);
        let steps = self.steps(ray, end);
        let (mut light, mut next) = (Vec3::ZERO, 0);
        let through = self.scatter(ray, &steps, |added| {
            let [from, to] = added.part;
            // The medium's light is dimmed by the layers in front of it.
            let (first, last) = (before(from), before(to));
            let mut at = from;
            let mut seen = 0.0;
            for layer in first..last {
                seen += clear_at(layer) * (layers[layer].depth - at);
                at = layers[layer].depth;
            }
            seen = (seen + clear_at(last) * (to - at)) / (to - from).max(f32::MIN_POSITIVE);
            light += seen * added.radiance;
            if added.weight <= 0.0 {
                return;
            }
            // Layers are dimmed by the medium in front of them.
            let kept = (1.0 - added.weight / added.through.max(f32::MIN_POSITIVE)).max(0.0);
            for layer in &layers[next..last.max(next)] {
                let share = ((layer.depth - from) / (to - from)).clamp(0.0, 1.0);
                let medium = channels(added.through * kept.powf(share));
                light += medium * layer.radiance * (layer.clear * layer.alpha);
            }
            next = next.max(last);
        });
        let medium = channels(through);
        for layer in &layers[next..] {
            light += medium * layer.radiance * (layer.clear * layer.alpha);
        }
        let through = clear * medium;
        let behind = match (through == Vec3::ZERO, ground > 0.0) {
            (true, _) => Vec4::ZERO,
            (_, true) if coloured => self.lit_ground_of_colours(ray.at(ground)).extend(1.0),
            (_, true) => self.lit_ground(ray.at(ground)).extend(1.0),
            _ => self.frame.view.background,
        };
        let covered = 1.0 - through.element_sum() / 3.0;
        (light + through * behind.xyz()).extend(covered + (1.0 - covered) * behind.w)
    }

    /// Radiance per unit of opacity of a part of a strand.
    fn strand_radiance(&self, raster: &ViewRaster, part: &Part, direction: Vec3) -> Vec3 {
        let looks = &raster.looks;
        let (point, share) = part.place();
        let [a, b] = [point as usize, point as usize + 1];
        let place = looks.shapes.points[a].lerp(looks.shapes.points[b], share);
        let (position, radius) = (place.xyz(), place.w);
        let tangent = looks.tangents[a].lerp(looks.tangents[b], share).normalize_or_zero();
        let albedo = looks.albedos[a].xyz().lerp(looks.albedos[b].xyz(), share);
        let coat = &looks.coats[looks.albedos[a].w as usize];
        let to_light = -light_direction_at(self.frame, position);
        let off = self.within(position, self.frame.map.bias.max(coat.off_radii * radius));
        let gloss = [coat.specular, coat.shininess];
        let reflected = strand_reflectance(tangent, [to_light, -direction], albedo, gloss);
        let arriving = self.arriving_at(coat, position, position + off * to_light, reflected);
        arriving + albedo * self.frame.view.ambient
    }

    /// The opacity of a triangle, and its radiance per unit of it.
    fn triangle_radiance(&self, raster: &ViewRaster, hit: &Hit, ray: &Ray) -> (f32, Vec3) {
        let (looks, index) = (&raster.looks, hit.triangle as usize);
        let corners = looks.shapes.triangles[index];
        let alpha = -(-corners[0].w).exp_m1();
        let corners = corners.map(|corner| corner.xyz());
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
        let arriving = self.arriving_at(coat, position, place, reflected);
        (alpha, arriving + albedo * self.frame.view.ambient)
    }

    /// A way towards the light that does not lead past it: at most half of the whole one.
    fn within(&self, position: Vec3, way: f32) -> f32 {
        let light = &self.frame.light;
        if light.spread == 0 { way } else { way.min(0.5 * light.position.distance(position)) }
    }

    /// The light that arrives at `position`, in the shadow that falls on `place`, times the share
    /// that is `reflected`.
    fn arriving_at(&self, coat: &FrameCoat, position: Vec3, place: Vec3, reflected: Vec3) -> Vec3 {
        let unshadowed = irradiance_at(self.frame, position) * reflected;
        if !coat.receives || unshadowed == Vec3::ZERO {
            return unshadowed;
        }
        let light = light_coordinates(self.frame, place);
        unshadowed
            * if self.frame.media.coloured == 1 {
                self.colours_at(light)
            } else {
                Vec3::splat(self.lookup(light))
            }
    }
}

/// What one pixel after another needs.
#[derive(Default)]
struct Scratch {
    /// The pixel's strands, in order of depth.
    strands: Vec<Part>,
    /// Radiance per unit of opacity of those that were seen already.
    colours: Vec<Option<Vec3>>,
    hits: Vec<Hit>,
    layers: Vec<Layer>,
}

impl Scratch {
    fn strands(&mut self, strands: &[Part]) {
        self.strands.clear();
        let visible = |part: &&Part| part.alpha() > 0.0 && part.depth() >= 0.0;
        self.strands.extend(strands.iter().filter(visible));
        self.strands.sort_by(|a, b| a.depth().total_cmp(&b.depth()));
        self.colours.clear();
        self.colours.resize(self.strands.len(), None);
    }
}
