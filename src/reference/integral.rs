//! The line integral of density, cell by cell.
//!
//! Between eight voxel centres trilinear density along a straight line is a cubic polynomial of the
//! distance, which two-point Gauss-Legendre quadrature integrates exactly (three would be exact to
//! the fifth degree). So walking a ray through the cells (Amanatides and Woo 1987) gives the optical
//! depth exact to rounding, without a step size. Within half a voxel of the border the clamped
//! density makes cells of their own.

use glam::{DMat4, DVec3};

use crate::volume::Volume;

/// The two nodes of Gauss-Legendre quadrature on -1..1 are at plus and minus this.
const NODE: f64 = 0.577_350_269_189_625_8;

/// A volume ready for exact integration.
#[derive(Clone, Debug)]
pub struct Cells<'a> {
    values: &'a [f32],
    dims: [usize; 3],
    domain: crate::math::Aabb,
    index_from_world: DMat4,
}

/// A stretch of a ray inside one cell; density is a cubic of the distance here.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// Distance along the ray where it begins.
    pub enter: f64,
    /// Distance along the ray where it ends.
    pub exit: f64,
    corners: [f64; 8],
    /// Position in the cell at distance 0, and its change per unit distance.
    origin: DVec3,
    direction: DVec3,
}

impl<'a> Cells<'a> {
    /// The cells of `volume`.
    pub fn of(volume: &'a Volume) -> Self {
        Self {
            values: volume.values().as_slice().unwrap_or_default(),
            dims: volume.dims(),
            domain: volume.domain(),
            index_from_world: volume.world_from_index().inverse(),
        }
    }

    /// Calls `visit` with the stretches of the ray `origin + t direction` (world space) for
    /// `from <= t <= to`, in order, until it returns false.
    pub fn walk(
        &self,
        origin: DVec3,
        direction: DVec3,
        [from, to]: [f64; 2],
        mut visit: impl FnMut(&Stretch) -> bool,
    ) {
        let o = self.index_from_world.transform_point3(origin);
        let d = self.index_from_world.transform_vector3(direction);
        let Some((enter, exit)) = self.domain.intersect(o, d) else { return };
        let (mut t, end) = (enter.max(from), exit.min(to));
        // The next plane of voxel centres along each axis, and the distance to it.
        let mut plane = [0.0; 3];
        let mut next = [f64::INFINITY; 3];
        let start = o + t * d;
        for axis in 0..3 {
            if d[axis] != 0.0 {
                plane[axis] = if d[axis] > 0.0 {
                    start[axis].floor() + 1.0
                } else {
                    start[axis].ceil() - 1.0
                };
                next[axis] = (plane[axis] - o[axis]) / d[axis];
            }
        }
        while t < end {
            let stop = next[0].min(next[1]).min(next[2]).min(end);
            if stop > t {
                let middle = o + (t + stop) * 0.5 * d;
                let cell = middle.floor();
                let stretch = Stretch {
                    enter: t,
                    exit: stop,
                    corners: self.corners(cell),
                    origin: o - cell,
                    direction: d,
                };
                if !visit(&stretch) {
                    return;
                }
                t = stop;
            }
            for axis in 0..3 {
                if next[axis] <= stop {
                    plane[axis] += d[axis].signum();
                    next[axis] = (plane[axis] - o[axis]) / d[axis];
                }
            }
        }
    }

    /// Densities at the corners of the cell between voxel `cell` and the next along each axis, x
    /// fastest, with indices clamped to the volume.
    fn corners(&self, cell: DVec3) -> [f64; 8] {
        let clamped = |i: f64, n: usize| (i.max(0.0) as usize).min(n - 1);
        let [nx, ny, nz] = self.dims;
        let x = [clamped(cell.x, nx), clamped(cell.x + 1.0, nx)];
        let y = [clamped(cell.y, ny) * nx, clamped(cell.y + 1.0, ny) * nx];
        let z = [clamped(cell.z, nz) * nx * ny, clamped(cell.z + 1.0, nz) * nx * ny];
        std::array::from_fn(|i| f64::from(self.values[z[i >> 2] + y[i >> 1 & 1] + x[i & 1]]))
    }
}

impl Stretch {
    /// Density at distance `t` along the ray.
    pub fn density(&self, t: f64) -> f64 {
        let f = self.origin + t * self.direction;
        let c = &self.corners;
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |i: usize| mix(c[i], c[i + 1], f.x);
        mix(mix(row(0), row(2), f.y), mix(row(4), row(6), f.y), f.z)
    }

    /// Integral of density from where the stretch begins to `t` in it; exact to rounding.
    pub fn integral_to(&self, t: f64) -> f64 {
        let half = (t - self.enter) * 0.5;
        let middle = self.enter + half;
        half * (self.density(middle - NODE * half) + self.density(middle + NODE * half))
    }

    /// Integral of density over the whole stretch.
    pub fn integral(&self) -> f64 {
        self.integral_to(self.exit)
    }
}

/// Integral of density along `origin + t direction` for `t` between the two bounds, in density times
/// world lengths if `direction` has unit length; times the density scale it is the optical depth.
pub fn optical_depth(cells: &Cells<'_>, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    cells.walk(origin, direction, bounds, |stretch| {
        sum += stretch.integral();
        true
    });
    sum
}
