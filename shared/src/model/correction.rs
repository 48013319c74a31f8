//! How the local model's pose is brought to the received one, without a jolt and without free energy.
//!
//! A received pose is not set, but for that of another body or where a phantom is felt: the difference is bled in at
//! bounded rates. Turning about the contact point and shifting along the face do no work on a frictionless contact and are
//! free, so is motion away from the HIP; motion towards it stores energy in the coupling and is paid from a tank that holds
//! what the model has dissipated on the ground. What the tank cannot pay is not done.

mod carry;

use crate::model::contact::{Coupling, Touch};
use crate::model::geometry::{Pose, Vec2, rotate};
use crate::model::history::PoseChange;
use crate::time::TICK_S;

use carry::Carry;

/// How fast a correction is bled in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BleedRates {
    /// Fastest shift, m/s: along the face's normal where the HIP touches one.
    pub shift_m_per_s: f64,
    /// Fastest shift along the face that the HIP touches, m/s.
    pub along_m_per_s: f64,
    /// Fastest turn, rad/s.
    pub turn_rad_per_s: f64,
    /// Time constant, s.
    pub tau_s: f64,
}

/// While the HIP touches the box: well below the speed of a push, so that the hand does not notice it.
pub const IN_CONTACT: BleedRates = BleedRates {
    shift_m_per_s: 0.05,
    along_m_per_s: 0.05,
    turn_rad_per_s: 1.0,
    tau_s: 0.3,
};
/// While the HIP touches the box and what remains comes from a replay, which does not come late: three
/// times as quick.
pub const IN_CONTACT_REPLAYED: BleedRates = BleedRates {
    tau_s: 0.1,
    along_m_per_s: 0.5,
    ..IN_CONTACT
};
/// While the HIP touches nothing: no hand feels it, it only must not look like a jump.
pub const IN_FREE_SPACE: BleedRates = BleedRates {
    shift_m_per_s: 0.5,
    along_m_per_s: 0.5,
    turn_rad_per_s: 10.0,
    tau_s: 0.02,
};
/// A box that is brought up to the HIP stops this far from it, m: five times the amplitude of a hand's
/// tremor, so that a hand at rest is not touched again and again.
pub const ROOM_M: f64 = 5e-4;
/// In free space the box goes at once to a pose that is farther away than this, m: that of another body, most likely.
pub const OTHER_BODY_M: f64 = 0.3;
/// Most energy that the tank holds, J: the coupling at 1000 N/m stores this at a depth of 14 mm, deeper
/// than any push at 8 N. What is dissipated beyond it is gone.
pub const TANK_MAX_J: f64 = 0.1;

/// Energy put aside from what the model dissipated, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tank {
    level: f64,
}

impl Tank {
    /// What it holds, J: less than nothing where the explicit friction of (5) has driven the box.
    pub fn level_j(&self) -> f64 {
        self.level
    }

    /// Puts in what the model has dissipated (J, negative where the ground did work on it), up to [`TANK_MAX_J`].
    pub fn fill(&mut self, dissipated_j: f64) {
        self.level = (self.level + dissipated_j).min(TANK_MAX_J);
    }

    /// Takes out `energy_j` if it is there, and returns whether it was.
    pub fn pay(&mut self, energy_j: f64) -> bool {
        if energy_j > self.level {
            return false;
        }
        self.level -= energy_j.max(0.0);
        true
    }
}

/// What remains to be corrected, and what pays for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// Shift and turn that are still to come.
    pub remaining: PoseChange,
    /// Sum of all shifts and turns done since the start.
    pub done: PoseChange,
    /// Pays for motion towards the HIP.
    pub tank: Tank,
    /// Takes box and HIP back together.
    carry: Carry,
}

impl Correction {
    /// Replaces what remains by the difference of a received pose and the model's own pose at the
    /// stamp it answers, less what has been corrected since that stamp (`done_then` is the sum then).
    pub fn aim(&mut self, received: &Pose, own_then: &Pose, done_then: &PoseChange) {
        let done_since = PoseChange {
            shift: self.done.shift - done_then.shift,
            turn: self.done.turn - done_then.turn,
        };
        self.remaining = PoseChange {
            shift: received.position - own_then.position - done_since.shift,
            turn: received.angle - own_then.angle - done_since.turn,
        };
    }

