//! What the wire takes at a time: at a constant rate, and by the opportunities of a trace.

use std::sync::Arc;
use std::time::Duration;

use crate::config::Service;
use crate::trace::mahimahi::{OPPORTUNITY_BYTES, Opportunities};

/// A packet that is heavier than this does not make `CoDel` wait longer: the usual MTU.
const MTU_BYTES: u64 = 1500;

/// How long sending takes what waits, at the rate asked for last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TimeLeft {
    /// Zero: not known.
    pub(super) bits_per_second: u64,
    pub(super) total: Duration,
}

/// The opportunity in use of a trace.
#[derive(Clone, Debug, Default)]
pub(super) struct Opportunity {
    trace: Option<Arc<Opportunities>>,
    number: u64,
    bytes_left: u64,
}

impl TimeLeft {
    pub(super) fn add(&mut self, bytes: u64) {
        if self.bits_per_second > 0 {
            let time = sending_time(self.bits_per_second, bytes);
            self.total = self.total.saturating_add(time);
        }
    }

    pub(super) fn remove(&mut self, bytes: u64) {
        if self.bits_per_second > 0 {
            let time = sending_time(self.bits_per_second, bytes);
            self.total = self.total.saturating_sub(time);
        }
    }
}

impl Opportunity {
    /// The first opportunity of `trace` from `ready` on, and the bytes that are left in it. One that was used
    /// up, or that passed unused, is gone.
    pub(super) fn at(&self, trace: &Arc<Opportunities>, ready: Duration) -> (u64, u64) {
        let first = trace.first_from(ready);
        if !self
            .trace
            .as_ref()
            .is_some_and(|own| Arc::ptr_eq(own, trace))
        {
            return (first, OPPORTUNITY_BYTES);
        }
        if first > self.number || self.bytes_left == 0 {
            return (first.max(self.number), OPPORTUNITY_BYTES);
        }
        (self.number, self.bytes_left)
    }

    /// Uses the next opportunity for `bytes` bytes; returns how many of them it carries.
    pub(super) fn send(&mut self, trace: &Arc<Opportunities>, ready: Duration, bytes: u64) -> u64 {
        let (number, left) = self.at(trace, ready);
        let sent = bytes.min(left);
        *self = Self {
            trace: Some(Arc::clone(trace)),
            number: number.saturating_add(u64::from(sent == left)),
            bytes_left: left - sent,
        };
        sent
    }
}

/// How long `bytes` bytes take on the wire.
pub(super) fn sending_time(bits_per_second: u64, bytes: u64) -> Duration {
    let rate = u128::from(bits_per_second.max(1));
    let nanos = (u128::from(bytes) * 8_000_000_000 + rate / 2) / rate;
    Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
}

/// How long a packet of one MTU takes; on a trace, on average.
pub(super) fn mtu_time(service: &Service) -> Duration {
    match service {
        Service::Constant { bits_per_second } => sending_time(*bits_per_second, MTU_BYTES),
        Service::Opportunities(trace) => {
            let nanos = MTU_BYTES as f64 * 8e9 / trace.mean_bit_s();
            Duration::from_nanos(nanos as u64)
        }
    }
}
