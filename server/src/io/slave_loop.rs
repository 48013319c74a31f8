//! The slave's 1 kHz loop: it owns the slave's end and does nothing but tick it.
//!
//! It never waits for the network, locks nothing and logs nothing.

use mmt_shared::io::clock::Clock;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::loop_thread::LoopSide;
use mmt_shared::io::record::Ticked;
use mmt_shared::io::schedule::Tick;
use mmt_shared::io::ticker::{Ticker, TickerReport};
use mmt_shared::io::truth::TruthSender;
use mmt_shared::time::Time;

use super::SlaveLive;
use super::plant_link::PlantPort;
use super::record::{self, SlaveSink};
use crate::end::{SlaveEnd, SlaveGiven};
use crate::feed::{ObserverView, RecentUpdates};
use crate::slave::SlaveTick;

/// A snapshot for the network task every so many ticks: 62 a second.
const SNAPSHOT_TICKS: u64 = 16;

/// What the network task sees of a running loop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Snapshot {
    pub(super) live: SlaveLive,
    /// What observers see; the session's number is not the loop's to know.
    pub(super) view: ObserverView,
    /// When a datagram of the master last arrived; none before the loop's first snapshot.
    pub(super) last_arrival: Option<Time>,
    /// The plant that is plugged in is silent: the tool stands.
    pub(super) plant_silent: bool,
    /// The session has used up its datagram numbers.
    pub(super) numbers_spent: bool,
    /// The tool stands for good.
    pub(super) disengaged: bool,
}

/// What the loop ends with.
pub(super) struct Finished {
    /// The slave's end as the session left it.
    pub(super) end: SlaveEnd,
    /// How the loop kept its time.
    pub(super) ticker: TickerReport,
}

/// The loop.
pub(super) struct SlaveLoop {
    pub(super) end: SlaveEnd,
    /// The way of the true poses to the report of a master in this process.
    pub(super) truth: Option<TruthSender>,
    pub(super) numbers_spent: bool,
    pub(super) newest: Option<SlaveTick>,
    /// For observers.
    updates: RecentUpdates,
    /// Where the session is recorded, if anybody wants that.
    record: Option<SlaveSink>,
    /// The emergency stop of this side.
    emergency: EmergencyStop,
    /// The plant that is plugged in, where one is.
    plant: Option<PlantPort>,
}

impl SlaveLoop {
    pub(super) fn new(end: SlaveEnd, truth: Option<TruthSender>, emergency: EmergencyStop) -> Self {
        Self {
            end,
            truth,
            numbers_spent: false,
            newest: None,
            updates: RecentUpdates::default(),
            record: None,
            emergency,
            plant: None,
        }
    }

    /// The same whose tool is this plant's.
    pub(super) fn plugged_into(mut self, plant: Option<PlantPort>) -> Self {
        self.plant = plant;
        self
    }

    /// The same with a record of all that it is given and does.
    pub(super) fn recorded(mut self, record: SlaveSink) -> Self {
        self.record = Some(record);
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
            self.tick(tick, &mut side, || clock.now());
            if tick.index.is_multiple_of(SNAPSHOT_TICKS) {
                self.show(tick.deadline, &mut side);
            }
        }
        // what came before the end counts
        while self.receive(&mut side) > 0 {}
        Finished {
            end: self.end,
            ticker: ticker.report(),
        }
    }

    /// One tick, at its deadline: the stamp is free of wake-up jitter. `now` is when what it sends leaves.
    pub(super) fn tick(
        &mut self,
        tick: Tick,
        side: &mut LoopSide<Snapshot>,
        now: impl FnOnce() -> Time,
    ) {
        self.receive(side);
        let given = self.given(tick.deadline);
        let done = self.end.tick(tick.deadline, &given);
        if let (Some(plant), Some(command)) = (&mut self.plant, self.end.plant_command()) {
            plant.send(&command);
        }
        if let Some(tick) = done {
            if let Some(truth) = &mut self.truth {
                truth.send(tick.stamp, tick.truth);
            }
            if let Some(update) = tick.update {
                self.updates.push(update);
            }
            self.newest = Some(tick);
        }
        let sent = now();
        if let Some(record) = &mut self.record {
            record.ticked(Ticked {
                tick,
                given,
                sent,
                done,
            });
        }
        side.send(sent, |out| match self.end.poll_transmit(sent, out) {
            Ok(length) => {
                let bytes = out.get(..length?).unwrap_or_default();
                if let Some(record) = &mut self.record {
                    record.sent(sent, bytes);
                }
                length
            }
            Err(_) => {
                self.numbers_spent = true;
                None
            }
        });
    }

    /// What the tick at `now` is given: a silent plant stops the tool as an emergency stop does.
    fn given(&mut self, now: Time) -> SlaveGiven {
        let plant = self.plant.as_mut().and_then(|plant| plant.receive(now));
        let stops = self.plant_is_silent(now) || self.emergency.is_set();
        SlaveGiven { stops, plant }
    }

    fn plant_is_silent(&self, now: Time) -> bool {
        let plant = self.plant.as_ref();
        plant.is_some_and(|plant| plant.is_silent(now))
    }

    fn show(&mut self, now: Time, side: &mut LoopSide<Snapshot>) {
        let snapshot = self.snapshot(now);
        if let Some(sink) = &mut self.record {
            sink.shown(now, record::shown(&snapshot.live, &self.end));
        }
        side.publish(snapshot);
    }

    /// Handles what has arrived; returns how many datagrams that were.
    fn receive(&mut self, side: &mut LoopSide<Snapshot>) -> usize {
        let mut handled = 0;
        for frame in side.arrivals() {
            self.end.handle_datagram(frame.at, frame.bytes());
            if let Some(record) = &mut self.record {
                record.arrived(&frame);
            }
            handled += 1;
        }
        handled
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
            stopped_by: end.stopped_by(),
            // what the model starts from, until there is more
            estimate: [estimate.m, estimate.b, estimate.c],
            ..SlaveLive::default()
        };
        for (slot, (_, count)) in live.updates.iter_mut().zip(end.counts().updates.by_cause()) {
            *slot = count;
        }
        if let Some(tick) = &self.newest {
            live = SlaveLive {
                f_s: tick.f_s,
                f_shadow: tick.f_shadow,
                tool: tick.tool,
                truth: tick.truth,
                footprint: Some(slave.environment().footprint()),
                in_contact: tick.in_contact,
                ..live
            };
        }
        Snapshot {
            live,
            view: ObserverView {
                session: 0,
                updates: self.updates,
                scene: self.newest.as_ref().map(|tick| slave.scene(tick)),
                stopped: end.stopped_by().is_some(),
            },
            last_arrival: Some(channel.last_arrival()),
            plant_silent: self.plant_is_silent(now),
            numbers_spent: self.numbers_spent,
            disengaged: end.is_disengaged(),
        }
    }
}
