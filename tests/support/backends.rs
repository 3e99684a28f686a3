//! The backends that tests run on.

use deepshadow::backend::{Backend, Passes};
use deepshadow::cpu::CpuBackend;

/// The GPU backend, where tests want one.
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

/// None is built in.
#[cfg(not(feature = "gpu"))]
pub fn gpu() -> Option<Box<dyn Passes>> {
    None
}

/// The CPU backend, and the GPU's where there is one.
pub fn every_backend() -> Vec<Box<dyn Passes>> {
    std::iter::once(Box::new(CpuBackend) as Box<dyn Passes>).chain(gpu()).collect()
}

/// Whether a backend weighs voxels in f32. Graphics hardware does with 8 bits, which moves a sample by up to 1/512
/// of a voxel.
pub fn interpolates_in_f32(backend: &dyn Backend) -> bool {
    let name = backend.description();
    ["cpu", "bent", "llvmpipe"].iter().any(|exact| name.contains(exact))
}
