//! Writes fragment maps as OpenEXR: the lists as a deep image, or statistics of them as a flat one.

use glam::DMat4;

use super::deep_exr::{DeepHeader, Slab, encode_slabs};
use super::exr::encode_channels;
use crate::error::Result;
use crate::math::Aabb;
use crate::shadow::{FragmentMap, TexelMap};

/// Encodes a fragment map as deep OpenEXR (ZIPS, f32): one pixel per texel, row 0 (v = 0) on top,
/// one sample per fragment, with the channels Z and ZBack (depths in world lengths along the
/// texel's ray) and A (opacity). The attributes are those of a threshold map where they apply
/// ([`super::exr::encode_threshold_map`]), with `kind` = `fragments`, and `tolerance` (float): the
/// largest error of transmittance that fitting may have caused, 0 for none.
///
/// # Errors
/// If the encoder fails.
pub fn encode_fragment_map(
    map: &FragmentMap,
    index_from_world: &DMat4,
    domain: &Aabb,
    certificate: Option<&str>,
) -> Result<Vec<u8>> {
    let view = map.view();
    let mut header = DeepHeader::new([map.size(); 2], Vec::new())
        .with("software", concat!("deepshadow ", env!("CARGO_PKG_VERSION")))
        .with("kind", "fragments")
        .with("tolerance", map.tolerance())
        .with("depth_unit", "world")
        .with("depth_from", if view.position.is_some() { "light" } else { "near plane" })
        .with("light_from_world", &view.light_from_world)
        .with("index_from_world", index_from_world)
        .with("domain_min", domain.min)
        .with("domain_max", domain.max);
    if let Some(position) = view.position {
        header = header.with("light_position", position);
    }
    if let Some(certificate) = certificate {
        header = header.with("certificate", certificate);
    }
    let unit = view.unit as f32;
    encode_slabs(&header, |x, y| {
        map.fragments(x, y).map(move |fragment| Slab {
            front: fragment.front * unit,
            back: fragment.back * unit,
            optical_depth: fragment.optical_depth,
        })
    })
}

/// Encodes statistics of a fragment map's lists as flat OpenEXR, f32: `count` of fragments, `front`
/// of the first and `back` of the last one (world lengths along the texel's ray; 0 without
/// fragments), and A, the opacity of the whole list.
///
/// # Errors
/// If the encoder fails.
pub fn encode_fragment_statistics(map: &FragmentMap) -> Result<Vec<u8>> {
    let (size, unit) = (map.size(), map.view().unit as f32);
    let mut channels = ["count", "front", "back", "A"].map(|name| (name, Vec::new()));
    for (x, y) in (0..size).flat_map(|y| (0..size).map(move |x| (x, y))) {
        let nodes = map.nodes(x, y);
        let (first, last) =
            (nodes.first().copied().unwrap_or_default(), nodes.last().copied().unwrap_or_default());
        let opacity = -(-last.optical_depth).exp_m1();
        let numbers =
            [map.fragments(x, y).count() as f32, first.depth * unit, last.depth * unit, opacity];
        for ((_, channel), number) in channels.iter_mut().zip(numbers) {
            channel.push(number);
        }
    }
    encode_channels([size; 2], channels.into(), Vec::new())
}
