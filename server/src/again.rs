//! The slave's end of a recorded session, run again: the same inputs give the same bits.
//!
//! Pure. What the end is made of is written into the record and read back from it here, in one place. The hello is kept as
//! it was on the wire, but for its token, which is zero, and its claim: no record holds a secret.

use mmt_shared::pairing::{SECRET_BYTES, Token};
use mmt_shared::plug::{PlugHead, PlugToken};
use mmt_shared::record::again::{EndAgain, TickInput};
use mmt_shared::record::digest::RunDigest;
use mmt_shared::record::messages::{Arrival, Session, SlaveTick};
use mmt_shared::time::Time;
use mmt_shared::wire::{Claim, DecodeError, Hello, HelloError, Side, StreamMessage};
use serde::{Deserialize, Serialize};

use crate::end::{SlaveEnd, SlaveGiven};
use crate::plant::PlantAnswer;
use crate::slave::{Memory, SlaveConfig, SlaveError, SlaveTick as Done};

/// Why a recorded session cannot be run again.
#[derive(Debug, thiserror::Error)]
pub enum SlaveAgainError {
    /// The hello cannot be read.
    #[error("its hello: {0}")]
    Unreadable(#[from] DecodeError),
    /// Something else than a hello.
    #[error("it has no hello")]
    NoHello,
    /// The hello's numbers are not accepted.
    #[error("its hello: {0}")]
    Hello(#[from] HelloError),
    /// The configuration cannot be read.
    #[error("its setting: {0}")]
    Setting(#[from] serde_json::Error),
    /// The configuration is not accepted.
    #[error("its setting: {0}")]
    Slave(#[from] SlaveError),
}

/// What a session's end at the slave is made of besides the hello.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Setting {
    slave: SlaveConfig,
    /// What an earlier session left; none at the first.
    earlier: Option<Memory>,
}

/// The beginning of the record of a session that begins at `began` with `hello`, where an `earlier` one ended; stamp and
/// number come with the record.
#[must_use]
pub fn session(
    began: Time,
    config: &SlaveConfig,
    hello: &Hello,
    earlier: Option<&Memory>,
    configuration: &impl Serialize,
) -> Session {
    let hello = Hello {
        token: Token::new([0; SECRET_BYTES]),
        claim: Claim::IfFree,
        ..*hello
    };
    let setting = Setting {
        slave: config.clone(),
        earlier: earlier.cloned(),
    };
    Session::of_end(began, &StreamMessage::Hello(hello), &setting, configuration)
}

/// No record holds a secret.
const NO_TOKEN: PlugToken = PlugToken::new([0; 16]);

/// What a record has of a plant's answer.
#[must_use]
pub fn plant_bytes(answer: &PlantAnswer) -> Vec<u8> {
    answer.packet(&NO_TOKEN, &PlugHead::default()).to_vec()
}

/// What the slave's end of a session is made of.
#[derive(Clone, Debug)]
pub struct SlaveSetting {
    /// The slave.
    pub config: SlaveConfig,
    /// The master's hello, its token zero.
    pub hello: Hello,
    /// What an earlier session left; none at the first.
    pub earlier: Option<Memory>,
}

impl SlaveSetting {
    /// The setting that a record has.
    ///
    /// # Errors
    /// A part of it cannot be read or is not accepted.
    pub fn of_session(session: &Session) -> Result<Self, SlaveAgainError> {
        let StreamMessage::Hello(hello) = StreamMessage::decode(&session.opening, Side::Master)?
        else {
            return Err(SlaveAgainError::NoHello);
        };
        let Setting { slave, earlier } = serde_json::from_str(&session.setting)?;
        Ok(Self {
            config: slave,
            hello: hello.accept()?,
            earlier,
        })
    }
}

/// A recorded session at work again.
pub struct SlaveAgain {
    end: SlaveEnd,
    digest: RunDigest,
    done: Option<Done>,
    left: Vec<Vec<u8>>,
}

impl SlaveAgain {
    /// The end as it is now.
    #[must_use]
    pub fn end(&self) -> &SlaveEnd {
        &self.end
    }

    /// What the newest tick gave; none before the first sample is due.
    #[must_use]
    pub fn done(&self) -> Option<&Done> {
        self.done.as_ref()
    }

    /// The datagrams that left after it.
    pub fn left(&self) -> impl Iterator<Item = &[u8]> {
        self.left.iter().map(Vec::as_slice)
    }
}

impl EndAgain for SlaveAgain {
    const SIDE: &'static str = "slave";
    type Tick = SlaveTick;
    type Error = SlaveAgainError;

    fn try_new(session: &Session) -> Result<Self, SlaveAgainError> {
        let SlaveSetting {
            config,
            hello,
            earlier,
        } = SlaveSetting::of_session(session)?;
        let began = Time::from_nanos(session.began_ns);
        Ok(Self {
            end: SlaveEnd::of_session(began, &config, &hello, earlier.as_ref())?,
            digest: RunDigest::default(),
            done: None,
            left: Vec::new(),
        })
    }

    fn arrival(&mut self, arrival: &Arrival) {
        let at = Time::from_nanos(arrival.at_ns);
        self.end.handle_datagram(at, &arrival.datagram);
    }

    fn tick(&mut self, tick: &SlaveTick) -> u64 {
        let now = Time::from_nanos(tick.deadline_ns);
        let (anew, read) = (tick.plant_anew, PlantAnswer::read(&NO_TOKEN, &tick.plant));
        let answer = read.ok().and_then(|(_, answer)| answer);
        let given = SlaveGiven {
            stops: tick.stops,
            plant: answer.map(|answer| PlantAnswer { anew, ..answer }),
        };
        let done = self.end.tick(now, &given);
        self.digest.tick(&done);
        let value = self.digest.value();
        self.done = done;
        let (end, sent) = (&mut self.end, Time::from_nanos(tick.sent_ns));
        let poll = |out: &mut [u8]| end.poll_transmit(sent, out).ok().flatten();
        self.left = self.digest.datagrams(poll);
        value
    }

    fn input(tick: &SlaveTick) -> TickInput {
        TickInput {
            session: tick.session,
            index: tick.index,
            digest: tick.digest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::settings::Mode;

    #[test]
    fn every_number_of_a_configuration_reads_back_to_the_same_bits() {
        for mode in [Mode::Paper, Mode::Recommended] {
            let mut config = SlaveConfig::of_mode(mode);
            // a number that a parser of little care reads one bit off
            config.environment.mass_kg = 0.1 + 0.7;
            let text = serde_json::to_string(&config).unwrap();
            let again: SlaveConfig = serde_json::from_str(&text).unwrap();
            assert_eq!(again, config);
        }
    }
}
