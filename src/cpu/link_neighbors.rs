//! Pass `link_neighbors`: links each node to the depth-nearest nodes of the texels to the right and
//! above.

use crate::parallel;
use crate::shadow::{Links, NO_LINK, Runs, nearest_nodes};

/// The links of all nodes of a map of `size` squared texels.
pub(super) fn link_neighbors(runs: &Runs, size: u32) -> Links {
    let size = size as usize;
    let rows = parallel::map(0..size, |y| {
        let mut row = Vec::new();
        for x in 0..size {
            let texel = y * size + x;
            let nodes = runs.of(texel);
            let first = row.len();
            row.resize(first + nodes.len(), [NO_LINK; 2]);
            if x + 1 < size {
                nearest_nodes(nodes, runs.of(texel + 1), |i, link| row[first + i][0] = link);
            }
            if y > 0 {
                nearest_nodes(nodes, runs.of(texel - size), |i, link| row[first + i][1] = link);
            }
        }
        row
    });
    Links::new(runs, rows.concat())
}
