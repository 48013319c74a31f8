//! The hand at a device that is plugged in, whatever its protocol: readings in, what the hand does ([`HandEvent`]) out, and the
//! force that may act on it.
//!
//! Pure. The hand is held from a press of the button to its release; where the HIP was then it goes on. A reading that cannot
//! be, or of a place where the device may not be, lets the hand go, and no force acts until the button has been up. The same
//! where the loop has let it go: at an emergency stop, a pause, a new session. Of a device without a button, rest is the
//! press: see [`Hold::Rest`](super::link::Hold::Rest).

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;

use super::link::config::{DeviceLinkConfig, DeviceLinkError, Hold};
use crate::operator::pointer::{HandEvent, PointerSample};

/// A loop of which no tick has been seen for so long is taken for gone: no force.
const LOOP_SILENCE: Duration = Duration::from_millis(50);
/// A loop that does not hold what is held here for so many ticks has let it go: all the events that may wait for it are taken by then.
const LET_GO_TICKS: u64 = 20;
/// For so long after the button is up the force of the ramp goes out: its 200 ms and some periods.
const RAMP_OUT: Duration = Duration::from_millis(210);
/// How far a reading may be from the one before besides what the greatest speed allows, m: quantization and noise.
const STEP_SLACK_M: f64 = 1e-3;
/// A device within this of one place is at rest, m: what a hand that means to stand still shakes by.
const REST_M: f64 = 2e-3;
/// A device that has rested for so long is held, ns.
const REST_NS: u64 = 1_000_000_000;

/// What a device measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// When, ns, by a clock that may begin anywhere and does not go back.
    pub stamp_ns: u64,
    /// Where the device is along its axes, m.
    pub place: [f64; 3],
    /// How fast, m/s. It has to be finite, and is not used: the HIP's is found from the places.
    pub velocity: [f64; 3],
    /// A bit for each button, the first is bit 0.
    pub buttons: u16,
}

/// What a tick of the haptic loop gives the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandOutput {
    /// Number of the tick, from 1; 0: no loop runs.
    pub tick: u64,
    /// Force on the hand as it left the limiter, N, world.
    pub force: Vec2,
    /// The HIP, m, world.
    pub hip: Vec2,
    /// Whether force may act on the hand.
    pub engaged: bool,
    /// Whether the HIP touches the model.
    pub in_contact: bool,
    /// Whether an emergency stop is set.
    pub stopped: bool,
    /// Whether nothing has come from the slave for 120 ms or more.
    pub link_late: bool,
}

/// What acts on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Action {
    /// Force along the device's axes, N.
    pub(super) force: [f64; 3],
    /// Whether a loop runs.
    pub(super) runs: bool,
    /// Whether the force may act.
    pub(super) acts: bool,
    /// Whether the button has to be up before it counts.
    pub(super) refused: bool,
}

/// The hand.
#[derive(Clone, Debug)]
pub(super) struct Hand {
    config: DeviceLinkConfig,
    /// Stamp and place of the newest reading that could be, ns and m.
    newest: Option<(u64, [f64; 3])>,
    /// Stamp that the times of readings count from, ns.
    first_ns: u64,
    grip: Grip,
    /// Where the device rests since when, m and ns.
    rests: Option<([f64; 3], u64)>,
    /// When the hand was held last; none if it never was, or was taken away.
    held: Option<Time>,
    /// The newest tick that was seen, and when it was new.
    ticked: (u64, Time),
    /// The tick since which the loop does not hold what is held here.
    unheld: Option<u64>,
    /// When something came last over a line that is the device's own.
    last_packet: Option<Time>,
    seen: Option<Reading>,
}

/// What the button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Grip {
    /// It must be seen up first.
    Barred,
    /// It is up.
    Up,
    /// It holds the hand.
    Held,
}

impl Hand {
    /// A hand of which nothing has come yet.
    ///
    /// # Errors
    /// Names the first number that is not accepted.
    pub(super) fn try_new(config: DeviceLinkConfig) -> Result<Self, DeviceLinkError> {
        config.check()?;
        Ok(Self {
            config,
            newest: None,
            first_ns: 0,
            grip: Grip::Barred,
            rests: None,
            held: None,
            ticked: (0, Time::ZERO),
            unheld: None,
            last_packet: None,
            seen: None,
        })
    }

    /// Takes in a reading, and gives what the hand does by it. Whether it could be.
    pub(super) fn take(&mut self, reading: &Reading, mut give: impl FnMut(HandEvent)) -> bool {
        self.seen = Some(*reading);
        let Reading {
            stamp_ns,
            place,
            velocity,
            ..
        } = *reading;
        let finite = place.iter().chain(&velocity).all(|n| n.is_finite());
        if !finite || !self.follows(stamp_ns, place) {
            self.anew(give);
            return false;
        }
        let Some(at) = self.config.world(place) else {
            self.newest = Some((stamp_ns, place));
            self.let_go(&mut give);
            return false;
        };
        self.hold(reading, at, give);
        true
    }

