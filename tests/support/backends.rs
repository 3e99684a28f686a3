//! The backends that tests run on.

use deepshadow::backend::{Backend, Passes};
use deepshadow::cpu::CpuBackend;
use deepshadow::error::Result;
use deepshadow::frame::Frame;
use deepshadow::image::Image;
use deepshadow::progress::Progress;
use deepshadow::scene::{Casters, Media};
use deepshadow::shadow::{Links, Map, Runs};
use glam::Vec3;

/// The GPU backend, if tests shall use one.
#[cfg(feature = "gpu")]
pub fn gpu() -> Option<Box<dyn Passes>> {
    use deepshadow::gpu::{AdapterChoice, GpuBackend};
    if std::env::var("DEEPSHADOW_TEST_GPU").is_ok_and(|value| value == "skip") {
        eprintln!("SKIPPED: DEEPSHADOW_TEST_GPU=skip, nothing is tested on a GPU");
        return None;
    }
    let backend = GpuBackend::open(AdapterChoice::Any).expect(
        "a Vulkan, Metal or DX12 driver (Debian: mesa-vulkan-drivers), or DEEPSHADOW_TEST_GPU=skip",
    );
    Some(Box::new(backend))
}

/// This build has no GPU backend.
#[cfg(not(feature = "gpu"))]
pub fn gpu() -> Option<Box<dyn Passes>> {
    None
}

/// The CPU backend, and the GPU backend if there is one.
pub fn every_backend() -> Vec<Box<dyn Passes>> {
    std::iter::once(Box::new(CpuBackend) as Box<dyn Passes>).chain(gpu()).collect()
}

/// Whether a backend interpolates voxels with f32 weights. Graphics hardware uses 8 bits, which
/// moves a sample by up to 1/512 of a voxel.
pub fn interpolates_in_f32(backend: &dyn Backend) -> bool {
    let name = backend.description();
    ["cpu", "llvmpipe"].iter().any(|exact| name.contains(exact))
}

/// The CPU backend, as it is or bent.
pub enum Bent {
    /// Not at all.
    Exact,
    /// Not at all, but held against the bounds of hardware that weighs voxels with 8 bits.
    EightBit,
    /// Every sample is taken somewhere else, by so much in voxels of the media's index space.
    Moved(Vec3),
    /// Threshold maps are empty: nothing is in shadow.
    Lit,
}

impl Bent {
    fn bend(&self, frame: &Frame) -> Frame {
        let mut frame = *frame;
        if let Self::Moved(by) = self {
            for (row, by) in frame.media.index_from_frame.iter_mut().zip(by.to_array()) {
                row.w += by;
            }
        }
        frame
    }
}

impl Backend for Bent {
    fn description(&self) -> String {
        if matches!(self, Self::EightBit) { "8-bit weights" } else { "bent cpu" }.to_owned()
    }

    fn passes(&self) -> &dyn Passes {
        self
    }
}

impl Passes for Bent {
    fn trace_threshold(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        if matches!(self, Self::Lit) {
            return Ok(vec![[0.0; 4]; (frame.map.size * frame.map.size) as usize]);
        }
        CpuBackend.trace_threshold(casters, &self.bend(frame), progress)
    }

    fn trace_slices(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        CpuBackend.trace_slices(casters, &self.bend(frame), memory, progress)
    }

    fn raster_slices(
        &self,
        media: &Media,
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Runs> {
        CpuBackend.raster_slices(media, &self.bend(frame), memory, progress)
    }

    fn link_neighbors(&self, runs: &Runs, size: u32) -> Result<Links> {
        CpuBackend.link_neighbors(runs, size)
    }

    fn march_view(
        &self,
        casters: Casters<'_>,
        frame: &Frame,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        CpuBackend.march_view(casters, &self.bend(frame), map, progress)
    }
}
