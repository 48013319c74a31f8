//! What the tool meets: the simulated world, or a plant of somebody else's behind the object's plug.
//!
//! Both are met through `Plant::meet`: the tool's place in, what was measured out. Pure: a plant that is plugged in gives its
//! answers as inputs ([`PlantAnswer`]) and takes commands as outputs ([`PlantCommand`]), so that a session with it runs again
//! from its record. Its answer to a command counts in the next tick.

mod follower;
mod packet;
#[cfg(test)]
mod tests;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::settings::Mode;
use mmt_shared::range::{OutOfRange, in_range};
use mmt_shared::time::{TICK_S, Time};
use serde::{Deserialize, Serialize};

use crate::environment::Environment;
use crate::estimator::ToolGives;
use crate::motion_limits::MotionLimits;
use crate::sensing::{Sensed, Sensing, SensorFaults, VisionSample};
use follower::Follower;

pub use packet::{PlantAnswer, PlantCommand, SILENCE};

/// Accepted greatest acceleration of the tool, m/s².
const ACCELERATION_MAX_M_PER_S2: (f64, f64) = (0.5, 100.0);

/// For so many periods the tool of a plant is taken to move on as it was measured last.
const MOVES_ON: u32 = 20;

/// Accepted friction of a plant's tool: beyond it the force of a box may point at any face.
const TOOL_FRICTION: (f64, f64) = (0.0, 0.5);

/// What the tool meets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlantConfig {
    /// Whether a plant is plugged in. Default: no, the simulated world.
    pub link: bool,
    /// Greatest acceleration of the tool that a plant is sent, m/s². Default 13, what the manual of a common arm allows.
    pub acceleration_max_m_per_s2: f64,
    /// Largest coefficient of friction that the plant's tool may have on what it pushes: images tell a force that friction turns
    /// from a box that is turned. 0: the tool is smooth. Default 0.2. Paper mode takes every tool for smooth (III-A).
    pub tool_friction: f64,
}

impl PlantConfig {
    /// The friction of the tool that a slave in this mode reckons with; the tool of the simulated world is smooth.
    pub(crate) fn friction_in(&self, mode: Mode) -> f64 {
        match mode {
            Mode::Recommended if self.link => self.tool_friction,
            _ => 0.0,
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// Names the one that is out of range or not a number.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        in_range(
            "plant: acceleration_max",
            "m/s^2",
            self.acceleration_max_m_per_s2,
            ACCELERATION_MAX_M_PER_S2,
        )?;
        in_range(
            "plant: tool_friction",
            "",
            self.tool_friction,
            TOOL_FRICTION,
        )
    }
}

impl Default for PlantConfig {
    fn default() -> Self {
        Self {
            link: false,
            acceleration_max_m_per_s2: 13.0,
            tool_friction: 0.2,
        }
    }
}

/// What the tool met in one tick.
pub(crate) struct Met {
    /// What the sensors gave.
    pub(crate) sensed: Sensed,
    /// The contact force as it is, N; of a plant that is plugged in as it measured it.
    pub(crate) force: Vec2,
    /// The object's pose then: true, or as a plant saw it last.
    pub(crate) pose: Pose,
    /// Number of the body that is touched, or was last.
    pub(crate) body: usize,
}

/// Behind one interface: the world of `environment`, or somebody else's.
pub(crate) enum Plant {
    /// The simulated world with the slave's sensors.
    World {
        /// The bodies and their ground.
        environment: Box<Environment>,
        /// What the slave measures of them.
        sensing: Box<Sensing>,
    },
    /// One that is plugged in and measures for itself.
    Linked(Box<LinkedPlant>),
}

impl Plant {
    /// So many ticks, after which the tool is at `tool` (m) and has moved at `velocity` (m/s); what is measured then. `body` was
    /// touched last.
    pub(crate) fn meet(
        &mut self,
        now: Time,
        ticks: u32,
        tool: Vec2,
        velocity: Vec2,
        body: usize,
    ) -> Met {
        match self {
            Self::World {
                environment,
                sensing,
            } => {
                // the world waits for no slave that misses ticks
                for missed in (1..ticks).rev() {
                    environment.step(tool - velocity * (f64::from(missed) * TICK_S), velocity);
                }
                let met = environment.step(tool, velocity);
                if met.body != body {
                    sensing.drop_images();
                }
                Met {
                    sensed: sensing.sense(now, tool, met.force, &met.pose),
                    force: met.force,
                    pose: met.pose,
                    body: met.body,
                }
            }
            Self::Linked(plant) => plant.meet(now, tool, velocity),
        }
    }

    /// How many images no tick was given.
    pub(crate) fn images_dropped(&self) -> u64 {
        match self {
            Self::World { sensing, .. } => sensing.images_dropped(),
            Self::Linked(plant) => plant.images_dropped,
        }
    }

    /// The bodies: the truth, or what stands for a plant's object where it was seen last.
    pub(crate) fn environment(&self) -> &Environment {
        match self {
            Self::World { environment, .. } => environment,
            Self::Linked(plant) => &plant.stand_in,
        }
    }

    /// The same, to be changed.
    pub(crate) fn environment_mut(&mut self) -> &mut Environment {
        match self {
            Self::World { environment, .. } => environment,
            Self::Linked(plant) => &mut plant.stand_in,
        }
    }

