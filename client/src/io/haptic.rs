//! The haptic loop: one tick around the master's core, and the two ends by which it meets the network.
//!
//! A tick never waits, never allocates, never logs and never takes a lock: updates come through a
//! latest-wins cell, samples leave through a bounded ring, a screen's look through another cell. No
//! thread is started here, so a test can tick it by hand.

mod port;

use std::ops::ControlFlow;
use std::time::Duration;

use mmt_shared::io::schedule::Tick;
use mmt_shared::io::ticker::TickerReport;
use mmt_shared::io::truth::TruthReceiver;
use mmt_shared::io::wake::Waker;
use mmt_shared::metrics::{AgeOfInformation, ContactBreaks, ForcePeak, PoseError};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;

use super::{MasterLive, SessionEnd};
use crate::failsafe::LinkState;
use crate::master::{Master, MasterTick};
use crate::operator::Operator;
use crate::tdpa::TdpaHand;

pub(super) use port::Gone;
use port::LoopEnd;
pub use port::{HapticPort, RING_SAMPLES, Said};

/// A look for a screen every so many ticks: 50 a second.
const LOOK_TICKS: u64 = 20;
/// True poses that a tick judges at most: it must not grow long when the slave catches up.
const TRUTHS_PER_TICK: usize = 4;

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
    /// The true pose, where the slave lives in this process: for the report.
    pub truth: Option<TruthReceiver>,
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
    /// Error of the model's pose; empty where the truth is not known.
    pub pose: PoseError,
    /// The smoothed round trip of the tool's force in the end, s; only where the hand felt it.
    pub round_trip_s: Option<f64>,
    /// Energy that updates added to the model beyond what its tank paid, J.
    pub energy_injected_j: f64,
    /// The least that the passivity observer at the hand showed, J.
    pub observer_min_j: f64,
}

/// The haptic loop's own end. It belongs to one thread.
#[derive(Debug)]
pub struct HapticLoop {
    master: Master,
    operator: Operator,
    duration: Option<Duration>,
    samples_per_wake: u8,
    unwoken: u8,
    port: LoopEnd,
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
    truth: Option<TruthReceiver>,
    pose: PoseError,
}

impl HapticLoop {
    /// A loop and the network task's end of it. The slave counts as heard at `began`; `waker` wakes the
    /// network task.
    #[must_use]
    pub fn new(parts: HapticParts, began: Time, waker: Waker) -> (Self, HapticPort) {
        let (loop_end, port) = port::ends(began, waker);
        let haptic = Self {
            master: parts.master,
            operator: parts.operator,
            duration: parts.duration,
            samples_per_wake: parts.samples_per_wake.max(1),
            unwoken: 0,
            port: loop_end,
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
            truth: parts.truth,
            pose: PoseError::default(),
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
        if let Some((at, tool)) = self.port.newest_tool() {
            self.master.handle_tool_state(*at, tool);
        }
        self.consider_end();
        let view = self.master.view();
        let hip = self.operator.step(self.elapsed, &view, self.hand_force);
        let done = self.master.tick(stamp, hip, self.port.silence(stamp));
        self.hand_force = done.hand_force;
        self.on_hand.push(done.hand_force);
        self.breaks.push(self.master.view().in_contact);
        self.judge_pose();
        if done.link == LinkState::Released && !self.releasing {
            self.end.get_or_insert(SessionEnd::LinkSilent);
        }
        self.give(Said {
            sample: done.sample,
            port: done.port,
        });
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
            pose: self.pose,
            round_trip_s: self.master.tdpa().and_then(TdpaHand::round_trip_s),
            energy_injected_j: self.master.energy_injected_j(),
            observer_min_j: self.master.port().least_j(),
        }
    }

    pub(super) fn gone(&self) -> Gone {
        self.port.gone()
    }

    fn take_update(&mut self, now: Time) {
        if let Some(update) = self.port.newest() {
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

    /// Holds the model as it was at a HIP sample against the object as the tool met it for the same sample.
    fn judge_pose(&mut self) {
        let truths = self
            .truth
            .iter_mut()
            .flat_map(|truth| std::iter::from_fn(|| truth.receive()).take(TRUTHS_PER_TICK));
        for (stamp, truth) in truths {
            if let Some(then) = self.master.model().history().at(stamp) {
                self.pose.push(&then.motion.pose, &truth);
            }
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
        if self.end.is_some() || self.port.asked_to_release() {
            self.releasing = true;
            self.master.release();
        }
    }

    fn give(&mut self, said: Said) {
        if !self.port.give(said) {
            self.samples_dropped = self.samples_dropped.saturating_add(1);
        }
        self.unwoken = self.unwoken.saturating_add(1);
        if self.unwoken >= self.samples_per_wake {
            self.unwoken = 0;
            self.port.wake();
        }
    }

    fn show(&mut self, done: &MasterTick) {
        let state = self.master.model().state();
        let params = &state.params;
        self.port.show(MasterLive {
            elapsed_s: self.elapsed.as_secs_f64(),
            hip: done.sample.hip.metres(),
            f_m: done.felt,
            hand_force: done.hand_force,
            model: state.pose,
            footprint: Some(state.footprint),
            params: [params.m(), params.b(), params.c()],
            in_contact: self.master.view().in_contact,
            updates_applied: u64::from(self.master.applied()),
            pushes: self.operator.pushes_completed(),
            link: done.link,
            scene: None,
            scene_age_s: None,
            rtt_ms: None,
            loss: (None, None),
            lateness_p99_us: self.timing.lateness.p99.as_secs_f64() * 1e6,
            skipped: self.skipped,
            ended: self.end,
        });
    }
}
