//! The operator's console as a command serves it: what it shows, and what it may change.

use mmt_client::io::MasterLive;
use mmt_client::io::console::{Console, ConsoleError, NetworkWish, Order, Source};
use mmt_client::io::hand_events::HandEvents;
use mmt_client::observer::ObserverLive;
use mmt_client::operator::pointer::HandEvent;
use mmt_netem::Direction;
use mmt_netem::LinkConfig;
use mmt_netem::presets::PRESETS;
use mmt_netem::words::ParseError;
use mmt_server::io::{SlaveLive, address_for_others};
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::model::update::Cause;
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::netem::control::without_seed;
use super::netem::wrap::Emulation;
use crate::args::ConsoleArguments;
use crate::failure::{Exit, Failure};
use crate::output::note;
use crate::view::Caption;

/// Scenes a second that a console asks the slave for.
pub(super) const SCENE_HZ: u8 = 30;

/// Both sides at one moment, as the page reads them.
#[derive(Serialize)]
struct Frame {
    master: MasterLive,
    slave: Option<SlaveLive>,
}

/// What an observer sees, as the page reads it.
#[derive(Serialize)]
struct ObserverFrame {
    observer: ObserverLive,
}

fn failure(error: ConsoleError) -> Failure {
    match error {
        ConsoleError::Listen { .. } => Failure::new(Exit::Address, error)
            .remedy("give another --console address, or port 0 for any free port"),
        ConsoleError::Token(_) | ConsoleError::Thread(_) => Failure::failed(error),
    }
}

/// Of a session what the hand meets, and no more: the remote object as last seen would show the delay.
fn felt(master: &MasterLive) -> MasterLive {
    MasterLive {
        elapsed_s: master.elapsed_s,
        hip: master.hip,
        f_m: master.f_m,
        hand_force: master.hand_force,
        model: master.model,
        footprint: master.footprint,
        in_contact: master.in_contact,
        proxy: master.proxy,
        engaged: master.engaged,
        stopped_by: master.stopped_by,
        person: master.person,
        link: master.link,
        ..MasterLive::default()
    }
}

/// A console, and what it shows besides the frames.
pub(super) struct SessionConsole {
    console: Console,
    about: Map<String, Value>,
    sessions: u64,
    /// Whether whoever looks on must not learn how the session is set.
    blind: bool,
}

impl SessionConsole {
    /// Starts a console if the arguments ask for one, or if it is `wanted` without; notes its address.
    ///
    /// # Errors
    /// It cannot be served there.
    pub(super) fn start(
        arguments: &ConsoleArguments,
        wanted: bool,
        emergency: &EmergencyStop,
    ) -> Result<Option<Self>, Failure> {
        let Some(mut options) = arguments.options(wanted)? else {
            return Ok(None);
        };
        options.for_others = address_for_others();
        let console = Console::start(options, emergency.clone()).map_err(failure)?;
        note(format_args!("console: {}", console.address()));
        let causes: Vec<&str> = Cause::ALL.into_iter().map(Cause::name).collect();
        let presets: Vec<Value> = PRESETS
            .iter()
            .map(|preset| json!({"name": preset.name, "words": preset.words}))
            .collect();
        let mut about = Map::new();
        about.insert("causes".to_owned(), json!(causes));
        about.insert("presets".to_owned(), json!(presets));
        about.insert("version".to_owned(), json!(env!("CARGO_PKG_VERSION")));
        Ok(Some(Self {
            console,
            about,
            sessions: 0,
            blind: false,
        }))
    }

    /// From now on shows what the hand meets and nothing of how it is made: no setting, no network, no number of either. The
    /// hand is the person's.
    pub(super) fn blindfold(&mut self) {
        self.console.refuse_script();
        self.blind = true;
        self.about.clear();
    }

    /// What a person opens.
    pub(super) fn address(&self) -> &str {
        self.console.address()
    }

    /// What a person does in the session that begins.
    pub(super) fn events(&self) -> HandEvents {
        self.console.events()
    }

