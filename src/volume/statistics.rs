//! What a volume's values look like as a whole, for automatic choices and for people.

use std::collections::HashMap;

use glam::DVec3;
use ndarray::{Array3, Axis};

use super::{BLOCK, SparseVoxels, Voxels};

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
        let last = dims.map(|n| n - 1);
        // Along a flat axis every voxel is a face; it says nothing of the surroundings.
        let faced = dims.map(|n| n >= 3);
        let (mut min, mut max, mut sum, mut held) = (f32::INFINITY, 0.0_f32, 0.0_f64, 0_usize);
        let mut shell: Vec<f32> = Vec::new();
        voxels.for_each_held(|voxel, value| {
            (min, max) = (min.min(value), max.max(value));
            sum += f64::from(value);
            held += 1;
            for axis in (0..3).filter(|&axis| faced[axis]) {
                if voxel[axis] == 0 || voxel[axis] == last[axis] {
                    shell.push(value);
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

/// The value below which 90 % of `count` lie, of which `held` are those that are not 0.
fn border(mut held: Vec<f32>, count: usize) -> f32 {
    let rank = count.saturating_sub(1) / 10 * 9 + count.saturating_sub(1) % 10 * 9 / 10;
    match rank.checked_sub(count - held.len()) {
        Some(rank) if rank < held.len() => *held.select_nth_unstable_by(rank, f32::total_cmp).1,
        _ => 0.0,
    }
}

/// Sums of voxels along `axis` (0 = x, 1 = y, 2 = z), of all columns that hold anything, rising.
pub(super) fn nonempty_column_sums(voxels: &Voxels, axis: usize) -> Vec<f64> {
    let mut sums: Vec<f64> = match voxels {
        Voxels::Dense(values) => column_sums(values, axis),
        Voxels::Sparse(voxels) => sparse_column_sums(voxels, axis),
    };
    sums.retain(|&sum| sum > 0.0);
    sums.sort_unstable_by(f64::total_cmp);
    sums
}

fn column_sums(values: &Array3<f32>, axis: usize) -> Vec<f64> {
    let sum = |lane: ndarray::ArrayView1<'_, f32>| lane.iter().map(|&v| f64::from(v)).sum();
    values.lanes(Axis(2 - axis)).into_iter().map(sum).collect()
}

fn sparse_column_sums(voxels: &SparseVoxels, axis: usize) -> Vec<f64> {
    // Columns of blocks that hold anything, with the sums of their columns of voxels.
    let mut blocks: HashMap<[usize; 2], Vec<f64>> = HashMap::new();
    let across = [(axis + 1) % 3, (axis + 2) % 3];
    for part in voxels.parts() {
        let block = across.map(|axis| part.origin[axis] / BLOCK);
        let sums = blocks.entry(block).or_insert_with(|| vec![0.0; BLOCK * BLOCK]);
        part.for_each(|voxel, value| {
            let [a, b] = across.map(|axis| voxel[axis] % BLOCK);
            sums[b * BLOCK + a] += f64::from(value);
        });
    }
    blocks.into_values().flatten().collect()
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
