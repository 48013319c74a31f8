//! Looking at a run: a dashboard on a terminal, plain lines elsewhere. Shows snapshots; computes nothing
//! that a report would hold.

mod dashboard;
mod history;
mod keys;
mod lines;
mod panels;
mod scene;
mod screen;

use mmt_client::failsafe::LinkState;
use mmt_client::io::MasterLive;
use mmt_client::observer::ObserverLive;
use mmt_server::io::SlaveLive;
use mmt_shared::channel::peer::Loss;
use mmt_shared::model::tool::Scene;
use mmt_shared::model::update::Cause;
use mmt_shared::wire::ToolState;

pub(crate) use dashboard::render;
pub(crate) use history::History;
pub(crate) use keys::{Keyboard, Wish};
pub(crate) use lines::line;
pub(crate) use screen::{Screen, restore_terminal};

/// What does not change during a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Caption {
    /// The command.
    pub(crate) command: &'static str,
    /// How long it runs, s; none if until somebody ends it.
    pub(crate) duration_s: Option<f64>,
    /// Mode, scheme, network in words.
    pub(crate) setting: String,
    /// The slave that the master connects to, as HOST:PORT; empty where there is none.
    pub(crate) slave: String,
    /// True m, b, c where this process has them.
    pub(crate) truth: Option<[f64; 3]>,
}

/// Both sides at one moment, as far as this process has them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Snapshot {
    /// The slave.
    pub(crate) slave: Option<SlaveLive>,
    /// The master.
    pub(crate) master: Option<MasterLive>,
    /// An observer: then neither of the two is here.
    pub(crate) observer: Option<ObserverLive>,
    /// For how long the master or the observer has tried to connect, s; none once its session has begun.
    pub(crate) connecting_s: Option<f64>,
}

/// What of a direction's datagrams does not arrive.
struct Missing {
    /// Share, 0 to 1: of what the sender sent where its own count is known, else of what it numbered.
    share: Option<f64>,
    /// Datagrams that the sender itself overtook or could not send, where this process counts them.
    unsent: Option<u64>,
}

impl Missing {
    /// The share's name: a loss of the path only where the sender's own part is known.
    fn name(&self) -> &'static str {
        if self.unsent.is_some() {
            "loss"
        } else {
            "missing"
        }
    }
}

impl Snapshot {
    /// Seconds since the session began.
    pub(crate) fn elapsed_s(&self) -> f64 {
        let master = self.master.map(|master| master.elapsed_s);
        let slave = self.slave.map(|slave| slave.elapsed_s);
        let observer = self.observer.map(|observer| observer.elapsed_s);
        master.or(slave).or(observer).unwrap_or(0.0)
    }

    /// The remote scene as it last came.
    fn scene(&self) -> Option<Scene> {
        let observed = self.observer.and_then(|observer| observer.scene);
        self.master.and_then(|master| master.scene).or(observed)
    }

    /// How old it is, s.
    fn scene_age_s(&self) -> Option<f64> {
        let observed = self.observer.and_then(|observer| observer.scene_age_s);
        let master = self.master.and_then(|master| master.scene_age_s);
        master.or(observed)
    }

    /// |f_s|, N; where the slave is not here that of the newest scene, which is as old as the scene.
    fn f_s(&self) -> Option<f64> {
        let here = self.slave.map(|slave| slave.f_s);
        here.or(self.scene().map(|scene| scene.force))
            .map(|f_s| f_s.norm())
    }

    /// |f_m|, N: as the master renders it, or else as the slave's shadow computes it.
    fn f_m(&self) -> Option<f64> {
        let shadow = self.slave.map(|slave| slave.f_shadow.norm());
        self.master.map(|master| master.f_m.norm()).or(shadow)
    }

    /// |f_s − f_m|, N, both of the same HIP sample: what the slave's trigger sees.
    fn error(&self) -> Option<f64> {
        self.slave.map(|slave| (slave.f_s - slave.f_shadow).norm())
    }

    /// Updates sent, by cause; applied, where only the master is here; taken by an observer.
    fn updates(&self) -> Option<[u64; Cause::ALL.len()]> {
        let applied = self.master.map(|master| master.updates_applied);
        let taken = self.observer.map(|observer| observer.updates);
        let sent = self.slave.map(|slave| slave.updates);
        sent.or(applied).or(taken)
    }

    /// m, b, c in use at the master; of an observer those of the newest update.
    fn params(&self) -> Option<[f64; 3]> {
        let taken = self.observer.map(|observer| observer.params);
        self.master.map(|master| master.params).or(taken)
    }

    /// The link as the master or the observer sees it.
    fn link(&self) -> Option<LinkState> {
        let observed = self.observer.map(|observer| observer.link);
        self.master.map(|master| master.link).or(observed)
    }

    /// Median round trip, ms.
    fn rtt_ms(&self) -> Option<f64> {
        let slave = self.slave.and_then(|slave| slave.rtt_ms);
        let observer = self.observer.and_then(|observer| observer.rtt_ms);
        let master = self.master.and_then(|master| master.rtt_ms);
        master.or(slave).or(observer)
    }

    /// Both sides, of which the master began to connect `tried_s` (s) ago.
    pub(crate) fn new(slave: Option<SlaveLive>, master: Option<MasterLive>, tried_s: f64) -> Self {
        let connects = |master: MasterLive| master.footprint.is_none() && master.ended.is_none();
        Self {
            slave,
            master,
            observer: None,
            connecting_s: master.filter(|master| connects(*master)).map(|_| tried_s),
        }
    }

    /// What an observer sees, who began to connect `tried_s` (s) ago.
    pub(crate) fn of_observer(observer: ObserverLive, tried_s: f64) -> Self {
        Self {
            observer: Some(observer),
            connecting_s: observer.footprint.is_none().then_some(tried_s),
            ..Self::default()
        }
    }

    /// Whose emergency stop is set, in words; none if neither's. An observer does not learn whose.
    fn stopped(&self) -> Option<String> {
        if self.observer.is_some_and(|observer| observer.stopped) {
            return Some("EMERGENCY STOP".to_owned());
        }
        let master = self.master.and_then(|master| master.stopped_by);
        let side = master.or(self.slave.and_then(|slave| slave.stopped_by));
        side.map(|side| format!("EMERGENCY STOP ({})", side.name()))
    }

    /// What keeps the tool from the HIP, in words, as the master received it; none if nothing does.
    fn tool_holds(&self) -> Option<&'static str> {
        let master = self.master?;
        match (master.tool_state, master.tool_energy_holds) {
            (ToolState::Hold, _) => Some("tool on hold: it gets no samples"),
            (ToolState::Disengaged, _) => Some("tool disengaged"),
            (ToolState::Nominal, true) => Some("tool held by its energy"),
            (ToolState::Nominal, false) => None,
        }
    }

    /// What does not arrive, up and down.
    fn missing(&self) -> [Missing; 2] {
        let (master, slave, observer) = (self.master, self.slave, self.observer);
        let up = (master.map(|m| m.up)).or_else(|| slave.map(|s| s.up));
        let up = up.or(observer.map(|o| o.up));
        let unsent = [master.map(|m| m.unsent), slave.map(|s| s.unsent)];
        let down = master.map(|m| m.down.on_the_path(unsent[1].unwrap_or(0), 0));
        let down = down.or(observer.map(|o| o.down));
        let of = |(counted, unsent): (Option<Loss>, Option<u64>)| Missing {
            share: counted.and_then(|counted| counted.share()),
            unsent,
        };
        [(up, unsent[0]), (down, unsent[1])].map(of)
    }
}

#[cfg(test)]
mod tests;
