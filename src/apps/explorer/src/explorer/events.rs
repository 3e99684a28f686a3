//! Takes what threads have made.

use std::time::Duration;

use deepshadow::wgpu;
use eframe::egui;
use web_time::Instant;

use super::{Explorer, Shown};
use crate::engine::truth::Answer;
use crate::engine::{Event, Face, Picture};
use crate::host;

/// What shows a picture.
pub enum Texture {
    /// A page, below the window.
    Below,
    /// One that egui keeps.
    Own(egui::TextureHandle),
    /// One of the window's device.
    Device(egui::TextureId),
}

impl Texture {
    /// Its number, if the window draws it.
    pub fn id(&self) -> Option<egui::TextureId> {
        match self {
            Self::Below => None,
            Self::Own(texture) => Some(texture.id()),
            Self::Device(id) => Some(*id),
        }
    }
}

impl Explorer {
    /// Takes what the engine has made.
    pub fn receive(&mut self) {
        for (input, document) in self.openings.arrived() {
            // Another one may have been opened, or this one given up, meanwhile.
            if self.opening.as_ref() != Some(&input) {
                continue;
            }
            self.opening = None;
            match document {
                Ok(document) => self.take_document(*document),
                Err(why) => self.complain(&why),
            }
        }
        let events = self.engine.events();
        self.hear(events);
        self.hear_of_truth();
        while let Ok((dialog, found)) = self.dialogs.1.try_recv() {
            self.hear_of_dialog(dialog, found);
        }
    }

    /// Takes what the engine tells.
    pub(super) fn hear(&mut self, events: Vec<Event>) {
        for event in events {
            match event {
                Event::Picture(picture) => self.take(*picture),
                Event::Loaded { document, .. } if Some(document) != self.id => {}
                Event::Loaded { notes, grids, .. } => {
                    self.grids = grids;
                    for note in &notes {
                        self.say(note);
                    }
                }
                Event::FellBack(why) => {
                    self.complain(&format!("{why}; the processor draws from now on"));
                }
                Event::Failed { serial, why, loading } => {
                    self.complain(&why);
                    // What was changed since then is still being tried.
                    if serial != self.engine.last_wish() {
                        continue;
                    }
                    self.failed = Some(serial);
                    // What cannot be loaded must not stay: nothing could be drawn any more.
                    if loading || self.shown().is_none() {
                        let good = self.good.clone();
                        self.show_document(good);
                    }
                }
            }
        }
    }

    /// Takes what is told of the truth.
    fn hear_of_truth(&mut self) {
        for answer in self.truth.answers() {
            let texture = |image: &egui::ColorImage, name: &str| {
                let options = egui::TextureOptions::NEAREST;
                self.context.load_texture(name, image.clone(), options)
            };
            match answer {
                Answer::Difference(difference) => {
                    let texture = texture(&difference.heat, "difference");
                    self.looking.pending = difference.share < 1.0;
                    self.looking.difference = Some((difference, texture));
                }
                Answer::Curves(drawn) => {
                    let texture = texture(&drawn.map, "map");
                    self.looking.pending = drawn.missing > 0;
                    self.looking.drawn = Some((*drawn, texture));
                }
                Answer::None(why) => {
                    self.looking.pending = false;
                    self.looking.refusal = Some(why);
                }
            }
        }
    }

    /// Shows a picture.
    pub(super) fn take(&mut self, picture: Picture) {
        let side = picture.side;
        if side == 0 {
            while self.asked.front().is_some_and(|(serial, _)| *serial < picture.serial) {
                self.asked.pop_front();
            }
            if let Some((serial, document)) = self.asked.front()
                && *serial == picture.serial
            {
                self.good = Some(document.clone());
            }
            self.arrived.push(Instant::now());
        }
        let known = self.pictures[side].take().map(|shown| shown.texture);
        let below = (side == 0).then(|| host::show_below(&picture)).flatten();
        let texture = match (&picture.face, known) {
            (_, known) if below.is_some() => {
                self.forget(known);
                Texture::Below
            }
            (Face::Pixels(pixels), Some(Texture::Own(mut own))) => {
                own.set(pixels.clone(), egui::TextureOptions::LINEAR);
                Texture::Own(own)
            }
            (Face::Pixels(pixels), known) => {
                self.forget(known);
                let options = egui::TextureOptions::LINEAR;
                Texture::Own(self.context.load_texture("picture", pixels.clone(), options))
            }
            (Face::Texture(view), known) => match self.on_device(view, known.as_ref()) {
                Some(texture) => texture,
                None => return,
            },
        };
        self.pictures[side] = Some(Shown { picture, texture, since: below });
        self.arrived.retain(|at| at.elapsed() < Duration::from_secs(1));
    }

    /// Gives up a texture of the device.
    pub(super) fn forget(&self, texture: Option<Texture>) {
        if let (Some(Texture::Device(id)), Some(screen)) = (texture, &self.screen) {
            screen.forget(id);
        }
    }

    /// A texture of the device on the screen.
    pub(super) fn on_device(
        &self,
        view: &wgpu::TextureView,
        known: Option<&Texture>,
    ) -> Option<Texture> {
        let known = match known {
            Some(Texture::Device(id)) => Some(*id),
            _ => None,
        };
        Some(Texture::Device(self.screen.as_ref()?.texture(view, known)))
    }
}
