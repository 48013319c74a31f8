//! The slave's 1 kHz loop: it owns the slave's end and does nothing but tick it.
//!
//! It never waits for the network, locks nothing and logs nothing.

use mmt_shared::io::clock::Clock;
use mmt_shared::io::input_log::InputLog;
use mmt_shared::io::loop_thread::LoopSide;
use mmt_shared::io::ticker::{Ticker, TickerReport};
use mmt_shared::io::truth::TruthSender;
use mmt_shared::time::Time;
use mmt_shared::wire::Hello;

use super::SlaveLive;
use crate::end::SlaveEnd;
use crate::slave::SlaveTick;

/// A snapshot for the network task every so many ticks: 50 a second.
const SNAPSHOT_TICKS: u64 = 20;

/// What the network task sees of a running loop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Snapshot {
    pub(super) live: SlaveLive,
    /// When a datagram of the master last arrived; none before the loop's first snapshot.
    pub(super) last_arrival: Option<Time>,
    /// The session has used up its datagram numbers.
    pub(super) numbers_spent: bool,
}

/// What the loop ends with.
pub(super) struct Finished {
    /// The slave's end as the session left it.
    pub(super) end: SlaveEnd,
    /// How the loop kept its time.
    pub(super) ticker: TickerReport,
    pub(super) record: Option<SlaveRecord>,
}

/// The beginning of a session: what the end was made of, its inputs, and what its ticks gave.
#[derive(Clone, Debug)]
pub struct SlaveRecord {
    /// When the end began.
    pub began: Time,
    /// The hello that it was made for.
    pub hello: Hello,
    /// What came.
    pub log: InputLog<(), Option<SlaveTick>>,
}

/// The loop.
pub(super) struct SlaveLoop {
    pub(super) end: SlaveEnd,
    /// The way of the true poses to the report of a master in this process.
    pub(super) truth: Option<TruthSender>,
    pub(super) numbers_spent: bool,
    pub(super) newest: Option<SlaveTick>,
    /// The inputs, if anybody wants to run them again.
    pub(super) record: Option<SlaveRecord>,
}

impl SlaveLoop {
    pub(super) fn new(end: SlaveEnd, truth: Option<TruthSender>) -> Self {
        Self {
            end,
            truth,
            numbers_spent: false,
            newest: None,
            record: None,
        }
    }

    /// The same with a record of the first so many inputs of a session that `hello` opened.
    pub(super) fn recorded(mut self, inputs: usize, hello: Hello) -> Self {
        self.record = Some(SlaveRecord {
            began: self.end.channel().began(),
            hello,
            log: InputLog::with_room(inputs),
        });
        self
    }

    /// Ticks until it is stopped.
    pub(super) fn run(
        mut self,
        mut side: LoopSide<Snapshot>,
        mut ticker: Ticker,
        clock: Clock,
    ) -> Finished {
        while !side.is_stopped() {
            let tick = ticker.wait();
            self.tick(tick.deadline, &mut side, || clock.now());
            if tick.index.is_multiple_of(SNAPSHOT_TICKS) {
                side.publish(self.snapshot(tick.deadline));
            }
        }
        // what came before the end counts
        self.receive(&mut side);
        Finished {
            end: self.end,
            ticker: ticker.report(),
            record: self.record,
        }
    }

    /// One tick, at its deadline: the stamp is free of wake-up jitter. `now` is when what it sends leaves.
    pub(super) fn tick(
        &mut self,
        deadline: Time,
        side: &mut LoopSide<Snapshot>,
        now: impl FnOnce() -> Time,
    ) {
        self.receive(side);
        let done = self.end.tick(deadline);
        if let Some(tick) = done {
            if let Some(truth) = &mut self.truth {
                truth.send(tick.stamp, tick.truth);
            }
            self.newest = Some(tick);
        }
        let now = now();
        side.send(now, |out| match self.end.poll_transmit(now, out) {
            Ok(length) => length,
            Err(_) => {
                self.numbers_spent = true;
                None
            }
        });
        if let Some(record) = &mut self.record {
            record.log.keep_tick(deadline, (), now, done);
        }
    }

    fn receive(&mut self, side: &mut LoopSide<Snapshot>) {
        while let Some(frame) = side.next_arrival() {
            self.end.handle_datagram(frame.at, frame.bytes());
            if let Some(record) = &mut self.record {
                record.log.keep_frame(&frame);
            }
        }
    }

    fn snapshot(&self, now: Time) -> Snapshot {
        let (end, slave) = (&self.end, self.end.slave());
        let (channel, estimate) = (end.channel(), slave.estimate());
        let median = channel.peer().round_trip().histogram().quantile(0.5);
        let mut live = SlaveLive {
            connected: true,
            elapsed_s: now.saturating_since(channel.began()).as_secs_f64(),
            rtt_ms: median.map(|rtt| rtt.as_secs_f64() * 1e3),
            up: channel.peer().incoming(),
            ..SlaveLive::default()
        };
        for (slot, (_, count)) in live.updates.iter_mut().zip(end.counts().updates.by_cause()) {
            *slot = count;
        }
        if let Some(tick) = &self.newest {
            live = SlaveLive {
                f_s: tick.f_s,
                f_shadow: tick.f_shadow,
                estimate: [estimate.m, estimate.b, estimate.c],
                tool: tick.tool,
                truth: tick.truth,
                footprint: Some(slave.environment().footprint()),
                in_contact: tick.in_contact,
                ..live
            };
        }
        Snapshot {
            live,
            last_arrival: Some(channel.last_arrival()),
            numbers_spent: self.numbers_spent,
        }
    }
}
