//! The haptic loop: one tick around the master's core, and the two ends by which it meets the network.
//!
//! A tick never waits, never allocates, never logs and never takes a lock: updates come through a
//! latest-wins cell, samples leave through a bounded ring, a screen's look through another cell. No
//! thread is started here, so a test can tick it by hand.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use mmt_shared::geometry::Vec2;
use mmt_shared::io::schedule::Tick;
use mmt_shared::io::ticker::TickerReport;
use mmt_shared::io::wake::Waker;
use mmt_shared::metrics::{AgeOfInformation, ContactBreaks, ForcePeak};
use mmt_shared::time::Time;
use mmt_shared::wire::{HipSample, Update};
use triple_buffer::{Input, Output, triple_buffer};

use super::{MasterLive, SessionEnd};
use crate::failsafe::LinkState;
use crate::master::{Master, MasterTick};
use crate::operator::Operator;

/// Samples that may wait for the network task: a quarter of a second. Older ones the slave would not
/// play any more; when the ring is full the new one is dropped and counted.
pub const RING_SAMPLES: usize = 256;
/// A look for a screen every so many ticks: 50 a second.
const LOOK_TICKS: u64 = 20;

/// What a haptic loop is made of.
#[derive(Debug)]
pub struct HapticParts {
    /// The master's core.
    pub master: Master,
    /// Who moves the HIP.
    pub operator: Operator,
    /// How long; for ever if absent.
    pub duration: Option<Duration>,
    /// The network task is woken once for so many samples.
    pub samples_per_wake: u8,
}

/// What both ends look at.
#[derive(Debug)]
struct Signals {
    last_heard_ns: AtomicU64,
    release: AtomicBool,
    ended: AtomicBool,
}

/// What the loop did, once it has ended.
#[derive(Clone, Copy, Debug)]
pub struct HapticOutcome {
    /// Why it ended; none if it was asked to.
    pub end: Option<SessionEnd>,
    /// From the first to the last tick.
    pub duration: Duration,
    /// The loop's own time.
    pub timing: TickerReport,
    /// Updates that reached the model.
    pub applied: u32,
    /// Updates that came after the hand had been released.
    pub frozen: u32,
    /// Samples dropped because the ring was full.
    pub samples_dropped: u64,
    /// Device readings that were not finite.
    pub bad_readings: u64,
    /// Wanted forces that were not finite.
    pub forces_rejected: u64,
    /// Pushes completed; none for a path.
    pub pushes: Option<u64>,
    /// Breaks of contact.
    pub breaks: ContactBreaks,
    /// Force on the hand.
    pub on_hand: ForcePeak,
    /// Age of the news that the model rests on.
    pub age: AgeOfInformation,
}

/// The haptic loop's own end. It belongs to one thread.
#[derive(Debug)]
pub struct HapticLoop {
    master: Master,
    operator: Operator,
    duration: Option<Duration>,
    samples_per_wake: u8,
    unwoken: u8,
    updates: Output<Option<Update>>,
    samples: rtrb::Producer<HipSample>,
    look: Input<MasterLive>,
    signals: Arc<Signals>,
    waker: Waker,
    first: Option<Time>,
    elapsed: Duration,
    ticks: u64,
    skipped: u64,
    timing: TickerReport,
    releasing: bool,
    end: Option<SessionEnd>,
    hand_force: Vec2,
    newest_answer: Option<Time>,
    samples_dropped: u64,
    breaks: ContactBreaks,
    on_hand: ForcePeak,
    age: AgeOfInformation,
}

/// The network task's end.
#[derive(Debug)]
pub struct HapticPort {
    updates: Input<Option<Update>>,
    samples: rtrb::Consumer<HipSample>,
    look: Output<MasterLive>,
    signals: Arc<Signals>,
    superseded: u32,
}

