//! Drives the tool: to the played HIP, or as far towards it as energy, force and speed allow.
//!
//! It must never move the tool faster than the limit of play-out, never with more acceleration in free space, and never pass on
//! f_m of a HIP that the tool is not at.

pub mod compliance;
pub mod energy;
pub mod force;
pub mod port;

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

use crate::motion_limits::{BEHIND_M, Goal, MotionLimits};
use crate::playout::Played;
use energy::ToolEnergy;
use force::ToolForce;
use port::ToolPort;

/// Velocities that differ by less are the same, m/s: rounding.
const SAME_VELOCITY_M_PER_S: f64 = 1e-9;

/// The tool between play-out and the object.
#[derive(Clone, Debug)]
pub(crate) struct ToolDrive {
    /// Where it is while it is not at the played HIP, m.
    own: Option<Vec2>,
    /// Whether it goes only as far as the energy allows.
    passive: bool,
    /// Whether the limit of the force keeps it there, or has and it is still catching up.
    held_back: bool,
    /// The same of the limit of the energy.
    energy_holds: bool,
    port: ToolPort,
    force: ToolForce,
    energy: ToolEnergy,
    /// Whether the tool touches something.
    touches: bool,
    limits: MotionLimits,
    /// No farther than this from the origin, m.
    reach_m: f64,
}

impl ToolDrive {
    pub(crate) fn new(
        port: ToolPort,
        force: ToolForce,
        energy: ToolEnergy,
        limits: MotionLimits,
        reach_m: f64,
    ) -> Self {
        Self {
            limits,
            reach_m,
            own: None,
            passive: false,
            held_back: false,
            energy_holds: false,
            port,
            force,
            energy,
            touches: false,
        }
    }

    pub(crate) fn port(&self) -> &ToolPort {
        &self.port
    }

    pub(crate) fn force(&self) -> &ToolForce {
        &self.force
    }

    /// Whether the tool goes only as far as the energy allows.
    pub(crate) fn is_passive(&self) -> bool {
        self.passive
    }

    pub(crate) fn energy(&self) -> &ToolEnergy {
        &self.energy
    }

    /// The path takes so long, there and back.
    pub(crate) fn set_round_trip(&mut self, path: Duration) {
        self.energy.set_round_trip(path);
    }

    /// The master's model can give the hand so much back, J.
    pub(crate) fn set_returnable(&mut self, returnable_j: f64) {
        self.energy.set_returnable(returnable_j);
    }

    /// Whether a limit, of the force or of the energy, keeps the tool from the HIP.
    pub(crate) fn is_held_back(&self) -> bool {
        self.held_back
    }

    /// Whether it is the limit of the force, so that what the tool touches withstands that.
    pub(crate) fn force_holds(&self) -> bool {
        self.held_back && !self.energy_holds
    }

    /// Takes in E_in of the master's port, J: from now on the tool goes only as far as that pays for. `hip` is the HIP
    /// that was played last, m.
    pub(crate) fn credit(&mut self, other_in_j: f64, hip: Option<Vec2>) {
        self.port.receive(other_in_j);
        self.own = self.own.or(hip);
        self.passive = true;
    }

    /// Begins at `place` (m), where an earlier session left the tool with this force on it, N.
    pub(crate) fn begin_at(&mut self, place: Vec2, force: Vec2) {
        self.own = Some(place);
        self.port.measured(force);
        self.energy.begin_at(place, force);
    }

    /// One tick: the tool follows the played HIP from `before` (the one played last, m), or goes towards it. When it may
    /// follow again it catches up within the speed limit. The force of the master is that of the HIP, not of a tool that
    /// is held back.
    pub(crate) fn step(&mut self, before: Option<Vec2>, played: Played) -> Played {
        self.energy.follow_hand(played.hand);
        let Some(tool) = self.own.or(before) else {
            return played;
        };
        let follows = self.own.is_none() && !self.passive;
        let period_s = played.period_s.max(TICK_S);
        let (wanted, bounded) = if follows {
            let way = played.hip - tool;
            (way, way)
        } else {
            self.drawn(tool, &played, period_s)
        };
        let free = if self.passive {
            self.port.allowed(bounded, period_s)
        } else {
            bounded
        };
        let paid = self.paid(free, period_s);
        let allowed = self.force.allowed(paid, period_s, self.port.held());
        let held = allowed != free;
        let energy_holds = paid != free;
        self.energy.note(energy_holds);
        if follows && !held {
            self.force.moved(played.velocity, false);
            return played;
        }
        let way = if held {
            self.port.within_speed(allowed, period_s)
        } else {
            free
        };
        let way = self.within_reach(tool, way);
        let velocity = way / period_s;
        self.port.moved(way);
        self.force.moved(velocity, held);
        let behind = (wanted - way).norm() > BEHIND_M;
        self.held_back = held || (self.held_back && behind);
        self.energy_holds = energy_holds || (self.energy_holds && behind);
        // with the HIP's velocity, so that it goes on with it
        let joins = (velocity - played.velocity).norm() < SAME_VELOCITY_M_PER_S;
        let there = !self.passive && !played.stands && way == wanted && joins;
        self.own = Some(tool + way).filter(|_| !there);
        Played {
            hip: tool + way,
            velocity,
            force: played.force.filter(|_| !self.held_back),
            ..played
        }
    }

