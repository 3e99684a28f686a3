//! Questions about pictures, which a worker answers.

use std::rc::Rc;

use eframe::egui;

use super::Engine;
use super::hands::Hands;
use super::port::Order;
use crate::engine::Picture;
use crate::engine::truth::{Answer, Question};

/// The way to the worker that made the whole pictures.
pub struct Truth(Rc<Hands>);

impl Truth {
    /// Of the workers of `engine`.
    ///
    /// # Errors
    /// None.
    pub fn start(engine: &Engine, _context: &egui::Context) -> std::io::Result<Self> {
        Ok(Self(engine.hands()))
    }

    /// Asks about a picture; earlier questions are given up.
    pub fn ask(&self, question: Question, picture: &Picture) {
        let number = self.0.next_question();
        self.0.order(1, &Order::Ask { number, serial: picture.serial, question });
    }

    /// Gives up.
    pub fn give_up(&self) {
        let number = self.0.next_question();
        if self.0.is_at_work(1) {
            self.0.order(1, &Order::Quiet(number));
        }
    }

    /// Answers to the latest question.
    pub fn answers(&self) -> Vec<Answer> {
        self.0.answers()
    }
}