/// Tells the network task that the loop is no more, however it ended: also by a panic.
#[derive(Debug)]
pub(super) struct Gone {
    signals: Arc<Signals>,
    waker: Waker,
}

impl Drop for Gone {
    fn drop(&mut self) {
        self.signals.ended.store(true, Ordering::Release);
        self.waker.wake();
    }
}

impl HapticLoop {
    /// A loop and the network task's end of it. The slave counts as heard at `began`; `waker` wakes the
    /// network task.
    #[must_use]
    pub fn new(parts: HapticParts, began: Time, waker: Waker) -> (Self, HapticPort) {
        let signals = Arc::new(Signals {
            last_heard_ns: AtomicU64::new(began.as_nanos()),
            release: AtomicBool::new(false),
            ended: AtomicBool::new(false),
        });
        let (updates_in, updates) = triple_buffer(&None);
        let (samples, samples_out) = rtrb::RingBuffer::new(RING_SAMPLES);
        let (look, look_out) = triple_buffer(&MasterLive::default());
        let port = HapticPort {
            updates: updates_in,
            samples: samples_out,
            look: look_out,
            signals: Arc::clone(&signals),
            superseded: 0,
        };
        let haptic = Self {
            master: parts.master,
            operator: parts.operator,
            duration: parts.duration,
            samples_per_wake: parts.samples_per_wake.max(1),
            unwoken: 0,
            updates,
            samples,
            look,
            signals,
            waker,
            first: None,
            elapsed: Duration::ZERO,
            ticks: 0,
            skipped: 0,
            timing: TickerReport::default(),
            releasing: false,
            end: None,
            hand_force: Vec2::zeros(),
            newest_answer: None,
            samples_dropped: 0,
            breaks: ContactBreaks::default(),
            on_hand: ForcePeak::default(),
            age: AgeOfInformation::default(),
        };
        (haptic, port)
    }

