//! What is measured: the configuration with its ranges, the carriers, and what can go wrong.

use std::io;
use std::time::Duration;

use mmt_shared::wire::DATAGRAM_MAX;

use crate::io::failure::Failure;

/// The shortest message, bytes: its stamp and the number of its slice.
pub const BYTES_MIN: usize = 16;
/// The longest message, bytes: the longest of the protocol.
pub const BYTES_MAX: usize = DATAGRAM_MAX;
/// Messages a second at most.
pub const RATE_MAX: u32 = 10_000;

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
    Cores(#[source] io::Error),
    /// The machine gave no socket, thread or connection, or took one back.
    #[error(transparent)]
    Failed(#[from] Failure),
}

/// Where the two ends run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cores {
    /// Each end on a core of its own that never sleeps, as on two hosts that are set up for low latency; on a machine
    /// with one core as [`Cores::Any`].
    #[default]
    Own,
    /// Where the kernel puts them, which for two threads that wake each other is mostly one core.
    Any,
}

impl Cores {
    /// As the command spells it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Any => "any",
        }
    }

    /// In words, after "over loopback,".
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Own => "each end on a core of its own that stays awake",
            Self::Any => "each end where the kernel puts it",
        }
    }
}
