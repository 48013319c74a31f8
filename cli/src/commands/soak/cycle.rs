//! A cycle of the soak: masters one after the other, random faults meanwhile, and afterwards a session that must come about.

use std::path::Path;
use std::time::{Duration, Instant};

use mmt_lab::swarm::{Fault, Scheduled, draw};
use mmt_lab::worlds::RandomWorld;
use mmt_shared::time::Time;
use rustix::process::Signal;

use super::process::{Ended, PATIENCE, Process};
use super::rig::Rig;
use super::tally::{Recorded, Tally};
use crate::failure::Failure;
use crate::stop::Stop;

/// Between two looks at faults and processes.
const LOOK: Duration = Duration::from_millis(5);
/// Between two looks at what processes have of the system's.
const SAMPLE: Duration = Duration::from_secs(1);
/// From the end of a master to the next.
const BETWEEN: Duration = Duration::from_millis(200);
/// Once the faults are over, a session must come about that lasts so long.
const PROOF: &str = "2s";

/// The faults of a slave that lives on.
const LASTING: [Fault; 14] = [
    Fault::UpSilent,
    Fault::DownSilent,
    Fault::BothSilent,
    Fault::Burst,
    Fault::Flapping,
    Fault::Late,
    Fault::Replayed,
    Fault::Mutated,
    Fault::MasterStands,
    Fault::SlaveStands,
    Fault::MasterStops,
    Fault::SlaveStops,
    Fault::MasterDies,
    Fault::SessionEnds,
];

/// What may happen to the slave of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slave {
    /// It lives on.
    Lasting,
    /// It may die as well.
    Mortal,
}

impl Slave {
    /// What its processes are called in the report: slave and relay.
    fn kinds(self) -> [&'static str; 2] {
        match self {
            Self::Lasting => ["slave, whole soak", "relay, whole soak"],
            Self::Mortal => ["slaves, a cycle each", "relays, a cycle each"],
        }
    }

    /// Samples what slave and relay have when no session has been there for a while.
    pub(super) fn sample_idle(self, rig: &Rig, tally: &mut Tally) {
        let [slave, relay] = self.kinds();
        rig.slave.iter().for_each(|of| tally.sample_idle(slave, of));
        tally.sample_idle(relay, &rig.relay);
    }
}

/// A cycle at work.
pub(super) struct Cycle<'a> {
    rig: &'a mut Rig,
    tally: &'a mut Tally,
    stop: &'a Stop,
    folder: &'a Path,
    state: &'a Path,
    world: RandomWorld,
    slave: Slave,
    master: Option<Process>,
    masters: usize,
    /// When the last master ended.
    ended: Option<Instant>,
    sampled: Instant,
    records: Vec<Recorded>,
}

