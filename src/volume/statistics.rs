//! What a volume's values look like as a whole, for automatic choices and for people.

use glam::DVec3;
use ndarray::{Array3, Axis};

use super::{Held, SparseVoxels, Voxels};

/// Range, mean and border level of a volume's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Mean over all voxels.
    pub mean: f64,
    /// Share of the voxels above 0, in 0..1.
    pub nonempty: f64,
    /// The value below which 90 % of the voxels on the six faces lie: what the surroundings of a
    /// scanned object look like, even where the object itself touches a face. 0 where the medium
    /// lies free in empty space.
    pub border: f32,
}

impl Statistics {
    /// Statistics of voxels that are finite and at least 0, not none.
    pub fn of(voxels: &Voxels) -> Self {
        let dims = voxels.dims();
        // Along a flat axis every voxel is a face; it says nothing of the surroundings.
        let faced = dims.map(|n| n >= 3);
        let (mut min, mut max, mut sum, mut held) = (f32::INFINITY, 0.0_f32, 0.0_f64, 0_usize);
        let mut shell: Vec<(f32, usize)> = Vec::new();
        voxels.for_each_held(|part, value| {
            let count = part.voxels();
            (min, max) = (min.min(value), max.max(value));
            sum += f64::from(value) * count as f64;
            held += count;
            for axis in (0..3).filter(|&axis| faced[axis]) {
                let end = part.first[axis] + part.size[axis];
                for _ in [part.first[axis] == 0, end == dims[axis]].into_iter().filter(|&on| on) {
                    shell.push((value, count / part.size[axis]));
                }
            }
        });
        let count = dims.iter().map(|&n| n as f64).product::<f64>().max(1.0);
        if (held as f64) < count {
            min = 0.0;
        }
        let on_faces = |axis: usize| 2.0 * count / dims[axis] as f64;
        let faces = (0..3).filter(|&axis| faced[axis]).map(on_faces).sum::<f64>() as usize;
        let nonempty = held as f64 / count;
        Self { min, max, mean: sum / count, nonempty, border: border(shell, faces) }
    }
}

/// The value below which 90 % of `count` lie, of which `held` are those that are not 0: values, and how many.
fn border(mut held: Vec<(f32, usize)>, count: usize) -> f32 {
    let last = count.saturating_sub(1);
    let rank = last / 10 * 9 + last % 10 * 9 / 10;
    let known: usize = held.iter().map(|(_, count)| count).sum();
    held.sort_unstable_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut below = count.saturating_sub(known);
    for (value, count) in held {
        if rank < below {
            break;
        }
        below += count;
        if rank < below {
            return value;
        }
    }
    0.0
}

/// Sums of voxels along `axis` (0 = x, 1 = y, 2 = z), of all columns that hold anything, rising; of sparse voxels
/// every second, fourth, ... column along both other axes where there are more than [`MOST_COLUMNS`].
pub(super) fn nonempty_column_sums(voxels: &Voxels, axis: usize) -> Vec<f64> {
    let mut sums: Vec<f64> = match voxels {
        Voxels::Dense(values) => column_sums(values, axis),
        Voxels::Sparse(voxels) => sparse_column_sums(voxels, axis),
    };
    sums.retain(|&sum| sum > 0.0);
    sums.sort_unstable_by(f64::total_cmp);
    sums
}

/// Columns whose sums are worked out at most.
const MOST_COLUMNS: usize = 1 << 25;

fn column_sums(values: &Array3<f32>, axis: usize) -> Vec<f64> {
    let sum = |lane: ndarray::ArrayView1<'_, f32>| lane.iter().map(|&v| f64::from(v)).sum();
    values.lanes(Axis(2 - axis)).into_iter().map(sum).collect()
}

fn sparse_column_sums(voxels: &SparseVoxels, axis: usize) -> Vec<f64> {
    let across = [(axis + 1) % 3, (axis + 2) % 3];
    let dims = voxels.dims();
    let mut stride = 1;
    let counts = |stride: usize| across.map(|axis| dims[axis].div_ceil(stride));
    while counts(stride)[0].saturating_mul(counts(stride)[1]) > MOST_COLUMNS {
        stride *= 2;
    }
    let [width, height] = counts(stride);
    let mut sums = vec![0.0; width * height];
    let column = |voxel: [usize; 3]| {
        let [a, b] = across.map(|axis| voxel[axis]);
        (a % stride == 0 && b % stride == 0).then(|| b / stride * width + a / stride)
    };
    for part in voxels.parts() {
        if let Some(value) = part.uniform {
            // One layer of its columns stands for all.
            let mut layer = Held { first: part.origin, size: part.size };
            layer.size[axis] = 1;
            let sum = f64::from(value) * part.size[axis] as f64;
            for voxel in (0..layer.voxels()).map(|i| layer.voxel(i)) {
                if let Some(i) = column(voxel) {
                    sums[i] += sum;
                }
            }
        } else {
            part.for_each(|voxel, value| {
                if let Some(i) = column(voxel) {
                    sums[i] += f64::from(value);
                }
            });
        }
    }
    sums
}

/// The corners (voxel index x, y, z) where rows along x begin and end to be above `least`, half a
/// voxel outside; of about `most` rows along y and z each.
pub(super) fn row_ends_above(voxels: &Voxels, least: f32, most: usize) -> Vec<DVec3> {
    let [nx, ny, nz] = voxels.dims();
    let stride = |n: usize| n.div_ceil(most);
    let mut ends = Vec::new();
    let mut row = vec![0.0; nx];
    for z in (0..nz).step_by(stride(nz)) {
        for y in (0..ny).step_by(stride(ny)) {
            voxels.fill_row(y, z, &mut row);
            let Some(first) = row.iter().position(|&v| v > least) else { continue };
            let last = row.iter().rposition(|&v| v > least).unwrap_or(first);
            for x in [first as f64 - 0.5, last as f64 + 0.5] {
                ends.push(DVec3::new(x, y as f64, z as f64));
            }
        }
    }
    ends
}
