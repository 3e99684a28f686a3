//! The surfaces along a pixel's ray as layers in order of distance, and what is seen of them and of
//! the medium between them.
//!
//! Strands cover some of a pixel's cells (the A-buffer, Carpenter 1984), so that what lies side by
//! side in a pixel is not taken to lie in front of each other.

use std::ops::Range;

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::ground::farthest;
use super::march_view::View;
use super::raster_surfaces::Part;
use super::raster_view::{Hit, ViewRaster};
use super::shade_view::Shared;
use crate::frame::{CELLS, cells_around, pixel_offset};
use crate::kernel::ray::Ray;
use crate::kernel::view::ground_distance;

/// Surfaces hide the ground up to this share of its distance behind it.
const ON_GROUND: f32 = 1e-5;

/// Strands share a lookup that together take less than so many times what counts as nothing.
const SHARED: f32 = 8.0;

/// Most rays of a pixel of a deep image: each must have cells of its own.
const MOST_DEEP: u32 = 16;

/// A surface along a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub depth: f32,
    /// The share of light that the surfaces in front of it let through.
    pub clear: f32,
    /// The share of light that it takes itself.
    pub weight: f32,
    /// Radiance per unit of opacity.
    pub radiance: Vec3,
}

impl Layer {
    /// Adds another part of the same triangle.
    fn add(&mut self, depth: f32, weight: f32, radiance: Vec3) {
        let share = weight / (self.weight + weight).max(f32::MIN_POSITIVE);
        self.depth += (depth - self.depth) * share;
        self.radiance = self.radiance.lerp(radiance, share);
        self.weight += weight;
    }

    /// Its opacity, 0..1.
    pub(super) fn alpha(&self) -> f32 {
        (self.weight / self.clear.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}

impl View<'_> {
    /// What a ray sees of the strands and hits in `scratch`, and of everything else.
    pub(super) fn composed(&self, raster: &ViewRaster, scratch: &mut Scratch, ray: &Ray) -> Vec4 {
        let ground = ground_distance(self.frame, ray);
        let (clear, end) = self.find_layers(raster, scratch, ray, farthest(ground));
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
        let Scratch { strands, colours, hits, layers, cells, .. } = scratch;
        layers.clear();
        // What is left of the light in each of the pixel's cells around the ray.
        let mut left = [1.0_f32; (CELLS * CELLS) as usize];
        let share = 1.0 / cells.count_ones() as f32;
        let (mut clear, mut strand, mut hit) = (1.0, 0, 0);
        let mut shared = Shared::new(SHARED * self.frame.view.opaque);
        // The triangle of the last layer, if it is one.
        let mut triangle = None;
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
            let mut take = |mut bits: u64, alpha: f32| {
                let mut taken = 0.0;
                while bits != 0 {
                    let left = &mut left[bits.trailing_zeros() as usize];
                    taken += alpha * *left;
                    *left *= 1.0 - alpha;
                    bits &= bits - 1;
                }
                taken * share
            };
            let (weight, radiance) = if of_strand <= of_hit {
                let part = &strands[strand];
                strand += 1;
                let (bits, [alpha, rest]) = part.cells();
                let mut weight = take(bits & *cells, alpha);
                if rest > 0.0 {
                    weight += take(!bits & *cells, rest);
                }
                if weight <= 0.0 {
                    continue;
                }
                triangle = None;
                let known = &mut colours[strand - 1];
                let own = shared.pass(weight, known.is_none());
                let radiance = known.unwrap_or_else(|| {
                    self.strand_radiance(raster, part, ray.direction, (own, &mut shared))
                });
                if own {
                    *known = Some(radiance);
                }
                (weight, radiance)
            } else {
                hit += 1;
                let (alpha, radiance) =
                    self.triangle_radiance(raster, &hits[hit - 1], ray, &mut shared);
                let weight = take(hits[hit - 1].cells & *cells, alpha);
                let before = triangle.replace(hits[hit - 1].triangle);
                // Rays of one pixel may meet the same triangle.
                if let Some(last) = layers.last_mut().filter(|_| before == triangle) {
                    last.add(next, weight, radiance);
                    clear -= weight;
                    continue;
                }
                (weight, radiance)
            };
            layers.push(Layer { depth: next, clear, weight, radiance });
            clear -= weight;
        }
        if clear < self.frame.view.opaque {
            (clear, end) = (0.0, layers.last().map_or(end, |layer| layer.depth));
        }
        (clear, end)
    }

    /// The layers in front of the ground in each pixel of a row, in some columns of one tile; with
    /// what they let through and where nothing behind is seen. Triangles cover the cells of those of
    /// the pixel's rays that meet them.
    pub(super) fn layers_of_row(
        &self,
        raster: &ViewRaster,
        columns: &Range<usize>,
        y: usize,
    ) -> Vec<(Vec<Layer>, f32, f32)> {
        let seen = raster.tile(columns, &(y..y + 1));
        let samples = self.frame.view.samples.min(MOST_DEEP);
        let mut scratch = Scratch::default();
        let pixel = |(i, x): (usize, usize)| {
            let (place, ray) = ([x, y], self.ray([x, y], [0, 1]));
            scratch.set_strands(seen.strands.of(i));
            scratch.hits.clear();
            for sample in 0..samples {
                scratch.go_on(sample, samples);
                let of_ray = (pixel_offset(sample, samples), scratch.cells);
                raster.meet(seen.triangles.of(i), place, of_ray, &mut scratch.hits);
            }
            scratch.cells = u64::MAX;
            let end = farthest(ground_distance(self.frame, &ray));
            let (clear, end) = self.find_layers(raster, &mut scratch, &ray, end);
            (scratch.layers.clone(), clear, end)
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
            for layer in &layers[first..last.max(first)] {
                seen += layer.clear * (layer.depth - at);
                at = layer.depth;
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
                light += medium * layer.radiance * layer.weight;
            }
            next = next.max(last);
        });
        let medium = channels(through);
        for layer in &layers[next..] {
            light += medium * layer.radiance * layer.weight;
        }
        let through = clear * medium;
        let behind = if through == Vec3::ZERO { Vec4::ZERO } else { self.behind(ray, ground) };
        let covered = 1.0 - through.element_sum() / 3.0;
        (light + through * behind.xyz()).extend(covered + (1.0 - covered) * behind.w)
    }
}

/// What one pixel after another needs.
#[derive(Default)]
pub(super) struct Scratch {
    /// The pixel's strands, in order of depth.
    pub strands: Vec<Part>,
    /// Radiance per unit of opacity of those that were seen already.
    colours: Vec<Option<Vec3>>,
    pub hits: Vec<Hit>,
    layers: Vec<Layer>,
    /// The cells of the pixel that a ray stands for.
    cells: u64,
    /// The cells of each of a number of rays.
    groups: Vec<u64>,
}

impl Scratch {
    /// Goes on with one of `rays` of a pixel; the share of the pixel that it stands for, in cells.
    pub(super) fn go_on(&mut self, ray: u32, rays: u32) -> f32 {
        if self.groups.len() != rays as usize {
            self.groups = cells_around(rays);
        }
        self.cells = self.groups[ray as usize];
        self.cells.count_ones() as f32
    }

    pub(super) fn set_strands(&mut self, strands: &[Part]) {
        self.strands.clear();
        let visible = |part: &&Part| part.alpha() > 0.0 && part.depth() >= 0.0;
        self.strands.extend(strands.iter().filter(visible));
        self.strands.sort_by(|a, b| a.depth().total_cmp(&b.depth()));
        self.colours.clear();
        self.colours.resize(self.strands.len(), None);
    }
}
