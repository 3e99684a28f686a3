//! Where rays cross surfaces, in f64.
//!
//! A strand is the union of its segments, and a segment is the convex hull of two balls. Each
//! interval of a ray inside a strand is one crossing, which lies in the interval's middle. A point
//! on the strand's axis is thus as deep as the strand's crossing there. A triangle is crossed at a
//! point. A crossing takes the opacity of what is crossed, so transmittance is the product of (1 -
//! opacity) over all of them.

use glam::DVec3;

use super::shapes::{Hull, through_triangle};
use super::tree::Tree;
use crate::math::Aabb;
use crate::scene::{Shape, Surfaces};

/// Surfaces, prepared for exact crossings.
#[derive(Clone, Debug)]
pub struct Crossings {
    things: Vec<Thing>,
    tree: Tree,
    /// The thickness of the thinnest strand, in world lengths; infinite without strands.
    thinnest: f64,
}

#[derive(Clone, Copy, Debug)]
enum Thing {
    Triangle {
        corners: [DVec3; 3],
        opacity: f64,
        /// Its surface, and its number there.
        place: [u32; 2],
    },
    Segment(Hull),
}

/// A place where a ray crosses a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the ray.
    pub distance: f64,
    /// The opacity there, 0..1.
    pub opacity: f64,
    /// The index of the surface.
    pub surface: usize,
    /// Where on it.
    pub on: On,
}

/// A place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum On {
    /// On a triangle of this index, with the weights of its corners.
    Triangle(usize, [f64; 3]),
    /// In the segment that begins at the point of this index, at a share of its way to the next.
    Strand(usize, f64),
}

/// An interval of a ray inside a segment, with its strand and its opacity.
#[derive(Clone, Copy, Debug)]
struct Inside {
    strand: u32,
    interval: [f64; 2],
    hull: Hull,
}

impl Crossings {
    /// Prepares `surfaces`.
    pub fn of(surfaces: &Surfaces) -> Self {
        let (mut things, mut strand, mut thinnest) = (Vec::new(), 0, f64::INFINITY);
        for (number, surface) in surfaces.iter().enumerate() {
            let place = |index: usize| [number as u32, index as u32];
            let to = surface.world_from_object();
            let scale = surface.scale();
            match &surface.shape {
                Shape::Mesh(mesh) => {
                    things.extend((0..mesh.triangles().len()).map(|i| Thing::Triangle {
                        corners: mesh.corners(i).map(|p| to.transform_point3(p.as_dvec3())),
                        opacity: mesh.material(i).opacity,
                        place: place(i),
                    }));
                }
                Shape::Strands(strands) => {
                    for index in 0..strands.count() {
                        let points = strands.strand(index);
                        for first in points.start..points.end - 1 {
                            let segment = strands.segment(first);
                            let radii = segment.radii.map(|r| scale * f64::from(r));
                            thinnest = thinnest.min(2.0 * radii[0].max(radii[1]));
                            things.push(Thing::Segment(Hull {
                                centers: segment.ends.map(|p| to.transform_point3(p.as_dvec3())),
                                radii,
                                opacities: segment.opacities.map(f64::from),
                                strand,
                                place: place(first),
                            }));
                        }
                        strand += 1;
                    }
                }
            }
        }
        let boxes: Vec<Aabb> = things.iter().map(Thing::bounds).collect();
        let tree = Tree::over(&boxes);
        Self { things, tree, thinnest }
    }

    /// The thickness of the thinnest segment of all strands at its thicker end, in world lengths;
    /// infinite without strands.
    pub fn thinnest(&self) -> f64 {
        self.thinnest
    }

