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
}

impl Cause {
    /// All causes, in the order of their numbers on the wire.
    pub const ALL: [Self; 6] = [
        Self::Deadband,
        Self::Timer,
        Self::MasterOnlyContact,
        Self::SlaveOnlyContact,
        Self::ContactLost,
        Self::EverySample,
    ];

    /// Its number on the wire and its place in [`Cause::ALL`].
    #[must_use]
    pub const fn number(self) -> usize {
        self as usize
    }

    /// The name used in reports, files and on screens.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Deadband => "deadband",
            Self::Timer => "timer",
            Self::MasterOnlyContact => "master_only_contact",
            Self::SlaveOnlyContact => "slave_only_contact",
            Self::ContactLost => "contact_lost",
            Self::EverySample => "every_sample",
        }
    }
}

/// What an update says: the whole state at one HIP sample, so that it supersedes all earlier ones.
///
/// Off the wire comes a [`RawUpdate`](crate::wire::RawUpdate); only its `accept` makes one of these.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Update {
    /// Number of the update, from 1, strictly increasing.
    pub sequence: u32,
    /// Why it was sent.
    pub cause: Cause,
    /// Stamp of the HIP sample that it answers, by the master's clock.
    pub answers: Time,
    /// Number of the newest command that the slave has seen.
    pub newest_command: u32,
    /// Whether the slave's tool touches the object.
    pub slave_in_contact: bool,
    /// Parameters, footprint, pose and velocity of the object at that sample.
    pub state: ModelState,
}