    /// From now on this of the simulated world's sensors is broken.
    pub(crate) fn set_sensor_faults(&mut self, faults: SensorFaults) {
        if let Self::World { sensing, .. } = self {
            sensing.set_faults(faults);
        }
    }

    /// The plant that is plugged in; none in the simulated world.
    pub(crate) fn linked(&self) -> Option<&LinkedPlant> {
        match self {
            Self::World { .. } => None,
            Self::Linked(plant) => Some(plant),
        }
    }

    /// The same, to be given answers.
    pub(crate) fn linked_mut(&mut self) -> Option<&mut LinkedPlant> {
        match self {
            Self::World { .. } => None,
            Self::Linked(plant) => Some(plant),
        }
    }
}

/// The slave's end of the object's plug.
pub(crate) struct LinkedPlant {
    /// The configured object, where the plant's was seen last.
    stand_in: Environment,
    follower: Follower,
    /// `k_p` and `k_d` that the tool is to meet things with.
    coupling: Coupling,
    force_max_n: f64,
    gives: ToolGives,
    newest: Option<PlantAnswer>,
    /// Place (m) and velocity (m/s) of its tool as measured last, and for how many periods nothing newer has been.
    motion: Option<(Vec2, Vec2)>,
    age: u32,
    /// How far the tool gives by its own spring and damper, m.
    given: Vec2,
    /// An image that no tick has taken yet.
    image: Option<VisionSample>,
    /// Images that a newer one took the place of before a tick took them.
    images_dropped: u64,
    command: Option<PlantCommand>,
}

impl LinkedPlant {
    /// A plant that has not answered yet. `stand_in` is the configured object; the tool meets things with `coupling`, and `gives` by
    /// itself or by the slave's compliance.
    pub(crate) fn new(
        config: PlantConfig,
        stand_in: Environment,
        coupling: Coupling,
        (speed_max_m_per_s, force_max_n): (f64, f64),
        gives: ToolGives,
    ) -> Self {
        let limits = MotionLimits {
            speed_m_per_s: speed_max_m_per_s,
            acceleration_m_per_s2: config.acceleration_max_m_per_s2,
        };
        Self {
            stand_in,
            follower: Follower::new(limits),
            coupling,
            force_max_n,
            gives,
            newest: None,
            motion: None,
            age: 0,
            given: Vec2::zeros(),
            image: None,
            images_dropped: 0,
            command: None,
        }
    }

    /// Puts the tool to a place, m: where the plant's tool is.
    pub(crate) fn place(&mut self, tool: Vec2) {
        self.follower.place(tool);
        self.command = Some(self.commanded(tool, Vec2::zeros()));
    }

    /// Takes in an answer that came at `now`.
    pub(crate) fn take(&mut self, now: Time, answer: &PlantAnswer) {
        if let Some(pose) = answer.object {
            self.stand_in.place(&[pose]);
            let age_ns = (answer.image_age_s * 1e9) as i64;
            let image = VisionSample {
                taken: now.offset_by(-age_ns),
                pose,
            };
            let overtaken = self.image.replace(image).is_some();
            self.images_dropped += u64::from(overtaken);
        }
        self.newest = Some(*answer);
    }

    /// Where the tool has to go; none before its first place is known.
    pub(crate) fn command(&self) -> Option<PlantCommand> {
        self.command
    }

    fn meet(&mut self, _now: Time, tool: Vec2, velocity: Vec2) -> Met {
        let (at, speed) = self.follower.step(tool, velocity);
        self.command = Some(self.commanded(at, speed));
        let (measured, force) = self.measured_by_now().unwrap_or((at, Vec2::zeros()));
        // what the model renders as penetration of the HIP is how far the tool gives
        if self.gives == ToolGives::ByPlant {
            let given = |f, before| self.coupling.penetration(f, before, TICK_S);
            self.given = force.zip_map(&self.given, given);
        }
        Met {
            sensed: Sensed {
                tool: measured + self.given,
                force,
                vision: self.image.take(),
            },
            force,
            pose: self.stand_in.pose(),
            body: 0,
        }
    }

    /// Place of the tool (m) and its force (N). A plant that measures more rarely than every period moves on meanwhile.
    fn measured_by_now(&mut self) -> Option<(Vec2, Vec2)> {
        let newest = self.newest?;
        let motion = (newest.tool, newest.velocity);
        if self.motion == Some(motion) {
            self.age = (self.age + 1).min(MOVES_ON);
        } else {
            (self.motion, self.age) = (Some(motion), 0);
        }
        // no faster than a tool is ever sent
        let velocity = newest
            .velocity
            .cap_magnitude(self.follower.speed_max_m_per_s());
        let moved = velocity * (f64::from(self.age) * TICK_S);
        Some((newest.tool + moved, newest.force))
    }

    fn commanded(&self, tool: Vec2, velocity: Vec2) -> PlantCommand {
        PlantCommand {
            tool,
            velocity,
            stiffness_n_per_m: self.coupling.stiffness_n_per_m,
            damping_ns_per_m: self.coupling.damping_ns_per_m,
            force_max_n: self.force_max_n,
            begins: false,
            held: false,
        }
    }
}
