//! The camera's view as a deep image, for compositing programs.

use std::str::FromStr;

use crate::cpu::DeepView;
use crate::error::{Error, Result};
use crate::io::deep_exr::{self, Attribute, Channel, DeepHeader};
use crate::io::exr::standard_matrices;
use crate::scene::Camera;

/// What depths in a deep image are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum DeepZ {
    /// Distances from the camera along its axis, as compositing programs expect.
    #[default]
    Planar,
    /// Distances from the camera along each pixel's ray.
    Ray,
}

impl FromStr for DeepZ {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "planar" => Ok(Self::Planar),
            "ray" => Ok(Self::Ray),
            _ => Err(Error::value("deep-z", format!("'{text}' is not one of planar, ray"))),
        }
    }
}

/// Encodes the view of `camera`, marched on the processor: R, G, B (radiance, premultiplied), A, Z
/// and ZBack (world lengths from the camera), f32. The attribute `deep_z` says what depths are.
pub(super) fn encode(
    view: &DeepView<'_>,
    camera: &Camera,
    [width, height]: [u32; 2],
    deep_z: DeepZ,
    certificate: Option<&str>,
) -> Result<Vec<u8>> {
    let channels = ["A", "B", "G", "R", "Z", "ZBack"].map(Channel::float).into();
    let (name, from) = match deep_z {
        DeepZ::Planar => ("planar", "camera, along its axis"),
        DeepZ::Ray => ("ray", "camera, along the ray"),
    };
    let [camera_matrix, picture_matrix] = standard_matrices(camera, [width, height]);
    let mut header = DeepHeader::new([width, height], channels)
        .with("software", concat!("deepshadow ", env!("CARGO_PKG_VERSION")))
        .with("kind", "camera")
        .with("depth_unit", "world")
        .with("depth_from", from)
        .with("deep_z", name)
        .with("worldToCamera", Attribute::Matrix4x4(camera_matrix))
        .with("worldToNDC", Attribute::Matrix4x4(picture_matrix));
    if let Some(certificate) = certificate {
        header = header.with("certificate", certificate);
    }
    let rays = camera.rays(f64::from(width) / f64::from(height));
    let [forward, ..] = camera.axes();
    let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    deep_exr::encode(&header, |y, row| {
        for (x, samples) in (0..width).zip(view.row(y)) {
            let (_, direction) = rays.ray(at(x, width), at(y, height));
            let per_length = match deep_z {
                DeepZ::Planar => direction.dot(forward),
                DeepZ::Ray => 1.0,
            };
            for sample in samples {
                let [r, g, b] = sample.radiance.to_array();
                let [front, back] =
                    [sample.front, sample.back].map(|d| (f64::from(d) * per_length) as f32);
                row.push(&[sample.alpha, b, g, r, front, back]);
            }
            row.end_pixel();
        }
        Ok(())
    })
}
