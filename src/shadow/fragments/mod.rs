//! The fragment map as data: each texel's fragments, as the nodes of a polyline of optical depth.
//!
//! ```text
//! casters --(texel, front, back, optical depth)--> FragmentLists --sort, fit, compact--> Runs
//!                                                                                         |
//! slabs in order --------------------------fit while marching---------------------------> Runs
//!                                                                                         |
//!                             links between neighbouring texels  + ---------------> FragmentMap
//! ```

mod links;
mod lists;
mod overlaps;

pub use links::{Links, MOST_WALKED, NO_LINK, nearest_nodes};
pub use lists::{Fragment, FragmentLists, Runs, truncate};
pub use overlaps::{Merged, disjoint};

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::{Shadow, TexelMap, aligned, alignment, four_texels, four_weights, inside, powers};
use crate::error::{ErrorKind, Result};
use crate::frame::Frame;
use crate::kernel::exponential::four_transmitted;
use crate::kernel::fragments::{
    Node, exponential_transmittance, four_optical_depths, front_of, nodes_before,
    optical_depth_between,
};
use crate::math::Each;
use crate::scene::LightView;
use links::{Place, search, step};

/// Lists of fragments, turned into transmittance over depth.
#[derive(Clone, Debug)]
pub struct FragmentMap {
    size: u32,
    runs: Runs,
    links: Option<Links>,
    view: LightView,
    /// Steepness of exponential shadow tests, 1 / world length; 0 for exact ones.
    sharpness: f32,
    tolerance: f32,
    /// See [`TexelMap::reach`].
    reach: f32,
}

impl FragmentMap {
    /// A map of `frame.map.size` squared texels, row 0 at v = 0, with the nodes `runs`, built from
    /// `view` for `frame`.
    ///
    /// # Panics
    /// If `runs` has another number of texels.
    pub fn new(runs: Runs, view: LightView, frame: &Frame) -> Self {
        let size = frame.map.size;
        assert_eq!(runs.texels(), size as usize * size as usize, "texels of a {size}^2 map");
        let (sharpness, tolerance) = (frame.map.sharpness, frame.map.tolerance);
        let reach = frame.map.surface_reach;
        Self { size, runs, links: None, view, sharpness, tolerance, reach }
    }

    /// The same map with links between neighbours, which wide filters then follow.
    #[must_use]
    pub fn with_links(self, links: Links) -> Self {
        Self { links: Some(links), ..self }
    }

    /// The nodes of all texels.
    pub fn runs(&self) -> &Runs {
        &self.runs
    }

    /// Links between neighbours, if the map has any.
    pub fn links(&self) -> Option<&Links> {
        self.links.as_ref()
    }

    /// Largest error of transmittance that fitting may have caused; 0 if every fragment is kept.
    pub fn tolerance(&self) -> f32 {
        self.tolerance
    }

    /// The light's view that the map was built from.
    pub fn view(&self) -> &LightView {
        &self.view
    }

    /// The fragments of a texel by rising depth, without stretches of zero opacity.
    pub fn fragments(&self, x: u32, y: u32) -> impl Iterator<Item = Fragment> {
        self.nodes(x, y)
            .windows(2)
            .filter(|pair| pair[1].optical_depth > pair[0].optical_depth)
            .map(|pair| Fragment {
                front: pair[0].depth,
                back: pair[1].depth,
                optical_depth: pair[1].optical_depth - pair[0].optical_depth,
            })
    }

    /// The nodes of a texel, by rising depth.
    pub fn nodes(&self, x: u32, y: u32) -> &[Node] {
        self.runs.of(self.texel(x, y))
    }

    /// A number of nodes in 32 bits.
    ///
    /// # Errors
    /// If it does not fit.
    pub(super) fn counted(nodes: usize) -> Result<u32> {
        u32::try_from(nodes).map_err(|_| {
            let needed = format!("{nodes} nodes");
            let limit = "2^32 - 1: use fewer texels or steps, or a tolerance".to_owned();
            ErrorKind::Limit { what: "fragment map".to_owned(), needed, limit }.into()
        })
    }

    fn texel(&self, x: u32, y: u32) -> usize {
        y as usize * self.size as usize + x as usize
    }