    /// One sample period. Breaks when the session is over and no force is left on the hand, which is
    /// 200 ticks after its end at the latest.
    pub fn tick(&mut self, tick: Tick) -> ControlFlow<()> {
        // the deadline and not the wake: all stamps lie on one grid of whole milliseconds
        let stamp = tick.deadline;
        self.elapsed = stamp.saturating_since(*self.first.get_or_insert(stamp));
        self.ticks = self.ticks.saturating_add(1);
        self.skipped = self.skipped.saturating_add(tick.skipped);
        self.take_update(stamp);
        self.consider_end();
        let view = self.master.view();
        let hip = self.operator.step(self.elapsed, &view, self.hand_force);
        let done = self.master.tick(stamp, hip, self.signals.silence(stamp));
        self.hand_force = done.hand_force;
        self.on_hand.push(done.hand_force);
        self.breaks.push(done.rendered.in_contact());
        if done.link == LinkState::Released && !self.releasing {
            self.end.get_or_insert(SessionEnd::LinkSilent);
        }
        self.give(done.sample);
        let at_rest = self.master.limiter().at_rest();
        if at_rest || self.ticks.is_multiple_of(LOOK_TICKS) {
            self.show(&done);
        }
        match at_rest {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// Takes note of how the loop's thread keeps its time.
    pub fn note_timing(&mut self, timing: &TickerReport) {
        self.timing = *timing;
    }

    /// The master's core.
    #[must_use]
    pub fn master(&self) -> &Master {
        &self.master
    }

    /// What the loop did.
    #[must_use]
    pub fn outcome(&self) -> HapticOutcome {
        HapticOutcome {
            end: self.end,
            duration: self.elapsed,
            timing: self.timing,
            applied: self.master.applied(),
            frozen: self.master.frozen(),
            samples_dropped: self.samples_dropped,
            bad_readings: self.master.bad_readings(),
            forces_rejected: self.master.limiter().rejected(),
            pushes: self.operator.pushes_completed(),
            breaks: self.breaks,
            on_hand: self.on_hand,
            age: self.age,
        }
    }

    pub(super) fn gone(&self) -> Gone {
        Gone {
            signals: Arc::clone(&self.signals),
            waker: self.waker.clone(),
        }
    }

    fn take_update(&mut self, now: Time) {
        if self.updates.update()
            && let Some(update) = self.updates.output_buffer()
        {
            let before = self.master.applied();
            self.master.apply(update);
            if self.master.applied() != before {
                self.newest_answer = Some(update.answers);
            }
        }
        if let Some(answers) = self.newest_answer {
            self.age.push(now, answers);
        }
    }

    /// Begins to release the hand when the session is over, for whatever reason.
    fn consider_end(&mut self) {
        if self.releasing {
            return;
        }
        let over = self.duration.is_some_and(|most| self.elapsed >= most);
        if over {
            self.end.get_or_insert(SessionEnd::DurationOver);
        } else if self.operator.finished(self.elapsed) {
            self.end.get_or_insert(SessionEnd::OperatorFinished);
        }
        if self.end.is_some() || self.signals.release.load(Ordering::Acquire) {
            self.releasing = true;
            self.master.release();
        }
    }

    fn give(&mut self, sample: HipSample) {
        if self.samples.push(sample).is_err() {
            self.samples_dropped = self.samples_dropped.saturating_add(1);
        }
        self.unwoken = self.unwoken.saturating_add(1);
        if self.unwoken >= self.samples_per_wake {
            self.unwoken = 0;
            self.waker.wake();
        }
    }

    fn show(&mut self, done: &MasterTick) {
        let state = self.master.model().state();
        let params = &state.params;
        *self.look.input_buffer_mut() = MasterLive {
            elapsed_s: self.elapsed.as_secs_f64(),
            hip: done.sample.hip.metres(),
            f_m: done.rendered.force,
            hand_force: done.hand_force,
            model: state.pose,
            footprint: Some(state.footprint),
            params: [params.m(), params.b(), params.c()],
            in_contact: done.rendered.in_contact(),
            updates_applied: u64::from(self.master.applied()),
            pushes: self.operator.pushes_completed(),
            link: done.link,
            rtt_ms: None,
            loss: (None, None),
            lateness_p99_us: self.timing.lateness.p99.as_secs_f64() * 1e6,
            skipped: self.skipped,
            ended: self.end,
        };
        self.look.publish();
    }
}

impl Signals {
    fn silence(&self, now: Time) -> Duration {
        let heard = Time::from_nanos(self.last_heard_ns.load(Ordering::Acquire));
        now.saturating_since(heard)
    }
}

impl HapticPort {
    /// Puts an update into the cell; one that no tick has taken yet is superseded.
    pub fn offer(&mut self, update: &Update) {
        *self.updates.input_buffer_mut() = Some(*update);
        let overtook = self.updates.publish();
        self.superseded = self.superseded.saturating_add(u32::from(overtook));
    }

    /// Says when the slave was last heard.
    pub fn heard(&self, at: Time) {
        self.signals
            .last_heard_ns
            .store(at.as_nanos(), Ordering::Release);
    }

    /// Asks the loop to release the hand and to end.
    pub fn release(&self) {
        self.signals.release.store(true, Ordering::Release);
    }

    /// Whether the loop's thread has ended.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.signals.ended.load(Ordering::Acquire)
    }

    /// The oldest sample that waits.
    pub fn pop(&mut self) -> Option<HipSample> {
        self.samples.pop().ok()
    }

    /// The newest look, without what only the network knows.
    pub fn look(&mut self) -> MasterLive {
        *self.look.read()
    }

    /// Updates that a newer one overtook before a tick could take them.
    #[must_use]
    pub fn superseded(&self) -> u32 {
        self.superseded
    }

    /// Whether an update waits that no tick has taken: once the loop has ended, none will.
    #[must_use]
    pub fn untaken(&self) -> bool {
        !self.updates.consumed()
    }
}
