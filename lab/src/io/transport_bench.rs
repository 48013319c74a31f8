//! What a message costs on this machine: over raw UDP, over QUIC as mmt sets it, and over bare sockets as the control.
//!
//! Two threads are the two hosts, loopback is the network. The carriers take turns in short slices, so that the
//! machine's noise hits all alike, and the order of the turns rotates. It measures real time: no two runs are equal,
//! and nothing here may be taken for a figure of virtual time.

mod bare;
mod cores;
mod endpoint;
mod report;
mod slice;
#[cfg(test)]
mod tests;

use std::error::Error;
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::transport::Transport;
use mmt_shared::wire::DATAGRAM_MAX;

use bare::BarePair;
use cores::Placement;
use endpoint::EndpointPair;
use report::Summaries;
use slice::{Slice, SliceResult};

pub use cores::Cores;
pub use report::BenchReport;
pub use slice::{BYTES_MIN, Flow};

/// The longest message, bytes: the longest of the protocol.
pub const BYTES_MAX: usize = DATAGRAM_MAX;
/// Messages a second at most.
pub const RATE_MAX: u32 = 10_000;
/// From the order to the first message: threads start in this time.
const LEAD: Duration = Duration::from_millis(10);

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BenchConfig {
    /// Messages a second, 1 to [`RATE_MAX`].
    pub rate_hz: u32,
    /// How long, all slices together; at least one of each is measured.
    pub duration: Duration,
    /// Bytes of a message, [`BYTES_MIN`] to [`BYTES_MAX`].
    pub bytes: usize,
    /// Where the two ends run.
    pub cores: Cores,
}

/// What carries the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Carrier {
    /// Bare sockets that block: what the operating system takes.
    Control,
    /// Raw UDP of mmt, on tokio, as the hosts run it.
    RawUdp,
    /// QUIC as mmt sets it, on tokio, as the hosts run it.
    Quic,
}

impl Carrier {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Control, Self::RawUdp, Self::Quic];

    /// As tables spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::RawUdp => "udp",
            Self::Quic => "quic",
        }
    }
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Messages a second out of range.
    #[error("a rate of {rate_hz} messages a second: 1 to {RATE_MAX} can be measured")]
    Rate {
        /// The rate asked for.
        rate_hz: u32,
    },
    /// Bytes out of range.
    #[error("messages of {bytes} bytes: {BYTES_MIN} to {BYTES_MAX} can be measured")]
    Bytes {
        /// The size asked for.
        bytes: usize,
    },
    /// The ends cannot have cores of their own.
    #[error("no core for each end: {0}; measure with --cores any")]
    Cores(#[source] std::io::Error),
    /// The machine gave no socket, thread or connection, or took one back.
    #[error(transparent)]
    Failed(#[from] Box<dyn Error + Send + Sync>),
}

/// Why an end could not go on.
type Failure = Box<dyn Error + Send + Sync>;

/// Both ends of a carrier, connected.
enum Pair {
    Bare(BarePair),
    Endpoints(Box<EndpointPair>),
}

impl Pair {
    fn try_new(
        carrier: Carrier,
        config: &BenchConfig,
        placement: &Placement,
    ) -> Result<Self, BenchError> {
        let transport = match carrier {
            Carrier::Control => return Ok(Self::Bare(BarePair::try_new()?)),
            Carrier::RawUdp => Transport::RawUdp { insist: false },
            Carrier::Quic => Transport::Quic,
        };
        let pair = EndpointPair::try_new(transport, config, placement)?;
        Ok(Self::Endpoints(Box::new(pair)))
    }

    fn run(
        &self,
        placement: &Placement,
        slice: &Slice,
        clock: Clock,
    ) -> Result<SliceResult, BenchError> {
        let (near, far) = match self {
            Self::Bare(pair) => {
                placement.run(|| pair.near(slice, clock), || pair.far(slice, clock))?
            }
            Self::Endpoints(pair) => {
                let EndpointPair { near, far } = &**pair;
                placement.run(|| near.run(slice, clock), || far.run(slice, clock))?
            }
        };
        Ok(SliceResult { near, far })
    }
}

/// Measures every carrier in both flows until the duration is over or `stop` returns true; what was measured until
/// then is the result. A first round warms up and is not counted.
///
/// # Errors
/// Numbers out of range, or the machine has no sockets or threads to give.
pub fn run(config: &BenchConfig, stop: impl Fn() -> bool) -> Result<BenchReport, BenchError> {
    let (rate_hz, bytes) = (config.rate_hz, config.bytes);
    if !(1..=RATE_MAX).contains(&rate_hz) {
        return Err(BenchError::Rate { rate_hz });
    }
    if !(BYTES_MIN..=BYTES_MAX).contains(&bytes) {
        return Err(BenchError::Bytes { bytes });
    }
    let clock = Clock::start();
    let placement = Placement::try_new(config.cores)?;
    let mut pairs = Vec::new();
    for carrier in Carrier::ALL {
        pairs.push((carrier, Pair::try_new(carrier, config, &placement)?));
    }
    let mut summaries = Summaries::new();
    let mut end = None;
    for round in 0_u64.. {
        for flow in Flow::ALL {
            for (carrier, pair) in &pairs {
                let slice = Slice::new(round, flow, config, clock.now() + LEAD);
                let result = pair.run(&placement, &slice, clock)?;
                // the first round warms up
                if round > 0 {
                    summaries.add(*carrier, flow, &result);
                }
            }
        }
        // nobody always follows the same one
        pairs.rotate_left(1);
        let end = *end.get_or_insert_with(|| clock.now() + config.duration);
        if round > 0 && (clock.now() >= end || stop()) {
            break;
        }
    }
    Ok(summaries.report(config, placement.cores()))
}
