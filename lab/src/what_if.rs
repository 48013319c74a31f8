//! What a recorded session would have been with another scheme or over another network, in virtual time.
//!
//! The hand goes the way that it went in the record, whatever it would feel now. Object, sensors, seed and settings are the
//! record's. Pure: whoever reads the files hands over message by message.

use mmt_client::again::{MasterAgainError, MasterSetting};
use mmt_client::operator::trace::Trace;
use mmt_netem::LinkConfig;
use mmt_server::again::{SlaveAgainError, SlaveSetting};
use mmt_server::end::session_config;
use mmt_server::trigger::Scheme;
use mmt_shared::clean::clean;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::record::cdr::CdrError;
use mmt_shared::record::messages::{MasterTick, Message, Session};
use mmt_shared::time::Time;

use crate::table::{Column, Table, column};
use crate::trial::{Measured, Trial, TrialError};
use crate::world::WorldConfig;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum WhatIfError {
    /// A message is broken.
    #[error("a message on {topic} is broken: {why}")]
    Message {
        /// Where.
        topic: String,
        /// Why.
        why: CdrError,
    },
    /// One end is not there.
    #[error("there is no session of the {0}: it takes the records of both ends")]
    NoSession(&'static str),
    /// The hand's way is not there.
    #[error("the record has no tick of the master")]
    NoHand,
    /// The master's session cannot be read.
    #[error("the master's session {0}")]
    Master(#[from] MasterAgainError),
    /// The slave's session cannot be read.
    #[error("the slave's session {0}")]
    Slave(#[from] SlaveAgainError),
    /// An emulated network of the record cannot be read.
    #[error("the record's network {words:?} is none: {why}")]
    Network {
        /// Its words.
        words: String,
        /// Why.
        why: String,
    },
    /// It cannot be run.
    #[error(transparent)]
    Trial(#[from] TrialError),
}

/// What is to be other than in the record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Otherwise {
    /// When updates are sent; as in the record if absent.
    pub scheme: Option<Scheme>,
    /// From master to slave; as in the record if absent.
    pub up: Option<LinkConfig>,
    /// From slave to master; as in the record if absent.
    pub down: Option<LinkConfig>,
}

/// The first session of a record: what its ends were made of, and where the hand was.
#[derive(Clone, Debug, Default)]
pub struct RecordedRun {
    master: Option<Session>,
    slave: Option<Session>,
    /// Time of the master's clock, ns, and HIP as the device read it, m.
    hand: Vec<(u64, Vec2)>,
}

impl RecordedRun {
    /// Takes the next message of the record; those that it does not need change nothing.
    ///
    /// # Errors
    /// The message is broken.
    pub fn take(&mut self, topic: &str, message: &[u8]) -> Result<(), WhatIfError> {
        let broken = |why| WhatIfError::Message {
            topic: clean(topic),
            why,
        };
        match topic {
            "/master/session" => {
                let session = Session::read(message).map_err(broken)?;
                self.master.get_or_insert(session);
            }
            "/slave/session" => {
                let session = Session::read(message).map_err(broken)?;
                self.slave.get_or_insert(session);
            }
            "/master/ticks" => {
                let tick = MasterTick::read(message).map_err(broken)?;
                if self
                    .master
                    .as_ref()
                    .is_some_and(|of| of.session == tick.session)
                {
                    let reading = Vec2::new(tick.reading_x_m, tick.reading_y_m);
                    self.hand.push((tick.deadline_ns, reading));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The session as it was set up, and as it would be `otherwise`: each run in virtual time with the same hand.
    ///
    /// # Errors
    /// The record lacks an end, or holds what is not accepted.
    pub fn answer(&self, otherwise: &Otherwise) -> Result<Table, WhatIfError> {
        let (config, hand) = (self.config()?, self.hand()?);
        let mut other = config.clone();
        if let Some(scheme) = otherwise.scheme {
            other.slave.trigger.scheme = scheme;
        }
        other.up = otherwise.up.clone().unwrap_or(other.up);
        other.down = otherwise.down.clone().unwrap_or(other.down);
        let mut rows = Vec::new();
        for (name, config) in [("as recorded", config), ("what if", other)] {
            let words = (config.slave.trigger.scheme.to_string(), words_of(&config));
            let measured = Trial::new(config, hand.duration()).run_along(&hand)?;
            rows.push(Row {
                name,
                words,
                measured,
            });
        }
        let title = format!(
            "The recorded hand in virtual time, {:.1} s",
            hand.duration().as_secs_f64()
        );
        Ok(Table::of(title, &rows, &columns()))
    }

    fn config(&self) -> Result<WorldConfig, WhatIfError> {
        let master = self
            .master
            .as_ref()
            .ok_or(WhatIfError::NoSession("master"))?;
        let slave = self.slave.as_ref().ok_or(WhatIfError::NoSession("slave"))?;
        let setting = MasterSetting::of_session(master)?;
        let SlaveSetting { config, hello, .. } = SlaveSetting::of_session(slave)?;
        let config = session_config(&config, &hello);
        Ok(WorldConfig {
            seed: config.seed,
            slave: config,
            settings: Some(setting.welcome.settings),
            stiffness_n_per_m: Some(hello.coupling.stiffness_n_per_m),
            architecture: setting.architecture,
            samples_per_command: setting.commands.samples_per_command,
            repeat_samples: setting.commands.repeat_samples,
            stretch_max: setting.commands.stretch_max,
            up: network(master)?,
            down: network(slave)?,
            ..WorldConfig::default()
        })
    }

    fn hand(&self) -> Result<Trace, WhatIfError> {
        let (began_ns, _) = self.hand.first().ok_or(WhatIfError::NoHand)?;
        let since = |ns: u64| Time::from_nanos(ns).saturating_since(Time::from_nanos(*began_ns));
        let samples = self.hand.iter().map(|(ns, hip)| (since(*ns), *hip));
        Trace::of_samples(samples).ok_or(WhatIfError::NoHand)
    }
}

/// The emulated network of an end, by the words of its configuration.
fn network(session: &Session) -> Result<LinkConfig, WhatIfError> {
    let configuration: serde_json::Value =
        serde_json::from_str(&session.configuration).unwrap_or_default();
    let words = configuration.get("netem").and_then(|words| words.as_str());
    let words = words.unwrap_or("none").to_owned();
    words
        .parse()
        .map_err(|why: mmt_netem::words::ParseError| WhatIfError::Network {
            why: why.to_string(),
            words,
        })
}

fn words_of(config: &WorldConfig) -> String {
    let (up, down) = (config.up.to_string(), config.down.to_string());
    if up == down {
        up
    } else {
        format!("up {up}; down {down}")
    }
}

struct Row {
    name: &'static str,
    /// Scheme and network.
    words: (String, String),
    measured: Measured,
}

fn columns() -> [Column<'static, Row>; 9] {
    [
        column("run", "", 0, |row: &Row| row.name),
        column("scheme", "", 0, |row| row.words.0.clone()),
        column("network", "", 0, |row| row.words.1.clone()),
        column("packet_rate_hz", "1/s", 2, |row| {
            row.measured.updates.rate_hz()
        }),
        column("contact_s", "s", 1, |row| row.measured.contact_s),
        column("pmse", "", 4, |row| row.measured.force.pmse),
        column("relative_error", "", 3, |row| {
            row.measured.force.relative_error
        }),
        column("position_rms_m", "m", 4, |row| row.measured.position_rms_m),
        column("force_peak_n", "N", 2, |row| row.measured.force_peak_n),
    ]
}
