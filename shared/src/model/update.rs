//! An update of the model: the whole state at one HIP sample, and why it was sent.

use serde::{Deserialize, Serialize};

use crate::model::geometry::Face;
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
    /// The face that the slave's tool touches; none where it touches nothing.
    #[serde(with = "touched_face")]
    pub touched_face: Option<Face>,
    /// Parameters, footprint, pose and velocity of the object at that moment.
    pub state: S,
}

impl<S> Update<S> {
    /// Whether the slave's tool touches the object.
    pub fn slave_in_contact(&self) -> bool {
        self.touched_face.is_some()
    }

    /// The same update with its state in another form.
    pub(crate) fn with_state<T>(&self, state: T) -> Update<T> {
        Update {
            sequence: self.sequence,
            cause: self.cause,
            answers: self.answers,
            touched_face: self.touched_face,
            state,
        }
    }
}

/// On the wire a choice: 0 nothing, 1 and on the faces in the order of [`Face::ALL`].
mod touched_face {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::model::geometry::Face;

    pub(super) fn serialize<S: Serializer>(face: &Option<Face>, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u8(face.map_or(0, |face| face as u8 + 1))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<Face>, D::Error> {
        let Some(place) = u8::deserialize(from)?.checked_sub(1) else {
            return Ok(None);
        };
        let face = Face::ALL.get(usize::from(place));
        Ok(Some(*face.ok_or_else(|| D::Error::custom("no such face"))?))
    }
}
