//! The packets of the object's plug (`docs/plugs.md`), and the checks on what a plant sends.

use std::time::Duration;

use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::params::WORKSPACE_M;
use mmt_shared::plug::{
    NotTaken, PLANT_BYTES, PlugHead, PlugKind, PlugToken, decode, doubles, encode,
};

/// A plant of which nothing came for so long is gone: the tool stands.
pub const SILENCE: Duration = Duration::from_millis(50);
/// Greatest force that a plant can have measured, N.
const FORCE_MAX_N: f64 = 1000.0;
/// Greatest speed that a tool can have, m/s.
const SPEED_MAX_M_PER_S: f64 = 20.0;
/// An image is at most this old, s.
const IMAGE_AGE_MAX_S: f64 = 10.0;

/// Bits of a command.
mod command {
    pub(super) const SESSION: u16 = 1;
    pub(super) const BEGINS: u16 = 2;
    pub(super) const HELD: u16 = 4;
}

/// Bits of an answer.
mod answer {
    pub(super) const OBJECT_SEEN: u16 = 1;
}

/// What a plant measured, by its own sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantAnswer {
    /// The tool, m, world.
    pub tool: Vec2,
    /// Its velocity, m/s.
    pub velocity: Vec2,
    /// `f_s`, the force of the tool on what it touches, N.
    pub force: Vec2,
    /// The object's pose, where it was seen since the last answer.
    pub object: Option<Pose>,
    /// How old that image is, s.
    pub image_age_s: f64,
    /// Whether it is the first after a silence: the tool is where the plant reports it, wherever it was.
    pub anew: bool,
}

/// Where the tool has to go, and how it meets things.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantCommand {
    /// Where, m, world; within the limits on speed and acceleration.
    pub tool: Vec2,
    /// How fast, m/s.
    pub velocity: Vec2,
    /// k_p: what the tool is to give by, N/m.
    pub stiffness_n_per_m: f64,
    /// k_d, N s/m.
    pub damping_ns_per_m: f64,
    /// It presses with no more than this, N.
    pub force_max_n: f64,
    /// Whether a session begins: a simulated tool may be put there.
    pub begins: bool,
    /// Whether the tool stands because an emergency stop is set.
    pub held: bool,
}

impl PlantAnswer {
    /// Reads a packet: its head and, unless its numbers cannot be, the answer.
    ///
    /// # Errors
    /// It is no packet of a plant with this token.
    pub fn read(token: &PlugToken, packet: &[u8]) -> Result<(PlugHead, Option<Self>), NotTaken> {
        let (head, numbers) = decode(PlugKind::Answer, PLANT_BYTES, token, packet)?;
        let [x, y, v_x, v_y, f_x, f_y, o_x, o_y, angle, age] = doubles(numbers);
        let seen = head.flags & answer::OBJECT_SEEN != 0;
        let read = Self {
            tool: Vec2::new(x, y),
            velocity: Vec2::new(v_x, v_y),
            force: Vec2::new(f_x, f_y),
            object: seen.then(|| Pose::new(o_x, o_y, angle)),
            image_age_s: if seen { age } else { 0.0 },
            anew: false,
        };
        Ok((head, Some(read).filter(Self::can_be)))
    }

    /// The packet.
    #[must_use]
    pub fn packet(&self, token: &PlugToken, head: &PlugHead) -> [u8; PLANT_BYTES] {
        let pose = self.object.unwrap_or_default();
        let head = PlugHead {
            flags: self.object.map_or(0, |_| answer::OBJECT_SEEN),
            ..*head
        };
        let (tool, velocity, force) = (self.tool, self.velocity, self.force);
        let numbers = [
            tool.x,
            tool.y,
            velocity.x,
            velocity.y,
            force.x,
            force.y,
            pose.position.x,
            pose.position.y,
            pose.angle,
            self.image_age_s,
        ];
        let numbers = numbers.map(f64::to_le_bytes);
        encode(PlugKind::Answer, token, &head, numbers)
    }

    /// The choke point: every number finite and of a place, a speed and a force that can be.
    fn can_be(&self) -> bool {
        let within = |numbers: &[f64], most: f64| numbers.iter().all(|n| n.abs() <= most);
        let pose = self.object.unwrap_or_default();
        let places = [self.tool.x, self.tool.y, pose.position.x, pose.position.y];
        within(&places, WORKSPACE_M)
            && within(&[self.velocity.x, self.velocity.y], SPEED_MAX_M_PER_S)
            && within(&[self.force.x, self.force.y], FORCE_MAX_N)
            && within(&[pose.angle], 1e6)
            && (0.0..=IMAGE_AGE_MAX_S).contains(&self.image_age_s)
    }
}

impl PlantCommand {
    /// The packet.
    #[must_use]
    pub fn packet(&self, token: &PlugToken, head: &PlugHead) -> [u8; PLANT_BYTES] {
        let bits = [
            (true, command::SESSION),
            (self.begins, command::BEGINS),
            (self.held, command::HELD),
        ];
        let head = PlugHead {
            flags: bits.iter().filter(|bit| bit.0).map(|bit| bit.1).sum(),
            ..*head
        };
        let numbers = [
            self.tool.x,
            self.tool.y,
            self.velocity.x,
            self.velocity.y,
            self.stiffness_n_per_m,
            self.damping_ns_per_m,
            self.force_max_n,
        ];
        let numbers = numbers.map(f64::to_le_bytes);
        encode(PlugKind::Tool, token, &head, numbers)
    }
}
