//! Options that say how good or how fast a picture has to be.

use clap::Args;

use super::arguments::{PictureArguments, SceneArguments, above_0};
use super::job::Job;
use super::limits::LimitArguments;
use crate::compare::{Chosen, Given, Goal, choose_picture};
use crate::error::{Error, Result};
use crate::progress::Progress;

/// What a picture is chosen for.
#[derive(Debug, Args)]
pub(super) struct GoalArguments {
    /// Allowed RMS error of radiance over lit pixels, as a share of its 99.9th percentile: chooses
    /// maps and steps for the least time, and certifies the picture at random pixels.
    #[arg(long, value_name = "E", value_parser = above_0, allow_negative_numbers = true, help_heading = "Picture")]
    pub max_picture_error: Option<f64>,
    /// Seconds that map and picture may take: chooses the best picture within them.
    #[arg(long, value_name = "S", value_parser = above_0, allow_negative_numbers = true, help_heading = "Picture", conflicts_with = "max_picture_error")]
    pub time: Option<f64>,
}

impl GoalArguments {
    /// The goal, if one was given.
    pub(super) fn goal(&self) -> Option<Goal> {
        let error = self.max_picture_error.map(Goal::Error);
        error.or(self.time.map(Goal::Seconds))
    }

    /// The picture that reaches the goal; `None` if there is none.
    ///
    /// # Errors
    /// If it cannot be reached, or other options contradict it.
    pub(super) fn picture(
        &self,
        job: &Job,
        (arguments, limits, picture): (&SceneArguments, &LimitArguments, &PictureArguments),
        progress: &dyn Progress,
    ) -> Result<Option<Chosen>> {
        let Some(goal) = self.goal() else { return Ok(None) };
        let own = [
            (limits.any(), "a limit of the map"),
            (arguments.tolerance.is_some(), "a tolerance"),
            (arguments.steps.is_some() || picture.view_steps.is_some(), "a number of steps"),
        ];
        if let Some((_, what)) = own.into_iter().find(|(given, _)| *given) {
            let name = if self.time.is_some() { "time" } else { "max-picture-error" };
            return Err(Error::value(name, format!("chooses what {what} would fix")));
        }
        let given = Given {
            size: arguments.map_size.is_some(),
            quality: arguments.quality.is_some(),
            tolerance: picture.picture_tolerance.is_some(),
        };
        choose_picture(job.backend, &job.scene, &job.settings, goal, given, progress).map(Some)
    }
}