    /// The way of a tool that does not follow (m, in `period_s`): all that draws it, and the part that the limits of its motion
    /// allow.
    fn drawn(&self, tool: Vec2, played: &Played, period_s: f64) -> (Vec2, Vec2) {
        let velocity = self.force.velocity();
        if played.stands {
            // nothing draws a tool that has to stand; it may give way all the same
            let stop = self.limits.towards(velocity, Vec2::zeros(), period_s) * period_s;
            return (stop, stop);
        }
        let goal = Goal {
            way: played.hip - tool,
            velocity: played.velocity,
        };
        let limits = MotionLimits {
            speed_m_per_s: played.speed_max_m_per_s,
            ..self.limits
        };
        (goal.way, limits.way(velocity, goal, period_s))
    }

    /// The part of a way (m, in `period_s`) that the energy allows: along the force no faster than the tool can brake in the way
    /// that is left. Where the hand feels the tool, its port knows.
    fn paid(&self, way: Vec2, period_s: f64) -> Vec2 {
        let force = self.port.held();
        let left_m = self.energy.way_left_m(force);
        if self.passive || !self.touches || left_m.is_infinite() {
            return way;
        }
        let n = force.normalize();
        let most = self.limits.braking_speed(left_m, period_s) * period_s;
        let beyond = n.dot(&way) - most;
        if beyond <= 0.0 {
            return way;
        }
        let wanted = (way - n * beyond) / period_s;
        self.limits.towards(self.force.velocity(), wanted, period_s) * period_s
    }

    /// The part of a way from `tool` (m) that leads no farther out of reach, whatever pushes the tool there.
    fn within_reach(&self, tool: Vec2, way: Vec2) -> Vec2 {
        let (most, far) = (self.reach_m.max(tool.norm()), (tool + way).norm());
        if far > most {
            (tool + way) * (most / far) - tool
        } else {
            way
        }
    }

    /// Takes the force (N) that is measured with the tool at `place` (m), and whether that is contact.
    pub(crate) fn measured(&mut self, place: Vec2, force: Vec2, touches: bool) {
        self.port.measured(force);
        self.force.measured(force);
        self.energy.measured(place, force);
        self.touches = touches;
    }
}

#[cfg(test)]
mod tests {
    use super::energy::EnergyConfig;
    use super::*;
    use crate::playout::Status;
    use mmt_shared::model::contact::Coupling;
    use mmt_shared::time::Time;

    fn drive() -> ToolDrive {
        let coupling = Coupling::for_stiffness(1000.0);
        let force = ToolForce::try_new(15.0, coupling).unwrap();
        let limits = MotionLimits {
            speed_m_per_s: 0.6,
            acceleration_m_per_s2: 20.0,
        };
        let energy = ToolEnergy::try_new(EnergyConfig::default(), 15.0, coupling, 0.6).unwrap();
        ToolDrive::new(ToolPort::new(0.01, 0.6), force, energy, limits, 2.0)
    }

    fn played(x: f64, stands: bool) -> Played {
        Played {
            stamp: Time::ZERO,
            hip: Vec2::new(x, 0.0),
            velocity: Vec2::zeros(),
            force: None,
            hand: None,
            status: Status::Interpolated,
            period_s: TICK_S,
            speed_max_m_per_s: 0.6,
            limited: false,
            stands,
        }
    }

    #[test]
    fn a_tool_that_its_force_held_back_stands_when_it_has_to_and_gives_way_all_the_same() {
        let mut drive = drive();
        drive.measured(Vec2::zeros(), Vec2::new(14.4, 0.0), true);
        let at = |drive: &mut ToolDrive, stands| {
            drive.step(Some(Vec2::zeros()), played(0.05, stands)).hip.x
        };
        // at the limit of its force it is behind a HIP that is 5 cm further
        let held = at(&mut drive, false);
        assert!(held < 1e-3, "{held}");
        // what it pressed on is gone
        drive.measured(Vec2::zeros(), Vec2::zeros(), true);
        for _ in 0..100 {
            assert_eq!(at(&mut drive, true), held, "nothing draws it");
        }
        drive.measured(Vec2::zeros(), Vec2::new(26.0, 0.0), true);
        assert!(at(&mut drive, true) < held, "it is pressed on");
        drive.measured(Vec2::zeros(), Vec2::zeros(), true);
        // it brakes on its way back
        let before = (0..100).map(|_| at(&mut drive, true)).last().unwrap();
        assert!(at(&mut drive, false) > before, "it may follow again");
    }

    #[test]
    fn a_tool_at_its_reach_gives_way_along_it_and_not_beyond() {
        let mut drive = drive();
        drive.begin_at(Vec2::new(2.0, 0.0), Vec2::zeros());
        let mut at = Vec2::zeros();
        for _ in 0..100 {
            // what is out there draws the tool outwards and along
            drive.measured(Vec2::zeros(), Vec2::new(-26.0, -26.0), true);
            at = drive.step(None, played(2.0, true)).hip;
            assert!(at.norm() <= 2.0 + 1e-12, "{} m", at.norm());
        }
        assert!(at.y > 1e-3, "{at}");
    }

    #[test]
    fn a_tool_that_an_earlier_session_left_pressing_presses_no_harder_in_its_first_tick() {
        let (mut pressing, mut free) = (drive(), drive());
        pressing.begin_at(Vec2::zeros(), Vec2::new(15.0, 0.0));
        let first = pressing.step(None, played(0.6e-3, false)).hip.x;
        assert!(first <= 0.0, "{first} m at the limit of its force");
        free.begin_at(Vec2::zeros(), Vec2::zeros());
        // from rest
        let first = free.step(None, played(0.6e-3, false)).hip.x;
        assert!((first - 20e-6).abs() < 1e-12, "{first} m");
    }
}
