//! The faults of a run, drawn from its seed.

use std::fmt;
use std::time::Duration;

use mmt_shared::rng::Substream;
use mmt_shared::time::Time;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Nothing arrives at the slave.
    UpSilent,
    /// Nothing arrives at the master.
    DownSilent,
    /// Nothing arrives anywhere.
    BothSilent,
    /// Half of all is lost, both ways.
    Burst,
    /// Both ways are there and gone, 100 ms each.
    Flapping,
    /// What arrives is late by up to the strength times 400 ms, in any order.
    Late,
    /// Copies of what was sent arrive again.
    Replayed,
    /// Copies arrive with a few bytes changed or cut off, as from a peer that is broken.
    Mutated,
    /// A peer that breaks the rules: far places, foreign numbers, false echoes and acknowledgements.
    Forged,
    /// The master's process stands still.
    MasterStands,
    /// The slave's process stands still.
    SlaveStands,
    /// Both loops miss ticks.
    Overrun,
    /// The slave's clock goes ahead by up to an hour.
    ClockJumps,
    /// The device gives no number.
    ReadingNone,
    /// The device gives places far away.
    ReadingFar,
    /// The device gives the same place.
    ReadingFrozen,
    /// The force sensor gives the same force.
    ForceFrozen,
    /// The force sensor is off by up to the strength times 30 N.
    ForceOff,
    /// The camera takes no images.
    NoImages,
    /// Nobody holds the device.
    HandLetsGo,
    /// The master's emergency stop is set.
    MasterStops,
    /// The slave's emergency stop is set.
    SlaveStops,
    /// The master's process dies and is started again.
    MasterDies,
    /// The slave's process dies and is started again: the object is as at first.
    SlaveDies,
    /// The operator ends the session and begins another.
    SessionEnds,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 25] = [
        Self::UpSilent,
        Self::DownSilent,
        Self::BothSilent,
        Self::Burst,
        Self::Flapping,
        Self::Late,
        Self::Replayed,
        Self::Mutated,
        Self::Forged,
        Self::MasterStands,
        Self::SlaveStands,
        Self::Overrun,
        Self::ClockJumps,
        Self::ReadingNone,
        Self::ReadingFar,
        Self::ReadingFrozen,
        Self::ForceFrozen,
        Self::ForceOff,
        Self::NoImages,
        Self::HandLetsGo,
        Self::MasterStops,
        Self::SlaveStops,
        Self::MasterDies,
        Self::SlaveDies,
        Self::SessionEnds,
    ];

    /// Accepted lengths, ms.
    fn lasts_ms(self) -> (f64, f64) {
        match self {
            Self::UpSilent | Self::DownSilent | Self::BothSilent => (20.0, 10_000.0),
            Self::MasterStands | Self::SlaveStands | Self::MasterDies | Self::SlaveDies => {
                (50.0, 5_000.0)
            }
            Self::ReadingNone | Self::ReadingFar | Self::ReadingFrozen => (1.0, 500.0),
            Self::ClockJumps | Self::SessionEnds => (1.0, 1.1),
            _ => (100.0, 3_000.0),
        }
    }
}

/// A fault, when it is there and how strong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheduled {
    /// Which.
    pub fault: Fault,
    /// From when, by the world's time.
    pub from: Time,
    /// Until when.
    pub until: Time,
    /// 0 to 1.
    pub strength: f64,
}

impl Scheduled {
    /// Whether it is there at `now`.
    #[must_use]
    pub fn is_at(&self, now: Time) -> bool {
        self.from <= now && now < self.until
    }
}

impl fmt::Display for Scheduled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (from, until) = (self.from.as_secs_f64(), self.until.as_secs_f64());
        write!(
            f,
            "{:?} {from:.3} to {until:.3} s ({:.2})",
            self.fault, self.strength
        )
    }
}

/// The faults of a run that lasts as long: those `among` which there are, on average one in five seconds, none in the first two.
#[must_use]
pub fn draw(seed: u64, duration: Duration, among: &[Fault]) -> Vec<Scheduled> {
    let mut stream = Substream::new(seed, "swarm/faults", 0);
    let whole_s = duration.as_secs_f64();
    let count = stream.uniform_in(0.0, whole_s / 2.5) as usize;
    let mut faults: Vec<_> = (0..count)
        .filter_map(|_| one(&mut stream, whole_s, among))
        .collect();
    faults.sort_by_key(|fault| fault.from);
    faults
}

fn one(stream: &mut Substream, whole_s: f64, among: &[Fault]) -> Option<Scheduled> {
    let place = stream.uniform_in(0.0, among.len() as f64) as usize;
    let from_s = stream.uniform_in(2.0, whole_s.max(2.5));
    let (share, strength) = (stream.uniform(), stream.uniform());
    let fault = *among.get(place)?;
    let (least, most) = fault.lasts_ms();
    // short ones are as likely as long ones
    let ms = libm::exp(libm::log(least) + share * (libm::log(most) - libm::log(least)));
    let at = |s: f64| Time::from_millis((s * 1e3) as u64);
    Some(Scheduled {
        fault,
        from: at(from_s),
        until: at(from_s) + Duration::from_millis(ms.max(1.0) as u64),
        strength,
    })
}

/// The faults that are there at a moment.
#[derive(Clone, Debug, Default)]
pub(super) struct Now(Vec<Scheduled>);

impl Now {
    pub(super) fn of(faults: &[Scheduled], now: Time) -> Self {
        Self(
            faults
                .iter()
                .filter(|fault| fault.is_at(now))
                .copied()
                .collect(),
        )
    }

    /// How strong this one is, if it is there.
    pub(super) fn strength(&self, fault: Fault) -> Option<f64> {
        let found = self.0.iter().find(|of| of.fault == fault);
        found.map(|of| of.strength)
    }

    pub(super) fn has(&self, fault: Fault) -> bool {
        self.strength(fault).is_some()
    }
}