    /// Replaces what remains by the way from the model's own pose to where it should be now.
    pub fn aim_at(&mut self, wanted: &Pose, own: &Pose) {
        self.remaining = PoseChange {
            shift: wanted.position - own.position,
            turn: wanted.angle - own.angle,
        };
    }

    /// Counts a shift of the centre that was done elsewhere, so that older answers are held against it.
    pub fn count(&mut self, shift: Vec2) {
        self.remaining.shift -= shift;
        self.done.shift += shift;
    }

    /// Does all that remains at once, whatever it costs. The paper's way; sound only at zero delay.
    pub fn snap(&mut self, pose: &mut Pose) {
        let all = self.remaining;
        self.apply(pose, all);
    }

    /// Bleeds one tick's worth of what remains into `pose`. `touch` is what the HIP touches now,
    /// `in_contact` how fast that may be done while it touches anything. While it touches nothing the model goes over
    /// to another body at once: on its way there the box might have to pass the HIP.
    pub fn bleed(
        &mut self,
        pose: &mut Pose,
        touch: Option<&Touch>,
        coupling: &Coupling,
        in_contact: BleedRates,
    ) {
        let rates = if touch.is_some() {
            in_contact
        } else {
            IN_FREE_SPACE
        };
        if touch.is_none() && self.remaining.shift.norm() > OTHER_BODY_M {
            self.snap(pose);
            return;
        }
        let share = TICK_S / rates.tau_s;
        let most = rates.turn_rad_per_s * TICK_S;
        let turn = (self.remaining.turn * share).clamp(-most, most);
        let pivot = touch.map_or(pose.position, |touch| touch.proxy);
        let turned = turn_about(pose, pivot, turn);
        self.apply(pose, turned);

        let mut shift = self.remaining.shift * share;
        let most = rates.shift_m_per_s * TICK_S;
        if let Some(touch) = touch {
            // the face as it lies after the turn about the proxy
            let inward = rotate(turn, touch.inward);
            let normal = inward * inward.dot(&shift);
            let along = (shift - normal).cap_magnitude(rates.along_m_per_s * TICK_S);
            let penetration = touch.penetration * libm::cos(turn);
            shift =
                along + self.affordable(normal.cap_magnitude(most), inward, penetration, coupling);
        } else {
            shift = shift.cap_magnitude(most);
        }
        self.apply(pose, PoseChange { shift, turn: 0.0 });
    }

    /// Plans how far box and HIP go together before the next sample. `stands` is whether friction holds the box.
    pub fn plan_carry(&mut self, touch: Option<&Touch>, stands: bool) {
        self.carry.plan(self.remaining.shift, touch, stands);
    }

    /// How far the HIP goes with the box before the next sample, m.
    pub fn carry(&self) -> Vec2 {
        self.carry.shift()
    }

    /// Does the planned shift, once; returns it, for the HIP (m).
    pub fn take_carry(&mut self, pose: &mut Pose) -> Vec2 {
        let shift = self.carry.take();
        self.apply(pose, PoseChange { shift, turn: 0.0 });
        shift
    }

    /// Takes back a part of the last bleed: a shift of the centre, m.
    pub fn back_off(&mut self, pose: &mut Pose, shift: Vec2) {
        self.apply(pose, PoseChange { shift, turn: 0.0 });
    }

    /// The part of a shift that is free or that the tank pays for.
    fn affordable(&mut self, shift: Vec2, inward: Vec2, pen: f64, coupling: &Coupling) -> Vec2 {
        let towards = -inward.dot(&shift);
        if towards <= 0.0 {
            return shift;
        }
        let cost = coupling.energy(pen + towards) - coupling.energy(pen);
        if self.tank.pay(cost) {
            shift
        } else {
            shift + inward * towards
        }
    }

    /// Does a change and takes it off what remains.
    fn apply(&mut self, pose: &mut Pose, change: PoseChange) {
        pose.position += change.shift;
        pose.angle += change.turn;
        self.remaining.shift -= change.shift;
        self.remaining.turn -= change.turn;
        self.done.shift += change.shift;
        self.done.turn += change.turn;
    }
}

fn turn_about(pose: &Pose, pivot: Vec2, turn: f64) -> PoseChange {
    let lever = pose.position - pivot;
    PoseChange {
        shift: rotate(turn, lever) - lever,
        turn,
    }
}

#[cfg(test)]
mod tests;
