//! The thread that answers questions about pictures.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use eframe::egui;

use super::Engine;
use crate::engine::truth::{Answer, Answers, Question, Wanted};
use crate::engine::{Made, Picture};

/// The thread.
pub struct Truth {
    questions: Sender<(u64, Question, Arc<Made>)>,
    answers: Receiver<(u64, Answer)>,
    serial: Arc<AtomicU64>,
}

impl Truth {
    /// Starts it; `context` is asked to repaint when there is an answer.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(_engine: &Engine, context: &egui::Context) -> std::io::Result<Self> {
        let (questions, asked) = channel::<(u64, Question, Arc<Made>)>();
        let (sender, answers) = channel();
        let serial = Arc::new(AtomicU64::new(0));
        let (latest, repaint) = (serial.clone(), context.clone());
        std::thread::Builder::new().name("truth".to_owned()).spawn(move || {
            let mut own = Answers::default();
            while let Ok(mut question) = asked.recv() {
                while let Ok(newer) = asked.try_recv() {
                    question = newer;
                }
                let (number, question, made) = question;
                let wanted = Wanted { number, latest: latest.clone() };
                let tell = |answer: Answer| {
                    let _ = sender.send((number, answer));
                    repaint.request_repaint();
                };
                pollster::block_on(own.answer(&question, &made, &wanted, &tell));
            }
        })?;
        Ok(Self { questions, answers, serial })
    }

    /// Asks about a picture; earlier questions are given up.
    pub fn ask(&self, question: Question, picture: &Picture) {
        let number = self.serial.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(made) = picture.made.clone() {
            // The thread ends with this.
            let _ = self.questions.send((number, question, made));
        }
    }

    /// Gives up.
    pub fn give_up(&self) {
        self.serial.fetch_add(1, Ordering::Relaxed);
    }

    /// Answers to the latest question.
    pub fn answers(&self) -> Vec<Answer> {
        let latest = self.serial.load(Ordering::Relaxed);
        let answers = self.answers.try_iter().filter(|(number, _)| *number == latest);
        answers.map(|(_, answer)| answer).collect()
    }
}
