//! What is open: how it comes, goes and is compared.

use std::sync::mpsc::{Receiver, Sender, channel};

use eframe::egui;
use web_time::Instant;

use super::Explorer;
use crate::document::Document;
use crate::panels::TransferEditor;

/// A document that was opened, or why it was not, with the name of its input.
type Opened = (String, Result<Box<Document>, String>);

/// Where documents come from.
pub(super) struct Openings {
    sender: Sender<Opened>,
    receiver: Receiver<Opened>,
    context: egui::Context,
}

/// Where to leave a document that was opened.
#[derive(Clone)]
pub struct Opening {
    sender: Sender<Opened>,
    context: egui::Context,
}

impl Openings {
    pub(super) fn new(context: &egui::Context) -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver, context: context.clone() }
    }

    fn sender(&self) -> Opening {
        Opening { sender: self.sender.clone(), context: self.context.clone() }
    }

    pub(super) fn arrived(&self) -> Vec<Opened> {
        self.receiver.try_iter().collect()
    }
}

impl Opening {
    /// Leaves what `input` names, or why it cannot be opened.
    pub fn opened(&self, input: String, document: Result<Document, String>) {
        // Nobody listens any more when the window has closed.
        let _ = self.sender.send((input, document.map(Box::new)));
        self.context.request_repaint();
    }
}

impl Explorer {
    /// Opens a preset, a scene file, or a file of a volume, of hair or of a mesh: on a thread of its
    /// own, because disks may be slow. If it cannot be opened, what was open before stays.
    pub fn open(&mut self, input: &str) {
        self.opening = Some(input.to_owned());
        self.end_round();
        if self.engine.open(input, &self.openings.sender()).is_err() {
            self.opening = None;
            self.complain("the system starts no thread to open a file");
        }
    }

    /// Takes a document that was opened.
    pub(super) fn take_document(&mut self, document: Document) {
        self.messages.retain(|message| !message.is_error);
        for note in &document.notes {
            self.say(note);
        }
        self.end_comparison();
        (self.light, self.volume, self.playing) = (0, 0, false);
        self.transfer = TransferEditor::default();
        self.looking.at = None;
        self.scales.clear();
        self.show_document(Some(document));
    }

    /// Shows another document, or the same at another time.
    pub(super) fn show_document(&mut self, document: Option<Document>) {
        self.last = None;
        self.cancelled = None;
        self.engine.ask_again();
        self.id = document.as_ref().map(|document| document.id);
        let title = document.as_ref().map(Document::title);
        let title = title.map_or_else(|| "deepshadow".to_owned(), |name| name + " - deepshadow");
        self.context.send_viewport_cmd(egui::ViewportCommand::Title(title));
        self.document = document;
    }

    /// Gives up what is being opened, loaded or drawn.
    pub fn cancel(&mut self) {
        self.opening = None;
        self.engine.cancel();
        if self.shown().is_none() {
            // There is nothing to be seen of it.
            let good = self.good.clone();
            self.show_document(good);
        } else {
            self.cancelled.clone_from(&self.wished);
            self.settle();
        }
    }

    /// Draws what was given up.
    pub fn draw_again(&mut self) {
        if self.cancelled.take().is_some() {
            self.engine.ask_again();
        }
    }

    /// Ends the comparison with other settings.
    pub fn end_comparison(&mut self) {
        self.beside = None;
        let other = self.pictures[1].take().map(|shown| shown.texture);
        self.forget(other);
    }

    /// Compares with the settings of now.
    pub fn compare(&mut self, document: &Document) {
        self.end_comparison();
        self.beside = document.now().ok();
    }

    /// Starts or stops a sequence.
    pub fn play(&mut self, document: &mut Document) {
        self.playing = !self.playing && document.frames.is_some();
        self.played = Instant::now();
        if self.playing
            && let Some(scene) = self.scene()
        {
            document.fix(&scene);
        }
    }
}
