//! What a message costs on this machine: over raw UDP, over QUIC as mmt sets it, and over bare sockets as the control.
//!
//! Two threads are the two hosts, loopback is the network. The carriers take turns in short slices, so that the
//! machine's noise hits all alike, and the order of the turns rotates. It measures real time: no two runs are equal,
//! and nothing here may be taken for a figure of virtual time.

mod bare;
mod config;
mod cores;
mod endpoint;
mod report;
mod slice;
#[cfg(test)]
mod tests;

use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::transport::Transport;

use bare::BarePair;
use cores::Placement;
use endpoint::EndpointPair;
use report::Summaries;
use slice::{Slice, SliceResult};

pub use config::{BYTES_MAX, BYTES_MIN, BenchConfig, BenchError, Carrier, Cores, RATE_MAX};
pub use report::BenchReport;
pub use slice::Flow;

/// From the order to the first message: threads start in this time.
const LEAD: Duration = Duration::from_millis(10);

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