    /// Shows a session that has begun.
    pub(super) fn show(
        &mut self,
        caption: &Caption,
        mut master: impl FnMut() -> MasterLive + Send + 'static,
        mut slave: impl FnMut() -> Option<SlaveLive> + Send + 'static,
    ) {
        let blind = self.blind;
        let source = move || {
            let frame = if blind {
                let (master, slave) = (felt(&master()), None);
                Frame { master, slave }
            } else {
                let (master, slave) = (master(), slave());
                Frame { master, slave }
            };
            // numbers and names only: it cannot fail
            serde_json::to_string(&frame).unwrap_or_default()
        };
        self.begin(caption, Box::new(source));
    }

    /// Shows what an observer sees; no page may do anything.
    pub(super) fn show_observer(
        &mut self,
        caption: &Caption,
        mut observer: impl FnMut() -> ObserverLive + Send + 'static,
    ) {
        self.console.look_on();
        let source = move || {
            let observer = observer();
            // numbers and names only: it cannot fail
            serde_json::to_string(&ObserverFrame { observer }).unwrap_or_default()
        };
        self.begin(caption, Box::new(source));
        self.show_about([("observes", json!(true))]);
    }

    fn begin(&mut self, caption: &Caption, source: Source) {
        self.sessions += 1;
        let blind = self.blind;
        self.console.show(source);
        self.show_about([
            ("command", json!((!blind).then_some(caption.command))),
            ("setting", json!((!blind).then_some(&caption.setting))),
            ("truth", json!(caption.truth.filter(|_| !blind))),
            ("session", json!(self.sessions)),
            ("state", json!("running")),
            ("why", Value::Null),
            ("note", Value::Null),
        ]);
    }

    /// Shows what has changed.
    pub(super) fn show_about<const N: usize>(&mut self, changes: [(&str, Value); N]) {
        for (key, value) in changes {
            self.about.insert(key.to_owned(), value);
        }
        let about = json!({"about": self.about});
        self.console.show_about(about.to_string());
    }

    /// Shows that no session runs, and why.
    pub(super) fn show_end(&mut self, why: &str) {
        self.show_about([("state", json!("ended")), ("why", json!(why))]);
    }

    /// What a viewer asks for.
    pub(super) fn next_order(&mut self) -> Option<Order> {
        self.console.next_order()
    }

    /// Whether anybody looks on.
    pub(super) fn is_watched(&self) -> bool {
        self.console.viewers() > 0
    }

    /// Lets the session end as one whose operator has finished.
    pub(super) fn finish(&self) {
        self.console.give(HandEvent::Finish);
    }

    /// Changes these emulated networks as a viewer wishes; shows what came of it.
    pub(super) fn change_networks(
        &mut self,
        wish: &NetworkWish,
        emulation: &Emulation,
        networks: [Option<&mut LinkConfig>; 2],
    ) {
        let mut wrong = None;
        let wishes = [(Direction::Up, &wish.up), (Direction::Down, &wish.down)];
        for ((direction, words), now) in wishes.into_iter().zip(networks) {
            let (Some(words), Some(now)) = (words, now) else {
                continue;
            };
            let link = wished(words);
            match link.and_then(|link| emulation.reconfigure(direction, &link).map(|()| link)) {
                Ok(link) => *now = link,
                Err(error) => wrong = Some(error),
            }
        }
        self.show_about([("note", json!(wrong))]);
    }
}

/// What the words of a page ask of a link at work: files can be named on the command line only.
fn wished(words: &str) -> Result<LinkConfig, String> {
    let link = words.parse().map_err(|error: ParseError| error.to_string());
    link.and_then(without_seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_asks_a_link_at_work_for_no_seed() {
        assert!(wished("delay 5ms").is_ok());
        assert!(wished("delay 5ms seed 7").unwrap_err().contains("seed"));
        assert!(wished("delay 5").unwrap_err().contains("unit"));
    }
}
