//! What the transport adds to the network's own delay: the cases that are measured and what is counted in each.
//!
//! A case is one flow of messages over one path by stock quinn or by quinn as mmt sets it. Delay added is the time
//! from the application that sends to the one that receives, without what the path itself takes for the packet that
//! brought the message: its serialisation, propagation and jitter. Waiting counts, before the socket and at a
//! bottleneck. Pure: who runs a case reports to the log what happened, and nothing here uses QUIC.

mod log;

pub use log::{FlowOutcome, Log, Sent};

use std::ops::Range;
use std::time::Duration;

use mmt_netem::{Delay, LinkConfig, Loss, Order, Probability};
use mmt_shared::time::Time;

/// The slave of a measured master sends a heartbeat this often.
pub const HEARTBEAT: Duration = Duration::from_millis(50);
/// Bytes of a heartbeat with an echo.
pub const HEARTBEAT_BYTES: usize = 32;
/// What is on its way when the last message was sent may still come for this long, beyond the path's own delay.
const SETTLING: Duration = Duration::from_secs(2);
/// The outage begins after this share of a run.
const OUTAGE_AT: u32 = 4;

/// Who carries the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stack {
    /// quinn with its defaults: CUBIC, and 1 MiB of unsent datagrams that wait for it in a queue.
    Stock,
    /// quinn with the settings and the congestion controller of `shared`.
    Ours,
}

impl Stack {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Stock, Self::Ours];

    /// As tables spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stock => "stock",
            Self::Ours => "ours",
        }
    }
}

/// A flow of equal messages at equal intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flow {
    /// Messages a second.
    pub rate_hz: u32,
    /// Bytes of a message.
    pub bytes: usize,
}

impl Flow {
    /// A command for each sample, with room for repeated ones.
    pub const EVERY_SAMPLE: Self = Self::new(1000, 100);
    /// Updates as fast as an eager scheme sends them, or commands of several samples.
    pub const EAGER: Self = Self::new(150, 180);
    /// Updates of a usual scheme.
    pub const USUAL: Self = Self::new(60, 180);
    /// All of them.
    pub const ALL: [Self; 3] = [Self::EVERY_SAMPLE, Self::EAGER, Self::USUAL];

    const fn new(rate_hz: u32, bytes: usize) -> Self {
        Self { rate_hz, bytes }
    }
}

/// A link that is slower than the others, with a queue before it that drops what does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bottleneck {
    /// Bits a second, IP and UDP headers included.
    pub bits_per_s: u64,
    /// The longest wait in the queue.
    pub queue: Duration,
}

impl Bottleneck {
    /// 1 Mbit/s behind a second of queue, as home routers have it.
    pub const NARROW: Self = Self {
        bits_per_s: 1_000_000,
        queue: Duration::from_secs(1),
    };
}

/// The path, the same in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conditions {
    /// The shortest round trip, without serialisation.
    pub round_trip: Duration,
    /// Share of packets lost by chance.
    pub loss: Probability,
    /// J: each packet takes between 0 and 2 J longer than half of the round trip, whatever the others do.
    pub jitter: Duration,
    /// Nothing gets through for this long, a quarter of the run from its begin; zero for never.
    pub outage: Duration,
    /// A bottleneck before the rest of the path.
    pub bottleneck: Option<Bottleneck>,
}

impl Conditions {
    /// Share of packets lost by chance, %.
    #[must_use]
    pub fn loss_percent(&self) -> f64 {
        f64::from(self.loss.parts_per_billion()) / 1e7
    }

    /// The link behind the bottleneck.
    #[must_use]
    pub fn link(&self) -> LinkConfig {
        let mean = self.round_trip / 2 + self.jitter;
        LinkConfig {
            delay: match self.jitter {
                Duration::ZERO => Delay::constant(mean),
                half_width => Delay::uniform(mean, half_width),
            },
            order: Order::Free,
            loss: match self.loss {
                Probability::ZERO => Loss::None,
                probability => Loss::Independent { probability },
            },
            ..LinkConfig::default()
        }
    }
}

/// One run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// Who carries the messages.
    pub stack: Stack,
    /// The messages, from the master.
    pub flow: Flow,
    /// The path.
    pub conditions: Conditions,
    /// For how long messages are sent.
    pub duration: Duration,
    /// Of the link's and of quinn's random numbers.
    pub seed: u64,
}

impl Case {
    /// When nothing gets through, if the first message is sent at `start`.
    #[must_use]
    pub fn outage(&self, start: Time) -> Range<Time> {
        let begin = start + self.duration / OUTAGE_AT;
        begin..begin + self.conditions.outage
    }

    /// No message is sent from here on.
    #[must_use]
    pub fn end(&self, start: Time) -> Time {
        start + self.duration
    }

    /// What has not come by then never does.
    #[must_use]
    pub fn over(&self, start: Time) -> Time {
        let longest = self.conditions.round_trip + 2 * self.conditions.jitter;
        self.end(start) + longest + SETTLING
    }
}
