//! The line integral of density, cell by cell.
//!
//! Between eight voxel centres, trilinear density along a straight line is a cubic polynomial of
//! the distance. Its four coefficients in a cell give the integral up to any point of the cell in
//! closed form. So walking a ray through the cells (Amanatides and Woo 1987) gives the optical
//! depth exact to rounding, without a step size. Within half a voxel of the border, the clamped
//! density forms cells of its own.

use glam::{DMat4, DVec3};

use crate::math::Each;
use crate::volume::{Volume, Voxels};

/// Pieces of a ray whose voxels are read together: memory takes longer than all the rest.
const AHEAD: usize = 16;

/// A volume, prepared for exact integration.
#[derive(Clone, Debug)]
pub struct Cells<'a> {
    voxels: &'a Voxels,
    /// All voxels, x fastest; empty if they are sparse.
    dense: &'a [f32],
    dims: [usize; 3],
    domain: crate::math::Aabb,
    index_from_world: DMat4,
}

/// A stretch of a ray inside one cell, where density is a cubic of the distance.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// Distance along the ray where it begins.
    pub enter: f64,
    /// Distance along the ray where it ends.
    pub exit: f64,
    /// Coefficients, by rising powers, of density as a polynomial of the share of the stretch,
    /// 0..1; all zero if no corner of the cell has density.
    cubic: [f64; 4],
}

impl<'a> Cells<'a> {
    /// Prepares `volume` for integration.
    pub fn of(volume: &'a Volume) -> Self {
        let dense = match volume.voxels() {
            Voxels::Dense(values) => values.as_slice().unwrap_or_default(),
            Voxels::Sparse(_) => &[],
        };
        Self {
            voxels: volume.voxels(),
            dense,
            dims: volume.dims(),
            domain: volume.domain(),
            index_from_world: volume.world_from_index().inverse(),
        }
    }

    /// Calls `visit` for the stretches of the ray `origin + t direction` (world space) with `from
    /// <= t <= to`, in order, until it returns false.
    #[inline]
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
        let start = o + t * d;
        let [nx, ny, nz] = self.dims;
        let mut axes = [
            Axis::new(o.x, d.x, start.x, nx),
            Axis::new(o.y, d.y, start.y, ny),
            Axis::new(o.z, d.z, start.z, nz),
        ];
        let mut ahead = [Piece::default(); AHEAD];
        while t < end {
            let mut count = 0;
            while t < end && count < AHEAD {
                let stop = axes[0].next.min(axes[1].next).min(axes[2].next).min(end);
                if stop > t {
                    ahead[count] = Piece::of(&axes, [t, stop]);
                    count += 1;
                    t = stop;
                }
                for axis in &mut axes {
                    if axis.next <= stop {
                        axis.step();
                    }
                }
            }
            let mut corners = [[[0.0; 2]; 4]; AHEAD];
            for (corners, piece) in corners.iter_mut().zip(&ahead[..count]) {
                *corners = self.corners(piece.layers);
            }
            for (piece, corners) in ahead[..count].iter().zip(corners) {
                if !visit(&piece.stretch(&axes, corners)) {
                    return;
                }
            }
        }
    }

    /// Density at a world position; 0 outside of the domain.
    pub fn at(&self, world: DVec3) -> f64 {
        let mut density = 0.0;
        // A ray of nearly zero length evaluates it.
        self.walk(world, DVec3::X, [0.0, f64::MIN_POSITIVE.sqrt()], |stretch| {
            density = stretch.density(stretch.enter);
            false
        });
        density
    }

    /// The values at the corners of a cell between these layers: of both voxels along x, for the two
    /// of y and then those of z.
    #[inline]
    fn corners(&self, layers: [[usize; 2]; 3]) -> [[f32; 2]; 4] {
        match self.voxels {
            Voxels::Dense(_) => {
                let ([nx, ny, _], [x, [y0, y1], [z0, z1]]) = (self.dims, layers);
                let row = |y: usize, z: usize| {
                    let row = &self.dense[(z * ny + y) * nx..][..nx];
                    x.each(|x| row[x])
                };
                [row(y0, z0), row(y1, z0), row(y0, z1), row(y1, z1)]
            }
            Voxels::Sparse(voxels) => voxels.corners(layers),
        }
    }
}

/// A piece of a ray inside one cell.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    /// Distances along the ray where it begins and ends.
    bounds: [f64; 2],
    /// The cell along x, y, z, and the two layers of voxels around it.
    cell: [i64; 3],
    layers: [[usize; 2]; 3],
}

impl Piece {
    /// The piece between two distances in the cell that `axes` are in.
    #[inline]
    fn of(axes: &[Axis; 3], bounds: [f64; 2]) -> Self {
        let [x, y, z] = axes;
        Self { bounds, cell: [x.cell, y.cell, z.cell], layers: [x.layers, y.layers, z.layers] }
    }

