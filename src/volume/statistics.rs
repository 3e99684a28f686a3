//! Statistics of a volume's values, for automatic choices and for people.

use glam::DVec3;
use ndarray::Array3;

use super::{Held, SparseVoxels, Voxels};
use crate::parallel;

/// Range, mean and border level of a volume's values.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Mean over all voxels.
    pub mean: f64,
    /// Share of the voxels above 0, in 0..1.
    pub nonempty: f64,
    /// The value below which 90 % of the voxels on the six faces lie. It characterises the
    /// surroundings of a scanned object, even if the object touches a face. It is 0 if the medium
    /// is surrounded by empty space.
    pub border: f32,
}

impl Statistics {
    /// Statistics of `voxels`, which must be finite, at least 0, and not empty.
    pub fn of(voxels: &Voxels) -> Self {
        let dims = voxels.dims();
        // Along a flat axis every voxel lies on a face, which says nothing about the surroundings.
        let faced = dims.map(|n| n >= 3);
        let (mut min, mut max, mut sum, mut held) = (f32::INFINITY, 0.0_f32, 0.0_f64, 0_u64);
        let mut shell: Vec<(f32, u64)> = Vec::new();
        voxels.for_each_held(|part, value| {
            let count = part.voxels() as u64;
            (min, max) = (min.min(value), max.max(value));
            sum += f64::from(value) * count as f64;
            held += count;
            for axis in (0..3).filter(|&axis| faced[axis]) {
                let end = part.first[axis] + part.size[axis];
                for _ in [part.first[axis] == 0, end == dims[axis]].into_iter().filter(|&on| on) {
                    shell.push((value, count / part.size[axis] as u64));
                }
            }
        });
        let count = dims.iter().map(|&n| n as f64).product::<f64>().max(1.0);
        if (held as f64) < count {
            min = 0.0;
        }
        let on_faces = |axis: usize| 2.0 * count / dims[axis] as f64;
        let faces = (0..3).filter(|&axis| faced[axis]).map(on_faces).sum::<f64>() as u64;
        let nonempty = held as f64 / count;
        Self { min, max, mean: sum / count, nonempty, border: border(shell, faces) }
    }
}

