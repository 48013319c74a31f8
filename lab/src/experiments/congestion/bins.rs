//! One run, cut into bins of a quarter of a second: what was sent, what was dropped, what the hand felt.
//!
//! It only reads the world that it steps: a run that is looked at is the run that nobody looks at.

use std::time::Duration;

use mmt_server::trigger::Scheme;
use mmt_shared::time::Time;

use crate::experiment::findings::ExperimentError;
use crate::experiment::grid;
use crate::trial::TrialError;
use crate::world::{World, WorldConfig, WorldTick};

/// When the bottleneck comes and goes, s.
pub(super) const FROM_S: f64 = 10.0;
pub(super) const UNTIL_S: f64 = 25.0;
/// Beginning of the part after congestion: what had queued is gone, and the stretch.
pub(super) const AFTER_S: f64 = 35.0;
/// Length of a bin.
pub(super) const BIN: Duration = Duration::from_millis(250);

/// Who answers, and the world.
pub(super) struct Variant {
    pub(super) name: &'static str,
    pub(super) world: WorldConfig,
}

pub(super) type Group = grid::Group<Variant, Binned>;

/// What one bin of one run came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bin {
    /// Its end, s.
    pub(super) t_s: f64,
    /// The round trip as the slave last measured it, ms.
    pub(super) round_trip_ms: Option<f64>,
    /// Delta now, 0 if the scheme has none.
    pub(super) delta: f64,
    /// T_update now, ms.
    pub(super) t_update_ms: f64,
    pub(super) commands: u64,
    /// Messages of all kinds in both directions.
    pub(super) messages: u64,
    /// Repeats included.
    pub(super) updates: u64,
    /// Bits in each direction with headers.
    pub(super) bits_up: f64,
    pub(super) bits_down: f64,
    /// Datagrams that the bottleneck's queue dropped.
    pub(super) dropped: u64,
    /// Σ |f_s − f_m|², N², Σ |f_s|², N², and the number of pairs.
    pub(super) error: (f64, f64),
    pub(super) pairs: u64,
    pub(super) ticks: u64,
}

/// What is counted from the start on.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    commands: u64,
    messages: u64,
    updates: u64,
    bytes_up: f64,
    bytes_down: f64,
    dropped: u64,
}

fn totals(world: &World) -> Totals {
    let traffic = world.traffic();
    let (messages, wire) = (&traffic.messages, &traffic.wire);
    let bytes = |of: &mmt_shared::report::WireReport| {
        let headers = of.header_bytes.unwrap_or(0) * of.datagrams.unwrap_or(0);
        (of.bytes.unwrap_or(0) + headers) as f64
    };
    let all = |of: &mmt_shared::report::MessagesReport| {
        let kinds = [of.commands, of.updates, of.scenes, of.heartbeats];
        kinds.into_iter().flatten().sum::<u64>()
    };
    Totals {
        commands: messages.up.commands.unwrap_or(0),
        messages: all(&messages.up) + all(&messages.down),
        updates: messages.down.updates.unwrap_or(0),
        bytes_up: bytes(&wire.up),
        bytes_down: bytes(&wire.down),
        dropped: world.dropped_in_queues(),
    }
}

fn scheme_numbers(scheme: Scheme) -> (f64, f64) {
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    match scheme {
        Scheme::Hybrid { delta, t_update } | Scheme::Useful { delta, t_update } => {
            (delta, ms(t_update))
        }
        Scheme::Deadband { delta } | Scheme::Adaptive { delta, .. } => (delta, 0.0),
        Scheme::Timer { t_update } => (0.0, ms(t_update)),
        Scheme::EverySample | Scheme::Dis { .. } => (0.0, 0.0),
    }
}

impl Bin {
    /// The rate of some of its bits, kbit/s.
    pub(super) fn kbit_per_s(&self, bits: f64) -> f64 {
        bits / BIN.as_secs_f64() * 1e-3
    }

    /// The relative force error of its pairs; none if none had a force.
    pub(super) fn relative_error(&self) -> Option<f64> {
        (self.error.1 > 0.0).then(|| libm::sqrt(self.error.0 / self.error.1))
    }

    fn take(&mut self, tick: &WorldTick) {
        self.ticks += 1;
        let Some(slave) = &tick.slave else {
            return;
        };
        if let Some(f_m) = slave.f_m {
            self.error.0 += (slave.f_s - f_m).norm_squared();
            self.error.1 += slave.f_s.norm_squared();
            self.pairs += 1;
        }
    }

    fn close(&mut self, now: Time, world: &World, before: &Totals) -> Totals {
        let totals = totals(world);
        let peer = world.slave_end().channel().peer();
        let latest = peer.round_trip().latest();
        (self.delta, self.t_update_ms) = scheme_numbers(world.slave().scheme_now());
        self.t_s = now.as_secs_f64();
        self.round_trip_ms = latest.map(|took| took.as_secs_f64() * 1e3);
        self.commands = totals.commands - before.commands;
        self.messages = totals.messages - before.messages;
        self.updates = totals.updates - before.updates;
        self.bits_up = 8.0 * (totals.bytes_up - before.bytes_up);
        self.bits_down = 8.0 * (totals.bytes_down - before.bytes_down);
        self.dropped = totals.dropped - before.dropped;
        totals
    }
}

/// One run, cut into bins.
pub(super) struct Binned {
    pub(super) bins: Vec<Bin>,
    /// Of the whole world.
    pub(super) digest: String,
}

/// Runs a world and cuts it into bins; what is left of a last one is not run.
///
/// # Errors
/// When the world is not accepted.
pub(super) fn run(config: &WorldConfig, duration: Duration) -> Result<Binned, ExperimentError> {
    let mut world = World::try_new(config).map_err(TrialError::from)?;
    let (mut bins, mut before) = (Vec::new(), Totals::default());
    for _ in 0..duration.as_millis() / BIN.as_millis() {
        let mut bin = Bin::default();
        let mut now = Time::ZERO;
        world.run(BIN, |tick| {
            bin.take(tick);
            now = tick.now;
        });
        before = bin.close(now, &world, &before);
        bins.push(bin);
    }
    Ok(Binned {
        bins,
        digest: world.digest(),
    })
}

/// The rate of what was counted in a bin.
pub(super) fn per_second(count: u64) -> f64 {
    count as f64 / BIN.as_secs_f64()
}
