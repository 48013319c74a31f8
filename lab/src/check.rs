//! What must hold of every session, judged from what its ends were given and what they gave.
//!
//! Each invariant has a name, a promise, one predicate and, where it is broken, the instant and the values. The same judges read a
//! record (`mmt check`), a world in virtual time and the swarm. They compute from the contract and from bytes and ticks, and never
//! from what an end reports of itself, but for the numbers that no tick has: the update in use and the model's numbers.

mod both;
mod channel;
mod intake;
mod master;
mod record;
mod session;
mod slave;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt;

use mmt_shared::time::Time;
use serde::Serialize;

pub use both::{Both, Way};
pub use master::{MasterAbout, MasterChecks, MasterTicked};
pub use record::{CheckError, RecordChecks};
pub(crate) use session::SessionChecks;
pub use slave::{SlaveAbout, SlaveChecks, SlaveTicked};

macro_rules! invariants {
    ($($(#[$doc:meta])* $variant:ident $name:literal $promise:literal;)*) => {
        /// What must hold.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Invariant { $($(#[$doc])* $variant,)* }

        impl Invariant {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Its name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What is promised, in one line.
            #[must_use]
            pub const fn promise(self) -> &'static str {
                match self { $(Self::$variant => $promise,)* }
            }
        }
    };
}

invariants! {
    /// F_max and the ramps.
    ForceCap "force-cap" "the force on the hand is a number and at most F_max, times the ramp of 200 ms after engaging and releasing";
    /// S_max.
    ForceStep "force-step" "the force on the hand changes by at most S_max a tick";
    /// Released means less.
    ForceFalls "force-falls" "the force on a released hand never grows";
    /// Emergency stop at the hand.
    ForceStops "force-stops" "while an emergency stop is set the force on the hand falls by S_max a tick";
    /// Late, Stale, Released.
    LinkState "link-state" "the master shows late after 120 ms of silence either way, stale after 250 ms, released after 1 s, beyond the path";
    /// Released for good.
    Released "released-for-good" "a released link stays released";
    /// Order of updates.
    UpdateOrder "update-order" "updates are applied in increasing sequence, each of them one that arrived";
    /// Nothing while stale.
    UpdateStale "update-stale" "no update that came while the link was stale is applied";
    /// Nothing too old.
    UpdateAge "update-age" "no update is applied that answers a sample of longer ago than the path and 750 ms";
    /// Good updates count.
    UpdateTaken "update-taken" "an accepted update that came while the link was not stale is in use in the next tick";
    /// Numbers of the model.
    ModelAccepted "model-accepted" "the parameters in use are finite and within m 0.05-50 kg, b 0-200 N s/m, c 0-200 N";
    /// Energy from updates.
    EnergyPaid "energy-paid" "updates add no energy to the model that dissipation has not paid, in recommended mode and until the device jumps";
    /// Acknowledgements.
    Acknowledged "acknowledged" "a command acknowledges the newest accepted update and nothing else";
    /// The samples sent.
    SamplesTrue "samples-true" "a command's samples are those of the ticks: HIP as used, force as rendered";
    /// Numbers and stamps.
    Numbers "numbers" "datagrams are numbered one by one, stamped with when they leave, and carry the sender's emergency stop";
    /// Echoes.
    EchoTrue "echo-true" "an echo names the newest datagram that arrived, when it was sent, and how many arrived";
    /// Heartbeat.
    Heartbeat "heartbeat" "something leaves each end every 50 ms";
    /// Speed.
    ToolSpeed "tool-speed" "the tool is no faster than its limit";
    /// Acceleration.
    ToolAcceleration "tool-acceleration" "in free space the tool has no greater acceleration than its limit, also where it stops";
    /// Workspace.
    ToolReach "tool-reach" "the tool stays within its reach";
    /// Force of the tool.
    ToolForce "tool-force" "the tool presses with no more than its limit, where the contact is as stiff as the session knows it";
    /// Hold.
    ToolHolds "tool-holds" "the tool stands once no new sample has come for the play-out delay, 30 ms and the ramp to a stop";
    /// Disengaged.
    ToolDisengaged "tool-disengaged" "after 2 s without a new sample the tool brakes to a stop, and nothing moves it in this session";
    /// Emergency stop at the tool.
    ToolStops "tool-stops" "while an emergency stop is set the tool brakes to a stop and stands, or gives way";
    /// Order of play-out.
    PlaysInOrder "plays-in-order" "the stamps that are played never go back, and no further ahead of the samples than a second";
    /// f_m is the master's.
    PlaysTrue "plays-true" "the force taken for f_m is the one that came with the sample, or between two of them";
    /// Updates as made.
    UpdateTrue "update-true" "an update leaves as it was made, numbered one by one; repeats are copies of the newest";
    /// Cause of an update.
    UpdateCause "update-cause" "an update answers the tick's sample, and its cause fits the contact, unless it repeats a lost one";
    /// The trigger.
    TriggerFires "trigger-fires" "an update of cause deadband leaves only where (12) is violated, one of cause timer only after T_update; where a scheme asks for no more, it leaves then";
    /// Shadow.
    ShadowConfirmed "shadow-confirmed" "the slave takes for confirmed only what it sent and a command acknowledged";
    /// The network invents nothing.
    ArrivedWasSent "arrived-was-sent" "a datagram that arrives is bit for bit one that left under that number";
    /// Counters.
    CountersBalance "counters-balance" "what was sent was received, dropped under a name or lost; each update and sample that arrived was used or dropped under a name";
    /// One operator.
    OneOperator "one-operator" "sessions of a slave follow one another";
    /// Determinism.
    SameBits "same-bits" "the recorded inputs give the recorded bits";
}

impl fmt::Display for Invariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Where an invariant was broken first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Violation {
    /// Since the beginning of the session, s.
    pub at_s: f64,
    /// The values.
    pub values: String,
}

/// How often an invariant was looked at and broken.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Judged {
    /// How often it was looked at.
    pub checked: u64,
    /// How often it did not hold.
    pub broken: u64,
    /// Where it did not hold first.
    pub first: Option<Violation>,
}