    /// The stretch of the ray of `axes`, with the values at the corners of its cell.
    #[inline]
    fn stretch(&self, axes: &[Axis; 3], corners: [[f32; 2]; 4]) -> Stretch {
        let Self { bounds: [enter, exit], cell, .. } = *self;
        // All but the sign of zeros.
        let bits = corners.as_flattened().iter().fold(0, |bits, value| bits | value.to_bits());
        if bits << 1 == 0 {
            return Stretch { enter, exit, cubic: [0.0; 4] };
        }
        // Within a cell, each coordinate is linear in the share of the stretch.
        let [x, y, z] = [0, 1, 2].each(|i| axes[i].share(cell[i], [enter, exit]));
        let rows = corners.each(|[a, b]| {
            let (a, b) = (f64::from(a), f64::from(b));
            [a + (b - a) * x[0], (b - a) * x[1]]
        });
        let face = |a: [f64; 2], b: [f64; 2]| {
            let change = [b[0] - a[0], b[1] - a[1]];
            [
                a[0] + change[0] * y[0],
                a[1] + (change[0] * y[1] + change[1] * y[0]),
                change[1] * y[1],
            ]
        };
        let (a, b) = (face(rows[0], rows[1]), face(rows[2], rows[3]));
        let change = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let cubic = [
            a[0] + change[0] * z[0],
            a[1] + (change[0] * z[1] + change[1] * z[0]),
            a[2] + (change[1] * z[1] + change[2] * z[0]),
            change[2] * z[1],
        ];
        Stretch { enter, exit, cubic }
    }
}

/// One axis of a walk: the layer of cells that it is in, and where it leaves that layer.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Index coordinate at distance 0, its change per distance, and the inverse of that.
    origin: f64,
    slope: f64,
    inverse: f64,
    /// The lower voxel index of the cell; -1 and the last index are cells of clamped density.
    cell: i64,
    /// The two layers of voxels around the cell, clamped to the volume.
    layers: [usize; 2],
    /// Distance where the ray leaves the cell along this axis.
    next: f64,
    last: i64,
}

impl Axis {
    fn new(origin: f64, slope: f64, start: f64, count: usize) -> Self {
        // On a plane between two cells, the ray belongs to the cell that it enters.
        let cell = if slope < 0.0 { start.ceil() as i64 - 1 } else { start.floor() as i64 };
        let last = count as i64 - 1;
        // From so far away that rounding exceeds the volume's size, the walk would be too long.
        let cell = cell.clamp(-1, last);
        let (inverse, next) = (1.0 / slope, f64::INFINITY);
        let mut axis = Self { origin, slope, inverse, cell, layers: [0; 2], next, last };
        axis.arrive();
        axis
    }

    /// Moves to the next cell.
    #[inline]
    fn step(&mut self) {
        self.cell += if self.slope < 0.0 { -1 } else { 1 };
        self.arrive();
    }

    #[inline]
    fn arrive(&mut self) {
        let layer = |i: i64| i.clamp(0, self.last) as usize;
        self.layers = [layer(self.cell), layer(self.cell + 1)];
        if !(-1..=self.last).contains(&self.cell) {
            // The ray has left the volume.
            self.next = f64::INFINITY;
        } else if self.slope != 0.0 {
            let plane = if self.slope < 0.0 { self.cell } else { self.cell + 1 };
            self.next = (plane as f64 - self.origin) * self.inverse;
        }
    }

    /// Position in a cell at the first of two distances, and its change up to the second.
    #[inline]
    fn share(&self, cell: i64, [enter, exit]: [f64; 2]) -> [f64; 2] {
        let begin = self.origin - cell as f64 + enter * self.slope;
        [begin, (exit - enter) * self.slope]
    }
}

impl Stretch {
    /// Whether no corner of its cell has density.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.cubic == [0.0; 4]
    }

    /// Distances where density changes between rising and falling, also outside of the stretch.
    pub fn turns(&self) -> [Option<f64>; 2] {
        let [_, b, c, d] = self.cubic;
        let place = |s: f64| s.is_finite().then_some(self.enter + s * (self.exit - self.enter));
        let discriminant = c * c - 3.0 * b * d;
        if discriminant <= 0.0 {
            return [None; 2];
        }
        let sum = -c - discriminant.sqrt().copysign(c);
        [place(sum / (3.0 * d)), place(b / sum)]
    }

    /// Density at distance `t` along the ray.
    #[inline]
    pub fn density(&self, t: f64) -> f64 {
        let s = (t - self.enter) / (self.exit - self.enter);
        let [a, b, c, d] = self.cubic;
        a + s * (b + s * (c + s * d))
    }

    /// Integral of density from the begin of the stretch to `t`; exact to rounding.
    #[inline]
    pub fn integral_to(&self, t: f64) -> f64 {
        let s = (t - self.enter) / (self.exit - self.enter);
        let [a, b, c, d] = self.cubic;
        (t - self.enter) * (a + s * (b * (1.0 / 2.0) + s * (c * (1.0 / 3.0) + s * (d * 0.25))))
    }

    /// Integral of density over the whole stretch.
    #[inline]
    pub fn integral(&self) -> f64 {
        let [a, b, c, d] = self.cubic;
        (self.exit - self.enter) * (a + (b * (1.0 / 2.0) + (c * (1.0 / 3.0) + d * 0.25)))
    }
}

/// Integral of density along `origin + t direction` (world space) for `t` between the two bounds.
/// If `direction` has unit length, it is in density times world lengths; multiplied by the density
/// scale it is the optical depth.
pub fn optical_depth(cells: &Cells<'_>, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    cells.walk(origin, direction, bounds, |stretch| {
        sum += stretch.integral();
        true
    });
    sum
}
