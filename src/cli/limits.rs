//! Options that limit the error and the size of a map.

use clap::Args;

use super::arguments::{SceneArguments, above_0, parse};
use super::job::Job;
use crate::compare::{Budget, Certified, Limits, choose};
use crate::error::Result;
use crate::scene::Beam;
use crate::settings::MapKind;

/// Limits that a map is chosen to keep.
#[derive(Debug, Args)]
pub(super) struct LimitArguments {
    /// Allowed RMS error of the map's transmittance, measured at random points of the volume; uses
    /// the smallest map found within it.
    #[arg(long, value_name = "E", value_parser = above_0, allow_negative_numbers = true, help_heading = "Shadow map")]
    pub max_error: Option<f64>,
    /// Bytes that the map may take in total (4000000, 512KiB, 4MiB) or per texel (16/texel); uses
    /// the most exact map found within that, or the smallest with --max-error.
    #[arg(long, value_name = "B", value_parser = parse::<Budget>, help_heading = "Shadow map")]
    pub max_map_bytes: Option<Budget>,
}

impl LimitArguments {
    /// Whether a limit was given.
    pub(super) fn any(&self) -> bool {
        self.max_error.is_some() || self.max_map_bytes.is_some()
    }

    /// The map of `beam`, one of the job's beams, that keeps the limits, among the kinds for which
    /// `wanted` is true; `None` without limits.
    ///
    /// # Errors
    /// If no map that was tried keeps them; the error describes the one that came closest.
    pub(super) fn choose(
        &self,
        job: &Job,
        beam: &Beam,
        arguments: &SceneArguments,
        wanted: fn(MapKind) -> bool,
    ) -> Result<Option<Certified>> {
        if !self.any() {
            return Ok(None);
        }
        let limits = Limits {
            error: self.max_error,
            budget: self.max_map_bytes,
            size: arguments.map_size,
            kind: arguments.map.as_ref().and(job.settings.map.kind),
            own_tolerance: arguments.tolerance.is_some(),
        };
        choose(job.backend, beam, &job.settings, &limits, wanted, &*job.progress).map(Some)
    }
}
