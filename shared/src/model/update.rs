//! An update of the model: the whole state at one HIP sample, and why it was sent.

use serde::{Deserialize, Serialize};

use crate::model::params::ModelState;
use crate::time::Time;

/// Why an update was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// (12): the force error left the deadband.
    Deadband,
    /// T_update passed since the last update.
    Timer,
    /// Section III-A, case 1: the master touches, the slave does not.
    MasterOnlyContact,
    /// Section III-A, case 2: the slave touches, the master does not.
    SlaveOnlyContact,
    /// The slave lost contact.
    ContactLost,
    /// The scheme sends every sample.
    EverySample,
    /// Nobody touches the object, and it is not where the model has it, or not held as there.
    Elsewhere,
}

impl Cause {
    /// All causes, in the order of their numbers on the wire.
    pub const ALL: [Self; 7] = [
        Self::Deadband,
        Self::Timer,
        Self::MasterOnlyContact,
        Self::SlaveOnlyContact,
        Self::ContactLost,
        Self::EverySample,
        Self::Elsewhere,
    ];

    /// Its number on the wire and its place in [`Cause::ALL`].
    pub const fn number(self) -> usize {
        self as usize
    }

    /// The name used in reports, files and on screens.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deadband => "deadband",
            Self::Timer => "timer",
            Self::MasterOnlyContact => "master_only_contact",
            Self::SlaveOnlyContact => "slave_only_contact",
            Self::ContactLost => "contact_lost",
            Self::EverySample => "every_sample",
            Self::Elsewhere => "elsewhere",
        }
    }
}

/// The whole state of the model at one moment, so that it supersedes all earlier ones.
///
/// Off the wire its state is a [`RawState`](crate::wire::RawState): only `accept` makes a [`ModelState`] of that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Update<S = ModelState> {
    /// Number of the update, from 1, strictly increasing.
    pub sequence: u32,
    /// Why it was sent.
    pub cause: Cause,
    /// The moment that it answers, by the master's clock: what the slave played, between two HIP samples as a rule.
    pub answers: Time,
    /// Whether the slave's tool touches the object.
    pub slave_in_contact: bool,
    /// Parameters, footprint, pose and velocity of the object at that moment.
    pub state: S,
}

impl<S> Update<S> {
    /// The same update with its state in another form.
    pub(crate) fn with_state<T>(&self, state: T) -> Update<T> {
        Update {
            sequence: self.sequence,
            cause: self.cause,
            answers: self.answers,
            slave_in_contact: self.slave_in_contact,
            state,
        }
    }
}
