//! All who look on: how many may, and what there is to be seen.
//!
//! An observer holds no lease, so that it keeps nobody from operating. What it is shown the session's task leaves here; nothing of
//! an observer reaches the 1 kHz loop.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::wish::{Wish, asked_to_stop};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::pairing::Token;
use mmt_shared::wire::{Refusal, Welcome};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::timeout;

use crate::feed::ObserverView;

/// How long the observers' farewells may take together when the host ends.
const END_WAIT: Duration = Duration::from_secs(2);
/// The secret in an observer's welcome: it has nothing to resume.
pub(super) const NO_RESUME: Token = Token::new([0; 32]);

/// All observers of a host, and what they see.
#[derive(Debug)]
pub(super) struct Observers {
    clock: Clock,
    most: u8,
    places: Arc<Semaphore>,
    emergency: EmergencyStop,
    /// As the newest session began.
    welcome: Mutex<Welcome>,
    view: watch::Sender<ObserverView>,
    ending: watch::Sender<Wish>,
    commands_refused: AtomicU64,
}

impl Observers {
    /// Places for `most` observers, who are welcomed with this until a session begins.
    pub(super) fn new(most: u8, clock: Clock, emergency: EmergencyStop, welcome: Welcome) -> Self {
        Self {
            clock,
            most,
            places: Arc::new(Semaphore::new(most.into())),
            emergency,
            welcome: Mutex::new(welcome),
            view: watch::Sender::default(),
            ending: watch::Sender::default(),
            commands_refused: AtomicU64::new(0),
        }
    }

    /// A place for one more.
    ///
    /// # Errors
    /// The host admits none, or no more.
    pub(super) fn enter(&self) -> Result<OwnedSemaphorePermit, Refusal> {
        if self.most == 0 {
            return Err(Refusal::WrongRole);
        }
        if self.ending.borrow().ends() {
            return Err(Refusal::Ending);
        }
        let place = Arc::clone(&self.places).try_acquire_owned();
        place.map_err(|_| Refusal::Busy)
    }

    /// A session begins with this welcome to its operator.
    pub(super) fn session_begins(&self, welcome: &Welcome) {
        *self.welcome.lock().unwrap_or_else(PoisonError::into_inner) = *welcome;
        self.view.send_modify(|view| {
            *view = ObserverView {
                session: view.session + 1,
                ..ObserverView::default()
            };
        });
    }

    /// Shows what there is to be seen of the session now.
    pub(super) fn show(&self, seen: &ObserverView) {
        self.view.send_modify(|view| {
            *view = ObserverView {
                session: view.session,
                ..*seen
            };
        });
    }

    /// Nobody operates any more: the newest update stays.
    pub(super) fn session_over(&self) {
        self.view.send_modify(|view| {
            *view = ObserverView {
                scene: None,
                stopped: false,
                ..*view
            };
        });
    }

    /// Ends all observers with a farewell, and waits until they are gone. They learn whether this host fails.
    pub(super) async fn end(&self, wish: Wish) {
        let why = if wish.ends() { wish } else { Wish::End };
        self.ending.send_replace(why);
        // who does not answer is left alone
        let _ = timeout(END_WAIT, self.places.acquire_many(self.most.into())).await;
    }

    /// Commands that observers have sent since the host was started.
    pub(super) fn commands_refused(&self) -> u64 {
        self.commands_refused.load(Ordering::Relaxed)
    }

    /// The host's clock.
    pub(super) fn clock(&self) -> Clock {
        self.clock
    }

    /// Reports each change of what is to be seen.
    pub(super) fn views(&self) -> watch::Receiver<ObserverView> {
        self.view.subscribe()
    }

    /// Returns once all observers are to end, and why.
    pub(super) async fn ending(&self) -> Wish {
        asked_to_stop(&mut self.ending.subscribe()).await
    }

    /// Counts what an observer was refused.
    pub(super) fn refuse_commands(&self, more: u64) {
        self.commands_refused.fetch_add(more, Ordering::Relaxed);
    }

    /// The welcome of an observer with this coupling; the operator's secret stays with the operator.
    pub(super) fn welcome_for(&self, coupling: Coupling) -> Welcome {
        let welcome = *self.welcome.lock().unwrap_or_else(PoisonError::into_inner);
        Welcome {
            settings: ModelSettings {
                coupling,
                ..welcome.settings
            },
            resume: NO_RESUME,
            ..welcome
        }
    }

    /// What there is to be seen at this moment: the slave's own emergency stop outlives sessions.
    pub(super) fn view_now(&self) -> ObserverView {
        let view = *self.view.borrow();
        ObserverView {
            stopped: view.stopped || self.emergency.is_set(),
            ..view
        }
    }
}
