//! Linked lists of fragments per texel, unordered, as any caster leaves them. (Real-time deep
//! shadow maps for hair, "Creating list entries".)

use super::FragmentMap;
use crate::error::memory;
use crate::kernel::fitting::{Fitter, truncated};
use crate::kernel::fragments::{Node, OPAQUE_OPTICAL_DEPTH};

/// A fragment that a caster leaves on a texel's ray: a slab of medium between two depths, or a
/// surface at one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fragment {
    /// Depth where the ray enters it, along the texel's ray in units of the light's view
    /// ([`LightView::unit`](crate::scene::LightView::unit)).
    pub front: f32,
    /// Depth where the ray leaves it; equal to `front` for a surface.
    pub back: f32,
    /// Its optical depth along the ray, at least 0.
    pub optical_depth: f32,
}

impl Fragment {
    /// A surface at `depth` that takes the share `alpha` (0..1) of the light.
    pub fn surface(depth: f32, alpha: f32) -> Self {
        let optical_depth = (-(1.0 - alpha).max(0.0).ln()).clamp(0.0, OPAQUE_OPTICAL_DEPTH);
        Self { front: depth, back: depth, optical_depth }
    }

    /// The share of the light that it takes, 0..1.
    pub fn alpha(&self) -> f32 {
        -(-self.optical_depth).exp_m1()
    }
}

/// An element of the element buffer.
#[derive(Clone, Copy, Debug)]
struct Element {
    fragment: Fragment,
    next: u32,
}

/// The `next` of the last element of a list.
const NONE: u32 = u32::MAX;

/// A head buffer and an element buffer: one linked list of fragments per texel, the last pushed
/// first.
#[derive(Clone, Debug)]
pub struct FragmentLists {
    heads: Vec<u32>,
    elements: Vec<Element>,
}

impl FragmentLists {
    /// Empty lists for `texels` texels.
    pub fn new(texels: usize) -> Self {
        Self { heads: vec![NONE; texels], elements: Vec::new() }
    }

    /// Pushes a fragment on a texel's list. A fragment without opacity, or with a number that is
    /// not finite, is ignored.
    ///
    /// # Panics
    /// If there is no such texel.
    pub fn push(&mut self, texel: usize, fragment: Fragment) {
        let Fragment { front, back, optical_depth } = fragment;
        let some = front.is_finite() && back >= front && optical_depth > 0.0;
        if some && back.is_finite() && self.elements.len() < NONE as usize {
            let fragment =
                Fragment { optical_depth: optical_depth.min(OPAQUE_OPTICAL_DEPTH), ..fragment };
            let next = std::mem::replace(&mut self.heads[texel], self.elements.len() as u32);
            self.elements.push(Element { fragment, next });
        }
    }

    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.heads.len()
    }

    /// Number of fragments on all lists.
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// Whether all lists are empty.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// A texel's fragments, the last pushed first.
    ///
    /// # Panics
    /// If there is no such texel.
    pub fn list(&self, texel: usize) -> impl Iterator<Item = Fragment> {
        let element = |at: u32| self.elements.get(at as usize);
        std::iter::successors(element(self.heads[texel]), move |e| element(e.next))
            .map(|element| element.fragment)
    }

    /// Sorts a texel's list by depth and turns it into nodes, which replace the contents of
    /// `nodes`. They are fitted within `tolerance` if that is above 0; else they are truncated by
    /// `truncation` (0: not at all).
    ///
    /// # Panics
    /// If there is no such texel.
    pub fn sorted_nodes(
        &self,
        texel: usize,
        [tolerance, truncation]: [f32; 2],
        nodes: &mut Vec<Node>,
    ) {
        let mut fragments: Vec<Fragment> = self.list(texel).collect();
        // The sort is stable, so that fragments of equal depth keep their order.
        fragments.sort_by(|a, b| a.front.total_cmp(&b.front));
        nodes.clear();
        let mut fitter = Fitter::new(tolerance);
        for fragment in fragments {
            let extent = [fragment.front, fragment.back];
            fitter.add(extent, fragment.optical_depth, &mut |node| nodes.push(node));
        }
        fitter.finish(&mut |node| nodes.push(node));
        if tolerance == 0.0 {
            truncate(nodes, truncation);
        }
    }
}

/// Cuts a raw list where transmittance is within `truncation` of its final value; one line to the
/// last node replaces the rest.
pub fn truncate(nodes: &mut Vec<Node>, truncation: f32) {
    let kept = truncated(nodes, truncation);
    if let Some(&last) = nodes.last()
        && kept < nodes.len()
    {
        nodes.truncate(kept);
        nodes.push(last);
    }
}

/// The nodes of all texels in one buffer, texel after texel. A node is a [`Node`] of a polyline of
/// optical depth unless another type is given.
#[derive(Clone, Debug, Default)]
pub struct Runs<T = Node> {
    /// The index of each texel's first node, and the number of nodes at the end; empty if there are
    /// no texels.
    pub(super) starts: Vec<u32>,
    pub(super) nodes: Vec<T>,
}

impl<T: Copy> Runs<T> {
    /// Appends a texel.
    ///
    /// # Errors
    /// If the number of nodes would exceed 32 bits.
    pub fn push(&mut self, nodes: &[T]) -> crate::Result<()> {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        memory::grow(&mut self.nodes, nodes.len(), "a map's lists")?;
        self.nodes.extend_from_slice(nodes);
        self.starts.push(FragmentMap::counted(self.nodes.len())?);
        Ok(())
    }

    /// Appends all texels of `other`.
    ///
    /// # Errors
    /// If the number of nodes would exceed 32 bits.
    pub fn append(&mut self, other: &Self) -> crate::Result<()> {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        let before = self.nodes.len();
        FragmentMap::counted(before + other.nodes.len())?;
        memory::grow(&mut self.nodes, other.nodes.len(), "a map's lists")?;
        self.nodes.extend_from_slice(&other.nodes);
        self.starts.extend(other.starts.iter().skip(1).map(|start| before as u32 + start));
        Ok(())
    }

    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Bytes of the nodes and of the index of each texel's first one.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.nodes) + size_of_val(&*self.starts)) as u64
    }

    /// Nodes of all texels.
    pub fn nodes(&self) -> &[T] {
        &self.nodes
    }

    /// The index of each texel's first node, and the number of nodes at the end.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// The nodes of a texel, by rising depth; none if there is no such texel.
    #[inline]
    pub fn of(&self, texel: usize) -> &[T] {
        let bounds = self.starts.get(texel).zip(self.starts.get(texel + 1));
        bounds.and_then(|(&a, &b)| self.nodes.get(a as usize..b as usize)).unwrap_or_default()
    }
}
