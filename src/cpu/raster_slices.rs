//! Pass `raster_slices`: draws planes through the volume, from the last to the first, into linked
//! lists of fragments, which `sort_fragments` sorts. It is the twin of the GPU's lists, not of its
//! rasteriser: its tiles are pieces of rows of texels.

use std::ops::Range;

use super::sort_fragments::sort_fragments;
use super::tiles;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::media::Sampler;
use crate::kernel::slices::{Slabs, slab_bounds, slab_optical_depth, slabs_of};
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::{Fragment, FragmentLists, Runs};

/// The nodes of all texels, row 0 at v = 0.
pub(super) fn raster_slices(media: &Media, frame: &Frame, progress: &dyn Progress) -> Result<Runs> {
    let sampler = Sampler::of_extinction(media);
    let size = frame.map.size as usize;
    tiles::runs(size, progress, |columns, rows| {
        let row = |y| sort_fragments(&raster_row(&sampler, frame, columns.clone(), y), frame);
        rows.map(row).collect()
    })
}

fn raster_row(
    sampler: &Sampler<'_>,
    frame: &Frame,
    columns: Range<usize>,
    y: usize,
) -> FragmentLists {
    let at = |i: usize| (i as f32 + 0.5) / frame.map.size as f32;
    let texels: Vec<Slabs> = columns.map(|x| slabs_of(frame, at(x), at(y))).collect();
    let planes = texels.iter().map(|slabs| slabs.last).max().unwrap_or(0);
    let mut lists = FragmentLists::new(texels.len());
    for i in (0..planes).rev() {
        for (x, slabs) in texels.iter().enumerate() {
            let [front, back] = slab_bounds(slabs, i);
            if (slabs.first..slabs.last).contains(&i) && back > front {
                let optical_depth = slab_optical_depth(sampler, frame, slabs, i);
                lists.push(x, Fragment { front, back, optical_depth });
            }
        }
    }
    lists
}
