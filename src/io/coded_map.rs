//! Writes coded maps as OpenEXR: the bytes of each texel.

use exr::prelude::AttributeValue;
use glam::DMat4;

use super::exr::{certified, encode_channels, placement, text};
use crate::error::Result;
use crate::math::Aabb;
use crate::shadow::{CodedMap, TexelMap};

/// Encodes a coded map as OpenEXR: one pixel per texel, row 0 (v = 0) on top. Byte `i` of a texel
/// is the channel `byteI` (three digits), f32, 0 to 255. The attributes are those of a threshold
/// map where they apply ([`super::exr::encode_threshold_map`]), with `kind` = the name of the code.
///
/// # Errors
/// If the encoder fails.
pub fn encode_coded_map(
    map: &CodedMap,
    index_from_world: &DMat4,
    domain: &Aabb,
    certificate: Option<&str>,
) -> Result<Vec<u8>> {
    let mut attributes: Vec<(&str, AttributeValue)> = vec![("kind", text(&map.kind().to_string()))];
    attributes.extend(placement(map.view(), index_from_world, domain));
    attributes.extend(certified(certificate));
    let names: Vec<String> = (0..map.stride()).map(|i| format!("byte{i:03}")).collect();
    let channels = names.iter().enumerate().map(|(i, name)| {
        let bytes = map.texels().iter().skip(i).step_by(map.stride());
        (name.as_str(), bytes.map(|&byte| f32::from(byte)).collect())
    });
    encode_channels([map.size(); 2], channels.collect(), attributes)
}
