//! Writes flat OpenEXR through the `exr` crate: pictures in linear radiance, and shadow maps with
//! everything that a reader needs for lookups. (The crate does not support deep data; `deep_exr`
//! does.)

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image as ExrImage,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, Text, Vec2, WritableImage, f16,
};

use glam::{DMat4, DVec3};

use super::exr_order::sort_attributes;
use crate::error::memory;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::math::Aabb;
use crate::scene::{Camera, LightView};
use crate::settings::Lookup;
use crate::shadow::{TexelMap, ThresholdMap};

/// What is known of a picture besides its pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct PictureFacts<'a> {
    /// A text on the measured errors of its shadows, which becomes the attribute `certificate`
    /// (string).
    pub certificate: Option<&'a str>,
    /// What it was seen by, which becomes the format's standard attributes `worldToCamera` and
    /// `worldToNDC` (m44f). As the format wants, they are for row vectors; camera space is
    /// left-handed with z forward; NDC is 0..1 from the upper left to the lower right corner.
    pub camera: Option<&'a Camera>,
}

/// Encodes a picture as OpenEXR: channels R, G, B (linear radiance, premultiplied) and A, as f32,
/// or as f16 if `half`, which cuts radiance at 65504.
///
/// # Errors
/// If the encoder fails.
pub fn encode_image(image: &Image, facts: &PictureFacts<'_>, half: bool) -> Result<Vec<u8>> {
    let size = [image.width, image.height];
    let mut layer = rgba_layer(size, &image.pixels, certified(facts.certificate).collect());
    if let Some(camera) = facts.camera {
        let [camera, picture] = standard_matrices(camera, size);
        layer.attributes.world_to_camera = Some(camera);
        layer.attributes.world_to_normalized_device = Some(picture);
    }
    if half {
        for channel in &mut layer.channel_data.list {
            let values = channel.sample_data.values_as_f32();
            let largest = f16::MAX.to_f32();
            let values = values.map(|v| f16::from_f32(v.clamp(-largest, largest))).collect();
            channel.sample_data = FlatSamples::F16(values);
        }
    }
    encode_layers(vec![layer])
}

/// The values of `worldToCamera` and `worldToNDC` of a picture of this size.
pub(crate) fn standard_matrices(camera: &Camera, [width, height]: [u32; 2]) -> [[f32; 16]; 2] {
    let aspect = f64::from(width) / f64::from(height);
    // Columns for column vectors are rows for row vectors.
    [camera.camera_from_world(), camera.picture_from_world(aspect)]
        .map(|matrix| matrix.to_cols_array().map(|x| x as f32))
}

/// The attribute of a certificate, if there is one.
pub(super) fn certified(
    certificate: Option<&str>,
) -> impl Iterator<Item = (&'static str, AttributeValue)> {
    // A certificate that the format's strings cannot hold is left out.
    let value = certificate.and_then(Text::new_or_none);
    value.into_iter().map(|value| ("certificate", AttributeValue::Text(value)))
}

/// A threshold map as OpenEXR: channels R, G, B (depths in world lengths along the texel's ray), A
/// (largest opacity), f32, with these attributes:
///
/// | attribute | type | meaning |
/// |---|---|---|
/// | `kind` | string | `threshold` |
/// | `thresholds` | v3f | the opacities whose depths R, G, B hold |
/// | `unset` | string | what a channel holds whose threshold is above A |
/// | `depth_unit` | string | `world` |
/// | `depth_from` | string | `near plane` (directional) or `light` (point, spot) |
/// | `light_from_world` | m44f | row-major, for column vectors: world to (u, v, depth, 1) times w |
/// | `light_position` | v3f | of point and spot lights; depth is the distance to it |
/// | `lookup` | string | the lookup that it is made for: `default` or `paper` |
/// | `index_from_world` | m44f | row-major, for column vectors: world to voxel index |
/// | `certificate` | string | what was measured of the map's error, if anything was |
/// | `domain_min`, `domain_max` | v3f | box of voxel indices with medium; default lookups use it |
///
/// # Errors
/// If the encoder fails.
pub fn encode_threshold_map(
    map: &ThresholdMap,
    index_from_world: &DMat4,
    domain: &Aabb,
    certificate: Option<&str>,
) -> Result<Vec<u8>> {
    encode_layers(vec![threshold_layer(map, index_from_world, domain, certificate)])
}

/// Encodes threshold maps that belong together (a light's channels, several lights) as one OpenEXR
/// file, with one named layer per map and the attributes of [`encode_threshold_map`].
///
/// # Errors
/// If the encoder fails.
pub fn encode_threshold_maps(
    maps: &[(String, &ThresholdMap, Option<&str>)],
    index_from_world: &DMat4,
    domain: &Aabb,
) -> Result<Vec<u8>> {
    let layer = |(name, map, certificate): &(String, &ThresholdMap, Option<&str>)| {
        let mut layer = threshold_layer(map, index_from_world, domain, *certificate);
        layer.attributes.layer_name = Text::new_or_none(name);
        layer
    };
    encode_layers(maps.iter().map(layer).collect())
}

