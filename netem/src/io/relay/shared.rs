//! What the relay's thread and its handle share.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use mmt_shared::io::alarm::Alarm;
use serde::Serialize;

use super::error::RelayError;
use crate::config::LinkConfig;
use crate::counters::Tally;
use crate::io::driver::DirectionCounters;
use crate::io::lateness::{Lateness, Recorder};

/// What the relay did so far. The counts of one snapshot are those of one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RelaySnapshot {
    /// From the clients (masters) to the target (slave).
    pub up: DirectionCounters,
    /// From the target (slave) to the clients (masters).
    pub down: DirectionCounters,
    /// Clients that have a place at the relay now.
    pub clients: u64,
    /// Clients that the relay met since its start.
    pub clients_met: u64,
    /// Clients that had to make room for newer ones: there were as many as there can be, and they did not talk with the target.
    pub clients_displaced: u64,
    /// Datagrams from clients for which nobody had to make room, or without a socket to be had: never offered.
    pub refused: Tally,
    /// Datagrams from clients that the kernel dropped because the relay did not read in time: never offered.
    pub overflows_up: u64,
    /// The same of datagrams from the target.
    pub overflows_down: u64,
    /// Times that the target's host answered that nobody listens there (ICMP port unreachable).
    pub unreachable: u64,
    /// Other errors of receiving.
    pub receive_errors: u64,
    /// Times that a client got a new port toward the target.
    pub rebinds: u64,
    /// Packets that the record misses, because the disk was too slow.
    pub unrecorded: u64,
    /// Packets that the capture misses, because the disk was too slow.
    pub uncaptured: u64,
    /// How late packets left, both directions.
    pub lateness: Lateness,
}

/// What the handle asks of the thread.
#[derive(Debug, Default)]
pub(in crate::io) struct Commands {
    pub(in crate::io) links: Option<(LinkConfig, LinkConfig)>,
    pub(super) rebind: bool,
}

/// What the relay's thread and its handle share.
#[derive(Debug)]
pub(in crate::io) struct Shared {
    pub(in crate::io) alarm: Alarm,
    pub(in crate::io) stopping: AtomicBool,
    pub(in crate::io) commands: Mutex<Commands>,
    /// The counts as of the thread's last round, without the lateness.
    pub(in crate::io) board: Mutex<RelaySnapshot>,
    pub(super) lateness: Arc<Recorder>,
    /// Delays up and down since somebody last asked.
    pub(super) delays: [Arc<Recorder>; 2],
}

impl Shared {
    pub(in crate::io) fn try_new() -> Result<Arc<Self>, RelayError> {
        Ok(Arc::new(Self {
            alarm: Alarm::try_new().map_err(RelayError::Thread)?,
            stopping: AtomicBool::new(false),
            commands: Mutex::default(),
            board: Mutex::default(),
            lateness: Arc::default(),
            delays: Default::default(),
        }))
    }
}
