//! The master's end of a recorded session, run again: the same inputs give the same bits.
//!
//! Pure. What the end is made of is written into the record and read back from it here, in one place; numbers from a file
//! pass the same doors as numbers off the wire.

use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::{SECRET_BYTES, Token};
use mmt_shared::range::OutOfRange;
use mmt_shared::record::again::{EndAgain, TickInput};
use mmt_shared::record::digest::RunDigest;
use mmt_shared::record::messages::{Arrival, MasterTick, Session};
use mmt_shared::time::Time;
use mmt_shared::wire::{DecodeError, Side, StreamMessage, Welcome, WelcomeError};
use serde::{Deserialize, Serialize};

use crate::commands::CommandConfig;
use crate::end::{MasterEnd, MasterGiven};
use crate::limiter::{ForceLimiter, Limits};
use crate::master::{Master, MasterTick as Done};

/// What a session's end at the master is made of besides the welcome.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Numbers {
    architecture: Architecture,
    limits: Limits,
    commands: CommandConfig,
}

/// What the master's end of a session is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MasterSetting {
    /// When the end begins.
    pub began: Time,
    /// The slave's welcome.
    pub welcome: Welcome,
    /// Whose force the hand feels.
    pub architecture: Architecture,
    /// The device's limits.
    pub limits: Limits,
    /// How commands are made.
    pub commands: CommandConfig,
}

/// Why a recorded session cannot be run again.
#[derive(Debug, thiserror::Error)]
pub enum MasterAgainError {
    /// The welcome cannot be read.
    #[error("its welcome: {0}")]
    Unreadable(#[from] DecodeError),
    /// Something else than a welcome.
    #[error("it has no welcome")]
    NoWelcome,
    /// The welcome's numbers are not accepted.
    #[error("its welcome: {0}")]
    Welcome(#[from] WelcomeError),
    /// The rest of its setting cannot be read.
    #[error("its setting: {0}")]
    Setting(#[from] serde_json::Error),
    /// The device's limits are not accepted.
    #[error("its device: {0}")]
    Limits(#[from] OutOfRange),
}

impl MasterSetting {
    /// The end.
    ///
    /// # Errors
    /// The device's limits are not accepted.
    pub fn end(&self) -> Result<MasterEnd, OutOfRange> {
        let limiter = ForceLimiter::try_new(self.limits)?;
        let master = Master::with_architecture(&self.welcome, limiter, self.architecture);
        Ok(MasterEnd::new(self.began, master, self.commands))
    }

    /// The beginning of its record; stamp and number come with the record.
    pub fn session(&self, configuration: &impl Serialize) -> Session {
        let welcome = Welcome {
            resume: Token::new([0; SECRET_BYTES]),
            ..self.welcome
        };
        let numbers = Numbers {
            architecture: self.architecture,
            limits: self.limits,
            commands: self.commands,
        };
        let opening = StreamMessage::Welcome((&welcome).into());
        Session::of_end(self.began, &opening, &numbers, configuration)
    }

    /// The setting that a record has.
    ///
    /// # Errors
    /// A part of it cannot be read or is not accepted.
    pub fn of_session(session: &Session) -> Result<Self, MasterAgainError> {
        let StreamMessage::Welcome(welcome) = StreamMessage::decode(&session.opening, Side::Slave)?
        else {
            return Err(MasterAgainError::NoWelcome);
        };
        let numbers: Numbers = serde_json::from_str(&session.setting)?;
        Ok(Self {
            began: Time::from_nanos(session.began_ns),
            welcome: welcome.accept(&welcome.settings.coupling)?,
            architecture: numbers.architecture,
            limits: numbers.limits,
            commands: numbers.commands,
        })
    }
}

/// A recorded session at work again.
#[derive(Debug)]
pub struct MasterAgain {
    end: MasterEnd,
    digest: RunDigest,
    done: Option<Done>,
    left: Vec<Vec<u8>>,
}

impl MasterAgain {
    /// The end as it is now.
    pub fn end(&self) -> &MasterEnd {
        &self.end
    }

    /// What the newest tick gave; none before the first.
    pub fn done(&self) -> Option<&Done> {
        self.done.as_ref()
    }

    /// The datagrams that left after it.
    pub fn left(&self) -> impl Iterator<Item = &[u8]> {
        self.left.iter().map(Vec::as_slice)
    }
}

impl EndAgain for MasterAgain {
    const SIDE: &'static str = "master";
    type Tick = MasterTick;
    type Error = MasterAgainError;

    fn try_new(session: &Session) -> Result<Self, MasterAgainError> {
        Ok(Self {
            end: MasterSetting::of_session(session)?.end()?,
            digest: RunDigest::default(),
            done: None,
            left: Vec::new(),
        })
    }

    fn arrival(&mut self, arrival: &Arrival) {
        let at = Time::from_nanos(arrival.at_ns);
        self.end.handle_datagram(at, &arrival.datagram);
    }

    fn tick(&mut self, tick: &MasterTick) -> u64 {
        let given = MasterGiven {
            reading: Vec2::new(tick.reading_x_m, tick.reading_y_m),
            engaged: tick.engaged,
            releases: tick.releases,
            stops: tick.stops,
        };
        let done = self.end.tick(Time::from_nanos(tick.deadline_ns), &given);
        self.digest.tick(&done);
        let value = self.digest.value();
        self.done = Some(done);
        let (end, sent) = (&mut self.end, Time::from_nanos(tick.sent_ns));
        let poll = |out: &mut [u8]| end.poll_transmit(sent, out).ok().flatten();
        self.left = self.digest.datagrams(poll);
        value
    }

    fn input(tick: &MasterTick) -> TickInput {
        TickInput {
            session: tick.session,
            index: tick.index,
            digest: tick.digest,
        }
    }
}
