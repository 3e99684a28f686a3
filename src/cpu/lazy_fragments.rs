//! A fragment map whose texels are traced when they are first looked up.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use web_time::Instant;

use super::raster_surfaces::SurfaceRaster;
use super::trace_slices::trace_texel;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::exponential::transmitted;
use crate::kernel::fragments::{Node, front_of, nodes_before, optical_depth_between};
use crate::kernel::media::Sampler;
use crate::scene::Casters;
use crate::shadow::{Shadow, TexelMap};

/// The fragment map of a frame, without links, of which only those texels are traced that lookups
/// need. It tells what few pixels look like without the cost of a whole map.
#[derive(Debug)]
pub struct LazyFragments<'a> {
    sampler: Sampler<'a>,
    surfaces: Option<SurfaceRaster>,
    frame: &'a Frame,
    traced: Mutex<Traced>,
}

#[derive(Debug, Default)]
struct Traced {
    texels: HashMap<[u32; 2], Arc<[Node]>>,
    seconds: f64,
}

impl<'a> LazyFragments<'a> {
    /// The map of `casters`, which may be media alone, for `frame`; nothing is traced yet.
    ///
    /// # Errors
    /// If surfaces take too much memory.
    pub fn new(casters: impl Into<Casters<'a>>, frame: &'a Frame) -> Result<Self> {
        let casters = casters.into();
        let surfaces = SurfaceRaster::new(casters, frame)?;
        let sampler = Sampler::of_extinction(casters.media);
        Ok(Self { sampler, surfaces, frame, traced: Mutex::default() })
    }

    /// The number of texels that were traced, and the seconds that it took, of all threads together.
    pub fn traced(&self) -> (usize, f64) {
        let traced = self.traced.lock().unwrap_or_else(PoisonError::into_inner);
        (traced.texels.len(), traced.seconds)
    }

    fn nodes(&self, texel: [u32; 2]) -> Arc<[Node]> {
        let lock = || self.traced.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(nodes) = lock().texels.get(&texel) {
            return nodes.clone();
        }
        let begun = Instant::now();
        let size = self.frame.map.size as f32;
        let mut nodes = Vec::new();
        let [columns, rows] = texel.map(|i| i as usize..i as usize + 1);
        let lists = self.surfaces.as_ref().map(|all| all.tile(columns, rows));
        let pieces = lists.as_ref().map_or(&[][..], |lists| lists.of(0));
        let place = texel.map(|i| (i as f32 + 0.5) / size);
        trace_texel(&self.sampler, self.frame, place, pieces, &mut nodes);
        let nodes: Arc<[Node]> = nodes.into();
        let mut traced = lock();
        traced.seconds += begun.elapsed().as_secs_f64();
        traced.texels.entry(texel).or_insert(nodes).clone()
    }
}

impl Shadow for LazyFragments<'_> {
    fn bytes(&self) -> u64 {
        let traced = self.traced.lock().unwrap_or_else(PoisonError::into_inner);
        traced.texels.values().map(|nodes| size_of_val(&**nodes) as u64).sum()
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }
}

impl TexelMap for LazyFragments<'_> {
    fn size(&self) -> u32 {
        self.frame.map.size
    }

    fn front(&self, x: u32, y: u32) -> Option<f32> {
        front_of(&self.nodes([x, y]))
    }

    fn reach(&self) -> f32 {
        self.frame.map.surface_reach
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let nodes = self.nodes([x, y]);
        transmitted(optical_depth_between(&nodes, nodes_before(&nodes, depth), depth))
    }
}
