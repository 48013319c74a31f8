//! Recorded sessions, run again and judged.

use std::collections::BTreeMap;

use mmt_client::again::{MasterAgain, MasterAgainError, MasterSetting};
use mmt_client::end::MasterGiven;
use mmt_server::again::{SlaveAgain, SlaveAgainError, SlaveSetting};
use mmt_server::end::{SlaveGiven, session_config};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::record::messages::{Arrival, MasterTick, Session, SlaveTick, Stamp};
use mmt_shared::time::Time;

use super::{
    Both, Invariant, MasterAbout, MasterChecks, MasterTicked, SlaveAbout, SlaveChecks, SlaveTicked,
    Verdict,
};
use crate::again::{AgainError, Input, SessionsAgain, Taken};

/// Why a record cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// It cannot be run again.
    #[error(transparent)]
    Again(#[from] AgainError),
    /// The master's session cannot be read.
    #[error("the master's session {0}")]
    Master(#[from] MasterAgainError),
    /// The slave's session cannot be read.
    #[error("the slave's session {0}")]
    Slave(#[from] SlaveAgainError),
}

/// The sessions of one run, judged while they run again: a demo's record, or those of both hosts.
#[derive(Default)]
pub struct RecordChecks {
    again: SessionsAgain,
    masters: BTreeMap<u32, MasterChecks>,
    slaves: BTreeMap<u32, SlaveChecks>,
    both: BTreeMap<u32, Both>,
    /// When each session of the slave began and last ticked, on the wall clock: each session of a demo has a clock of its own.
    times: BTreeMap<u32, (Stamp, Stamp)>,
    verdict: Verdict,
    differs: bool,
}

impl RecordChecks {
    /// Takes the next message of a record. After a tick that gave other bits the rest is not judged.
    ///
    /// # Errors
    /// The record cannot be run again.
    pub fn take(&mut self, topic: &str, message: &[u8]) -> Result<(), CheckError> {
        if self.differs {
            return Ok(());
        }
        let taken = match self.again.take(topic, message) {
            Err(difference @ AgainError::Difference { .. }) => {
                self.differs = true;
                let values = || difference.to_string();
                self.verdict
                    .judge(Invariant::SameBits, Time::ZERO, false, values);
                return Ok(());
            }
            taken => taken?,
        };
        match taken {
            Some(Taken::Master(session, input)) => self.master(session, &input),
            Some(Taken::Slave(session, input)) => self.slave(session, &input),
            None => Ok(()),
        }
    }

    fn master(&mut self, session: u32, input: &Input<MasterTick>) -> Result<(), CheckError> {
        if let Input::Beginning(beginning) = input {
            let checks = MasterChecks::new(master_about(beginning)?);
            self.masters.insert(session, checks);
            return Ok(());
        }
        let (checks, again) = (self.masters.get_mut(&session), self.again.master(session));
        let (Some(checks), Some(again)) = (checks, again) else {
            return Ok(());
        };
        let both = self.both.entry(session).or_default();
        match input {
            Input::Beginning(_) => {}
            Input::Arrival(Arrival {
                at_ns, datagram, ..
            }) => {
                let at = Time::from_nanos(*at_ns);
                checks.arrived(at, datagram);
                both.down.arrived(at, datagram);
            }
            Input::Tick(tick) => {
                self.verdict
                    .judge(Invariant::SameBits, Time::ZERO, true, String::new);
                master_ticked(checks, tick, again);
                again.left().for_each(|bytes| both.up.left(bytes));
            }
        }
        Ok(())
    }

    fn slave(&mut self, session: u32, input: &Input<SlaveTick>) -> Result<(), CheckError> {
        let Some(again) = self.again.slave(session) else {
            return Ok(());
        };
        if let Input::Beginning(beginning) = input {
            let about = slave_about(beginning, again)?;
            self.times
                .insert(session, (beginning.stamp, beginning.stamp));
            self.slaves.insert(session, SlaveChecks::new(about));
            return Ok(());
        }
        let Some(checks) = self.slaves.get_mut(&session) else {
            return Ok(());
        };
        let both = self.both.entry(session).or_default();
        match input {
            Input::Beginning(_) => {}
            Input::Arrival(Arrival {
                at_ns, datagram, ..
            }) => {
                let at = Time::from_nanos(*at_ns);
                checks.arrived(at, datagram);
                both.up.arrived(at, datagram);
            }
            Input::Tick(tick) => {
                self.verdict
                    .judge(Invariant::SameBits, Time::ZERO, true, String::new);
                slave_ticked(checks, tick, again);
                again.left().for_each(|bytes| both.down.left(bytes));
                if let Some((_, last)) = self.times.get_mut(&session) {
                    *last = tick.stamp;
                }
            }
        }
        Ok(())
    }

    /// Each session that was judged: its side, its number and what was found of it alone.
    pub fn sessions(&self) -> impl Iterator<Item = (&'static str, u32, &Verdict)> {
        let masters = self.masters.iter();
        let slaves = self.slaves.iter();
        let masters = masters.map(|(number, of)| ("master", *number, of.verdict()));
        masters.chain(slaves.map(|(number, of)| ("slave", *number, of.verdict())))
    }

    /// What was found of all of them. What both ends show together counts where they have as many sessions and no input is missing:
    /// `whole` means that no record was cut off.
    #[must_use]
    pub fn verdict(&self, whole: bool) -> Verdict {
        let mut sum = self.verdict.clone();
        self.sessions()
            .for_each(|(.., verdict)| sum.add(verdict.clone()));
        let whole = whole && self.again.ran().all(|(.., ran)| !ran.has_gap) && !self.differs;
        if whole && self.masters.len() == self.slaves.len() {
            for (session, both) in &self.both {
                let (master, slave) = (self.masters.get(session), self.slaves.get(session));
                if let (Some(master), Some(slave)) = (master, slave) {
                    let ends = [master.totals(), slave.totals()];
                    sum.add(both.verdict(Time::ZERO, ends));
                }
            }
        }
        let times: Vec<_> = self.times.values().collect();
        for pair in times.windows(2) {
            if let [(_, ended), (began, _)] = pair {
                sum.judge(Invariant::OneOperator, Time::ZERO, ended <= began, || {
                    let late_s = (ended.0 - began.0) as f64 * 1e-9;
                    format!("a session ticks for {late_s:.3} s after the next has begun")
                });
            }
        }
        sum
    }
}

fn master_about(session: &Session) -> Result<MasterAbout, MasterAgainError> {
    let setting = MasterSetting::of_session(session)?;
    Ok(MasterAbout {
        began: setting.began,
        limits: setting.limits,
        settings: setting.welcome.settings,
        start: setting.welcome.tool,
    })
}

fn slave_about(session: &Session, again: &SlaveAgain) -> Result<SlaveAbout, SlaveAgainError> {
    let SlaveSetting { config, hello, .. } = SlaveSetting::of_session(session)?;
    Ok(SlaveAbout {
        began: Time::from_nanos(session.began_ns),
        config: session_config(&config, &hello),
        coupling: hello.coupling,
        tool: again.end().slave().tool_at(),
    })
}

fn master_ticked(checks: &mut MasterChecks, tick: &MasterTick, again: &MasterAgain) {
    let polled = Time::from_nanos(tick.sent_ns);
    let Some(done) = again.done() else {
        return;
    };
    checks.ticked(&MasterTicked {
        now: Time::from_nanos(tick.deadline_ns),
        polled,
        given: MasterGiven {
            reading: Vec2::new(tick.reading_x_m, tick.reading_y_m),
            engaged: tick.engaged,
            releases: tick.releases,
            stops: tick.stops,
        },
        done,
        end: again.end(),
    });
    again.left().for_each(|bytes| checks.left(polled, bytes));
}

fn slave_ticked(checks: &mut SlaveChecks, tick: &SlaveTick, again: &SlaveAgain) {
    let polled = Time::from_nanos(tick.sent_ns);
    checks.ticked(&SlaveTicked {
        now: Time::from_nanos(tick.deadline_ns),
        polled,
        given: SlaveGiven {
            stops: tick.stops,
            plant: None,
        },
        done: again.done(),
        end: again.end(),
    });
    again.left().for_each(|bytes| checks.left(polled, bytes));
}
