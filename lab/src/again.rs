//! Recorded sessions run again: the ends of a record, fed with the inputs that they had, must give the same bits.
//!
//! Pure: whoever reads the file hands over message by message.

use std::collections::BTreeMap;

use mmt_client::again::{MasterAgain, MasterAgainError};
use mmt_server::again::{SlaveAgain, SlaveAgainError};
use mmt_shared::clean::clean;
use mmt_shared::record::PROGRAM;
use mmt_shared::record::again::EndAgain;
use mmt_shared::record::cdr::CdrError;
use mmt_shared::record::messages::{Arrival, MasterTick, Message, Session, SlaveTick};

/// Why a record did not run again.
#[derive(Debug, thiserror::Error)]
pub enum AgainError {
    /// Another version may compute otherwise.
    #[error("it was made by {made}, and this is {PROGRAM}: only that version runs it again")]
    OtherProgram {
        /// What made it.
        made: String,
    },
    /// A message is broken.
    #[error("a message on {topic} is broken: {why}")]
    Message {
        /// Where.
        topic: String,
        /// Why.
        why: CdrError,
    },
    /// The master's end cannot be made.
    #[error("the master's session {0}")]
    Master(#[from] MasterAgainError),
    /// The slave's end cannot be made.
    #[error("the slave's session {0}")]
    Slave(#[from] SlaveAgainError),
    /// A tick of a session whose beginning is not there.
    #[error("session {session} of the {side} has no beginning")]
    NoBeginning {
        /// Which end.
        side: &'static str,
        /// Its number.
        session: u32,
    },
    /// A tick gave something else.
    #[error(
        "tick {tick} of session {session} of the {side} gave something else than when it was recorded"
    )]
    Difference {
        /// Which end.
        side: &'static str,
        /// Number of the session.
        session: u32,
        /// Number of the tick in its session, from 0.
        tick: u64,
    },
}

/// How far a session ran again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RanAgain {
    /// Ticks that gave the same bits.
    pub ticks: u64,
    /// Digest of all that they gave.
    pub digest: u64,
    /// Whether inputs are missing after these ticks: it runs no further.
    pub has_gap: bool,
    next_input: u64,
}

impl RanAgain {
    /// Whether the input of this number is the next one.
    fn is_next(&mut self, index: u64) -> bool {
        self.has_gap |= index != self.next_input;
        self.next_input += 1;
        !self.has_gap
    }
}

/// Which input of a session a message of a record was.
#[derive(Clone, Debug, PartialEq)]
pub enum Input<T> {
    /// The session began.
    Beginning(Session),
    /// A datagram arrived.
    Arrival(Arrival),
    /// A tick.
    Tick(T),
}

/// What a message of a record was: an input of the session of this number, which has taken it.
#[derive(Clone, Debug, PartialEq)]
pub enum Taken {
    /// At the master.
    Master(u32, Input<MasterTick>),
    /// At the slave.
    Slave(u32, Input<SlaveTick>),
}

/// The session and the input, if a message was one.
type TakenBy<E> = Result<Option<(u32, Input<<E as EndAgain>::Tick>)>, AgainError>;

/// The sessions of one end.
struct Sessions<E>(BTreeMap<u32, (E, RanAgain)>);

impl<E> Default for Sessions<E> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<E: EndAgain<Error: Into<AgainError>>> Sessions<E> {
    /// `what`: the rest of the topic. None of what is no input, or comes after inputs that are missing.
    fn take(&mut self, what: &str, topic: &str, message: &[u8]) -> TakenBy<E> {
        match what {
            "session" => {
                let session = beginning(topic, message)?;
                let began = (
                    E::try_new(&session).map_err(Into::into)?,
                    RanAgain::default(),
                );
                self.0.insert(session.session, began);
                Ok(Some((session.session, Input::Beginning(session))))
            }
            "arrivals" => {
                let arrival: Arrival = parse(topic, message)?;
                let (end, ran) = self.session(arrival.session)?;
                if !ran.is_next(arrival.index) {
                    return Ok(None);
                }
                end.arrival(&arrival);
                Ok(Some((arrival.session, Input::Arrival(arrival))))
            }
            "ticks" => {
                let tick: E::Tick = parse(topic, message)?;
                let input = E::input(&tick);
                let (end, ran) = self.session(input.session)?;
                if !ran.is_next(input.index) {
                    return Ok(None);
                }
                let digest = end.tick(&tick);
                if digest != input.digest {
                    return Err(AgainError::Difference {
                        side: E::SIDE,
                        session: input.session,
                        tick: ran.ticks,
                    });
                }
                (ran.ticks, ran.digest) = (ran.ticks + 1, digest);
                Ok(Some((input.session, Input::Tick(tick))))
            }
            _ => Ok(None),
        }
    }

    fn session(&mut self, session: u32) -> Result<&mut (E, RanAgain), AgainError> {
        let side = E::SIDE;
        let found = self.0.get_mut(&session);
        found.ok_or(AgainError::NoBeginning { side, session })
    }

    fn ran(&self) -> impl Iterator<Item = (&'static str, u32, RanAgain)> {
        let sessions = self.0.iter();
        sessions.map(|(number, (_, ran))| (E::SIDE, *number, *ran))
    }
}

/// The sessions of a record.
#[derive(Default)]
pub struct SessionsAgain {
    masters: Sessions<MasterAgain>,
    slaves: Sessions<SlaveAgain>,
}

impl SessionsAgain {
    /// Takes the next message of the record, and returns which input it was; one that is no input changes nothing.
    ///
    /// # Errors
    /// The message is broken, a session cannot begin, or a tick gave something else.
    pub fn take(&mut self, topic: &str, message: &[u8]) -> Result<Option<Taken>, AgainError> {
        if let Some(what) = topic.strip_prefix("/master/") {
            let taken = self.masters.take(what, topic, message)?;
            Ok(taken.map(|(session, input)| Taken::Master(session, input)))
        } else if let Some(what) = topic.strip_prefix("/slave/") {
            let taken = self.slaves.take(what, topic, message)?;
            Ok(taken.map(|(session, input)| Taken::Slave(session, input)))
        } else {
            Ok(None)
        }
    }

    /// The master of this session, as far as it has run again.
    #[must_use]
    pub fn master(&self, session: u32) -> Option<&MasterAgain> {
        self.masters.0.get(&session).map(|(end, _)| end)
    }

    /// The slave of this session, as far as it has run again.
    #[must_use]
    pub fn slave(&self, session: u32) -> Option<&SlaveAgain> {
        self.slaves.0.get(&session).map(|(end, _)| end)
    }

    /// Each session with its side and number, the master's first.
    pub fn ran(&self) -> impl Iterator<Item = (&'static str, u32, RanAgain)> {
        self.masters.ran().chain(self.slaves.ran())
    }
}

fn parse<M: Message>(topic: &str, message: &[u8]) -> Result<M, AgainError> {
    M::read(message).map_err(|why| AgainError::Message {
        topic: clean(topic),
        why,
    })
}

/// The beginning of a session of this very program.
fn beginning(topic: &str, message: &[u8]) -> Result<Session, AgainError> {
    let session: Session = parse(topic, message)?;
    if session.program == PROGRAM {
        Ok(session)
    } else {
        let made = clean(&session.program);
        Err(AgainError::OtherProgram { made })
    }
}
