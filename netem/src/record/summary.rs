//! What a record shows of a link: the numbers to hold against the settings, and what to draw.

use std::collections::BTreeMap;

use mmt_shared::stats::values::{mean, quantile, standard_deviation};
use serde::Serialize;

use super::entry::{End, Entry};
use crate::counters::Tally;
use crate::direction::Direction;

/// Beyond this p99.9 of release lateness the emulation is degraded: more than 0.1 % of its packets left later
/// than one tick of the loops.
pub const P999_DEGRADED_US: f64 = 1000.0;

/// Bins of the delay histogram.
const DELAY_BINS: usize = 40;
/// Points of the queue over time.
const QUEUE_POINTS: usize = 200;

/// What one direction did.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Packets offered.
    pub offered: Tally,
    /// Packets and copies sent on.
    pub sent: Tally,
    /// Copies among them.
    pub copies: u64,
    /// Those among them with a bit turned over.
    pub corrupted: u64,
    /// Packets dropped by the link, by the name of the cause; zeros are left out.
    pub dropped: BTreeMap<&'static str, u64>,
    /// Packets that the host could not send.
    pub unsent: u64,
    /// Packets offered per second, from the first to the last offer.
    pub rate_hz: f64,
    /// Mean delay from offer to sending, ms.
    pub mean_ms: f64,
    /// Its standard deviation, ms.
    pub sd_ms: f64,
    /// What 99 % of it does not exceed, ms.
    pub p99_ms: f64,
    /// Share of packets dropped by the link, 0 to 1.
    pub loss: f64,
    /// Mean length of runs of dropped packets, packets; 0 without any.
    pub burst_packets: f64,
    /// Share of what was sent that was sent after a packet offered later (RFC 4737, section 3).
    pub reordered: f64,
    /// Release lateness of the host, us: median, 99th percentile, maximum.
    pub lateness_us: [f64; 3],
    /// Whether the host was too slow for these numbers to be about the link.
    pub degraded: bool,
    /// Delay histogram: lower edge in ms, packets; all bins are equally wide.
    pub delay_histogram: Vec<(f64, u64)>,
    /// Runs of dropped packets: length, how many.
    pub loss_bursts: BTreeMap<u64, u64>,
    /// Backlog over time: seconds from the first offer, most packets in flight since the point before.
    pub queue: Vec<(f64, u32)>,
}

impl Summary {
    /// What the entries of one direction show.
    #[must_use]
    pub fn of(entries: &[Entry], direction: Direction) -> Self {
        let mine = entries.iter().filter(|entry| entry.direction == direction);
        let mut mine: Vec<&Entry> = mine.collect();
        mine.sort_by_key(|entry| (entry.number, is_copy(entry)));
        let mut summary = Self::default();
        summary.count(&mine);
        summary.time(&mine);
        summary.delays(&mine);
        summary.bursts(&mine);
        summary
    }

    fn count(&mut self, mine: &[&Entry]) {
        for entry in mine {
            let bytes = entry.bytes as usize;
            if !is_copy(entry) {
                self.offered.count(bytes);
            }
            match entry.end {
                End::Sent {
                    copy, corrupted, ..
                } => {
                    self.sent.count(bytes);
                    self.copies += u64::from(copy);
                    self.corrupted += u64::from(corrupted);
                }
                End::Dropped(cause) => *self.dropped.entry(cause.name()).or_default() += 1,
                End::Unsent => self.unsent += 1,
            }
        }
        let dropped: u64 = self.dropped.values().sum();
        self.loss = dropped as f64 / self.offered.packets.max(1) as f64;
    }

