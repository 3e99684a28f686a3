//! The workers of a page, and what they are told.

mod hearing;

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use eframe::egui;
use js_sys::Array;
use wasm_bindgen::prelude::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{ErrorEvent, File, MessageEvent, Worker, WorkerOptions, WorkerType};

use super::port::{Order, Report, packed, received};
use crate::engine::truth::Answer;
use crate::engine::worker::Part;
use crate::engine::{Device, Doing, Event, Motion, Wish};
use crate::explorer::Opening;

/// How many there are: one for what is in a hurry, one for whole pictures and for a GPU.
const COUNT: usize = 2;

/// How long the window may not say what workers do.
const SOON: Duration = Duration::from_millis(60);

/// The script of a worker, beside the page.
const SCRIPT: &str = "worker.js";

/// A worker.
struct Hand {
    worker: Worker,
    /// Hear it, and its end; kept as long as it may say something.
    _heard: Closure<dyn FnMut(MessageEvent)>,
    _ended: Closure<dyn FnMut(ErrorEvent)>,
    /// How many orders it was given, and how many it has done.
    given: u64,
    done: u64,
    /// Whether it draws a picture.
    draws: bool,
    doing: Option<Doing>,
    /// Its GPU, and whether that is hardware.
    gpu: Option<(String, bool)>,
}

/// The workers.
pub struct Hands {
    state: RefCell<State>,
    context: egui::Context,
    /// The program, compiled.
    module: JsValue,
}

#[derive(Default)]
struct State {
    hands: Vec<Hand>,
    files: Vec<(String, File)>,
    serial: u64,
    /// The latest wish.
    wish: Option<Wish>,
    /// What workers are to draw of it as soon as they can.
    next: [Option<Part>; COUNT],
    events: Vec<Event>,
    /// The wish and the kind of the last picture of each side that was taken.
    taken: [(u64, bool); 2],
    /// Whether a GPU drew the last whole picture.
    by_gpu: bool,
    /// What is being opened.
    opening: Option<(String, Opening)>,
    question: u64,
    answers: Vec<Answer>,
    /// What went wrong last, which two workers may notice.
    failed: Option<(u64, String)>,
}

impl Hands {
    /// Starts the workers, which run `module`.
    ///
    /// # Errors
    /// If the browser has none.
    pub fn start(context: &egui::Context, module: &JsValue) -> std::io::Result<Rc<Self>> {
        let state = RefCell::default();
        let hands = Rc::new(Self { state, context: context.clone(), module: module.clone() });
        for index in 0..COUNT {
            let hand = hands.hired(index)?;
            hands.state.borrow_mut().hands.push(hand);
        }
        hands.order(1, &Order::Gpu);
        Ok(hands)
    }

