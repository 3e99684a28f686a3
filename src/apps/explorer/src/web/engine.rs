//! What the window asks for pictures: the workers.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use eframe::egui;
use wasm_bindgen::JsValue;

use super::Screen;
use super::hands::Hands;
use crate::engine::{Doing, Event, Wish};
use crate::explorer::Opening;

thread_local! {
    /// The program, compiled, for the workers.
    static MODULE: RefCell<JsValue> = const { RefCell::new(JsValue::NULL) };
    /// The workers, for what people choose.
    static HANDS: RefCell<Option<Rc<Hands>>> = const { RefCell::new(None) };
}

/// Keeps the compiled program.
pub(super) fn keep_module(module: JsValue) {
    MODULE.set(module);
}

/// The workers of the page.
pub(super) fn hands() -> Option<Rc<Hands>> {
    HANDS.with_borrow(Clone::clone)
}

/// The way to the workers.
pub struct Engine {
    hands: Rc<Hands>,
    last: Option<Wish>,
}

impl Engine {
    /// Starts them; `context` is asked to repaint when something has happened.
    ///
    /// # Errors
    /// If the browser has no workers.
    pub fn start(_screen: Option<&Screen>, context: &egui::Context) -> std::io::Result<Self> {
        let hands = MODULE.with_borrow(|module| Hands::start(context, module))?;
        HANDS.set(Some(hands.clone()));
        Ok(Self { hands, last: None })
    }

    /// The workers.
    pub(super) fn hands(&self) -> Rc<Hands> {
        self.hands.clone()
    }

    /// Opens a document in a worker.
    ///
    /// # Errors
    /// None.
    pub fn open(&self, input: &str, opening: &Opening) -> std::io::Result<()> {
        self.hands.open(input, opening);
        Ok(())
    }

    /// Asks for a picture; returns the number of the wish. The same wish again is the same wish.
    pub fn wish(&mut self, wish: Wish) -> u64 {
        if self.last.as_ref() == Some(&wish) {
            return self.hands.serial();
        }
        self.last = Some(wish.clone());
        self.hands.wish(wish)
    }

    /// The number of the latest wish.
    pub fn last_wish(&self) -> u64 {
        self.hands.serial()
    }

    /// Gives up what is being drawn or loaded.
    pub fn cancel(&mut self) {
        self.last = None;
        self.hands.cancel();
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
        self.hands.events()
    }

    /// Nothing: a page must not wait.
    pub fn wait_for(&self, _serial: u64, _most: Duration) -> Vec<Event> {
        Vec::new()
    }

    /// What is being done.
    pub fn doing(&self) -> Option<Doing> {
        self.hands.doing()
    }

    /// Whether everything that was wished for is done.
    pub fn is_idle(&self) -> bool {
        self.hands.is_idle()
    }
}