/// The value below which 90 % of `count` values lie. `held` lists those that are not 0, as value
/// and number.
fn border(mut held: Vec<(f32, u64)>, count: u64) -> f32 {
    let last = count.saturating_sub(1);
    let rank = last / 10 * 9 + last % 10 * 9 / 10;
    let known: u64 = held.iter().map(|(_, count)| count).sum();
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

/// Sums of the voxels of all columns along `axis` (0 = x, 1 = y, 2 = z) that are not empty, sorted
/// by rising value. If sparse voxels have more than [`MOST_COLUMNS`] columns, only every second,
/// fourth, ... one along both other axes counts.
pub(super) fn nonempty_column_sums(voxels: &Voxels, axis: usize) -> Vec<f64> {
    let mut sums: Vec<f64> = match voxels {
        Voxels::Dense(values) => column_sums(values, axis),
        Voxels::Sparse(voxels) => sparse_column_sums(voxels, axis),
    };
    sums.retain(|&sum| sum > 0.0);
    sums.sort_unstable_by(f64::total_cmp);
    sums
}

/// The largest number of columns that are summed.
const MOST_COLUMNS: usize = 1 << 25;

/// In each column, values are added one after another along the axis.
fn column_sums(values: &Array3<f32>, axis: usize) -> Vec<f64> {
    let (nz, ny, nx) = values.dim();
    let values = values.as_slice().unwrap_or_default();
    let row = |y: usize, z: usize| &values[(z * ny + y) * nx..][..nx];
    let add = |sums: &mut [f64], row: &[f32]| {
        sums.iter_mut().zip(row).for_each(|(sum, &value)| *sum += f64::from(value));
    };
    let layers = match axis {
        0 => parallel::map(0..nz, |z| {
            // Four rows at once, because each sum waits for the one before.
            let mut sums = vec![0.0; ny];
            for (part, sums) in sums.chunks_mut(4).enumerate() {
                let rows = [0, 1, 2, 3].map(|i| row((4 * part + i).min(ny - 1), z));
                let mut four = [0.0; 4];
                for x in 0..nx {
                    add(&mut four, &rows.map(|row| row[x]));
                }
                let count = sums.len();
                sums.copy_from_slice(&four[..count]);
            }
            sums
        }),
        1 => parallel::map(0..nz, |z| {
            let mut sums = vec![0.0; nx];
            (0..ny).for_each(|y| add(&mut sums, row(y, z)));
            sums
        }),
        _ => parallel::map(0..ny, |y| {
            let mut sums = vec![0.0; nx];
            (0..nz).for_each(|z| add(&mut sums, row(y, z)));
            sums
        }),
    };
    layers.concat()
}

fn stride_of(across: [usize; 2]) -> usize {
    let mut stride = 1;
    while across.iter().fold(1, |all: usize, n| all.saturating_mul(n.div_ceil(stride)))
        > MOST_COLUMNS
    {
        stride *= 2;
    }
    stride
}

fn sparse_column_sums(voxels: &SparseVoxels, axis: usize) -> Vec<f64> {
    let across = [(axis + 1) % 3, (axis + 2) % 3];
    let dims = voxels.dims();
    let stride = stride_of(across.map(|axis| dims[axis]));
    let [width, height] = across.map(|axis| dims[axis].div_ceil(stride));
    let mut sums = vec![0.0; width * height];
    let column = |voxel: [usize; 3]| {
        let [a, b] = across.map(|axis| voxel[axis]);
        (a % stride == 0 && b % stride == 0).then(|| b / stride * width + a / stride)
    };
    for part in voxels.parts() {
        if let Some(value) = part.uniform {
            // One layer across the columns stands for all layers.
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

/// Visible parts that are thinner than this, in voxels, are framed together with the voxels next to
/// them.
const THIN: f64 = 8.0;

/// The first and the last voxel above `least` in rows of voxels along each axis, as voxel indices
/// (x, y, z), moved outwards by half a voxel. About `most` rows are taken along each of the other
/// two axes; they are the same whichever way an axis runs.
pub(super) fn row_ends_above(voxels: &Voxels, least: f32, most: usize) -> Vec<DVec3> {
    let dims = voxels.dims();
    // Dense voxels, which have standard layout, are addressed in memory directly.
    let flat = match voxels {
        Voxels::Dense(values) => values.as_slice(),
        Voxels::Sparse(_) => None,
    };
    let steps = [1, dims[0], dims[0] * dims[1]];
    let first_and_last = |axis: usize, start: [usize; 3]| -> Option<[usize; 2]> {
        let n = dims[axis];
        if let Some(flat) = flat {
            let begin: usize = (0..3).map(|axis| start[axis] * steps[axis]).sum();
            let row = &flat[begin..=begin + (n - 1) * steps[axis]];
            let first = row.iter().step_by(steps[axis]).position(|&value| value > least)?;
            let last = row.iter().rev().step_by(steps[axis]).position(|&value| value > least);
            return Some([first, n - 1 - last.unwrap_or(0)]);
        }
        let Voxels::Sparse(voxels) = voxels else { return None };
        let shown = |i: usize| {
            let mut voxel = start;
            voxel[axis] = i;
            voxels.get(voxel) > least
        };
        let first = (0..n).find(|&i| shown(i))?;
        Some([first, (first..n).rfind(|&i| shown(i)).unwrap_or(first)])
    };
    // Ends of rows, and the outward half voxel along their axis.
    let mut ends: Vec<(DVec3, DVec3)> = Vec::new();
    for axis in 0..3 {
        let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
        for j in spread(dims[b], most) {
            for k in spread(dims[c], most) {
                let voxel = |i: usize| {
                    let mut voxel = [0; 3];
                    (voxel[axis], voxel[b], voxel[c]) = (i, j, k);
                    voxel
                };
                let Some([first, last]) = first_and_last(axis, voxel(0)) else { continue };
                let out = DVec3::AXES[axis] * 0.5;
                for (i, out) in [(first, -out), (last, out)] {
                    ends.push((DVec3::from_array(voxel(i).map(|v| v as f64)), out));
                }
            }
        }
    }
    let low = ends.iter().fold(DVec3::INFINITY, |low, (end, _)| low.min(*end));
    let high = ends.iter().fold(DVec3::NEG_INFINITY, |high, (end, _)| high.max(*end));
    let thin = (high - low).cmplt(DVec3::splat(THIN));
    // Interpolation reaches to the next voxels, which is visible where there are few.
    let reach = DVec3::select(thin, DVec3::ONE, DVec3::ZERO);
    let mut points: Vec<DVec3> =
        ends.iter().map(|(end, out)| *end + DVec3::select(thin, DVec3::ZERO, *out)).collect();
    for axis in DVec3::AXES.into_iter().map(|axis| axis * reach).filter(|axis| *axis != DVec3::ZERO)
    {
        points = points.iter().flat_map(|point| [*point - axis, *point + axis]).collect();
    }
    points
}

/// At most `most` of 0..n, evenly spaced, and the same ones counted from either end.
fn spread(n: usize, most: usize) -> impl Iterator<Item = usize> {
    let count = n.min(most);
    (0..count).map(move |k| {
        let at = |k: usize| (2 * k + 1) * n / (2 * count);
        if 2 * k < count { at(k) } else { n - 1 - at(count - 1 - k) }
    })
}
