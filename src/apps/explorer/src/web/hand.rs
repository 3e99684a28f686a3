//! The program of a worker: it does what the page orders, and reports.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use deepshadow::gpu::{AdapterChoice, GpuBackend};
use deepshadow::io::mount;
use wasm_bindgen::prelude::Closure;
use wasm_bindgen::{JsCast, JsValue};
use wasm_bindgen_futures::spawn_local;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent};
use web_time::Instant;

use super::files::Chosen;
use super::port::{Order, Report, reported, unpacked};
use super::threads::pause;
use crate::document::Document;
use crate::engine::devices::Devices;
use crate::engine::progress::{Call, Shared};
use crate::engine::truth::{Answers, Wanted};
use crate::engine::worker::Worker;
use crate::engine::{Doing, Event, Made};

/// A worker's state.
struct Hand {
    shared: Arc<Shared>,
    worker: RefCell<Option<Worker>>,
    /// Orders that are not done.
    queue: RefCell<VecDeque<Order>>,
    /// How many orders have come.
    orders: Cell<u64>,
    /// Whether it is at work.
    running: Cell<bool>,
    /// The number of the latest question.
    question: Arc<AtomicU64>,
    answers: RefCell<Option<Answers>>,
}

thread_local! {
    /// What the last whole picture was made of, with the number of its wish.
    static MADE: RefCell<Option<(u64, Arc<Made>)>> = const { RefCell::new(None) };
    /// What was said last of what is being done, and when.
    static SAID: RefCell<Option<(Option<Doing>, Instant)>> = const { RefCell::new(None) };
    /// Whether this is a worker.
    static WORKS: Cell<bool> = const { Cell::new(false) };
}

/// Shares of work are told this often.
const TOLD: Duration = Duration::from_millis(50);

/// Begins to work.
///
/// # Errors
/// If this is no worker.
pub fn work() -> Result<(), JsValue> {
    let scope: DedicatedWorkerGlobalScope = js_sys::global().dyn_into()?;
    WORKS.set(true);
    let shared = Arc::new(Shared::default());
    let hand = Rc::new(Hand {
        worker: RefCell::new(Some(worker(&shared, Devices::new(None, false)))),
        shared,
        queue: RefCell::default(),
        orders: Cell::new(0),
        running: Cell::new(false),
        question: Arc::default(),
        answers: RefCell::default(),
    });
    let heard =
        Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
            match unpacked(event.data()) {
                Ok((order, parts)) => hand.hear(order, &parts),
                Err(why) => report(&Report::Event(Event::FellBack(why))),
            }
        });
    scope.set_onmessage(Some(heard.as_ref().unchecked_ref()));
    heard.forget();
    Ok(())
}

/// What draws on these devices.
fn worker(shared: &Arc<Shared>, devices: Devices) -> Worker {
    let tell = |event: Event| {
        if let Event::Picture(picture) = &event
            && let (Some(made), true, 0) = (&picture.made, picture.whole, picture.side)
        {
            MADE.set(Some((picture.serial, made.clone())));
        }
        report(&Report::Event(event));
    };
    Worker::new(shared.clone(), devices, Box::new(tell))
}

/// Tells the page something.
fn report(what: &Report) {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return };
    if let Ok((message, handed)) = reported(what) {
        let _ = scope.post_message_with_transfer(&message, &handed);
    }
}

/// Tells the page what is being done, unless it was told a moment ago.
pub fn told(doing: Option<&Doing>) {
    if !WORKS.get() {
        return;
    }
    let news = SAID.with_borrow(|said| match said {
        None => doing.is_some(),
        Some((last, since)) => {
            let same = last.as_ref().map(|one| &one.what) == doing.map(|one| &one.what);
            !same || (doing.is_some() && since.elapsed() > TOLD)
        }
    });
    if news {
        SAID.set(Some((doing.cloned(), Instant::now())));
        report(&Report::Doing(doing.cloned()));
    }
}