/// What was found of one session, or of several together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    began: Time,
    of: BTreeMap<Invariant, Judged>,
}

impl Verdict {
    /// Of a session that began then, by the clock of its end.
    #[must_use]
    pub fn since(began: Time) -> Self {
        let of = BTreeMap::new();
        Self { began, of }
    }

    /// Looks at an invariant once; `values` are for people.
    pub fn judge(
        &mut self,
        invariant: Invariant,
        at: Time,
        holds: bool,
        values: impl FnOnce() -> String,
    ) {
        let began = self.began;
        let judged = self.of.entry(invariant).or_default();
        judged.checked += 1;
        if !holds {
            judged.broken += 1;
            judged.first.get_or_insert_with(|| Violation {
                at_s: at.saturating_since(began).as_secs_f64(),
                values: values(),
            });
        }
    }

    /// Whether all that was looked at holds.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.of.values().all(|judged| judged.broken == 0)
    }

    /// Each invariant that was looked at, with what was found.
    pub fn judged(&self) -> impl Iterator<Item = (Invariant, &Judged)> {
        self.of
            .iter()
            .map(|(invariant, judged)| (*invariant, judged))
    }

    /// The invariants that are broken, with where first.
    pub fn broken(&self) -> impl Iterator<Item = (Invariant, &Violation)> {
        self.judged()
            .filter_map(|(invariant, judged)| Some((invariant, judged.first.as_ref()?)))
    }

    /// Adds what was found of another session.
    pub fn add(&mut self, other: Self) {
        for (invariant, judged) in other.of {
            let sum = self.of.entry(invariant).or_default();
            sum.checked += judged.checked;
            sum.broken += judged.broken;
            sum.first = sum.first.take().or(judged.first);
        }
    }
}

impl fmt::Display for Verdict {
    /// The broken ones, one a line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, (invariant, Violation { at_s, values })) in self.broken().enumerate() {
            let gap = if n == 0 { "" } else { "\n" };
            write!(f, "{gap}{invariant} broken at {at_s:.3} s: {values}")?;
        }
        Ok(())
    }
}
