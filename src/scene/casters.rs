//! What casts shadows: media and surfaces together, as lights and passes see them.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use super::media::unit_of;
use super::{Media, Surface, Surfaces};
use crate::math::Aabb;

/// Largest number of directions that are tried as the side of a rectangle.
const MOST_SIDES: usize = 256;

/// The media and the surfaces of a beam, borrowed. Some of the surfaces may cast no shadow.
#[derive(Clone, Copy, Debug)]
pub struct Casters<'a> {
    /// The media.
    pub media: &'a Media,
    /// The surfaces.
    pub surfaces: &'a Surfaces,
}

impl<'a> Casters<'a> {
    /// Whether the media's domain is part of the scene: media without bodies count only if there is
    /// nothing else.
    pub fn media_count(self) -> bool {
        self.surfaces.is_empty() || !self.media.bodies().is_empty()
    }

    /// The box around everything in the world.
    pub fn world_bounds(self) -> Aabb {
        let media = self.media_count().then(|| self.media.world_bounds());
        let both = media.into_iter().chain(self.surfaces.world_bounds());
        let both = both.reduce(|a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) });
        both.unwrap_or_else(|| self.media.world_bounds())
    }

    /// The world length of the unit in which maps and pictures are computed in f32
    /// ([`Media::unit`]).
    pub fn unit(self) -> f64 {
        unit_of(&self.world_bounds())
    }

    /// Whether there is nothing at all.
    pub fn is_empty(self) -> bool {
        self.media.bodies().is_empty() && self.surfaces.is_empty()
    }

    /// Whether a position is among the media, or within the surfaces' box.
    pub(super) fn surround(self, position: DVec3) -> bool {
        let index = self.media.world_from_index().inverse().transform_point3(position);
        let within = |of: Aabb, p: DVec3| p.cmpge(of.min).all() && p.cmple(of.max).all();
        let in_media = !self.media.bodies().is_empty() && within(self.media.domain(), index);
        in_media || self.casting().any(|surface| within(surface.world_bounds(), position))
    }

    /// The surfaces that cast shadows; all if none does, so that there is something that light can
    /// be fitted to.
    fn casting(self) -> impl Iterator<Item = &'a Surface> {
        let none = self.surfaces.iter().all(|surface| !surface.casts);
        self.surfaces.iter().filter(move |surface| surface.casts || none)
    }

    /// Calls `visit` for world positions, and the radius of a ball around each. The convex hull of
    /// all balls holds everything that casts a shadow.
    pub(super) fn for_each_ball(self, mut visit: impl FnMut(DVec3, f64)) {
        if self.media_count() {
            self.media.world_corners().into_iter().for_each(|corner| visit(corner, 0.0));
        }
        self.casting().for_each(|surface| surface.for_each_ball(&mut visit));
    }

    /// The corners of boxes that hold everything that casts a shadow.
    pub(super) fn corners(self) -> Vec<DVec3> {
        let media = self.media_count().then(|| self.media.world_corners());
        let surfaces = self.casting().map(|surface| surface.world_bounds().corners());
        media.into_iter().chain(surfaces).flatten().collect()
    }

    /// A direction along a side of the smallest rectangle around all casters as they are projected to
    /// the plane of the unit vectors `x` and `y`: one of the sides of the convex hull, of which the
    /// longest are tried. Balls count as their centres.
    pub(super) fn best_side(self, x: DVec3, y: DVec3) -> DVec3 {
        let mut points = Vec::new();
        self.for_each_ball(|center, _| points.push(DVec2::new(center.dot(x), center.dot(y))));
        let hull = convex_hull(points);
        let ends = hull.iter().zip(hull.iter().cycle().skip(1));
        let mut sides: Vec<DVec2> = ends.map(|(a, b)| *b - *a).collect();
        sides.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
        sides.truncate(MOST_SIDES);
        let area = |side: &DVec2| {
            let axis = side.normalize_or_zero();
            let span = |axis: DVec2| {
                let places = hull.iter().map(|corner| corner.dot(axis));
                let ends = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
                    (low.min(place), high.max(place))
                });
                ends.1 - ends.0
            };
            span(axis) * span(axis.perp())
        };
        let best = sides.iter().min_by(|a, b| area(a).total_cmp(&area(b)));
        best.map_or(x, |side| side.x * x + side.y * y)
    }
}

static NO_SURFACES: LazyLock<Surfaces> = LazyLock::new(Surfaces::default);

impl<'a> From<&'a Media> for Casters<'a> {
    fn from(media: &'a Media) -> Self {
        Self { media, surfaces: &NO_SURFACES }
    }
}

/// The corners of the convex hull of points, in order (Andrew 1979).
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_grid_is_its_four_corners() {
        let grid = (0..20).map(|i| DVec2::new(f64::from(i % 5), f64::from(i / 5)));
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)].map(DVec2::from);
        assert_eq!(convex_hull(grid.collect()), corners);
        assert_eq!(convex_hull(vec![DVec2::ONE; 7]), []);
    }
}
