//! Writes `.hair` files.

use glam::Vec3;

use super::hair::{HEADER, MAGIC, flags};
use super::turn;
use crate::error::{Error, Result};
use crate::surface::{Strands, Varying};
use crate::volume::Axis;

/// The bytes of a `.hair` file of `strands`, whose axis `up` points up, as z does in such files.
/// Opacities are stored as transparencies, which may change their last digit.
///
/// # Errors
/// If a strand has more than 65,536 points, which the format has no number for.
pub fn encode_hair(strands: &Strands, up: Axis) -> Result<Vec<u8>> {
    let counts = (0..strands.count()).map(|index| strands.strand(index).len());
    let mut segments = Vec::with_capacity(2 * strands.count());
    for count in counts {
        let Ok(count) = u16::try_from(count - 1) else {
            let why = format!("a strand of {count} points; .hair files have at most 65536");
            return Err(Error::value("hair", why));
        };
        segments.extend(count.to_le_bytes());
    }
    let (thickness, opacity, albedo) = (strands.thickness(), strands.opacity(), strands.albedo());
    let held = flags(
        matches!(thickness, Varying::PerPoint(_)),
        matches!(opacity, Varying::PerPoint(_)),
        matches!(albedo, Varying::PerPoint(_)),
    );
    let mut bytes = MAGIC.to_vec();
    for number in [strands.count() as u32, strands.points().len() as u32, held, 0] {
        bytes.extend(number.to_le_bytes());
    }
    let first = [thickness.at(0), 1.0 - opacity.at(0)];
    for number in first.into_iter().chain(albedo.at(0).to_array()) {
        bytes.extend(number.to_le_bytes());
    }
    bytes.resize(HEADER, 0);
    bytes.extend(segments);
    let mut floats = |values: &mut dyn Iterator<Item = f32>| {
        values.for_each(|value| bytes.extend(value.to_le_bytes()));
    };
    let mut points = strands.points().to_vec();
    turn(&mut points, up, Axis::Z);
    floats(&mut points.iter().flat_map(Vec3::to_array));
    if let Varying::PerPoint(values) = thickness {
        floats(&mut values.iter().copied());
    }
    if let Varying::PerPoint(values) = opacity {
        floats(&mut values.iter().map(|value| 1.0 - value));
    }
    if let Varying::PerPoint(values) = albedo {
        floats(&mut values.iter().flat_map(Vec3::to_array));
    }
    Ok(bytes)
}
