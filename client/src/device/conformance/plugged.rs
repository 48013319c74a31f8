//! A device at a haptic loop of which only the operator and the limiter of a session are there; time is virtual.

use std::time::Duration;

use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};
use mmt_shared::time::{TICK, Time};

use super::rigs::Rig;
use crate::device::DeviceProfile;
use crate::device::link::{DeviceLinkConfig, HandOutput, Hold};
use crate::limiter::ForceLimiter;
use crate::operator::Operator;
use crate::operator::pointer::{Driver, HandEvent, Person};
use crate::operator::scripted::{Scripted, ScriptedConfig, View};

/// What the model presses with where a test asks for a force that no limit touches, N, world.
pub(super) const GENTLE: Vec2 = Vec2::new(0.6, -0.8);

fn view() -> View {
    View {
        pose: Pose::default(),
        footprint: BoxFootprint::square(0.4),
        in_contact: false,
    }
}

fn person(config: &DeviceLinkConfig) -> Operator {
    let scripted = Scripted::try_new(ScriptedConfig::default(), view()).unwrap();
    let person = Person::new(scripted, Driver::Pointer, config.tuning());
    Operator::Person(Box::new(person))
}

/// What ends a grip, though the device does not let go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Interruption {
    Stop,
    Pause,
    NewSession,
}

/// A device at a haptic loop of which only hand and limiter are there.
pub(super) struct Plugged {
    pub(super) rig: Box<dyn Rig>,
    pub(super) config: DeviceLinkConfig,
    operator: Operator,
    limiter: ForceLimiter,
    stopped: bool,
    pub(super) now: Time,
    pub(super) ticks: u64,
    pub(super) hip: Vec2,
    pub(super) wanted: Vec2,
    /// What acts at the tool, N, device.
    pub(super) acts: [f64; 3],
    events: Vec<HandEvent>,
}

impl Plugged {
    pub(super) fn new(rig: Box<dyn Rig>) -> Self {
        let config = rig.config();
        let profile = DeviceProfile::plugged_in(&config).unwrap();
        let operator = person(&config);
        Self {
            config,
            hip: operator.start(),
            operator,
            limiter: ForceLimiter::try_new(profile.limits()).unwrap(),
            stopped: false,
            now: Time::from_millis(7),
            ticks: 0,
            wanted: GENTLE,
            acts: [0.0; 3],
            events: Vec::new(),
            rig,
        }
    }

    /// The middle of the workspace, and from there along the world's x and y, m of the device.
    pub(super) fn place(&self, x: f64, y: f64) -> [f64; 3] {
        let [dx, dy, dz] = self.config.device(Vec2::new(x, y));
        let [cx, cy, cz] = self.config.centre_m;
        [cx + dx, cy + dy, cz + dz]
    }

    /// A force on the device as the world has it, N.
    pub(super) fn in_world(&self) -> Vec2 {
        let [x, y] = [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)]
            .map(|axis| self.config.device(axis))
            .map(|along| along.iter().zip(self.acts).map(|(a, f)| a * f).sum());
        Vec2::new(x, y)
    }

    /// A millisecond in which `come` may bring something; then the loop ticks and the device gets its answer.
    pub(super) fn step(
        &mut self,
        come: impl FnOnce(&mut dyn Rig, Time, &mut dyn FnMut(HandEvent)),
    ) {
        self.now += Duration::from_millis(1);
        self.events.clear();
        let Self { rig, events, .. } = self;
        come(&mut **rig, self.now, &mut |event| events.push(event));
        let elapsed = self.now.saturating_since(Time::ZERO);
        for event in &self.events {
            self.operator.handle(elapsed, *event);
        }
        if self.stopped {
            self.operator.stand(TICK);
        } else {
            self.hip = self.operator.step(elapsed, &view(), Vec2::zeros());
        }
        if self.operator.engaged() {
            self.limiter.engage();
        } else {
            self.limiter.release();
        }
        self.ticks += 1;
        let output = HandOutput {
            tick: self.ticks,
            force: self.limiter.limit(self.wanted),
            hip: self.hip,
            engaged: self.operator.engaged(),
            in_contact: true,
            stopped: self.stopped,
            ..HandOutput::default()
        };
        self.acts = self.rig.acts(self.now, &output);
    }

    pub(super) fn at(&mut self, place: [f64; 3], down: bool) {
        self.step(|rig, now, give| rig.reading(now, place, down, give));
    }

    pub(super) fn nothing(&mut self, ms: u64) {
        for _ in 0..ms {
            self.step(|rig, now, give| rig.silence(now, give));
        }
    }

    /// Takes hold of the device there: with its button, else by resting.
    pub(super) fn grip(&mut self, place: [f64; 3]) {
        self.at(place, false);
        self.at(place, false);
        match self.config.hold {
            Hold::Button => self.at(place, true),
            Hold::Rest => {
                for _ in 0..1000 {
                    if !self.held() {
                        self.at(place, false);
                    }
                }
            }
        }
        assert!(self.held(), "{}: {:?}", self.rig.name(), self.events);
    }

    pub(super) fn held(&self) -> bool {
        self.operator.engaged()
    }

    /// The session is interrupted for so long, ms, while the device stands there; the greatest change of what acts, N.
    pub(super) fn interrupted(&mut self, by: Interruption, place: [f64; 3], ms: u64) -> f64 {
        let elapsed = self.now.saturating_since(Time::ZERO);
        match by {
            Interruption::Stop => self.stopped = true,
            Interruption::Pause => self.operator.handle(elapsed, HandEvent::Pause(true)),
            Interruption::NewSession => (self.operator, self.ticks) = (person(&self.config), 0),
        }
        let (mut most, mut last) = (0.0_f64, self.in_world());
        for _ in 0..ms {
            self.at(place, true);
            most = most.max((self.in_world() - last).norm());
            last = self.in_world();
        }
        self.stopped = false;
        self.operator.handle(elapsed, HandEvent::Pause(false));
        most
    }

    /// Whether the HIP is there, but for what adding and taking away rounds.
    pub(super) fn hip_is(&self, there: Vec2) -> bool {
        (self.hip - there).norm() < 1e-12
    }

    /// Whether something acts on the device.
    pub(super) fn pushed(&self) -> bool {
        self.acts.iter().any(|newtons| newtons.abs() > 1e-9)
    }

    /// Held, with all of the gentle force.
    pub(super) fn pushing(rig: Box<dyn Rig>) -> Self {
        let mut plugged = Self::new(rig);
        let place = plugged.place(0.0, 0.0);
        plugged.grip(place);
        (0..250).for_each(|_| plugged.at(place, true));
        assert!(plugged.pushed(), "{}", plugged.rig.name());
        plugged
    }
}