    fn transmittance(&self, place: Place, depth: f32) -> f32 {
        let nodes = self.runs.of(place.texel);
        if self.sharpness > 0.0 {
            return exponential_transmittance(nodes, place.before, depth, self.sharpness);
        }
        (-optical_depth_between(nodes, place.before, depth)).exp()
    }

    /// Bilinear interpolation of the texels' transmittances raised to the powers `ratios`.
    fn bilinear_colours(&self, place: Vec3, ratios: Vec3) -> Vec3 {
        let [u, v, depth] = place.to_array();
        if !inside(u, v) {
            return Vec3::ONE;
        }
        let ([xs, ys], [fx, fy]) = four_texels(self.size, u, v);
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].each(|[x, y]| self.texel(xs[x], ys[y]));
        let (depths, weights) = if self.reach > 0.0 {
            let (shifts, weights) = alignment(self, [xs, ys], [fx, fy]);
            let one = |(texel, shift): (usize, f32)| {
                let nodes = self.runs.of(texel);
                let depth = depth + shift;
                optical_depth_between(nodes, nodes_before(nodes, depth), depth)
            };
            (Vec4::from_array([0, 1, 2, 3].each(|i| one((corners[i], shifts[i])))), weights)
        } else {
            let lists = corners.each(|texel| self.runs.of(texel));
            (four_optical_depths(lists, depth), four_weights([fx, fy]))
        };
        // The four texels' transmittances in one channel.
        let channel = |ratio: f32| four_transmitted(depths * ratio).dot(Vec4::from_array(weights));
        Vec3::from_array(ratios.to_array().each(channel))
    }

    /// Mean over a window of texels, which follows the links from the lower left texel.
    fn linked_mean(&self, links: &Links, window: [[u32; 2]; 2], depth: f32) -> f32 {
        let [[x0, x1], [y0, y1]] = window;
        let mut row = search(&self.runs, self.texel(x0, y1), depth);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in (y0..=y1).rev() {
            if y < y1 {
                row = step(&self.runs, links, row, self.texel(x0, y), 1, depth);
            }
            let mut place = row;
            for x in x0..=x1 {
                if x > x0 {
                    place = step(&self.runs, links, place, self.texel(x, y), 0, depth);
                }
                sum += self.transmittance(place, depth);
                count += 1.0;
            }
        }
        sum / count
    }
}

impl Shadow for FragmentMap {
    /// Bytes of the nodes and of the index of each texel's first one, without links.
    fn bytes(&self) -> u64 {
        self.runs.bytes()
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }

    fn lookup_colours(&self, width: u32, place: Vec3, ratios: Vec3) -> Vec3 {
        match width {
            0 => self.bilinear_colours(place, ratios),
            _ => powers(self.filtered(width, place.x, place.y, place.z), ratios),
        }
    }
}

impl TexelMap for FragmentMap {
    fn size(&self) -> u32 {
        self.size
    }

    fn bilinear(&self, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        let ([xs, ys], [fx, fy]) = four_texels(self.size, u, v);
        if self.reach > 0.0 {
            return aligned(self, [xs, ys], [fx, fy], depth);
        }
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].each(|[x, y]| self.texel(xs[x], ys[y]));
        let four = if self.sharpness > 0.0 {
            let place = |texel| Place { texel, before: nodes_before(self.runs.of(texel), depth) };
            Vec4::from_array(corners.each(|texel| self.transmittance(place(texel), depth)))
        } else {
            four_transmitted(four_optical_depths(corners.each(|texel| self.runs.of(texel)), depth))
        };
        let (left, right) = (four.xz(), four.yw());
        let rows = left + (right - left) * fx;
        rows.x + (rows.y - rows.x) * fy
    }

    fn front(&self, x: u32, y: u32) -> Option<f32> {
        front_of(self.nodes(x, y))
    }

    fn reach(&self) -> f32 {
        self.reach
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let texel = self.texel(x, y);
        let before = nodes_before(self.runs.of(texel), depth);
        self.transmittance(Place { texel, before }, depth)
    }

    fn mean(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        let window = [u, v].each(|c| super::window(c, width, self.size));
        match &self.links {
            Some(links) => self.linked_mean(links, window, depth),
            None => super::brute_force_mean(self, window, depth),
        }
    }
}