impl<'a> Cycle<'a> {
    /// Nothing has begun. The folder is for logs and records, `state` for what masters keep.
    pub(super) fn new(
        rig: &'a mut Rig,
        tally: &'a mut Tally,
        stop: &'a Stop,
        [folder, state]: [&'a Path; 2],
        seed: u64,
        slave: Slave,
    ) -> Self {
        Self {
            rig,
            tally,
            stop,
            folder,
            state,
            world: RandomWorld::new(seed),
            slave,
            master: None,
            masters: 0,
            ended: None,
            sampled: Instant::now(),
            records: Vec::new(),
        }
    }

    /// Runs it, and returns what the masters recorded.
    ///
    /// # Errors
    /// A process does not start.
    pub(super) fn run(mut self, length: Duration) -> Result<Vec<Recorded>, Failure> {
        let mut among = LASTING.to_vec();
        among.extend((self.slave == Slave::Mortal).then_some(Fault::SlaveDies));
        let mut coming = draw(self.world.number, length, &among)
            .into_iter()
            .peekable();
        let mut active: Vec<Scheduled> = Vec::new();
        let (began, mut rebinds) = (Instant::now(), true);
        while began.elapsed() < length && !self.stop.asked() {
            let now = Time::ZERO + began.elapsed();
            while let Some(fault) = coming.next_if(|fault| fault.from <= now) {
                self.begin(&fault);
                active.push(fault);
            }
            let over = active.extract_if(.., |fault| fault.until <= now);
            for fault in over.collect::<Vec<_>>() {
                self.finish(&fault)?;
            }
            self.rig.network(&self.world, &active);
            if rebinds && began.elapsed() > length / 2 {
                self.rig.rebind();
                rebinds = false;
            }
            self.attend(&active)?;
            std::thread::sleep(LOOK);
        }
        for fault in active {
            self.finish(&fault)?;
        }
        self.rig.network(&self.world, &[]);
        self.end_master();
        if self.rig.slave.is_none() {
            self.rig.revive()?;
        }
        self.prove()?;
        Ok(self.records)
    }

    fn begin(&mut self, fault: &Scheduled) {
        self.tally.count_fault(fault.fault);
        let master = |signal| self.master.iter().for_each(|master| master.signal(signal));
        let slave = |signal| self.rig.slave.iter().for_each(|slave| slave.signal(signal));
        match fault.fault {
            Fault::MasterStands => master(Signal::STOP),
            Fault::MasterStops => master(Signal::USR1),
            Fault::MasterDies => master(Signal::KILL),
            Fault::SessionEnds => master(Signal::TERM),
            Fault::SlaveStands => slave(Signal::STOP),
            Fault::SlaveStops => slave(Signal::USR1),
            Fault::SlaveDies => self.rig.slave = None,
            _ => {}
        }
    }

    fn finish(&mut self, fault: &Scheduled) -> Result<(), Failure> {
        let master = |signal| self.master.iter().for_each(|master| master.signal(signal));
        let slave = |signal| self.rig.slave.iter().for_each(|slave| slave.signal(signal));
        match fault.fault {
            Fault::MasterStands => master(Signal::CONT),
            Fault::MasterStops => master(Signal::USR2),
            Fault::SlaveStands => slave(Signal::CONT),
            Fault::SlaveStops => slave(Signal::USR2),
            Fault::SlaveDies if self.rig.slave.is_none() => self.rig.revive()?,
            _ => {}
        }
        Ok(())
    }

    /// Looks after the processes: one master after the other, none of the others may end.
    fn attend(&mut self, active: &[Scheduled]) -> Result<(), Failure> {
        let dead = active.iter().any(|of| of.fault == Fault::MasterDies);
        let rested = self.ended.is_none_or(|ended| ended.elapsed() > BETWEEN);
        match self.master.as_mut().map(Process::ended) {
            None if rested && !dead => self.start_master(None)?,
            Some(Some(ended)) => self.master_ended(Some(ended)),
            _ => {}
        }
        for process in self.rig.slave.iter_mut().chain([&mut self.rig.relay]) {
            if let Some(ended) = process.ended() {
                let what = format!("the {} was gone: {ended:?}", process.name());
                return Err(Failure::failed(what));
            }
        }
        if self.sampled.elapsed() > SAMPLE {
            self.sampled = Instant::now();
            self.sample();
        }
        Ok(())
    }

    fn sample(&mut self) {
        let [slave, relay] = self.slave.kinds();
        let (rig, tally) = (&self.rig, &mut self.tally);
        rig.slave.iter().for_each(|of| tally.sample(slave, of));
        tally.sample(relay, &rig.relay);
        self.master
            .iter()
            .for_each(|of| tally.sample("masters", of));
    }

    fn start_master(&mut self, duration: Option<&str>) -> Result<(), Failure> {
        self.masters += 1;
        let name = format!("master-{}", self.masters);
        let path = self.folder.join(format!("{name}.mcap"));
        let stiffness = self.world.config.stiffness_n_per_m.unwrap_or(1000.0);
        let (stiffness, record) = (stiffness.to_string(), path.to_string_lossy());
        let seed = self.world.number.wrapping_add(self.masters as u64);
        let seed = (seed >> 1).to_string();
        let mut words = vec!["master", "-", "--json", "--device", "falcon"];
        words.extend([
            "--stiffness",
            &stiffness,
            "--seed",
            &seed,
            "--record",
            &record,
        ]);
        words.extend(duration.into_iter().flat_map(|time| ["--duration", time]));
        let mut master = Process::start(&name, self.folder, self.state, &words)?;
        master.send_line(&self.rig.pairing());
        self.records.push(Recorded {
            path,
            is_whole: false,
        });
        self.master = Some(master);
        Ok(())
    }

    /// The master has ended, or did not although it was asked to.
    fn master_ended(&mut self, ended: Option<Ended>) {
        if let (Some(master), Some(record)) = (self.master.take(), self.records.last_mut()) {
            record.is_whole = ended.is_some_and(|ended| ended != Ended::Killed);
            self.tally.count_master(&master, ended);
        }
        self.ended = Some(Instant::now());
    }

    fn end_master(&mut self) {
        if let Some(master) = self.master.take() {
            let (ended, master) = master.end();
            self.master = Some(master);
            self.master_ended(ended);
        }
    }

    /// The faults are over: a session must come about.
    fn prove(&mut self) -> Result<(), Failure> {
        let began = Instant::now();
        let wells = self.tally.masters_that(Ended::Well);
        while self.tally.masters_that(Ended::Well) == wells && !self.stop.asked() {
            if began.elapsed() > PATIENCE {
                self.tally.broken(format!(
                    "no session came about for {PATIENCE:?} after the faults"
                ));
                break;
            }
            if self.master.is_none() {
                std::thread::sleep(BETWEEN);
                self.start_master(Some(PROOF))?;
            }
            if let Some(Some(ended)) = self.master.as_mut().map(Process::ended) {
                self.master_ended(Some(ended));
            }
            std::thread::sleep(LOOK);
        }
        self.end_master();
        Ok(())
    }
}
