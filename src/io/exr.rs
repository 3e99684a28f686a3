//! Flat OpenEXR through the `exr` crate: pictures in linear radiance, shadow maps with what a reader
//! needs to look things up in them. (The crate has no deep data; deep files are not made here.)

use std::io::{Seek, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image as ExrImage, Layer,
    LayerAttributes, SmallVec, Text, WritableImage,
};

use crate::error::{Error, Result};
use crate::image::Image;
use crate::settings::Lookup;
use crate::shadow::{ShadowMap, ThresholdMap};

/// Writes a picture: channels R, G, B (linear radiance, premultiplied) and A, f32.
///
/// # Errors
/// If `out` cannot be written to.
pub fn write_image(image: &Image, out: impl Write + Seek) -> Result<()> {
    write_rgba([image.width, image.height], &image.pixels, Vec::new(), out)
}

/// Writes a threshold map: channels R, G, B (depths in world lengths along the texel's ray), A
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
///
/// # Errors
/// If `out` cannot be written to.
pub fn write_threshold_map(map: &ThresholdMap, out: impl Write + Seek) -> Result<()> {
    let text = |text: &str| AttributeValue::Text(Text::new_or_panic(text));
    let view = map.view();
    let thresholds = map.thresholds().map(|t| t as f32);
    let rows: Vec<f32> =
        (0..4).flat_map(|i| view.light_from_world.row(i).to_array()).map(|x| x as f32).collect();
    let mut matrix = [0.0; 16];
    matrix.copy_from_slice(&rows);
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
        ("depth_unit", text("world")),
        ("depth_from", text(if view.position.is_some() { "light" } else { "near plane" })),
        ("light_from_world", AttributeValue::Matrix4x4(matrix)),
    ];
    if let Some(position) = view.position {
        let position = position.as_vec3().to_array();
        attributes.push(("light_position", AttributeValue::FloatVec3(position.into())));
    }
    write_rgba([map.size(); 2], map.texels(), attributes, out)
}

fn write_rgba(
    [width, height]: [u32; 2],
    pixels: &[[f32; 4]],
    attributes: Vec<(&str, AttributeValue)>,
    out: impl Write + Seek,
) -> Result<()> {
    let channel = |name: &str, c: usize| {
        AnyChannel::new(name, FlatSamples::F32(pixels.iter().map(|p| p[c]).collect()))
    };
    let channels = SmallVec::from_vec(vec![
        channel("R", 0),
        channel("G", 1),
        channel("B", 2),
        channel("A", 3),
    ]);
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
    ExrImage::from_layer(layer)
        .write()
        .to_buffered(out)
        .map_err(|error| Error::value("exr", error.to_string()))
}
