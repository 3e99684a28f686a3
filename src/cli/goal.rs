//! Options that say how good or how fast a picture has to be.

use clap::Args;

use super::arguments::{PictureArguments, SceneArguments, above_0};
use super::job::Job;
use crate::compare::{Chosen, Given, Goal, choose_picture};
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::settings::{MapKind, Settings, Shading};

/// Options that fix what a goal chooses.
const CHOSEN: [&str; 5] = ["steps", "view_steps", "tolerance", "max_error", "max_map_bytes"];

/// What a picture is chosen for.
#[derive(Debug, Args)]
pub(super) struct GoalArguments {
    /// Allowed RMS error of radiance over lit pixels, as a share of its 99.9th percentile: chooses
    /// maps and steps for the least time, and certifies the picture at random pixels.
    #[arg(long, value_name = "E", value_parser = above_0, allow_negative_numbers = true, help_heading = "Picture", conflicts_with_all = CHOSEN)]
    pub max_picture_error: Option<f64>,
    /// Seconds that map and picture may take: chooses the best picture within them.
    #[arg(long, value_name = "S", value_parser = above_0, allow_negative_numbers = true, help_heading = "Picture", conflicts_with = "max_picture_error", conflicts_with_all = CHOSEN)]
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
        (arguments, picture): (&SceneArguments, &PictureArguments),
        progress: &dyn Progress,
    ) -> Result<Option<Chosen>> {
        let Some(goal) = self.goal() else { return Ok(None) };
        self.check(&job.settings)?;
        let given = Given {
            size: arguments.map_size.is_some(),
            quality: arguments.quality.is_some(),
            tolerance: picture.picture_tolerance.is_some(),
        };
        choose_picture(job.backend, &job.scene, &job.settings, goal, given, progress).map(Some)
    }

    /// Checks what is not an option's own value, since a scene file may say it too.
    fn check(&self, settings: &Settings) -> Result<()> {
        let name = if self.time.is_some() { "a time" } else { "an error of the picture" };
        let refused = |key: &str, why: &str| {
            Err(Error::value(key, format!("is not possible with {name}: {why}")))
        };
        match settings.map.kind {
            None | Some(MapKind::Fragments) => {}
            Some(_) => return refused("shadow.map", "it chooses fragment maps"),
        }
        if settings.view.shading == Shading::Paper {
            return refused("shadow.shading", "the paper's is not physical");
        }
        if settings.map.filter.window() != (0, false) {
            return refused("shadow.filter", "wide filters blur shadows on purpose");
        }
        Ok(())
    }
}