fn threshold_layer(
    map: &ThresholdMap,
    index_from_world: &DMat4,
    domain: &Aabb,
    certificate: Option<&str>,
) -> Channels {
    let thresholds = map.thresholds().map(|t| t as f32);
    let unset = match map.lookup() {
        Lookup::Paper => "exit: the depth where the ray leaves the volume".to_owned(),
        Lookup::Default => {
            "share of A: the depth where opacity reaches a share of A (levels of A and thresholds, \
             see the function `levels` in threshold.wgsl)"
                .to_owned()
        }
    };
    let mut attributes = vec![
        ("kind", text("threshold")),
        ("thresholds", AttributeValue::FloatVec3(thresholds.into())),
        ("unset", text(&unset)),
        ("lookup", text(map.lookup().name())),
    ];
    attributes.extend(placement(map.view(), index_from_world, domain));
    attributes.extend(certified(certificate));
    let unit = map.view().unit as f32;
    let world = |[r, g, b, a]: &[f32; 4]| [r * unit, g * unit, b * unit, *a];
    let texels: Vec<[f32; 4]> = map.texels().iter().map(world).collect();
    rgba_layer([map.size(); 2], &texels, attributes)
}

/// Attributes for a map's light view and its placement in the world.
pub(super) fn placement(
    view: &LightView,
    index_from_world: &DMat4,
    domain: &Aabb,
) -> Vec<(&'static str, AttributeValue)> {
    let mut attributes = vec![
        ("depth_unit", text("world")),
        ("depth_from", text(if view.position.is_some() { "light" } else { "near plane" })),
        ("light_from_world", rows(&view.light_from_world)),
        ("index_from_world", rows(index_from_world)),
        ("domain_min", vector(domain.min)),
        ("domain_max", vector(domain.max)),
    ];
    if let Some(position) = view.position {
        attributes.push(("light_position", vector(position)));
    }
    attributes
}

pub(super) fn text(text: &str) -> AttributeValue {
    AttributeValue::Text(Text::new_or_panic(text))
}

fn rows(matrix: &DMat4) -> AttributeValue {
    AttributeValue::Matrix4x4(matrix.transpose().to_cols_array().map(|x| x as f32))
}

fn vector(v: DVec3) -> AttributeValue {
    AttributeValue::FloatVec3(v.as_vec3().to_array().into())
}

/// A layer of named f32 channels.
type Channels = Layer<AnyChannels<FlatSamples>>;

fn rgba_layer(
    size: [u32; 2],
    pixels: &[[f32; 4]],
    attributes: Vec<(&str, AttributeValue)>,
) -> Channels {
    let channel = |c: usize| pixels.iter().map(|p| p[c]).collect();
    let names = ["R", "G", "B", "A"].into_iter().enumerate();
    channel_layer(size, names.map(|(c, name)| (name, channel(c))).collect(), attributes)
}

/// Encodes named f32 channels with one number per pixel each, row 0 on top.
pub(super) fn encode_channels(
    size: [u32; 2],
    channels: Vec<(&str, Vec<f32>)>,
    attributes: Vec<(&str, AttributeValue)>,
) -> Result<Vec<u8>> {
    encode_layers(vec![channel_layer(size, channels, attributes)])
}

fn channel_layer(
    [width, height]: [u32; 2],
    channels: Vec<(&str, Vec<f32>)>,
    attributes: Vec<(&str, AttributeValue)>,
) -> Channels {
    let channels = channels.into_iter();
    let channels = channels.map(|(name, v)| AnyChannel::new(name, FlatSamples::F32(v))).collect();
    let mut layer = Layer::new(
        (width as usize, height as usize),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    layer.attributes.software_name =
        Some(Text::new_or_panic(concat!("deepshadow ", env!("CARGO_PKG_VERSION"))));
    let named = attributes.into_iter().map(|(name, value)| (Text::new_or_panic(name), value));
    layer.attributes.other.extend(named);
    layer
}

/// Encodes layers of equal size as one file.
fn encode_layers(layers: Vec<Channels>) -> Result<Vec<u8>> {
    let size = layers.first().map_or(Vec2(0, 0), |layer| layer.size);
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let pixels = (size.0 as u64).saturating_mul(size.1 as u64);
    let channels: usize = layers.iter().map(|layer| layer.channel_data.list.len()).sum();
    // Room for incompressible pixels, and some for headers.
    memory::check(pixels.saturating_mul(4 * channels as u64 + 1), "an OpenEXR file")?;
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layers(attributes, layers)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| Error::value("exr", error.to_string()))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}
