//! Pass `sort_fragments`: sorts linked lists by depth and turns them into contiguous runs of nodes.

use crate::error::Result;
use crate::frame::Frame;
use crate::shadow::{FragmentLists, Runs};

/// The nodes of all lists, fitted within the frame's tolerance, or raw and truncated.
pub(super) fn sort_fragments(lists: &FragmentLists, frame: &Frame) -> Result<Runs> {
    let (tolerance, truncation) = (frame.map.tolerance, frame.map.truncation);
    let mut runs = Runs::default();
    let mut nodes = Vec::new();
    for texel in 0..lists.texels() {
        lists.sorted_nodes(texel, [tolerance, truncation], &mut nodes);
        runs.push(&nodes)?;
    }
    Ok(runs)
}