impl Hand {
    /// Takes an order. What must not wait until others are done is done at once.
    fn hear(self: &Rc<Self>, order: Order, parts: &[JsValue]) {
        self.orders.set(self.orders.get() + 1);
        let mut queue = self.queue.borrow_mut();
        match order {
            Order::Mount(names) => {
                for (name, part) in names.iter().zip(parts) {
                    if let Some(file) = part.dyn_ref::<web_sys::File>() {
                        mount(name, Chosen::new(file.clone()));
                    }
                }
            }
            Order::GiveUp => {
                queue.retain(|order| !matches!(order, Order::Wish { .. }));
                self.shared.give_up();
            }
            Order::Quiet(number) => self.question.store(number, Ordering::Relaxed),
            Order::Wish { serial, .. } => {
                queue.retain(|order| !matches!(order, Order::Wish { .. }));
                self.shared.announce(serial);
                // Whoever asks again asks about another picture.
                self.question.fetch_add(1, Ordering::Relaxed);
                queue.push_back(order);
            }
            Order::Ask { number, .. } => {
                self.question.store(number, Ordering::Relaxed);
                queue.push_back(order);
            }
            Order::Tone(..) | Order::Gpu | Order::Open(_) => queue.push_back(order),
        }
        drop(queue);
        if !self.running.replace(true) {
            let own = self.clone();
            spawn_local(async move { own.run().await });
        }
    }

    /// Does all orders.
    async fn run(&self) {
        loop {
            // Newer orders may have come that replace this one.
            pause().await;
            let next = self.queue.borrow_mut().pop_front();
            let Some(order) = next else { break };
            let taken = self.worker.borrow_mut().take();
            let Some(mut worker) = taken else { break };
            match order {
                Order::Wish { serial, wish, part } => {
                    worker.part = part;
                    worker.heed(Call::Wish(serial, wish)).await;
                }
                Order::Tone(side, tone) => {
                    if let Some(side) = worker.sides.get_mut(side) {
                        (side.tone, side.steady) = (tone, true);
                    }
                }
                Order::Open(input) => {
                    let document = Document::open(&input).map(Box::new);
                    let document = document.map_err(|error| error.to_string());
                    report(&Report::Opened(input, document));
                }
                Order::Ask { number, serial, question } => {
                    let made = MADE.with_borrow(Clone::clone);
                    if let Some((_, made)) = made.filter(|(of, _)| *of == serial) {
                        let wanted = Wanted { number, latest: self.question.clone() };
                        let tell = |answer| report(&Report::Answer(number, answer));
                        let mut answers = self.answers.take().unwrap_or_default();
                        answers.answer(&question, &made, &wanted, &tell).await;
                        self.answers.replace(Some(answers));
                    }
                }
                Order::Gpu => {
                    if let Some(found) = self.take_gpu().await {
                        worker = found;
                    }
                }
                Order::Mount(_) | Order::GiveUp | Order::Quiet(_) => {}
            }
            while let Some(call) = self.shared.call() {
                worker.heed(call).await;
            }
            *self.worker.borrow_mut() = Some(worker);
        }
        self.running.set(false);
        report(&Report::Done(self.orders.get()));
    }

    /// Takes a GPU; returns what draws on it.
    async fn take_gpu(&self) -> Option<Worker> {
        let hardware = GpuBackend::request(AdapterChoice::Hardware).await;
        let is_hardware = hardware.is_ok();
        let found = match hardware {
            Ok(gpu) => Ok(gpu),
            Err(_) => GpuBackend::request(AdapterChoice::Any).await,
        };
        match found {
            Ok(gpu) => {
                report(&Report::Gpu(Ok((gpu.description(), is_hardware))));
                Some(worker(&self.shared, Devices::new(Some(gpu), is_hardware)))
            }
            Err(error) => {
                report(&Report::Gpu(Err(error.to_string())));
                None
            }
        }
    }
}
