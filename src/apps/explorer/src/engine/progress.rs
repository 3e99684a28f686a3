//! What the thread that draws and those who ask share: the latest wish, and what is being done.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use deepshadow::Result;
use deepshadow::io::SceneLoader;
use deepshadow::progress::Progress;
use deepshadow::scene::automatic::Loaded;
use web_time::Instant;

use super::Wish;
use super::devices::Features;
use crate::host;
use crate::panels::Known;

/// A piece of work, for people.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
pub struct Doing {
    /// What it is.
    pub what: String,
    /// The share of it that is done, 0..1; `None` if that is not known.
    pub share: Option<f32>,
}

/// What was loaded for a wish.
pub struct Arrival {
    /// The number of the wish.
    pub serial: u64,
    /// The scene of the wish it was loaded for.
    pub side: usize,
    /// The loader, which keeps it.
    pub loader: SceneLoader,
    /// Itself, with what there is to say of it.
    pub loaded: Result<(Loaded, Vec<String>)>,
    /// The names of the grids in each volume's file.
    pub grids: Vec<Vec<String>>,
    /// The histograms of the volumes.
    pub histograms: Vec<Known>,
}

/// The way between threads.
#[derive(Default)]
pub struct Shared {
    inbox: Mutex<Inbox>,
    arrived: Condvar,
    /// The number of the latest wish.
    pub serial: AtomicU64,
    /// The number of the latest wish that was given up.
    abandoned: AtomicU64,
    /// What is being done.
    pub doing: Mutex<Option<Doing>>,
}

#[derive(Default)]
struct Inbox {
    wish: Option<(u64, Wish)>,
    arrivals: Vec<Arrival>,
    compiled: Vec<Features>,
    given_up: bool,
    /// Whether the thread is at work, or something is being loaded.
    busy: bool,
    quit: bool,
}

/// What the thread wakes up for.
pub enum Call {
    /// A new wish.
    Wish(u64, Box<Wish>),
    /// Something was loaded.
    Arrival(Box<Arrival>),
    /// Drivers have compiled something.
    Compiled(Features),
    /// Whatever was wished for is not wanted any more.
    GivenUp,
    /// The end.
    Quit,
}

impl Inbox {
    /// The next thing to do.
    fn call(&mut self) -> Option<Call> {
        if self.quit {
            return Some(Call::Quit);
        }
        if std::mem::take(&mut self.given_up) {
            return Some(Call::GivenUp);
        }
        let compiled = self.compiled.pop().map(Call::Compiled);
        let arrival = || self.arrivals.pop().map(|arrival| Call::Arrival(Box::new(arrival)));
        let found = compiled.or_else(arrival);
        found.or_else(|| self.wish.take().map(|(serial, wish)| Call::Wish(serial, Box::new(wish))))
    }
}

impl Shared {
    /// Something to do, if there is something.
    pub fn call(&self) -> Option<Call> {
        self.with(Inbox::call)
    }

    fn with<T>(&self, change: impl FnOnce(&mut Inbox) -> T) -> T {
        let result = change(&mut self.inbox.lock().unwrap_or_else(PoisonError::into_inner));
        self.arrived.notify_all();
        result
    }

    /// Leaves a wish, in place of one that was not looked at yet.
    pub fn ask(&self, wish: Wish) -> u64 {
        self.with(|inbox| {
            let serial = self.serial.fetch_add(1, Ordering::Relaxed) + 1;
            inbox.wish = Some((serial, wish));
            serial
        })
    }

    /// Makes all work that is being done unwanted.
    pub fn give_up(&self) {
        self.with(|inbox| {
            let serial = self.serial.fetch_add(1, Ordering::Relaxed);
            self.abandoned.store(serial, Ordering::Relaxed);
            (inbox.wish, inbox.given_up) = (None, true);
        });
    }

    /// Ends the thread.
    pub fn quit(&self) {
        self.give_up();
        self.with(|inbox| inbox.quit = true);
    }

    /// Leaves what was loaded.
    pub fn arrive(&self, arrival: Arrival) {
        self.with(|inbox| inbox.arrivals.push(arrival));
    }

    /// Says that drivers have compiled something.
    pub fn compiled(&self, features: Features) {
        self.with(|inbox| inbox.compiled.push(features));
    }

    /// Whether nothing is left to be done.
    pub fn is_idle(&self) -> bool {
        self.with(|inbox| {
            inbox.wish.is_none() && inbox.arrivals.is_empty() && !inbox.given_up && !inbox.busy
        })
    }

    /// The number of the latest wish, where somebody else numbers them.
    pub fn announce(&self, serial: u64) {
        self.serial.store(serial, Ordering::Relaxed);
    }

    /// Says what is being done.
    pub fn say(&self, doing: Option<Doing>) {
        host::told(doing.as_ref());
        *self.doing.lock().unwrap_or_else(PoisonError::into_inner) = doing;
    }

    /// Waits for something to do. `loading` says whether something is still being loaded.
    pub fn next(&self, loading: bool) -> Call {
        let mut inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            inbox.busy = true;
            if let Some(call) = inbox.call() {
                return call;
            }
            inbox.busy = loading;
            inbox = self.arrived.wait(inbox).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// The progress of one picture: it measures, tells, and is cancelled when another wish has come.
pub struct Watch<'a> {
    shared: &'a Shared,
    serial: u64,
    /// Whether it ends when another wish comes; it always does when its own is given up.
    gives_up: bool,
    state: Mutex<State>,
}

struct State {
    what: String,
    since: Instant,
    spent: HashMap<String, Duration>,
    total: u64,
    done: u64,
}

impl<'a> Watch<'a> {
    /// For the wish of this number.
    pub fn new(shared: &'a Shared, serial: u64, gives_up: bool) -> Self {
        let (what, spent) = (String::new(), HashMap::new());
        let state = State { what, since: Instant::now(), spent, total: 0, done: 0 };
        Self { shared, serial, gives_up, state: Mutex::new(state) }
    }

    /// Seconds spent on some work until now.
    pub fn seconds(&self, what: &str) -> f64 {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.stop();
        state.spent.get(what).map_or(0.0, Duration::as_secs_f64)
    }

    /// Whether some work has begun.
    pub fn has_begun(&self, what: &str) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.stop();
        state.spent.contains_key(what)
    }
}

impl State {
    /// Adds the time of the work that is going on.
    fn stop(&mut self) {
        let now = Instant::now();
        if !self.what.is_empty() {
            let spent = self.spent.entry(self.what.clone()).or_default();
            *spent += now - self.since;
        }
        self.since = now;
    }
}

impl Progress for Watch<'_> {
    fn begin(&self, what: &str, total: u64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.stop();
        what.clone_into(&mut state.what);
        (state.total, state.done) = (total, 0);
        if self.gives_up {
            self.shared.say(Some(Doing { what: what.to_owned(), share: Some(0.0) }));
        }
    }

    fn advance(&self, parts: u64) {
        if !self.gives_up {
            return;
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.done += parts;
        let share = (state.done as f32 / state.total.max(1) as f32).min(1.0);
        self.shared.say(Some(Doing { what: state.what.clone(), share: Some(share) }));
    }

    fn cancelled(&self) -> bool {
        let newer = self.shared.serial.load(Ordering::Relaxed) != self.serial;
        let abandoned = self.shared.abandoned.load(Ordering::Relaxed) >= self.serial;
        abandoned || (self.gives_up && newer)
    }
}
