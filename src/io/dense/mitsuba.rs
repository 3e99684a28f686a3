//! Mitsuba's grid volumes (`.vol`, version 3): voxels that fill a bounding box, as in Mitsuba 3,
//! and interleaved channels.

use glam::DVec3;

use super::DenseHeader;
use super::input::Input;
use super::payload::Payload;
use crate::error::Result;
use crate::io::number::ValueType;
use crate::math::Aabb;
use crate::volume::{Axis, world_from_index_in_bounds};

const VOXELS: u64 = 48;

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let [_, _, _, version] = input.array::<4>(0)?;
    if version != 3 {
        return Err(input.bad(format!("Mitsuba volume version {version}; only 3 is supported")));
    }
    let integer = |at: usize| input.array(at).map(i32::from_le_bytes);
    let value_type = match integer(4)? {
        1 => ValueType::F32,
        2 => ValueType::F16,
        3 => ValueType::U8,
        other => return Err(input.bad(format!("number type {other} is not one of 1, 2, 3"))),
    };
    let dims = input.dims([integer(8)?, integer(12)?, integer(16)?].map(i64::from))?;
    let mut header = DenseHeader::new(dims, value_type);
    header.components = usize::try_from(integer(20)?).unwrap_or(0);
    if value_type == ValueType::U8 {
        // Bytes stand for 0..1.
        header.scale = [1.0 / 255.0, 0.0];
    }
    let mut corners = [0.0; 6];
    for (corner, at) in corners.iter_mut().zip((24..).step_by(4)) {
        *corner = f64::from(f32::from_le_bytes(input.array(at)?));
    }
    let [x0, y0, z0, x1, y1, z1] = corners;
    let mut bounds = Aabb { min: DVec3::new(x0, y0, z0), max: DVec3::new(x1, y1, z1) };
    if bounds.size().max_element() < f64::from(f32::MIN_POSITIVE) {
        // Some writers put integers here, which read as tiny numbers; then take Mitsuba's unit
        // cube.
        bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
    }
    header.world_from_index = world_from_index_in_bounds(dims, &bounds, Axis::Y)
        .map_err(|error| input.bad(error.to_string()))?;
    Ok((header, Payload::bare(input.path, VOXELS)))
}
