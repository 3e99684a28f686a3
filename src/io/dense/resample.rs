//! Resamples voxels to a finer or coarser grid in the same place: a box filter downwards, trilinear
//! interpolation upwards, one axis after another. Knows no format.

use glam::{DMat4, DVec3, IVec3};

use super::grid::DenseGrid;
use crate::error::memory;
use crate::error::{Error, ErrorKind, Result};
use crate::io::number::{CHUNK, Endian};
use crate::parallel;

/// Less than this share of a voxel is a rounding error.
const ROUNDING: f64 = 1e-9;

/// The weights of old voxels in the new voxels along one axis.
struct Axis {
    /// Index of the first new voxel.
    first: i64,
    /// For each new voxel: old voxels, counted from the first (`None` for what lies outside of the
    /// box), and their weights.
    parts: Vec<Vec<(Option<usize>, f64)>>,
    /// For each new voxel: the old voxels that make it active if one of them is.
    near: Vec<Vec<usize>>,
}

impl Axis {
    /// The weights for `count` old voxels from index `origin` on. Outside of the box there is the
    /// background if `open`; else the border's values continue.
    fn new(origin: i64, count: usize, factor: f64, open: bool) -> Self {
        let (low, high) = (origin as f64, origin as f64 + count as f64);
        // Here a voxel extends from its index to the next one. New voxel j extends from j / factor.
        let first = (low * factor + ROUNDING).floor() as i64;
        let last = (high * factor - ROUNDING).ceil() as i64 - 1;
        let indices = first..=last.max(first);
        let local = |index: i64| usize::try_from(index - origin).ok().filter(|&at| at < count);
        let inside = |index: i64| (index - origin).clamp(0, count as i64 - 1) as usize;
        let mut axis = Self { first, parts: Vec::new(), near: Vec::new() };
        for index in indices {
            let (from, to) = (index as f64 / factor, (index + 1) as f64 / factor);
            let mut parts: Vec<(Option<usize>, f64)> = Vec::new();
            if factor < 1.0 {
                let first = ((from + ROUNDING).floor() as i64).max(origin);
                let end = ((to - ROUNDING).ceil() as i64).min(origin + count as i64);
                for old in first..end {
                    let share = to.min(old as f64 + 1.0) - from.max(old as f64);
                    parts.push((local(old), share));
                }
                let outside = (from.max(low) - from) + (to - to.min(high));
                if open && outside > 0.0 {
                    parts.push((None, outside));
                }
                axis.near.push(parts.iter().filter_map(|(at, _)| *at).collect());
            } else {
                let centre = 0.5 * (from + to) - 0.5;
                let below = centre.floor();
                let share = centre - below;
                for (old, weight) in [(below as i64, 1.0 - share), (below as i64 + 1, share)] {
                    let at = if open { local(old) } else { Some(inside(old)) };
                    if weight > 0.0 {
                        parts.push((at, weight));
                    }
                }
                axis.near.push(vec![inside((0.5 * (from + to)).floor() as i64)]);
            }
            let sum: f64 = parts.iter().map(|(_, weight)| weight).sum();
            for (_, weight) in &mut parts {
                *weight /= sum;
            }
            axis.parts.push(parts);
        }
        axis
    }

    /// Resamples `old` along this axis. For each of its `count` voxels, `inner` numbers lie next to
    /// each other; `outside` has the values beyond the box, one per component.
    fn apply(&self, old: &[f64], count: usize, inner: usize, outside: &[f64]) -> Result<Vec<f64>> {
        let mut new = memory::filled(old.len() / count * self.parts.len(), 0.0, "new voxels")?;
        // Some thousand numbers at a time, which may be many short rows.
        let (new_row, old_row) = (inner * self.parts.len(), inner * count);
        let rows = (CHUNK / new_row).max(1);
        let parts = new.chunks_mut(rows * new_row).zip(old.chunks(rows * old_row));
        let rows = |(new, old): (&mut [f64], &[f64])| {
            let rows = new.chunks_mut(new_row).zip(old.chunks(old_row));
            rows.for_each(|(new, old)| self.apply_row(new, old, inner, outside));
        };
        parallel::for_each(parts, rows);
        Ok(new)
    }

