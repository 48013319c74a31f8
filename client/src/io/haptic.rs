//! The haptic loop: the operator and the master's end, tick by tick.
//!
//! A tick never waits, never allocates, never logs and never takes a lock. No thread is started here, so a test can tick
//! it by hand.

use std::ops::ControlFlow;
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::loop_thread::LoopSide;
use mmt_shared::io::record::Ticked;
use mmt_shared::io::schedule::Tick;
use mmt_shared::io::ticker::{Ticker, TickerReport};
use mmt_shared::io::truth::TruthReceiver;
use mmt_shared::metrics::PoseError;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;

use super::device::DevicePort;
use super::hand_events::HandEvents;
use super::record::{self, MasterSink};
use super::{MasterLive, SessionEnd};
use crate::device::link::HandOutput;
use crate::end::{MasterEnd, MasterGiven};
use crate::failsafe::LinkState;
use crate::master::MasterTick;
use crate::operator::Operator;
use crate::path::PathRecorder;

mod snapshot;

/// A snapshot for a screen every so many ticks: 62 a second.
const SNAPSHOT_TICKS: u64 = 16;
/// The loop computes its own quantiles, which takes microseconds, every so many ticks.
const TIMING_TICKS: u64 = 500;
/// Events of a person that a tick takes in at most: a pointer gives one or two in a millisecond.
const EVENTS_PER_TICK: usize = 64;
/// True poses that a tick judges at most: it must not grow long when the slave catches up.
const TRUTHS_PER_TICK: usize = 4;

/// The haptic loop. It belongs to one thread, which hands it back when it ends.
#[derive(Debug)]
pub struct HapticLoop {
    pub(super) end: MasterEnd,
    pub(super) operator: Operator,
    /// The emergency stop of this side.
    emergency: EmergencyStop,
    /// Where the HIP was read last, m.
    pub(super) reading: Vec2,
    /// What a person does, where one operates.
    events: Option<HandEvents>,
    /// The device that is plugged in, where one is.
    pub(super) device: Option<DevicePort>,
    /// How long; for ever if absent.
    duration: Option<Duration>,
    /// The true pose, where the slave lives in this process: for the report.
    truth: Option<TruthReceiver>,
    /// Where the path of the session is kept, if anybody wants it.
    pub(super) path: Option<PathRecorder>,
    /// Where the session is recorded, if anybody wants that.
    record: Option<MasterSink>,
    first: Option<Time>,
    /// From the first to the newest tick.
    pub(super) elapsed: Duration,
    ticks: u64,
    skipped: u64,
    pub(super) timing: TickerReport,
    releasing: bool,
    /// Why it ends; none if it was asked to.
    pub(super) why: Option<SessionEnd>,
    pub(super) hand_force: Vec2,
    /// Error of the model's pose; empty where the truth is not known.
    pub(super) pose: PoseError,
}

impl HapticLoop {
    /// A loop around an end, with somebody who moves the HIP, for a while or for ever.
    pub fn new(end: MasterEnd, operator: Operator, duration: Option<Duration>) -> Self {
        Self {
            end,
            reading: operator.start(),
            operator,
            emergency: EmergencyStop::default(),
            events: None,
            device: None,
            duration,
            truth: None,
            path: None,
            record: None,
            first: None,
            elapsed: Duration::ZERO,
            ticks: 0,
            skipped: 0,
            timing: TickerReport::default(),
            releasing: false,
            why: None,
            hand_force: Vec2::zeros(),
            pose: PoseError::default(),
        }
    }

    /// The same with what reports need: the true pose, where the slave lives in this process, and a recorder of the path.
    #[must_use]
    pub fn observed_by(mut self, truth: Option<TruthReceiver>, path: Option<PathRecorder>) -> Self {
        (self.truth, self.path) = (truth, path);
        self
    }

    /// The same, operated by whoever fills these events.
    #[must_use]
    pub fn operated_through(mut self, events: Option<HandEvents>) -> Self {
        self.events = events;
        self
    }

    /// The same, its hand at this device.
    #[must_use]
    pub fn plugged_into(mut self, device: Option<DevicePort>) -> Self {
        self.device = device;
        self
    }

    /// The same with an emergency stop that others set.
    #[must_use]
    pub fn stopped_by(mut self, emergency: EmergencyStop) -> Self {
        self.emergency = emergency;
        self
    }

    /// The same with a record of all that it is given and does.
    #[must_use]
    pub fn recorded(mut self, record: MasterSink) -> Self {
        self.record = Some(record);
        self
    }

    /// Ticks until the session is over and no force is left on the hand.
    pub fn run(mut self, mut side: LoopSide<MasterLive>, mut ticker: Ticker, clock: Clock) -> Self {
        loop {
            let tick = ticker.wait();
            if tick.index % TIMING_TICKS == TIMING_TICKS / 2 {
                self.timing = ticker.report();
            }
            if self.tick(tick, &mut side, || clock.now()).is_break() {
                break;
            }
        }
        // what came before the end counts
        while self.receive(&mut side) > 0 {}
        self.timing = ticker.report();
        self
    }

