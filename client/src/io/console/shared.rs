//! What the console's tasks share: what is shown and who operates.

use std::sync::{Mutex, MutexGuard, PoisonError};

use axum::extract::ws::Utf8Bytes;
use mmt_shared::io::emergency::EmergencyStop;
use tokio::sync::{mpsc, watch};

use super::admission::Admission;
use super::assets::Assets;
use super::message::Order;
use crate::io::hand_events::HandEventSender;
use crate::operator::pointer::{Driver, HandEvent};

/// What a frame of the page is made of.
pub type Source = Box<dyn FnMut() -> String + Send>;

/// What is shown and who operates, under one lock that no tick ever takes.
#[derive(Default)]
pub(super) struct Stage {
    pub(super) source: Option<Source>,
    pub(super) events: Option<HandEventSender>,
    pub(super) operator: Option<u64>,
    /// Whether the script never gets the hand.
    pub(super) no_script: bool,
    /// Whether no page may do anything: there is no hand.
    pub(super) looks_on: bool,
    pub(super) viewers: usize,
    pub(super) viewers_ever: u64,
}

/// What the console's tasks share.
pub(super) struct Shared {
    pub(super) admission: Admission,
    pub(super) assets: Assets,
    pub(super) stage: Mutex<Stage>,
    /// The newest frame.
    pub(super) frame: watch::Sender<Utf8Bytes>,
    /// What changes seldom: settings, state, notes.
    pub(super) about: watch::Sender<Utf8Bytes>,
    /// Who operates.
    pub(super) operator: watch::Sender<Option<u64>>,
    pub(super) orders: mpsc::Sender<Order>,
    /// That of the sessions which are shown.
    pub(super) emergency: EmergencyStop,
}

impl Shared {
    pub(super) fn stage(&self) -> MutexGuard<'_, Stage> {
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Stage {
    pub(super) fn give(&mut self, event: HandEvent) {
        if self.no_script && event == HandEvent::Drive(Driver::Scripted) {
            return;
        }
        if let Some(events) = &mut self.events {
            events.send(event);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::hand_events::hand_events;

    #[test]
    fn where_the_script_is_refused_no_message_gives_it_the_hand() {
        let (events, mut to_loop) = hand_events(4);
        let mut stage = Stage {
            events: Some(events),
            ..Stage::default()
        };
        stage.give(HandEvent::Drive(Driver::Scripted));
        stage.no_script = true;
        stage.give(HandEvent::Drive(Driver::Scripted));
        stage.give(HandEvent::Drive(Driver::Pointer));
        stage.give(HandEvent::Pause(true));
        let given: Vec<_> = std::iter::from_fn(|| to_loop.next_event()).collect();
        assert_eq!(
            given,
            [
                HandEvent::Drive(Driver::Scripted),
                HandEvent::Drive(Driver::Pointer),
                HandEvent::Pause(true)
            ]
        );
    }
}
