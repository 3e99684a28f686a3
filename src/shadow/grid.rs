//! Transmittance in a grid over the volume: the shadow volume that most engines keep (the shadow
//! texture of Behrens and Ratering 1998, "Adding Shadows to a Texture-Based Volume Renderer").
//!
//! It has no texels or rays. Every lookup is of a point in the volume, trilinear between the
//! nearest cells' centres, so filters over texels do not apply. Behind the volume a ray keeps the
//! transmittance of the point where it left.

use glam::Vec3;

use super::Shadow;
use crate::frame::Frame;
use crate::kernel::light::light_ray;
use crate::kernel::ray::intersect_box;
use crate::scene::LightView;

/// Cells of a grid along x, y, z: `count` along the longest axis of a volume of `dims` voxels, and
/// as many per voxel along the other axes.
pub fn grid_shape(dims: [usize; 3], count: u16) -> [usize; 3] {
    let longest = dims.into_iter().max().unwrap_or(1).max(1);
    // The space of bodies of very different scales may have so many voxels that the product
    // overflows 64 bits.
    let cells = |n: usize| (n as u128 * u128::from(count)).div_ceil(longest as u128);
    dims.map(|n| usize::try_from(cells(n)).unwrap_or(1).max(1))
}

/// The voxel index in the middle of a cell.
pub fn grid_point(frame: &Frame, shape: [usize; 3], cell: [usize; 3]) -> Vec3 {
    let (min, max) = (frame.media.domain_min, frame.media.domain_max);
    let [shape, cell] = [shape, cell].map(|numbers| Vec3::from_array(numbers.map(|n| n as f32)));
    min + (max - min) * (cell + 0.5) / shape
}

/// A grid over the volume's box with the transmittance of each cell in 8 bits.
#[derive(Clone, Debug)]
pub struct GridMap {
    shape: [usize; 3],
    /// Transmittance at the cells' centres, times 255; x fastest.
    values: Vec<u8>,
    frame: Box<Frame>,
    view: LightView,
}

impl GridMap {
    /// A grid of `shape` (x, y, z) cells with `values`, their transmittances times 255, x fastest,
    /// built from `view` for `frame`.
    ///
    /// # Panics
    /// If there are no cells, or if the number of values differs from that of cells.
    pub fn new(values: Vec<u8>, shape: [usize; 3], view: LightView, frame: &Frame) -> Self {
        let cells: usize = shape.into_iter().product();
        assert!(values.len() == cells && cells > 0, "{} values of {shape:?} cells", values.len());
        Self { shape, values, frame: Box::new(*frame), view }
    }

    /// Number of cells along x, y, z.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Transmittance at the cells' centres, times 255; x fastest.
    pub fn values(&self) -> &[u8] {
        &self.values
    }

    /// Number of cells along the longest axis.
    pub fn longest(&self) -> u32 {
        self.shape.into_iter().max().unwrap_or(1) as u32
    }

    /// The light's view that the map was built from.
    pub fn view(&self) -> &LightView {
        &self.view
    }

    /// Trilinear at a voxel index; beyond the outermost centres the index is clamped.
    fn at(&self, index: Vec3) -> f32 {
        let (min, max) = (self.frame.media.domain_min, self.frame.media.domain_max);
        let shape = Vec3::from_array(self.shape.map(|n| n as f32));
        let place = (index - min) / (max - min) * shape - 0.5;
        let place = place.clamp(Vec3::ZERO, shape - 1.0);
        let cell = place.to_array().map(|c| c as usize);
        let share = place.fract().to_array();
        let mut sum = 0.0;
        for corner in 0..8_usize {
            let (mut at, mut weight) = (0, 1.0);
            for axis in [2, 1, 0] {
                let far = corner >> axis & 1;
                let last = self.shape[axis] - 1;
                at = at * self.shape[axis] + (cell[axis] + far).min(last);
                weight *= if far == 1 { share[axis] } else { 1.0 - share[axis] };
            }
            sum += weight * self.values.get(at).map_or(1.0, |&value| f32::from(value) / 255.0);
        }
        sum
    }
}

impl Shadow for GridMap {
    fn bytes(&self) -> u64 {
        self.values.len() as u64
    }

    /// Trilinear between the nearest cells, whatever the width.
    fn lookup(&self, _width: u32, u: f32, v: f32, depth: f32) -> f32 {
        if !super::inside(u, v) {
            return 1.0;
        }
        let frame = &self.frame;
        let ray = light_ray(frame, u, v).transformed(&frame.media.index_from_frame);
        let (min, max) = (frame.media.domain_min, frame.media.domain_max);
        let (enter, exit) = intersect_box(&ray, min, max);
        // 1 also where the ray misses the volume, and for NaN.
        if depth > enter && exit > enter { self.at(ray.at(depth.min(exit))) } else { 1.0 }
    }
}
