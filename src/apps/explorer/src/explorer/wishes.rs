//! Notices what has changed, and asks for what that needs.

use std::time::Duration;

use deepshadow::glam::DVec3;
use deepshadow::scene::Projection;
use web_time::Instant;

use super::{Explorer, MESSAGE};
use crate::engine::{Device, Motion, Wish, of_map};

/// How long after a change a picture counts as one at rest.
const REST: Duration = Duration::from_millis(150);
/// Pictures a second of a sequence that is played.
const PLAYED: f64 = 12.0;
/// The longest time that a window that processors draw waits for a picture.
const LONGEST: Duration = Duration::from_millis(70);
/// Documents that are kept to go back to.
const MOST_ASKED: usize = 64;
/// The largest picture that is drawn for a window.
const LARGEST: u32 = 8192;

impl Explorer {
    /// Notices changes, and asks for what they need.
    pub(super) fn ask_for_pictures(&mut self) {
        let Some(document) = &self.document else { return self.settle() };
        let (surroundings, id) = (document.surroundings, document.id);
        let now = match document.now() {
            Ok(now) => now,
            Err(error) => return self.complain(&error.to_string()),
        };
        if let Some(last) = self.last.as_ref().filter(|last| **last != now) {
            let light = of_map(last) != of_map(&now);
            // A light that was moved is not at rest because the camera moves too.
            if self.motion != Motion::Light || light {
                self.motion = if light { Motion::Light } else { Motion::Camera };
            }
            self.moved = Some(Instant::now());
        }
        self.last = Some(now.clone());
        match self.moved {
            Some(moved) if moved.elapsed() < REST => {
                self.context.request_repaint_after(REST.saturating_sub(moved.elapsed()));
            }
            // A whole picture would take the processor from the one that is awaited. None comes of what
            // is known already.
            _ if self.awaits_answer() => self.context.request_repaint_after(REST),
            _ => self.settle(),
        }
        let span = self.arrived.len() as f64;
        self.rate = (self.motion != Motion::Rest && span > 1.0).then_some(span);
        let own = now.image.width.zip(now.image.height);
        let here = self.size.map(|n| n.clamp(1, LARGEST));
        let size = own.map_or(here, |(width, height)| [width, height]);
        let beside = self.beside.clone().map(|mut beside| {
            // It is looked at from the same place, at the same size.
            beside.camera.clone_from(&now.camera);
            beside.image = now.image.clone();
            beside
        });
        let (motion, budget, device) = (self.motion, self.budget, self.device);
        let wish =
            Wish { document: id, file: now, surroundings, beside, size, motion, budget, device };
        if self.cancelled.as_ref().is_some_and(|cancelled| cancelled.is_of_same_scene(&wish)) {
            return;
        }
        self.cancelled = None;
        self.wished = Some(wish.clone());
        let before = self.engine.last_wish();
        let serial = self.engine.wish(wish);
        if serial != before {
            self.asked.extend(self.document.clone().map(|document| (serial, document)));
            // Pictures of those before will hardly come any more.
            while self.asked.len() > MOST_ASKED {
                self.asked.pop_front();
            }
        }
        // A window that processors draw takes all of them for longer than a moving picture does. It
        // is faster to have the picture first.
        let on_processors = self.is_software && device != Device::Gpu;
        let waits = on_processors && motion != Motion::Rest && !self.engine.is_loading();
        if waits && serial != before && self.shown().is_some() {
            let events = self.engine.wait_for(serial, (2 * budget).min(LONGEST));
            self.hear(events);
        }
        self.ask_for_truth();
    }

    /// Whether a picture of the latest change is still to come.
    fn awaits_answer(&self) -> bool {
        let latest = self.last_wish();
        let to_come = self.shown().is_some_and(|shown| shown.picture.serial < latest);
        to_come && self.failed != Some(latest) && !self.engine.is_idle()
    }

    pub(super) fn ask_for_truth(&mut self) {
        if self.shown().is_none() {
            return;
        }
        let Some(shown) = &self.pictures[0] else { return };
        if self.motion != Motion::Rest {
            self.truth.give_up();
            self.looking.asked = None;
            return;
        }
        if let Some(question) = self.looking.question(&shown.picture, self.light) {
            self.truth.ask(question, &shown.picture);
        }
    }

    /// Goes on with what runs by itself.
    pub(super) fn advance(&mut self) {
        self.messages.retain(|message| message.is_error || message.since.elapsed() < MESSAGE);
        if self.look_from_light {
            self.look_from_light = false;
            self.go_to_light();
        }
        if self.playing
            && let Some(document) = &mut self.document
            && let Some(frames) = document.frames.clone()
        {
            // The next frame waits for the last one.
            let drawn = self.engine.is_idle();
            let due = self.played.elapsed() >= Duration::from_secs_f64(1.0 / PLAYED);
            if drawn && due {
                let next = document.frame + 1;
                document.frame = if next > *frames.end() { *frames.start() } else { next };
                self.played = Instant::now();
            }
            self.context.request_repaint_after(Duration::from_millis(20));
        }
        self.advance_output();
    }

    /// The camera where the light is.
    pub(super) fn go_to_light(&mut self) {
        let (Some(scene), bounds) = (self.scene(), self.bounds()) else { return };
        let Some(light) = scene.lights.get(self.light) else { return };
        let (middle, size) = (bounds.center(), bounds.size().length().max(1e-9));
        let mut camera = scene.camera;
        let way = light.direction_at(middle).normalize_or(DVec3::NEG_Y);
        camera.target = middle;
        camera.position = light.position().unwrap_or(middle - way * 2.0 * size);
        camera.up = if way.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
        if light.position().is_none() {
            let kind = Projection::Orthographic { height: 1.1 * size };
            camera.projection = kind;
        }
        if let Some(document) = &mut self.document {
            if light.position().is_none() {
                document.file.camera.kind = Some("orthographic".to_owned());
            }
            document.place_camera(&camera);
        }
    }
}
