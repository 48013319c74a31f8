//! What a message costs on this machine: over raw UDP, over QUIC as mmt sets it, and over bare sockets as the control.
//!
//! Two threads are the two hosts, loopback is the network. The carriers take turns in short slices, so that the
//! machine's noise hits all alike, and the order of the turns rotates. It measures real time: no two runs are equal,
//! and nothing here may be taken for a figure of virtual time.

mod carried;
mod control;
mod cores;
mod report;
mod slice;
#[cfg(test)]
mod tests;

use std::io;
use std::time::Duration;

use mmt_netem::io::socket::WrapError;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::identity::GenerateError;
use mmt_shared::io::quic::EndpointError;
use mmt_shared::io::raw_udp::OpenError;
use mmt_shared::io::socket::BindError;
use mmt_shared::io::tls::TlsError;
use mmt_shared::wire::DATAGRAM_MAX;

use carried::Carried;
use control::Control;
use cores::Places;
use report::Ledger;
use slice::{Slice, Turn};

pub use cores::Cores;
pub use report::BenchReport;
pub use slice::BYTES_MIN;

/// The longest message, bytes: the longest of the protocol.
pub const BYTES_MAX: usize = DATAGRAM_MAX;
/// Messages a second at most.
pub const RATE_MAX: u32 = 10_000;
/// For how long messages are sent in a slice.
const SLICE: Duration = Duration::from_millis(200);
/// Between the order and the first message: threads start in this time.
const LEAD: Duration = Duration::from_millis(10);
/// After the last message: what is still on its way, and the last acknowledgement (25 ms), belong to the slice.
const SETTLING: Duration = Duration::from_millis(40);

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

/// Who carries the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Carrier {
    /// Bare sockets that block: what the operating system takes.
    Control,
    /// Raw UDP of mmt, on the single-thread runtime.
    RawUdp,
    /// QUIC as mmt sets it, on the single-thread runtime.
    Quic,
    /// QUIC as mmt sets it, on tokio, as the hosts run it.
    QuicTokio,
}

impl Carrier {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Control, Self::RawUdp, Self::Quic, Self::QuicTokio];

    /// As tables spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::RawUdp => "udp",
            Self::Quic => "quic",
            Self::QuicTokio => "quic-tokio",
        }
    }
}

/// Where messages go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flow {
    /// From one side to the other; nothing of the application's comes back.
    OneWay,
    /// To the other side and back, each.
    RoundTrip,
}

impl Flow {
    /// Both.
    pub const ALL: [Self; 2] = [Self::OneWay, Self::RoundTrip];

    /// As tables spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OneWay => "one way",
            Self::RoundTrip => "round trip",
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
    /// No socket.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The system gave no socket, thread or descriptor, or took one back.
    #[error("the operating system: {0}")]
    System(#[from] io::Error),
    /// The ends cannot have cores of their own.
    #[error("no core for each end: {0}; measure with --cores any")]
    Cores(#[source] io::Error),
    /// The socket cannot be counted.
    #[error(transparent)]
    Meter(#[from] WrapError),
    /// No identity.
    #[error(transparent)]
    Identity(#[from] GenerateError),
    /// TLS could not be set up.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// No endpoint of QUIC.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    /// QUIC cannot connect.
    #[error("QUIC cannot connect: {0}")]
    Connect(#[from] quinn::ConnectError),
    /// A connection of QUIC was lost.
    #[error("the connection was lost: {0}")]
    Lost(#[from] quinn::ConnectionError),
    /// A message was not taken.
    #[error("a message was not taken: {0}")]
    Send(#[from] quinn::SendDatagramError),
    /// Raw UDP cannot connect.
    #[error("raw UDP cannot connect: {0}")]
    Open(#[from] OpenError),
    /// The two sides did not meet in time.
    #[error("the two sides did not meet within 10 s: is loopback filtered?")]
    Handshake,
    /// No histogram.
    #[error("no histogram: {0}")]
    Histogram(String),
    /// A defect of this program.
    #[error("a thread of the measurement panicked")]
    Panicked,
}

/// What takes turns.
enum Rig {
    Control(Control),
    Carried(Box<Carried>),
}

impl Rig {
    fn try_new(
        carrier: Carrier,
        config: &BenchConfig,
        places: &Places,
        clock: Clock,
    ) -> Result<Self, BenchError> {
        Ok(match carrier {
            Carrier::Control => Self::Control(Control::try_new(clock)?),
            carried => Self::Carried(Box::new(Carried::try_new(carried, config, places, clock)?)),
        })
    }

    fn turn(&mut self, places: &Places, slice: &Slice) -> Result<Turn, BenchError> {
        match self {
            Self::Control(control) => control.turn(places, slice),
            Self::Carried(carried) => carried.turn(places, slice),
        }
    }
}

/// Measures every carrier in both flows until the duration is over or `stop` says so; what was measured until then
/// is the result. A first round warms up and is not counted.
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
    let places = Places::try_new(config.cores)?;
    let mut rigs = Vec::new();
    for carrier in Carrier::ALL {
        rigs.push((carrier, Rig::try_new(carrier, config, &places, clock)?));
    }
    let mut ledger = Ledger::try_new()?;
    let mut numbers = 0..;
    let mut round = |rigs: &mut Vec<(Carrier, Rig)>, ledger: Option<&mut Ledger>| {
        let mut turns = Vec::new();
        for flow in Flow::ALL {
            for (carrier, rig) in rigs.iter_mut() {
                let number = numbers.next().unwrap_or_default();
                let start = clock.now() + LEAD;
                let slice = Slice::new(number, flow, config, start);
                turns.push((*carrier, flow, rig.turn(&places, &slice)?));
            }
        }
        // nobody always follows the same one
        rigs.rotate_left(1);
        if let Some(ledger) = ledger {
            for (carrier, flow, turn) in turns {
                ledger.add(carrier, flow, &turn);
            }
        }
        Ok::<(), BenchError>(())
    };
    round(&mut rigs, None)?;
    let end = clock.now() + config.duration;
    loop {
        round(&mut rigs, Some(&mut ledger))?;
        if clock.now() >= end || stop() {
            return Ok(ledger.report(config, places.cores()));
        }
    }
}