    /// Starts a worker.
    fn hired(self: &Rc<Self>, index: usize) -> std::io::Result<Hand> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        let failed = |_| std::io::Error::other("the browser starts no worker");
        let worker = Worker::new_with_options(SCRIPT, &options).map_err(failed)?;
        let own = Rc::downgrade(self);
        let heard = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
            let Some(own) = own.upgrade() else { return };
            let report = received(event.data());
            // What is being done can wait: drawing windows may take time from it.
            let waits = matches!(report, Ok(Report::Doing(_) | Report::Done(_)));
            match report {
                Ok(report) => own.hear(index, report),
                Err(why) => own.state.borrow_mut().events.push(Event::FellBack(why)),
            }
            own.go_on();
            own.context.request_repaint_after(if waits { SOON } else { Duration::ZERO });
        });
        worker.set_onmessage(Some(heard.as_ref().unchecked_ref()));
        let own = Rc::downgrade(self);
        let ended = Closure::<dyn FnMut(ErrorEvent)>::new(move |event: ErrorEvent| {
            if let Some(own) = own.upgrade() {
                own.mourn(index, &event.message());
                own.context.request_repaint();
            }
        });
        worker.set_onerror(Some(ended.as_ref().unchecked_ref()));
        worker.post_message(&self.module).map_err(failed)?;
        Ok(Hand {
            worker,
            _heard: heard,
            _ended: ended,
            given: 0,
            done: 0,
            draws: false,
            doing: None,
            gpu: None,
        })
    }

    /// Ends a worker with whatever it does, and starts another one.
    fn replace(self: &Rc<Self>, index: usize) {
        let Ok(hand) = self.hired(index) else { return };
        let files = {
            let mut state = self.state.borrow_mut();
            std::mem::replace(&mut state.hands[index], hand).worker.terminate();
            state.files.clone()
        };
        self.give_files(index, &files);
        if index == 1 {
            self.order(1, &Order::Gpu);
        }
    }

    /// Puts another worker in the place of one that has ended by itself, as for lack of memory. What it
    /// did is not tried again.
    fn mourn(self: &Rc<Self>, index: usize, why: &str) {
        {
            let mut state = self.state.borrow_mut();
            let (serial, line) = (state.serial, why.lines().next().unwrap_or_default());
            let why = format!("what draws in this page has ended: {line}");
            let loading = state.hands[index].doing.as_ref().is_some_and(|one| one.share.is_none());
            state.next[index] = None;
            if let Some((input, opening)) = state.opening.take_if(|_| index == 0) {
                opening.opened(input, Err(why));
            } else {
                state.events.push(Event::Failed { serial, why, loading });
            }
        }
        self.replace(index);
    }

    /// Gives an order to a worker.
    pub fn order(&self, index: usize, order: &Order) {
        self.send(index, order, &[]);
    }

    fn send(&self, index: usize, order: &Order, parts: &[JsValue]) {
        let mut state = self.state.borrow_mut();
        let sent = packed(order, parts);
        let hand = &mut state.hands[index];
        let sent = sent.and_then(|message: Array| {
            hand.worker.post_message(&message).map_err(|error| format!("{error:?}"))
        });
        match sent {
            Ok(()) => hand.given += 1,
            Err(why) => state.events.push(Event::FellBack(why)),
        }
    }

    /// Whether a worker has something to do.
    pub fn is_at_work(&self, index: usize) -> bool {
        self.state.borrow().hands.get(index).is_some_and(|hand| hand.done < hand.given)
    }

    /// Lets all workers read files by their names.
    pub fn mount(&self, files: &[(String, File)]) {
        {
            let mut state = self.state.borrow_mut();
            state.files.retain(|(name, _)| files.iter().all(|(other, _)| other != name));
            state.files.extend_from_slice(files);
        }
        for index in 0..COUNT {
            self.give_files(index, files);
        }
    }

    fn give_files(&self, index: usize, files: &[(String, File)]) {
        if files.is_empty() {
            return;
        }
        let names = files.iter().map(|(name, _)| name.clone()).collect();
        let parts: Vec<JsValue> = files.iter().map(|(_, file)| file.clone().into()).collect();
        self.send(index, &Order::Mount(names), &parts);
    }

    /// Opens what a name stands for.
    pub fn open(&self, input: &str, opening: &Opening) {
        self.state.borrow_mut().opening = Some((input.to_owned(), opening.clone()));
        self.order(0, &Order::Open(input.to_owned()));
    }

    /// The number of the latest wish.
    pub fn serial(&self) -> u64 {
        self.state.borrow().serial
    }

    /// Asks for pictures.
    pub fn wish(&self, wish: Wish) -> u64 {
        let serial = {
            let mut state = self.state.borrow_mut();
            state.serial += 1;
            let gpu = state.hands[1].gpu.as_ref();
            let allowed = gpu.is_some_and(|(_, is_hardware)| match wish.device {
                Device::Auto => *is_hardware,
                Device::Gpu => true,
                Device::Cpu => false,
            });
            let rests = wish.motion == Motion::Rest;
            state.next = if allowed && state.by_gpu {
                [None, Some(Part::All)]
            } else {
                [Some(Part::Hurried), rests.then_some(Part::Whole)]
            };
            state.wish = Some(wish);
            state.serial
        };
        self.go_on();
        serial
    }

    /// Orders what waits for workers. A worker that computes hears nothing, so it is not told what may
    /// be old by then; one with a GPU hears, and gives up what is old.
    fn go_on(&self) {
        for index in 0..COUNT {
            let order = {
                let mut state = self.state.borrow_mut();
                let hand = &state.hands[index];
                let free = !hand.draws || (state.by_gpu && hand.gpu.is_some());
                let (serial, wish) = (state.serial, state.wish.clone());
                if !free {
                    continue;
                }
                let Some((part, wish)) = state.next[index].take().zip(wish) else { continue };
                state.hands[index].draws = true;
                Order::Wish { serial, wish: Box::new(wish), part }
            };
            self.order(index, &order);
        }
    }

    /// Gives up everything.
    pub fn cancel(self: &Rc<Self>) {
        {
            let mut state = self.state.borrow_mut();
            state.serial += 1;
            state.next = [None; COUNT];
            (state.wish, state.opening) = (None, None);
        }
        for index in 0..COUNT {
            if !self.is_at_work(index) {
                continue;
            }
            let hears = {
                let state = self.state.borrow();
                state.by_gpu && state.hands[index].gpu.is_some()
            };
            if hears {
                self.order(index, &Order::GiveUp);
            } else {
                self.replace(index);
            }
        }
    }

    /// What is being done.
    pub fn doing(&self) -> Option<Doing> {
        let state = self.state.borrow();
        // Whole pictures take longest.
        let mut all = state.hands.iter().rev().filter(|hand| hand.done < hand.given);
        all.find_map(|hand| hand.doing.clone())
    }

    /// Whether nothing is left to be done.
    pub fn is_idle(&self) -> bool {
        let state = self.state.borrow();
        let still = state.next.iter().all(Option::is_none) && state.opening.is_none();
        let draws = state.hands.iter().any(|hand| hand.draws);
        still && state.events.is_empty() && !draws
    }

    /// What has happened since the last call.
    pub fn events(&self) -> Vec<Event> {
        std::mem::take(&mut self.state.borrow_mut().events)
    }

    /// The number of another question.
    pub fn next_question(&self) -> u64 {
        let mut state = self.state.borrow_mut();
        state.question += 1;
        state.answers.clear();
        state.question
    }

    /// Answers to the latest question.
    pub fn answers(&self) -> Vec<Answer> {
        std::mem::take(&mut self.state.borrow_mut().answers)
    }

    /// The GPU, if a worker has one.
    pub fn gpu(&self) -> Option<(String, bool)> {
        self.state.borrow().hands.get(1).and_then(|hand| hand.gpu.clone())
    }
}
