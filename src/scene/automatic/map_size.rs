//! How many texels a shadow map gets if nobody says.

use crate::error::Result;
use crate::scene::Scene;
use crate::settings::{MapKind, Settings};

/// Texels along an edge per pixel of the picture. A map then takes about as long as the picture.
const PER_PIXEL: f64 = 0.5;
/// Fewest texels along an edge, unless more pixels or fewer voxels say otherwise.
const FEWEST: f64 = 128.0;
/// Texels per voxel that resolve most shadows, as long as there are pixels to show them...
const PER_VOXEL: f64 = 0.75;
/// ...which are at most this many per pixel.
const MOST_PER_PIXEL: f64 = 0.7;
/// Texels per voxel beyond which a map shows nothing more: density is linear between voxels, so
/// shadows are smooth within them.
const MOST_PER_VOXEL: f64 = 4.0;
/// Fewest and most texels along an edge where there are meshes or hair, whose shadows have sharp
/// edges; between them this many a pixel.
const OF_SURFACES: [f64; 2] = [256.0, 2048.0];
const PER_PIXEL_OF_SURFACES: f64 = 1.5;
/// Sizes are multiples of this: the edge of the tiles in which maps are made.
const MULTIPLE: f64 = 16.0;
/// Largest size that is chosen.
const LARGEST: f64 = 4096.0;

/// Texels along each edge of the shadow maps of `scene`, for a picture as `settings` have it. They
/// follow from the number of pixels, and from that of voxels across the lights.
///
/// # Errors
/// If a light cannot be fitted to the media.
pub(super) fn map_size(scene: &Scene, settings: &Settings) -> Result<u32> {
    if !matches!(settings.map.kind, None | Some(MapKind::Fragments)) {
        return Ok(settings.map.size);
    }
    let beams = scene.beams()?;
    let across = beams.iter().map(|beam| beam.view.voxels_across(&beam.media));
    let voxels = across.fold(1.0, f64::max);
    let [width, height] = settings.image.size.map(f64::from);
    let pixels = (width * height).sqrt();
    let least = (PER_VOXEL * voxels).min(MOST_PER_PIXEL * pixels).max(FEWEST);
    let size = (PER_PIXEL * pixels).max(least).min(MOST_PER_VOXEL * voxels);
    let [fewest, most] = OF_SURFACES;
    let sharp = (PER_PIXEL_OF_SURFACES * pixels).clamp(fewest, most);
    let surfaces = if scene.surfaces.is_empty() { 0.0 } else { sharp };
    let size = size.max(surfaces);
    Ok(((size / MULTIPLE).ceil() * MULTIPLE).min(LARGEST) as u32)
}
