//! A tree of boxes over things, to find those that a ray may meet. In f64, and used by the
//! reference alone.

use glam::DVec3;

use crate::math::Aabb;

/// Things in a leaf.
const LEAF: usize = 4;

/// A binary tree of boxes. Its leaves hold ranges of an order of the things.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The things by leaf.
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// The first child, whose sibling follows it; or the first thing of a leaf.
    first: u32,
    /// Number of things in a leaf; 0 for an inner node.
    count: u32,
}

impl Tree {
    /// A tree over things with these boxes.
    pub(super) fn over(boxes: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::new();
        if !boxes.is_empty() {
            nodes.push(Node { bounds: boxes[0], first: 0, count: 0 });
            // Each entry is a node and its range of the order.
            let mut open = vec![(0, 0..boxes.len())];
            while let Some((node, range)) = open.pop() {
                let own = &mut order[range.clone()];
                let bounds = union(own.iter().map(|&i| boxes[i as usize]));
                if own.len() <= LEAF {
                    let count = own.len() as u32;
                    nodes[node] = Node { bounds, first: range.start as u32, count };
                    continue;
                }
                // Halves by the centres along the axis where they spread most.
                let center = |i: u32| boxes[i as usize].center();
                let centers = own.iter().map(|&i| Aabb { min: center(i), max: center(i) });
                let spread = union(centers).size();
                let axis = if spread.x >= spread.y.max(spread.z) {
                    0
                } else if spread.y >= spread.z {
                    1
                } else {
                    2
                };
                let half = own.len() / 2;
                own.select_nth_unstable_by(half, |&a, &b| {
                    center(a)[axis].total_cmp(&center(b)[axis])
                });
                let first = nodes.len();
                nodes[node] = Node { bounds, first: first as u32, count: 0 };
                nodes.extend([Node { bounds, first: 0, count: 0 }; 2]);
                let middle = range.start + half;
                open.push((first, range.start..middle));
                open.push((first + 1, middle..range.end));
            }
        }
        Self { nodes, order }
    }

    /// Calls `visit` for every thing whose box the ray `origin + t direction` meets with `from <= t
    /// <= to`, until it returns false.
    pub(super) fn along(
        &self,
        origin: DVec3,
        direction: DVec3,
        [from, to]: [f64; 2],
        mut visit: impl FnMut(u32) -> bool,
    ) {
        let inverse = direction.recip();
        let meets = |bounds: &Aabb| {
            let (mut enter, mut exit) = (from, to);
            for axis in 0..3 {
                if direction[axis] == 0.0 {
                    if origin[axis] < bounds.min[axis] || origin[axis] > bounds.max[axis] {
                        return false;
                    }
                    continue;
                }
                let a = (bounds.min[axis] - origin[axis]) * inverse[axis];
                let b = (bounds.max[axis] - origin[axis]) * inverse[axis];
                enter = enter.max(a.min(b));
                exit = exit.min(a.max(b));
            }
            // Rounding must not lose a thing that only touches the ray.
            let slack = 1e-12 * (enter.abs() + exit.abs());
            enter <= exit + slack
        };
        let mut open: Vec<u32> = Vec::with_capacity(64);
        open.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            if !meets(&node.bounds) {
                continue;
            }
            if node.count == 0 {
                open.extend([node.first, node.first + 1]);
                continue;
            }
            let things = node.first as usize..(node.first + node.count) as usize;
            for &thing in &self.order[things] {
                if !visit(thing) {
                    return;
                }
            }
        }
    }
}

fn union(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    let empty = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
    boxes.fold(empty, |a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) })
}
