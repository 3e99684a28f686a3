//! The CPU backend: the passes on all cores. It is the default on machines without a GPU and the
//! referee of the other backends.

mod march_view;
mod trace_threshold;

use crate::backend::Backend;
use crate::error::Result;
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::shadow::ThresholdMap;
use crate::volume::Volume;

/// Renders with rayon's current thread pool.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend;

impl Backend for CpuBackend {
    fn description(&self) -> String {
        format!("cpu, {} threads", rayon::current_num_threads())
    }

    fn trace_threshold(
        &self,
        volume: &Volume,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        Ok(trace_threshold::trace_threshold(volume, frame, progress))
    }

    fn march_view(
        &self,
        volume: &Volume,
        frame: &Frame,
        map: &ThresholdMap,
        progress: &dyn Progress,
    ) -> Result<Image> {
        Ok(march_view::march_view(volume, frame, map, progress))
    }
}