    /// The same for a row.
    fn apply_row(&self, new: &mut [f64], old: &[f64], inner: usize, outside: &[f64]) {
        for (new, parts) in new.chunks_mut(inner).zip(&self.parts) {
            for &(at, weight) in parts {
                match at {
                    Some(at) => {
                        let old = &old[at * inner..(at + 1) * inner];
                        new.iter_mut().zip(old).for_each(|(new, old)| *new += weight * old);
                    }
                    None => {
                        let old = outside.iter().cycle();
                        new.iter_mut().zip(old).for_each(|(new, old)| *new += weight * old);
                    }
                }
            }
        }
    }

    fn apply_activity(&self, old: &[bool], count: usize, inner: usize) -> Result<Vec<bool>> {
        let mut new = memory::filled(old.len() / count * self.near.len(), false, "new voxels")?;
        let rows = new.chunks_mut(inner * self.near.len()).zip(old.chunks(inner * count));
        for (new, old) in rows {
            for (new, near) in new.chunks_mut(inner).zip(&self.near) {
                for &at in near {
                    let old = &old[at * inner..(at + 1) * inner];
                    new.iter_mut().zip(old).for_each(|(new, old)| *new |= old);
                }
            }
        }
        Ok(new)
    }
}

impl DenseGrid {
    /// The same grid with `factor` times as many voxels along each axis. Below 1 every new voxel is
    /// the mean of the old ones that it covers; above 1 values are interpolated. A voxel that
    /// extends beyond the box uses the part inside, or the background if that is known. A new voxel
    /// is active if one of the old voxels in its place is. Arithmetic is in `f64`; integers are
    /// rounded.
    ///
    /// # Errors
    /// If the factor is not above 0, and [`ErrorKind::Limit`] if more than `max_bytes` are needed.
    pub fn resampled(self, factor: f64, max_bytes: u64) -> Result<Self> {
        if !(factor > 0.0 && factor.is_finite() && factor.recip().is_finite()) {
            return Err(Error::value("resample", format!("{factor} is not above 0")));
        }
        if factor == 1.0 {
            return Ok(self);
        }
        let grown = self.dims.map(|n| (n as f64 * factor).ceil() + 1.0);
        let work = |[x, y, z]: [f64; 3]| x * y * z * self.components as f64 * 8.0;
        let needed = work(grown) + work(self.dims.map(|n| n as f64));
        if needed > max_bytes as f64 {
            let [x, y, z] = grown.map(|n| n - 1.0);
            return Err(ErrorKind::Limit {
                what: format!("resampling to {x} x {y} x {z} voxels"),
                needed: format!("{needed:.0} bytes"),
                limit: format!("{max_bytes} bytes"),
            }
            .into());
        }
        let open = self.background.is_some();
        let outside = self.background.clone().unwrap_or_else(|| vec![0.0; self.components]);
        let origin = self.origin.to_array().map(i64::from);
        let size = self.value_type.size();
        let mut values = memory::room(self.bytes.len() / size, "voxels")?;
        for part in self.bytes.chunks(size << 16) {
            values.extend(self.value_type.decode(part, Endian::Little));
        }
        let mut active = self.active;
        let (mut inner, mut dims, mut first) = (1, self.dims, [0; 3]);
        for axis in 0..3 {
            let count = self.dims[axis];
            let plan = Axis::new(origin[axis], count, factor, open);
            values = plan.apply(&values, count, inner * self.components, &outside)?;
            active = active.map(|active| plan.apply_activity(&active, count, inner)).transpose()?;
            (dims[axis], first[axis]) = (plan.parts.len(), plan.first);
            inner *= dims[axis];
        }
        let index = |n: i64| {
            i32::try_from(n)
                .map_err(|_| Error::value("resample", format!("index {n} does not fit in 32 bits")))
        };
        let origin = IVec3::new(index(first[0])?, index(first[1])?, index(first[2])?);
        let centre = DVec3::splat(0.5 / factor - 0.5);
        let old_from_new =
            DMat4::from_translation(centre) * DMat4::from_scale(DVec3::splat(1.0 / factor));
        let mut bytes = memory::room(values.len() * self.value_type.size(), "new voxels")?;
        self.value_type.encode(&values, &mut bytes);
        let world_from_index = self.world_from_index * old_from_new;
        Ok(Self { dims, bytes, active, world_from_index, origin, ..self })
    }
}
