//! The thread that draws, and the way to it.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use eframe::egui;

use super::Screen;
use super::threads::start;
use crate::document::Document;
use crate::engine::devices::Devices;
use crate::engine::progress::Shared;
use crate::engine::worker::Worker;
use crate::engine::{Doing, Event, Wish};
use crate::explorer::Opening;

/// The thread that draws, and the way to it.
pub struct Engine {
    shared: Arc<Shared>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
    last: Option<Wish>,
}

impl Engine {
    /// Starts it. Passes run on the device of `screen` if that is hardware; `context` is asked to
    /// repaint when something has happened.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(screen: Option<&Screen>, context: &egui::Context) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (sender, events) = channel();
        let (gpu, is_hardware) = screen.map_or((None, false), Screen::gpu);
        let devices = Devices::new(gpu, is_hardware);
        let repaint = context.clone();
        let tell = move |event: Event| {
            // Nobody listens any more when the window has closed.
            let _ = sender.send(event);
            repaint.request_repaint();
        };
        let own = shared.clone();
        let thread = std::thread::Builder::new().name("engine".to_owned());
        let thread = thread.spawn(move || {
            let mut worker = Worker::new(own.clone(), devices, Box::new(tell));
            while pollster::block_on(worker.heed(own.next(worker.is_loading()))) {}
        })?;
        Ok(Self { shared, events, thread: Some(thread), last: None })
    }

    /// Opens a document on a thread of its own, because disks may be slow.
    ///
    /// # Errors
    /// If the system starts no thread.
    pub fn open(&self, input: &str, opening: &Opening) -> std::io::Result<()> {
        let (input, opening) = (input.to_owned(), opening.clone());
        start("opening", move || {
            let document = Document::open(&input).map_err(|error| error.to_string());
            opening.opened(input, document);
        })
    }

    /// Asks for a picture; returns the number of the wish. The same wish again is the same wish.
    pub fn wish(&mut self, wish: Wish) -> u64 {
        if self.last.as_ref() == Some(&wish) {
            return self.shared.serial.load(Ordering::Relaxed);
        }
        self.last = Some(wish.clone());
        self.shared.ask(wish)
    }

    /// The number of the latest wish.
    pub fn last_wish(&self) -> u64 {
        self.shared.serial.load(Ordering::Relaxed)
    }

    /// Gives up what is being drawn or loaded.
    pub fn cancel(&mut self) {
        self.last = None;
        self.shared.give_up();
    }

    /// The next wish counts as a new one, whatever it is.
    pub fn ask_again(&mut self) {
        self.last = None;
    }

    /// Whether something is being loaded.
    pub fn is_loading(&self) -> bool {
        self.doing().is_some_and(|doing| doing.share.is_none())
    }

    /// What has happened since the last call.
    pub fn events(&self) -> Vec<Event> {
        self.events.try_iter().collect()
    }

    /// What happens until there is a picture of the wish with this number, or until too much time
    /// has passed.
    pub fn wait_for(&self, serial: u64, most: Duration) -> Vec<Event> {
        let until = Instant::now() + most;
        let mut events = Vec::new();
        while let Ok(event) =
            self.events.recv_timeout(until.saturating_duration_since(Instant::now()))
        {
            let is_last = match &event {
                Event::Picture(picture) => picture.serial >= serial,
                _ => true,
            };
            events.push(event);
            if is_last {
                break;
            }
        }
        events
    }

    /// What is being done.
    pub fn doing(&self) -> Option<Doing> {
        self.shared.doing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether everything that was wished for is done.
    pub fn is_idle(&self) -> bool {
        self.shared.is_idle()
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        self.shared.quit();
        if let Some(thread) = self.thread.take() {
            // Drivers do not bear that a process ends while they work.
            let _ = thread.join();
        }
    }
}

/// What is being done is asked for by whoever wants to know it.
pub fn told(_doing: Option<&Doing>) {}