    /// One sample period; `now` is when what it sends leaves. Breaks when the session is over and no force is left on
    /// the hand, which is 200 ticks after its end at the latest.
    pub fn tick(
        &mut self,
        tick: Tick,
        side: &mut LoopSide<MasterLive>,
        now: impl FnOnce() -> Time,
    ) -> ControlFlow<()> {
        // the deadline and not the wake: all stamps lie on one grid of whole milliseconds
        let stamp = tick.deadline;
        let elapsed = stamp.saturating_since(*self.first.get_or_insert(stamp));
        let period = elapsed.saturating_sub(self.elapsed);
        self.elapsed = elapsed;
        self.ticks = self.ticks.saturating_add(1);
        self.skipped = self.skipped.saturating_add(tick.skipped);
        self.receive(side);
        self.handle_events(stamp);
        let releases = self.consider_end(side.is_stopped());
        let given = self.read_hand(period, releases);
        let done = self.end.tick(stamp, &given);
        self.hand_force = done.hand_force;
        self.judge_pose();
        self.judge_tick(done.link);
        self.give_device(&done);
        let sent = now();
        if let Some(record) = &mut self.record {
            record.ticked(Ticked {
                tick,
                given,
                sent,
                done,
            });
        }
        self.transmit(side, sent);
        // a hand that is let go is at rest too
        let at_rest = self.releasing && self.end.master().limiter().at_rest();
        if at_rest || self.ticks.is_multiple_of(SNAPSHOT_TICKS) {
            self.show(&done, stamp, side);
        }
        if at_rest {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// What the tick is given: the hand is where it was while either side's emergency stop is set.
    fn read_hand(&mut self, period: Duration, releases: bool) -> MasterGiven {
        let view = self.end.update_model();
        let stops = self.emergency.is_set();
        if stops || self.end.channel().other().stopped {
            self.operator.stand(period);
        } else {
            self.reading = self.operator.step(self.elapsed, &view, self.hand_force);
        }
        MasterGiven {
            reading: self.reading,
            engaged: self.operator.engaged(),
            releases,
            stops,
        }
    }

    /// Notes the reason if a tick has shown that the session cannot go on.
    fn judge_tick(&mut self, link: LinkState) {
        if link == LinkState::Released && !self.releasing {
            self.why.get_or_insert(SessionEnd::LinkSilent);
        }
        if self.end.master().model().not_finite() > 0 {
            self.why.get_or_insert(SessionEnd::ModelBroken);
        }
    }

    /// The master's end.
    pub fn end(&self) -> &MasterEnd {
        &self.end
    }

    /// What a person or a device did and found no room on its way here.
    pub(super) fn hand_events_lost(&self) -> u64 {
        let events = self.events.as_ref().map(HandEvents::lost);
        let device = self.device.as_ref().map(DevicePort::events_lost);
        events.into_iter().chain(device).sum()
    }

    /// Where a device is plugged in it is the one hand.
    fn handle_events(&mut self, now: Time) {
        let has_device = self.device.is_some();
        let others = self.events.iter_mut();
        let others = others.flat_map(|events| std::iter::from_fn(|| events.next_event()));
        let others = others.take(EVENTS_PER_TICK);
        let others = others.filter(|event| !has_device || event.goes_beside_a_device());
        let device = self.device.iter_mut();
        let device = device.flat_map(|device| std::iter::from_fn(|| device.event()));
        for event in others.chain(device.take(EVENTS_PER_TICK)) {
            self.operator.handle(self.elapsed, event);
            if let Some(record) = &mut self.record
                && let Some(reading) = record::reading(now, &event)
            {
                record.read(reading);
            }
        }
    }

    fn give_device(&mut self, done: &MasterTick) {
        if let Some(device) = &mut self.device {
            device.give(HandOutput {
                tick: 0,
                force: done.hand_force,
                hip: done.sample.hip.metres(),
                engaged: self.end.master().limiter().engaged(),
                in_contact: done.rendered.in_contact(),
                stopped: self.end.stopped_by().is_some(),
                link_late: done.link > LinkState::Fresh,
            });
        }
    }

    /// Handles what has arrived; returns how many datagrams that were.
    fn receive(&mut self, side: &mut LoopSide<MasterLive>) -> usize {
        let mut handled = 0;
        for frame in side.arrivals() {
            self.end.handle_datagram(frame.at, frame.bytes());
            if let Some(record) = &mut self.record {
                record.arrived(&frame);
            }
            if let Some(path) = &mut self.path {
                path.note(frame.at, self.end.channel().peer());
            }
            handled += 1;
        }
        handled
    }

    fn transmit(&mut self, side: &mut LoopSide<MasterLive>, now: Time) {
        // a session whose numbers are used up falls silent, which ends it
        side.send(now, |out| {
            let length = self.end.poll_transmit(now, out).ok().flatten()?;
            if let (Some(record), Some(bytes)) = (&mut self.record, out.get(..length)) {
                record.sent(now, bytes);
            }
            Some(length)
        });
    }

    fn show(&mut self, done: &MasterTick, now: Time, side: &mut LoopSide<MasterLive>) {
        let live = self.snapshot(done, now);
        if let Some(sink) = &mut self.record {
            let twist = self.end.master().model().state().twist;
            sink.shown(now, record::shown(&live, twist));
        }
        side.publish(live);
    }

    /// Holds the model as it was at a HIP sample against the object as the tool met it for the same sample.
    fn judge_pose(&mut self) {
        let truths = self
            .truth
            .iter_mut()
            .flat_map(|truth| std::iter::from_fn(|| truth.receive()).take(TRUTHS_PER_TICK));
        for (stamp, truth) in truths {
            if let Some(then) = self.end.master().model().history().at(stamp) {
                self.pose.push(&then.motion.pose, &truth);
            }
        }
    }

    /// Begins to release the hand when the session is over, for whatever reason; whether it did now.
    fn consider_end(&mut self, is_stopped: bool) -> bool {
        if self.releasing {
            return false;
        }
        if self.duration.is_some_and(|most| self.elapsed >= most) {
            self.why.get_or_insert(SessionEnd::DurationOver);
        } else if self.operator.finished(self.elapsed) {
            self.why.get_or_insert(SessionEnd::OperatorFinished);
        }
        self.releasing = self.why.is_some() || is_stopped;
        self.releasing
    }
}
