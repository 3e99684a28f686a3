//! Pass `trace_coded`: encodes the slabs of every texel's ray, in order, in a fixed number of
//! bytes.

use rayon::prelude::*;

use super::trace_slices::trace_texel;
use crate::frame::Frame;
use crate::kernel::light::light_extent;
use crate::kernel::media::Sampler;
use crate::math::Each;
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::{Codec, TexelRay};

/// The bytes of all texels, row 0 at v = 0. The frame must ask for all nodes.
pub(super) fn trace_coded(
    media: &Media,
    frame: &Frame,
    codec: &dyn Codec,
    progress: &dyn Progress,
) -> Vec<u8> {
    let (size, stride) = (frame.map.size as usize, codec.stride());
    progress.begin("shadow map", size as u64);
    let sampler = Sampler::of_extinction(media);
    let mut bytes = vec![0; size * size * stride];
    let rows = bytes.par_chunks_exact_mut(size * stride).enumerate();
    rows.for_each_init(Vec::new, |nodes, (y, row)| {
        for (x, texel) in row.chunks_exact_mut(stride).enumerate() {
            let [u, v] = [x, y].each(|i| (i as f32 + 0.5) / size as f32);
            trace_texel(&sampler, frame, [u, v], &[], nodes);
            codec.encode(&TexelRay { nodes, extent: light_extent(frame, u, v).into() }, texel);
        }
        progress.advance(1);
    });
    bytes
}
