//! What has come of a device so far.

use std::time::Duration;

use mmt_client::device::link::Reading;
use mmt_client::io::device::Seen;
use mmt_shared::stats::histogram::Histogram;
use mmt_shared::time::Time;

/// What has come so far.
#[derive(Debug)]
pub(super) struct Gauge {
    pub(super) first: Option<Time>,
    pub(super) last: Option<Time>,
    pub(super) readings: u64,
    pub(super) interval: Histogram,
    /// How much later than the fastest before it each came by its stamp.
    pub(super) late: Histogram,
    /// Least arrival less stamp, ns.
    fastest: Option<i128>,
    pub(super) range: [(f64, f64); 3],
    pub(super) speed_max: f64,
    pub(super) buttons: u16,
}

impl Default for Gauge {
    fn default() -> Self {
        Self {
            first: None,
            last: None,
            readings: 0,
            interval: Histogram::default(),
            late: Histogram::default(),
            fastest: None,
            range: [(f64::INFINITY, f64::NEG_INFINITY); 3],
            speed_max: 0.0,
            buttons: 0,
        }
    }
}

impl Gauge {
    pub(super) fn take(&mut self, Seen { at, reading }: &Seen) {
        let Reading {
            stamp_ns,
            place,
            velocity,
            buttons,
        } = reading;
        if let Some(last) = self.last {
            self.interval.record(at.saturating_since(last));
        }
        self.first = self.first.or(Some(*at));
        self.last = Some(*at);
        self.readings += 1;
        let delay = i128::from(at.as_nanos()) - i128::from(*stamp_ns);
        let fastest = self.fastest.map_or(delay, |fastest| fastest.min(delay));
        self.fastest = Some(fastest);
        let late = u64::try_from(delay - fastest).unwrap_or(u64::MAX);
        self.late.record(Duration::from_nanos(late));
        for ((least, most), metres) in self.range.iter_mut().zip(place) {
            (*least, *most) = (least.min(*metres), most.max(*metres));
        }
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        self.speed_max = self.speed_max.max(speed);
        self.buttons |= buttons;
    }
}