    /// Lets the hand go; the next reading is the first of its clock.
    pub(super) fn anew(&mut self, mut give: impl FnMut(HandEvent)) {
        self.let_go(&mut give);
        give(HandEvent::NewPage);
        self.newest = None;
    }

    /// Something comes over a line that is the device's own: after a silence everything begins anew.
    pub(super) fn note_packet(&mut self, now: Time, give: impl FnMut(HandEvent)) {
        if self.is_silent(now) {
            self.anew(give);
        }
        self.last_packet = Some(now);
    }

    /// Whether nothing has come for too long over a line that is the device's own.
    pub(super) fn is_silent(&self, now: Time) -> bool {
        let silence = self.config.tuning().silence;
        self.last_packet
            .is_none_or(|at| now.saturating_since(at) >= silence)
    }

    /// The newest reading as it came, once.
    pub(super) fn seen(&mut self) -> Option<Reading> {
        self.seen.take()
    }

    /// What acts on the device, by the newest tick.
    pub(super) fn act(&mut self, now: Time, output: &HandOutput) -> Action {
        if output.tick != self.ticked.0 {
            self.ticked = (output.tick, now);
        }
        let runs = output.tick > 0 && now.saturating_since(self.ticked.1) < LOOP_SILENCE;
        self.follow_loop(runs, output);
        if self.grip == Grip::Held {
            self.held = Some(now);
        }
        // whoever else moves the hand moves no device that nobody holds
        let ramps = |held| now.saturating_since(held) < RAMP_OUT;
        let acts = runs && self.held.is_some_and(ramps);
        let force = if acts { output.force } else { Vec2::zeros() };
        Action {
            force: self.config.device(force),
            runs,
            acts,
            refused: self.grip == Grip::Barred,
        }
    }

    /// Ends a grip that the loop has ended; the force of its ramp still acts.
    fn follow_loop(&mut self, runs: bool, output: &HandOutput) {
        let holds = output.engaged && !output.stopped;
        let unheld = runs && self.grip == Grip::Held && !holds;
        // a new session begins to count anew
        let since = self.unheld.unwrap_or(output.tick).min(output.tick);
        self.unheld = unheld.then_some(since);
        if unheld && output.tick - since >= LET_GO_TICKS {
            (self.grip, self.rests) = (Grip::Barred, None);
        }
    }

    /// Whether a reading can follow the newest: later, and no further than the greatest speed allows.
    fn follows(&self, stamp_ns: u64, place: [f64; 3]) -> bool {
        let Some((then_ns, then)) = self.newest else {
            return true;
        };
        let silence_s = self.config.tuning().silence.as_secs_f64();
        let passed_s = (stamp_ns.saturating_sub(then_ns) as f64 * 1e-9).min(silence_s);
        let way = distance(place, then);
        stamp_ns > then_ns && way <= self.config.speed_max_m_per_s * passed_s + STEP_SLACK_M
    }

    /// A reading that can be, at `at` (m, world).
    fn hold(&mut self, reading: &Reading, at: Vec2, mut give: impl FnMut(HandEvent)) {
        if self.newest.is_none() {
            self.first_ns = reading.stamp_ns;
        }
        self.newest = Some((reading.stamp_ns, reading.place));
        let page_s = reading.stamp_ns.saturating_sub(self.first_ns) as f64 * 1e-9;
        let sample = PointerSample { page_s, at };
        let pressed = match self.config.hold {
            Hold::Button => reading.buttons >> self.config.button & 1 == 1,
            Hold::Rest => self.grip == Grip::Held || self.rests(reading),
        };
        self.grip = match (self.grip, pressed) {
            (Grip::Barred | Grip::Up, false) => {
                give(HandEvent::Clock(page_s));
                Grip::Up
            }
            (Grip::Up, true) => {
                give(HandEvent::Press(sample));
                Grip::Held
            }
            (Grip::Held, true) => {
                give(HandEvent::Move(sample));
                Grip::Held
            }
            (Grip::Held, false) => {
                give(HandEvent::Release);
                Grip::Up
            }
            (Grip::Barred, true) => Grip::Barred,
        };
    }

    /// Whether the device has rested for long enough.
    fn rests(&mut self, reading: &Reading) -> bool {
        let stays = |(place, _): &([f64; 3], u64)| distance(*place, reading.place) <= REST_M;
        let new = (reading.place, reading.stamp_ns);
        let (_, since_ns) = *self.rests.insert(self.rests.filter(stays).unwrap_or(new));
        reading.stamp_ns.saturating_sub(since_ns) >= REST_NS
    }

    fn let_go(&mut self, give: &mut impl FnMut(HandEvent)) {
        if self.grip == Grip::Held {
            give(HandEvent::Release);
        }
        (self.grip, self.held, self.rests) = (Grip::Barred, None, None);
    }
}

/// m.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let way = a.iter().zip(b).map(|(a, b)| a - b);
    way.fold(0.0, |sum, part| sum + part * part).sqrt()
}
