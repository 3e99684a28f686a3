//! The map that a picture is lit through.

use super::fragments::GpuFragments;
use super::nested::GpuNested;
use super::passes::Pass;
use super::renderer::GpuMap;

/// The map that a picture is lit through.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum GpuShadow<'a> {
    /// Four numbers a texel.
    Threshold(&'a GpuMap),
    /// Lists of fragments, of all texels.
    Fragments(&'a GpuFragments),
    /// Nine knots a texel.
    Nested(&'a GpuNested),
}

impl GpuShadow<'_> {
    /// The pass that pictures are made with through it.
    pub(super) fn march(self) -> Pass {
        match self {
            Self::Threshold(_) => Pass::MarchThreshold,
            Self::Fragments(_) => Pass::MarchFragments,
            Self::Nested(_) => Pass::MarchNested,
        }
    }

    /// The pass that gives more rays to some of their pixels.
    pub(super) fn refine(self) -> Pass {
        match self {
            Self::Threshold(_) => Pass::RefineThreshold,
            Self::Fragments(_) => Pass::RefineFragments,
            Self::Nested(_) => Pass::RefineNested,
        }
    }
}
