//! What comes back from workers.

use deepshadow::image::Tone;

use super::super::pane::show_early;
use super::super::port::{Order, Report};
use super::{Hands, State};
use crate::engine::{Event, Picture};

impl Hands {
    /// Takes what a worker tells.
    pub(super) fn hear(&self, index: usize, report: Report) {
        match report {
            Report::Event(event) => self.hear_event(index, event),
            Report::Opened(input, document) => {
                let opening = {
                    let mut state = self.state.borrow_mut();
                    state.opening.take_if(|(name, _)| *name == input)
                };
                if let Some((_, opening)) = opening {
                    opening.opened(input, document.map(|document| document.numbered_anew()));
                }
            }
            Report::Doing(doing) => self.state.borrow_mut().hands[index].doing = doing,
            Report::Answer(number, answer) => {
                let mut state = self.state.borrow_mut();
                if number == state.question {
                    state.answers.push(answer);
                }
            }
            Report::Gpu(found) => self.state.borrow_mut().hands[index].gpu = found.ok(),
            Report::Done(orders) => {
                let mut state = self.state.borrow_mut();
                let hand = &mut state.hands[index];
                hand.done = orders;
                if hand.done == hand.given {
                    (hand.draws, hand.doing) = (false, None);
                }
            }
        }
    }

    fn hear_event(&self, index: usize, event: Event) {
        let tone = {
            let mut state = self.state.borrow_mut();
            match &event {
                Event::Picture(picture) => {
                    if !state.wants(picture) {
                        return;
                    }
                    if picture.side == 0 {
                        show_early(picture);
                    }
                    if picture.whole {
                        state.by_gpu = index == 1 && picture.device.starts_with("gpu");
                    }
                }
                // Both load what they draw.
                Event::Loaded { .. } if index != state.loads() => return,
                Event::Failed { serial, why, .. } => {
                    let failed = (*serial, why.clone());
                    if state.failed.as_ref() == Some(&failed) {
                        return;
                    }
                    state.failed = Some(failed);
                }
                _ => {}
            }
            let tone = match &event {
                Event::Picture(picture) => picture.whole.then_some((picture.side, picture.tone)),
                _ => None,
            };
            state.events.push(event);
            tone.filter(|_| index == 1)
        };
        if let Some((side, tone)) = tone {
            self.tell_tone(side, tone);
        }
    }

    /// Lets pictures in a hurry be shown as the whole one was.
    fn tell_tone(&self, side: usize, tone: Tone) {
        self.order(0, &Order::Tone(side, tone));
    }
}

impl State {
    /// Whether a picture is newer than the last one of its side. A whole picture of what was wished for
    /// before the last move is old.
    fn wants(&mut self, picture: &Picture) -> bool {
        let Some(taken) = self.taken.get_mut(picture.side) else { return false };
        let own = (picture.serial, picture.whole);
        let old = own < *taken || (picture.whole && picture.serial != self.serial);
        if !old {
            *taken = own;
        }
        !old
    }

    /// The worker that loads first.
    fn loads(&self) -> usize {
        usize::from(self.by_gpu)
    }
}
