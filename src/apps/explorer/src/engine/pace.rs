//! How much of the full picture is drawn while something moves, so that answers come in time.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// What moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub enum Motion {
    /// Nothing: the picture is what `render` draws.
    #[default]
    Rest,
    /// The camera, or what the picture alone depends on.
    Camera,
    /// The light, or something else that maps depend on.
    Light,
}

/// How long the parts of a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Times {
    /// Seconds to complete the scene.
    pub scene: f64,
    /// Seconds of shadow maps; 0 if they were known.
    pub map: f64,
    /// Seconds of the camera's march.
    pub view: f64,
    /// Seconds to turn radiance into what a screen shows.
    pub tone: f64,
    /// Seconds from the wish to the picture.
    pub total: f64,
}

/// The share of the full picture that fits a budget, learnt from what pictures took.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Edge of the picture that is drawn, as a share of the full one's.
    picture: f64,
    /// The same of the map.
    map: f64,
    /// Whether anything was learnt yet.
    known: bool,
}

/// Smallest share of an edge.
const LEAST: f64 = 1.0 / 12.0;
/// Share of the budget that is aimed at, because times vary.
const AIM: f64 = 0.75;
/// How far a share changes at once, as a factor.
const MOST_CHANGE: f64 = 2.0;
/// Shares beyond this are the full size.
const NEARLY_ALL: f64 = 0.9;

impl Default for Pace {
    fn default() -> Self {
        Self { picture: 0.25, map: 0.4, known: false }
    }
}

impl Pace {
    /// Edges of picture and map as shares of the full ones, above 0 and at most 1.
    pub fn shares(&self) -> [f64; 2] {
        [self.picture, self.map].map(|share| if share > NEARLY_ALL { 1.0 } else { share })
    }

    /// Learns from the times of a picture that was drawn with [`Self::shares`]. What is spent beside
    /// maps and march cannot be saved.
    pub fn learn(&mut self, times: &Times, budget: Duration) {
        let fixed = times.scene;
        let left = (AIM * budget.as_secs_f64() - fixed).max(0.2 * AIM * budget.as_secs_f64());
        let with_map = times.map > 0.0;
        let view = times.view + times.tone;
        let room = if with_map { 0.5 * left } else { left };
        let change = |spent: f64, room: f64| {
            let change = (room / spent.max(1e-6)).sqrt();
            // The first picture pays for what is computed once.
            let least = if self.known { 1.0 / MOST_CHANGE } else { 0.7 };
            change.clamp(least, MOST_CHANGE)
        };
        let (of_view, of_map) = (change(view, room), change(times.map, room));
        self.picture = (self.picture * of_view).clamp(LEAST, 1.0);
        if with_map {
            self.map = (self.map * of_map).clamp(LEAST, 1.0);
        }
        self.known = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine on which the full picture takes `view` seconds and the full map `map`.
    fn settle(view: f64, map: f64, budget: f64) -> (Times, [f64; 2]) {
        let mut pace = Pace::default();
        let mut times = Times::default();
        for _ in 0..20 {
            let [picture, of_map] = pace.shares();
            times.view = view * picture * picture;
            times.map = map * of_map * of_map;
            pace.learn(&times, Duration::from_secs_f64(budget));
        }
        (times, pace.shares())
    }

    #[test]
    fn a_fast_machine_draws_everything() {
        let (_, shares) = settle(0.002, 0.001, 0.033);
        assert_eq!(shares, [1.0, 1.0]);
    }

    #[test]
    fn a_slow_machine_keeps_the_budget() {
        for (view, map) in [(1.0, 0.0), (0.5, 0.4), (0.05, 0.8)] {
            let (times, shares) = settle(view, map, 0.033);
            let spent = times.view + times.map;
            assert!(spent < 0.033 && spent > 0.009, "{view} {map}: {spent} {shares:?}");
        }
    }

    #[test]
    fn nothing_is_smaller_than_can_be_looked_at() {
        let (_, shares) = settle(1e3, 1e3, 0.033);
        assert_eq!(shares, [LEAST, LEAST]);
    }
}