    /// Distances along the ray `origin + t direction` (world space, unit length) where it crosses
    /// something, and the opacity there, in no order, for `t` between the bounds.
    pub fn along(&self, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> Vec<[f64; 2]> {
        let found = self.until(origin, direction, bounds, |_| false);
        found.iter().map(|one| [one.distance, one.opacity]).collect()
    }

    /// What the ray of [`Crossings::along`] crosses, in order of distance.
    pub fn met(&self, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> Vec<Crossing> {
        let mut found = self.until(origin, direction, bounds, |_| false);
        found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        found
    }

    /// [`Crossings::along`] until an opacity of a triangle `ends` the search.
    fn until(
        &self,
        origin: DVec3,
        direction: DVec3,
        [from, to]: [f64; 2],
        ends: impl Fn(f64) -> bool,
    ) -> Vec<Crossing> {
        let (mut found, mut inside) = (Vec::new(), Vec::new());
        // A strand's interval may reach beyond the bounds, although its middle does not.
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
        let bounds = if self.thinnest.is_finite() { everywhere } else { [from, to] };
        self.tree.along(origin, direction, bounds, |index| {
            match self.things[index as usize] {
                Thing::Triangle { corners, opacity, place: [surface, index] } => {
                    if let Some((t, weights)) = through_triangle(origin, direction, corners)
                        && t >= from
                        && t <= to
                    {
                        found.push(Crossing {
                            distance: t,
                            opacity,
                            surface: surface as usize,
                            on: On::Triangle(index as usize, weights),
                        });
                        return !ends(opacity);
                    }
                }
                Thing::Segment(hull) => {
                    if let Some(interval) = hull.inside(origin, direction) {
                        inside.push(Inside { strand: hull.strand, interval, hull });
                    }
                }
            }
            true
        });
        inside
            .sort_by(|a, b| a.strand.cmp(&b.strand).then(a.interval[0].total_cmp(&b.interval[0])));
        let mut rest = &inside[..];
        while let Some(first) = rest.first() {
            let (mut end, mut count) = (first.interval[1], 1);
            while let Some(next) = rest.get(count)
                && next.strand == first.strand
                && next.interval[0] <= end
            {
                end = end.max(next.interval[1]);
                count += 1;
            }
            let middle = 0.5 * (first.interval[0] + end);
            if middle >= from && middle <= to {
                let at = origin + middle * direction;
                let holds = |one: &&Inside| one.interval[0] <= middle && middle <= one.interval[1];
                let own = rest[..count].iter().find(holds).unwrap_or(first);
                let share = own.hull.share_near(at);
                let [surface, point] = own.hull.place.map(|index| index as usize);
                found.push(Crossing {
                    distance: middle,
                    opacity: own.hull.opacity_at(share),
                    surface,
                    on: On::Strand(point, share),
                });
            }
            rest = &rest[count..];
        }
        found
    }

    /// The share of light that gets along the ray `origin + t direction` (world space, unit length)
    /// for `t` between the bounds, 0..1.
    pub fn transmittance(&self, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> f64 {
        // Nothing gets through what is opaque, whatever else there is.
        let found = self.until(origin, direction, bounds, |opacity| opacity >= 1.0);
        found.iter().map(|one| 1.0 - one.opacity).product()
    }
}

impl Thing {
    fn bounds(&self) -> Aabb {
        let (min, max) = match self {
            Self::Triangle { corners: [a, b, c], .. } => (a.min(*b).min(*c), a.max(*b).max(*c)),
            Self::Segment(Hull { centers: [a, b], radii: [ra, rb], .. }) => {
                ((a - ra).min(b - rb), (a + ra).max(b + rb))
            }
        };
        Aabb { min, max }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::Vec3;

    use super::*;
    use crate::surface::{Material, Mesh, Strands, Varying};

    /// A scene of one surface at its own place.
    fn crossings(shape: Shape) -> Crossings {
        let surface = crate::scene::Surface::new(shape, glam::DMat4::IDENTITY).unwrap();
        Crossings::of(&vec![surface].into())
    }

    #[test]
    fn a_bent_strand_is_crossed_once_and_a_folded_one_twice() {
        let points =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.5, 0.0], [2.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
        let strands = Strands::new(
            "bent",
            points.map(Vec3::from).to_vec(),
            &[5],
            Varying::Same(0.25),
            Varying::PerPoint(vec![0.5, 0.5, 0.5, 0.25, 0.25]),
            Varying::Same(Vec3::ONE),
        );
        let crossings = crossings(Shape::Strands(strands.unwrap().into()));
        let from = DVec3::new(1.0, -5.0, 0.0);
        let mut found = crossings.along(from, DVec3::Y, [0.0, f64::INFINITY]);
        found.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(found.len(), 2, "{found:?}");
        // At the joint, the union of two segments reaches up to the slanted one's flank.
        let middle = 0.5 * (-0.125 + 0.125 * 1.25_f64.sqrt());
        assert!((found[0][0] - 5.0 - middle).abs() < 1e-12, "{found:?}");
        assert!((found[1][0] - 8.0).abs() < 1e-12 && found[1][1] == 0.25, "{found:?}");
        assert_eq!(crossings.transmittance(from, DVec3::Y, [0.0, 20.0]), 0.5 * 0.75);
        assert_eq!(crossings.transmittance(from, DVec3::Y, [0.0, 7.99]), 0.5);
        assert_eq!(crossings.transmittance(from, DVec3::Y, [5.01, 8.01]), 0.75);
    }

    #[test]
    fn edges_between_triangles_are_crossed_once() {
        // A square of four triangles around its centre, with rays through edges and corners.
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, 0.0]];
        let positions = corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        let triangles = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [4, 3, 0]];
        let glass = Material { opacity: 0.5, ..Material::default() };
        let mesh =
            Mesh::new("square", positions, triangles, vec![glass], vec![0; 4], None).unwrap();
        let crossings = crossings(Shape::Mesh(mesh.into()));
        for i in -8..=8 {
            for j in -8..=8 {
                let (x, y) = (f64::from(i) / 10.0, f64::from(j) / 10.0);
                for (z, direction) in [(-3.0, DVec3::Z), (2.0, DVec3::NEG_Z)] {
                    let from = DVec3::new(x, y, z);
                    let found = crossings.transmittance(from, direction, [0.0, 10.0]);
                    assert_eq!(found, 0.5, "{from} along {direction}");
                }
            }
        }
        assert_eq!(crossings.transmittance(DVec3::new(1.1, 0.0, -1.0), DVec3::Z, [0.0, 9.0]), 1.0);
    }

    /// What lies in front of and behind an opaque triangle is found too.
    #[test]
    fn all_crossings_of_a_ray_are_found() {
        let at = |z: f32| [[-1.0, -1.0, z], [1.0, -1.0, z], [0.0, 1.0, z]].map(Vec3::from);
        let positions: Vec<Vec3> = (0..40).flat_map(|i| at(i as f32)).collect();
        let triangles = (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let of = |opacity: f64| Material { opacity, ..Material::default() };
        let materials = vec![of(0.1), of(1.0)];
        let material_of = (0..40).map(|i| u32::from(i == 20)).collect();
        let mesh = Mesh::new("stack", positions, triangles, materials, material_of, None).unwrap();
        let crossings = crossings(Shape::Mesh(mesh.into()));
        let found = crossings.along(DVec3::NEG_Z, DVec3::Z, [0.0, 100.0]);
        assert_eq!(found.len(), 40);
        assert_eq!(crossings.transmittance(DVec3::NEG_Z, DVec3::Z, [0.0, 100.0]), 0.0);
        let front = crossings.transmittance(DVec3::NEG_Z, DVec3::Z, [0.0, 20.5]);
        assert!((front - 0.9_f64.powi(20)).abs() < 1e-12, "{front}");
    }
}