    fn time(&mut self, mine: &[&Entry]) {
        let (Some(first), Some(last)) = (mine.first(), mine.last()) else {
            return;
        };
        let length = last.offered.saturating_since(first.offered).as_secs_f64();
        if length > 0.0 {
            self.rate_hz = self.offered.packets.saturating_sub(1) as f64 / length;
        }
        let mut points = BTreeMap::new();
        for entry in mine {
            let since = entry.offered.saturating_since(first.offered).as_secs_f64();
            let point = (since / length.max(1e-9) * QUEUE_POINTS as f64) as u32;
            let most = points.entry(point).or_insert(0);
            *most = entry.backlog.max(*most);
        }
        let seconds = |point: u32| f64::from(point) * length / QUEUE_POINTS as f64;
        self.queue = points
            .into_iter()
            .map(|(point, most)| (seconds(point), most))
            .collect();
    }

    fn delays(&mut self, mine: &[&Entry]) {
        let mut by_sending = Vec::new();
        let mut delays_ms = Vec::new();
        let mut late_us = Vec::new();
        for entry in mine {
            if let End::Sent { due, sent, .. } = entry.end {
                delays_ms.push(sent.saturating_since(entry.offered).as_secs_f64() * 1e3);
                late_us.push(sent.saturating_since(due).as_secs_f64() * 1e6);
                by_sending.push((sent, entry.number));
            }
        }
        self.mean_ms = mean(delays_ms.iter().copied()).unwrap_or_default();
        self.sd_ms = standard_deviation(&delays_ms).unwrap_or_default();
        delays_ms.sort_unstable_by(f64::total_cmp);
        late_us.sort_unstable_by(f64::total_cmp);
        let late = |share| quantile(&late_us, share).unwrap_or_default();
        self.p99_ms = quantile(&delays_ms, 0.99).unwrap_or_default();
        self.lateness_us = [0.5, 0.99, 1.0].map(late);
        self.degraded = late(0.999) > P999_DEGRADED_US;
        self.delay_histogram = histogram(&delays_ms);
        by_sending.sort_unstable();
        let late = reordered(by_sending.iter().map(|(_, number)| *number));
        self.reordered = late / delays_ms.len().max(1) as f64;
    }

    fn bursts(&mut self, mine: &[&Entry]) {
        let originals = mine.iter().filter(|entry| !is_copy(entry));
        let lost = originals.map(|entry| matches!(entry.end, End::Dropped(_)));
        self.loss_bursts = runs(lost);
        self.burst_packets = mean_run(&self.loss_bursts);
    }
}

fn is_copy(entry: &Entry) -> bool {
    matches!(entry.end, End::Sent { copy: true, .. })
}

/// How many arrive after one with a higher number.
pub(crate) fn reordered(numbers: impl Iterator<Item = u64>) -> f64 {
    let (mut newest, mut late) = (0, 0.0);
    for number in numbers {
        if number < newest {
            late += 1.0;
        }
        newest = number.max(newest);
    }
    late
}

/// Runs of lost packets: length, how many.
pub(crate) fn runs(lost: impl Iterator<Item = bool>) -> BTreeMap<u64, u64> {
    let mut runs = BTreeMap::new();
    let mut length = 0;
    for lost in lost.chain([false]) {
        if lost {
            length += 1;
        } else if length > 0 {
            *runs.entry(length).or_default() += 1;
            length = 0;
        }
    }
    runs
}

/// The mean length of runs, packets; zero of none.
pub(crate) fn mean_run(runs: &BTreeMap<u64, u64>) -> f64 {
    let packets: u64 = runs.iter().map(|(length, n)| length * n).sum();
    let number: u64 = runs.values().sum();
    packets as f64 / number.max(1) as f64
}

fn histogram(sorted_ms: &[f64]) -> Vec<(f64, u64)> {
    let (Some(low), Some(high)) = (sorted_ms.first(), sorted_ms.last()) else {
        return Vec::new();
    };
    let width = ((high - low) / DELAY_BINS as f64).max(1e-6);
    let mut bins = vec![0; DELAY_BINS];
    for ms in sorted_ms {
        let at = (((ms - low) / width) as usize).min(DELAY_BINS - 1);
        if let Some(bin) = bins.get_mut(at) {
            *bin += 1;
        }
    }
    let edge = |at: usize| low + at as f64 * width;
    let bins = bins.into_iter().enumerate();
    bins.map(|(at, n)| (edge(at), n)).collect()
}
