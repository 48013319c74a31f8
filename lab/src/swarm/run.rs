//! A run of the swarm, millisecond by millisecond: processes that stand, die and come back, and one session after the other.

use std::time::Duration;

use mmt_client::master::MasterTick;
use mmt_server::slave::{Memory, SlaveTick};
use mmt_shared::record::digest::RunDigest;
use mmt_shared::rng::Substream;
use mmt_shared::time::{TICK, Time};

use super::faults::{Fault, Now, Scheduled};
use super::session::{BETWEEN, Moment, Session, SwarmError};
use crate::check::Verdict;
use crate::worlds::RandomWorld;

/// The master's clock at the beginning, and by how much the slave's is ahead: nothing may depend on either.
const EPOCH: Duration = Duration::from_secs(5000);
const SLAVE_AHEAD: Duration = Duration::from_secs(7200);
/// Clocks drift by no more than this, parts per million.
const DRIFT_PPM: f64 = 200.0;
/// An overrun keeps each loop from this share of its ticks.
const MISSED: f64 = 0.7;

/// A run.
pub(super) struct Run<'a> {
    seed: u64,
    world: &'a RandomWorld,
    faults: Vec<Scheduled>,
    /// Since the beginning.
    elapsed: Duration,
    drift_ppm: f64,
    /// What the slave's clock has jumped by.
    jumped: Duration,
    session: Option<Session>,
    sessions: u64,
    /// When the next session begins.
    next: Time,
    memory: Option<Memory>,
    verdict: Verdict,
    digest: RunDigest,
    draws: Substream,
}

impl<'a> Run<'a> {
    pub(super) fn try_new(
        seed: u64,
        world: &'a RandomWorld,
        faults: Vec<Scheduled>,
    ) -> Result<Self, SwarmError> {
        let mut draws = Substream::new(seed, "swarm/run", 0);
        Ok(Self {
            seed,
            world,
            faults,
            elapsed: Duration::ZERO,
            drift_ppm: draws.uniform_in(-DRIFT_PPM, DRIFT_PPM),
            jumped: Duration::ZERO,
            session: None,
            sessions: 0,
            next: Time::ZERO,
            memory: None,
            verdict: Verdict::default(),
            digest: RunDigest::default(),
            draws,
        })
    }

    pub(super) fn finish(mut self, duration: Duration) -> Result<Swarmed, SwarmError> {
        while self.elapsed < duration {
            self.elapsed += TICK;
            self.step()?;
        }
        self.end_session();
        Ok(Swarmed {
            seed: self.seed,
            sessions: self.sessions,
            faults: self.faults,
            verdict: self.verdict,
            digest: self.digest.value(),
        })
    }

    fn step(&mut self) -> Result<(), SwarmError> {
        let since = Time::ZERO + self.elapsed;
        let faults = Now::of(&self.faults, since);
        if let Some(strength) = faults.strength(Fault::ClockJumps) {
            self.jumped += Duration::from_secs_f64(strength * strength * 3600.0);
        }
        let drift = self.elapsed.as_secs_f64() * (1.0 + self.drift_ppm * 1e-6);
        let moment = Moment {
            now: since + EPOCH,
            slave_now: Time::ZERO + SLAVE_AHEAD + self.jumped + Duration::from_secs_f64(drift),
            faults: &faults,
        };
        let (master_dead, slave_dead) =
            (faults.has(Fault::MasterDies), faults.has(Fault::SlaveDies));
        self.kill(master_dead, slave_dead, moment.now);
        if self.session.is_none() && moment.now >= self.next && !master_dead && !slave_dead {
            self.sessions += 1;
            let memory = self.memory.as_ref();
            self.session = Some(Session::begin(self.world, self.sessions, &moment, memory)?);
        }
        self.tick(&moment);
        Ok(())
    }

    /// Processes die at once; what their operating system was given still leaves.
    fn kill(&mut self, master: bool, slave: bool, now: Time) {
        let Some(session) = &mut self.session else {
            if slave {
                self.memory = None;
            }
            return;
        };
        if master {
            session.master = None;
        }
        if slave {
            session.slave = None;
            self.memory = None;
        }
        // whoever is back finds the other in a session that has ended
        let back = (session.master.is_none() && !master) || (session.slave.is_none() && !slave);
        if back {
            self.next = now;
            self.end_session();
        }
    }

    fn tick(&mut self, moment: &Moment<'_>) {
        let Some(session) = &mut self.session else {
            return;
        };
        session.deliver(moment);
        let faults = moment.faults;
        let mut misses = || faults.has(Fault::Overrun) && self.draws.chance(MISSED);
        let (master_misses, slave_misses) = (misses(), misses());
        let mut over = false;
        if !faults.has(Fault::MasterStands)
            && !master_misses
            && let Some((done, at_rest)) = session.tick_master(moment)
        {
            note_master(&mut self.digest, &done);
            over = at_rest;
        }
        if !faults.has(Fault::SlaveStands)
            && !slave_misses
            && let Some(done) = session.tick_slave(moment)
        {
            note_slave(&mut self.digest, &done);
        }
        if over {
            self.next = moment.now + BETWEEN;
            self.end_session();
        }
    }

    /// Ends the session, if there is one, and keeps what it leaves.
    fn end_session(&mut self) {
        let Some(session) = self.session.take() else {
            return;
        };
        self.verdict.add(session.verdict());
        if let Some(slave) = &session.slave {
            self.memory = Some(slave.slave().memory());
        }
    }
}

fn note_master(digest: &mut RunDigest, done: &MasterTick) {
    [done.displayed, done.hand_force, done.sample.hip.metres()]
        .iter()
        .for_each(|vector| note(digest, [vector.x, vector.y]));
}

fn note_slave(digest: &mut RunDigest, done: &SlaveTick) {
    [done.tool, done.f_s, done.f_shadow]
        .iter()
        .for_each(|vector| note(digest, [vector.x, vector.y]));
    let update = done.update.map_or(0, |update| update.sequence);
    digest.datagram(&update.to_le_bytes());
}

fn note(digest: &mut RunDigest, numbers: [f64; 2]) {
    for number in numbers {
        digest.datagram(&number.to_bits().to_le_bytes());
    }
}

/// What a run of the swarm came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Swarmed {
    /// Its seed.
    pub seed: u64,
    /// How many sessions there were.
    pub sessions: u64,
    /// The faults, in the order of their beginnings.
    pub faults: Vec<Scheduled>,
    /// What was found of all sessions.
    pub verdict: Verdict,
    /// Digest of what both ends gave: equal for equal seeds.
    pub digest: u64,
}
