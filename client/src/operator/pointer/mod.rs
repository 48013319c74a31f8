//! A person at a pointer (mouse, pen or finger in a browser) or at a haptic device; until they press, the scripted operator
//! may work.
//!
//! The pointer moves the HIP as a hand on a table moves a cursor: a press engages where the HIP is, the way of the
//! pointer from there is the way of the HIP. Its readings carry the stamps of its own clock, that of the page or the device.
//! They are mapped to the loop's clock (`clock_map`), read at 1 kHz a fixed play-out later (`resampler`) and filtered
//! (`filter`). A hand that lets go or falls silent is released: the HIP stays, and no force is left on the hand.
//!
//! Pure and without allocation in a tick; a reading that is not finite is not taken.

mod clock_map;
mod filter;
mod resampler;
mod sample;
#[cfg(test)]
mod tests;

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use serde::{Deserialize, Serialize};

use super::scripted::{Scripted, View};
use clock_map::ClockMap;
use filter::Filter;
use resampler::Resampler;
pub use sample::PointerSample;

/// How the readings of a hand are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandTuning {
    /// From a reading's stamp to its use, s: a reading that is no later than this is in time.
    pub playout_s: f64,
    /// Whether the low-pass and its speed limit follow; a device has a mass of its own.
    pub low_pass: bool,
    /// A pressed hand of which nothing came for so long is let go: it sends while it is pressed, even at rest.
    pub silence: Duration,
}

impl HandTuning {
    /// Of a pointer in a browser. A page reads its pointer every 1 to 16 ms and hands readings over up to a frame late:
    /// with this one that is late by 24 ms is still in time. It adds to the filter's 27 ms.
    pub const POINTER: Self = Self {
        playout_s: 0.024,
        low_pass: true,
        silence: Duration::from_millis(120),
    };
}

/// The HIP stays within this of the origin on each axis, m.
pub const REACH_M: f64 = 1.5;

/// Who moves the HIP of a person's session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Driver {
    /// The scripted operator.
    #[default]
    Scripted,
    /// The pointer.
    Pointer,
}

/// What a person does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandEvent {
    /// Another page, with another clock, has the pointer.
    NewPage,
    /// What the page's clock shows, s.
    Clock(f64),
    /// The pointer is pressed: whoever moved the HIP, now the pointer does.
    Press(PointerSample),
    /// The pressed pointer is here.
    Move(PointerSample),
    /// The pointer is let go.
    Release,
    /// Who moves the HIP from now on.
    Drive(Driver),
    /// Whether the hand rests.
    Pause(bool),
    /// The session is to end.
    Finish,
}

/// The operator.
#[derive(Clone, Debug)]
pub struct Person {
    scripted: Scripted,
    driver: Driver,
    tuning: HandTuning,
    paused: bool,
    finished: bool,
    clock: ClockMap,
    readings: Resampler,
    filter: Filter,
    hip: Vec2,
    /// From the pointer to the HIP, m, while it is pressed.
    grip: Option<Vec2>,
    /// When the last reading of the pressed pointer came.
    last_reading: Duration,
}

impl Person {
    /// A person who begins where `scripted` does; until the first press `driver` moves the HIP.
    pub fn new(scripted: Scripted, driver: Driver, tuning: HandTuning) -> Self {
        let hip = scripted.hip();
        Self {
            scripted,
            driver,
            tuning,
            paused: false,
            finished: false,
            clock: ClockMap::default(),
            readings: Resampler::new(),
            filter: Filter::at_rest(hip),
            hip,
            grip: None,
            last_reading: Duration::ZERO,
        }
    }

    /// Goes on from a HIP (m, world), at rest there.
    pub(super) fn go_on_from(&mut self, hip: Vec2) {
        self.scripted.go_on_from(hip);
        self.filter = Filter::at_rest(hip);
        self.hip = hip;
    }

    /// Where the HIP is, m, world.
    pub fn hip(&self) -> Vec2 {
        self.hip
    }

    /// The scripted operator's share.
    pub fn scripted(&self) -> &Scripted {
        &self.scripted
    }

    /// Who moves the HIP.
    pub fn driver(&self) -> Driver {
        self.driver
    }

    /// Whether the hand rests.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Whether the session is to end.
    pub fn finished(&self) -> bool {
        self.finished
    }

    /// Whether a hand holds the device: only then force may act on it.
    pub fn engaged(&self) -> bool {
        !self.paused && (self.driver == Driver::Scripted || self.grip.is_some())
    }

    /// Takes in what the person did; it arrived at `now`, in the time since the first tick.
    pub fn handle(&mut self, now: Duration, event: HandEvent) {
        match event {
            HandEvent::NewPage => {
                self.let_go();
                self.clock = ClockMap::default();
            }
            HandEvent::Clock(page_s) if page_s.is_finite() => {
                self.clock.push(now.as_secs_f64(), page_s);
            }
            HandEvent::Press(sample) if sample.is_finite() => self.press(now, sample),
            HandEvent::Move(sample) if sample.is_finite() && self.grip.is_some() => {
                self.read(now, sample);
            }
            HandEvent::Release => self.let_go(),
            HandEvent::Drive(driver) => self.drive(driver),
            HandEvent::Pause(paused) => {
                self.paused = paused;
                self.let_go();
                self.scripted.go_on_from(self.hip);
            }
            HandEvent::Finish => self.finished = true,
            HandEvent::Clock(_) | HandEvent::Press(_) | HandEvent::Move(_) => {}
        }
    }

    /// One sample period: the HIP, m. As [`super::Operator::step`].
    pub fn step(&mut self, elapsed: Duration, view: &View, force_on_hand: Vec2) -> Vec2 {
        if elapsed.saturating_sub(self.last_reading) >= self.tuning.silence {
            self.let_go();
        }
        if self.paused {
            return self.hip;
        }
        self.hip = match self.driver {
            Driver::Scripted => self.scripted.step(view, force_on_hand),
            Driver::Pointer => self.follow(elapsed).unwrap_or(self.hip),
        };
        self.hip
    }

    fn press(&mut self, now: Duration, sample: PointerSample) {
        if self.paused {
            return;
        }
        self.drive(Driver::Pointer);
        self.let_go();
        self.grip = Some(self.hip - sample.at);
        self.read(now, sample);
    }

    fn read(&mut self, now: Duration, sample: PointerSample) {
        self.clock.push(now.as_secs_f64(), sample.page_s);
        self.readings.push(sample);
        self.last_reading = now;
    }

    /// The HIP stays where it is.
    pub(super) fn let_go(&mut self) {
        self.grip = None;
        self.readings.clear();
        self.filter = Filter::at_rest(self.hip);
    }

    fn drive(&mut self, driver: Driver) {
        if driver != self.driver {
            self.driver = driver;
            self.let_go();
            self.scripted.go_on_from(self.hip);
        }
    }

    /// One tick behind the pointer; none while nobody presses.
    fn follow(&mut self, elapsed: Duration) -> Option<Vec2> {
        let grip = self.grip?;
        let page_s = self.clock.page_s(elapsed.as_secs_f64())?;
        let target = self.readings.at(page_s - self.tuning.playout_s)? + grip;
        let within = target.map(|metres| metres.clamp(-REACH_M, REACH_M));
        Some(if self.tuning.low_pass {
            self.filter.step(within)
        } else {
            within
        })
    }
}

impl HandEvent {
    /// Whether a console may send it beside a device, which is the one hand and works alone.
    pub fn goes_beside_a_device(&self) -> bool {
        matches!(self, Self::Pause(_) | Self::Finish)
    }
}
