//! Pass `trace_coded`: encodes the slabs of every texel's ray, in order, in a fixed number of
//! bytes.

use rayon::prelude::*;

use super::raster_surfaces::SurfaceRaster;
use super::tiles::{TILE, columns, finished};
use super::trace_slices::trace_texel;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::light::light_extent;
use crate::kernel::media::Sampler;
use crate::math::Each;
use crate::progress::Progress;
use crate::scene::Casters;
use crate::shadow::{Codec, TexelRay};

/// The bytes of all texels, row 0 at v = 0. The frame must ask for all nodes.
pub(super) fn trace_coded(
    casters: Casters<'_>,
    frame: &Frame,
    codec: &dyn Codec,
    progress: &dyn Progress,
) -> Result<Vec<u8>> {
    let (size, stride) = (frame.map.size as usize, codec.stride());
    progress.begin("shadow map", size as u64);
    let sampler = Sampler::of_extinction(casters.media);
    let surfaces = SurfaceRaster::new(casters, frame)?;
    let around = frame.around(casters);
    let mut bytes = vec![0; size * size * stride];
    let bands = bytes.par_chunks_mut(size * stride * TILE).enumerate();
    bands.for_each_init(Vec::new, |nodes, (band, bytes)| {
        let rows = band * TILE..band * TILE + bytes.len() / (size * stride);
        for columns in columns(size) {
            if progress.cancelled() {
                return;
            }
            let lists = surfaces.as_ref().map(|all| all.tile(columns.clone(), rows.clone()));
            for (row, y) in rows.clone().enumerate() {
                for (column, x) in columns.clone().enumerate() {
                    let pieces = lists
                        .as_ref()
                        .map_or(&[][..], |lists| lists.of(row * columns.len() + column));
                    let [u, v] = [x, y].each(|i| (i as f32 + 0.5) / size as f32);
                    trace_texel(&sampler, frame, [u, v], pieces, nodes);
                    let ray = TexelRay { nodes, extent: light_extent(&around, u, v).into() };
                    codec.encode(&ray, &mut bytes[(row * size + x) * stride..][..stride]);
                }
            }
        }
        progress.advance(rows.len() as u64);
    });
    finished(progress).map(|()| bytes)
}
