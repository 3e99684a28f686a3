//! Where a ray meets one segment of a strand, or one triangle.

use glam::DVec3;

/// The convex hull of two balls, part of a strand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hull {
    pub centers: [DVec3; 2],
    pub radii: [f64; 2],
    pub opacities: [f64; 2],
    /// The strand, numbered over all surfaces.
    pub strand: u32,
    /// Its surface, and the point there where it begins.
    pub place: [u32; 2],
}

impl Hull {
    /// The interval of a ray inside the hull. Its ends lie on one of the balls or on the cone that
    /// touches both, so it reaches from the first to the last point where the ray meets one of the
    /// three.
    pub(super) fn inside(&self, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let ([a, b], [ra, rb]) = (self.centers, self.radii);
        // Distances are measured from the point of the ray nearest to the hull's middle, where
        // squares are smallest.
        let begin = (0.5 * (a + b) - origin).dot(direction);
        let start = origin + begin * direction;
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        let mut meet = |t: f64| ends = [ends[0].min(t), ends[1].max(t)];
        for (center, radius) in [(a, ra), (b, rb)] {
            let from = start - center;
            let half = from.dot(direction);
            let root = half * half - (from.length_squared() - radius * radius);
            if root >= 0.0 {
                meet(-half - root.sqrt());
                meet(-half + root.sqrt());
            }
        }
        // Where |m|^2 - ra^2 = (y - ra (ra - rb))^2 / (L^2 - (ra - rb)^2) with m from a, y = m . d,
        // and the touching ball lies between the two.
        let (d, narrower) = (b - a, ra - rb);
        let square = d.length_squared() - narrower * narrower;
        if square > 0.0 {
            let m = start - a;
            let (slope, at) = (direction.dot(d), m.dot(d) - ra * narrower);
            let quadratic = square - slope * slope;
            let half = square * m.dot(direction) - at * slope;
            let constant = square * (m.length_squared() - ra * ra) - at * at;
            let root = half * half - quadratic * constant;
            if root >= 0.0 && quadratic != 0.0 {
                for t in [(-half - root.sqrt()) / quadratic, (-half + root.sqrt()) / quadratic] {
                    let along = (at + t * slope) / square;
                    if (0.0..=1.0).contains(&along) {
                        meet(t);
                    }
                }
            }
        }
        (ends[0] < ends[1]).then(|| ends.map(|t| begin + t))
    }

    /// The share of the way along the axis at the place nearest to a point.
    pub(super) fn share_near(&self, point: DVec3) -> f64 {
        let [a, b] = self.centers;
        let along = (point - a).dot(b - a) / (b - a).length_squared();
        if along.is_finite() { along.clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The opacity of a crossing there.
    pub(super) fn opacity_at(&self, share: f64) -> f64 {
        self.opacities[0] + (self.opacities[1] - self.opacities[0]) * share
    }
}

/// Where a ray goes through a triangle, from either side (Woop, Benthin and Wald 2013): in a plane
/// across the ray, edge by edge, so that both triangles of an edge compute the same and none of
/// them, or one, but not both, is met there.
pub(super) fn through_triangle(
    origin: DVec3,
    direction: DVec3,
    corners: [DVec3; 3],
) -> Option<(f64, [f64; 3])> {
    let (x, y) = direction.any_orthonormal_pair();
    let [a, b, c] = corners.map(|p| {
        let from = p - origin;
        (from.dot(x), from.dot(y), from.dot(direction))
    });
    // Whether the ray is on the left of an edge. One on its line counts as a little above it or,
    // for an upright edge, on its right.
    let edge = |p: (f64, f64, f64), q: (f64, f64, f64)| {
        let forward = (p.0, p.1) <= (q.0, q.1);
        let (from, to) = if forward { (p, q) } else { (q, p) };
        let area = from.0 * to.1 - from.1 * to.0;
        let above = area > 0.0 || (area == 0.0 && to.0 > from.0);
        (if forward { area } else { -area }, above == forward)
    };
    let ((u, side_u), (v, side_v), (w, side_w)) = (edge(b, c), edge(c, a), edge(a, b));
    let area = u + v + w;
    if side_u != side_v || side_v != side_w || area == 0.0 {
        return None;
    }
    let weights = [u, v, w].map(|part| part / area);
    Some((weights[0] * a.2 + weights[1] * b.2 + weights[2] * c.2, weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hull(ends: [[f64; 3]; 2], radii: [f64; 2]) -> Hull {
        let centers = ends.map(DVec3::from);
        Hull { centers, radii, opacities: [0.25, 0.75], strand: 0, place: [0; 2] }
    }

    fn close(found: Option<[f64; 2]>, due: Option<[f64; 2]>) {
        match (found, due) {
            (Some(found), Some(due)) => {
                let off = (found[0] - due[0]).abs().max((found[1] - due[1]).abs());
                assert!(off < 1e-12, "{found:?}, not {due:?}");
            }
            (found, due) => assert_eq!(found, due),
        }
    }

    #[test]
    fn a_ray_in_a_strand_is_between_what_geometry_says() {
        // A cylinder along x: across, at a slant, along, and past it.
        let rod = hull([[0.0; 3], [10.0, 0.0, 0.0]], [0.5; 2]);
        let from = DVec3::new(5.0, -3.0, 0.3);
        let chord = (0.25_f64 - 0.09).sqrt();
        close(rod.inside(from, DVec3::Y), Some([3.0 - chord, 3.0 + chord]));
        let slant = DVec3::new(0.6, 0.8, 0.0);
        close(rod.inside(from, slant), Some([(3.0 - chord) / 0.8, (3.0 + chord) / 0.8]));
        let along = rod.inside(DVec3::new(-2.0, 0.3, 0.0), DVec3::X);
        close(along, Some([2.0 - 0.4, 12.0 + 0.4]));
        close(rod.inside(DVec3::new(5.0, -3.0, 0.51), DVec3::Y), None);
        // Beyond its ends there are half balls.
        close(rod.inside(DVec3::new(10.3, -3.0, 0.0), DVec3::Y), Some([3.0 - 0.4, 3.0 + 0.4]));
        close(rod.inside(DVec3::new(10.51, -3.0, 0.0), DVec3::Y), None);
        // A cone from radius 1 to a point at 2: its flanks touch the ball at 60 degrees, where they
        // are at a height of (2 - x) tan 30 degrees.
        let cone = hull([[0.0; 3], [2.0, 0.0, 0.0]], [1.0, 0.0]);
        let height = (2.0 - 1.25) / 3.0_f64.sqrt();
        close(
            cone.inside(DVec3::new(1.25, -5.0, 0.0), DVec3::Y),
            Some([5.0 - height, 5.0 + height]),
        );
        // In front of where they touch it is the ball.
        let height = (1.0_f64 - 0.04).sqrt();
        close(
            cone.inside(DVec3::new(-0.2, -5.0, 0.0), DVec3::Y),
            Some([5.0 - height, 5.0 + height]),
        );
        // A ball in a ball.
        let ball = hull([[0.0; 3], [0.1, 0.0, 0.0]], [1.0, 0.2]);
        close(ball.inside(DVec3::new(0.0, -5.0, 0.0), DVec3::Y), Some([4.0, 6.0]));
    }
}
