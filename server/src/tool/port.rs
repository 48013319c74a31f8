//! The tool's port: what force the tool holds, what energy passed it, and how far it may go for that.
//!
//! The same for a slave whose forces cross the network all the time and for one that does so for a while. It must never
//! use the true force: the sensor's is what it has.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::passivity::{PortEnergy, admittance_controller};

/// A force below this many times the sensor's noise per axis is taken for none: three ticks in ten thousand in free
/// space are not. It is F_min with the default sensor.
const NOISE_DEVIATIONS: f64 = 4.0;

/// The tool's port.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolPort {
    energy: PortEnergy,
    other_in_j: f64,
    /// Force on the object since the last tick as the port received it, N.
    held: Vec2,
    noise_n: f64,
    speed_max_m_per_s: f64,
}

impl ToolPort {
    /// A port through which nothing has passed. `force_noise_n` is the sensor's noise per axis, r.m.s., N; the tool
    /// stays below `speed_max_m_per_s`.
    #[must_use]
    pub fn new(force_noise_n: f64, speed_max_m_per_s: f64) -> Self {
        Self {
            energy: PortEnergy::default(),
            other_in_j: 0.0,
            held: Vec2::zeros(),
            noise_n: NOISE_DEVIATIONS * force_noise_n,
            speed_max_m_per_s,
        }
    }

    /// Energy that passed, J.
    #[must_use]
    pub fn energy(&self) -> PortEnergy {
        self.energy
    }

    /// The force that goes to the master, N on the object: the measured one, or none where that may be noise.
    #[must_use]
    pub fn held(&self) -> Vec2 {
        self.held
    }

    /// Takes in E_in of the master's port, J; it only grows, so an older one changes nothing.
    pub fn receive(&mut self, other_in_j: f64) {
        self.other_in_j = self.other_in_j.max(other_in_j);
    }

    /// The part of the way from the tool to the HIP (m, in `period_s`) that the energy allows: towards the hand, not along its
    /// velocity, so that where beta held the tool back it makes up for it as soon as there is energy (Artigas, Ryu and
    /// Preusche, IROS 2010).
    #[must_use]
    pub fn allowed(&self, wanted: Vec2, period_s: f64) -> Vec2 {
        let wanted = self.within_speed(wanted, period_s);
        let margin_j = self.energy.margin_j(self.other_in_j);
        admittance_controller(wanted, self.held + self.doubt(), margin_j)
    }

    /// The part of the way from the tool to the HIP (m, in `period_s`) that the speed limit allows.
    #[must_use]
    pub fn within_speed(&self, wanted: Vec2, period_s: f64) -> Vec2 {
        let most = self.speed_max_m_per_s * period_s;
        wanted * (most / wanted.norm().max(most))
    }

    /// Takes the way that the tool went in this tick (m); returns the work that it did by the held force, J.
    pub fn moved(&mut self, way: Vec2) -> f64 {
        // E(k) = E(k−1) − f(k−1)·(x(k) − x(k−1)), seen from the network
        let work_j = self.held.dot(&way);
        // the sensor may read low, and a tool that stops by what it reads goes on when it does
        let doubt_j = self.doubt().dot(&way).abs();
        self.energy.push(-work_j - doubt_j, self.other_in_j);
        work_j
    }

    /// Takes the force that is measured where the tool has gone, N.
    pub fn measured(&mut self, force: Vec2) {
        let noise = force.norm() < self.noise_n;
        self.held = if noise { Vec2::zeros() } else { force };
    }

    /// By how much more than the measured force the energy is counted, N: a tool that goes W / f at a noisy f goes
    /// sigma² / f² of it too far on average; twice that for what is taken for none.
    fn doubt(&self) -> Vec2 {
        let size2 = self.held.norm_squared();
        let deviation_n = self.noise_n / NOISE_DEVIATIONS;
        if size2 > 0.0 {
            self.held * (2.0 * deviation_n * deviation_n / size2)
        } else {
            Vec2::zeros()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::time::TICK_S;

    #[test]
    fn the_tool_goes_as_far_as_the_hand_has_paid_for_and_no_further() {
        let mut port = ToolPort::new(0.0, 10.0);
        port.measured(Vec2::new(2.0, 0.0));
        let wanted = Vec2::new(1e-3, 5e-4);
        assert_eq!(
            port.allowed(wanted, TICK_S),
            Vec2::new(0.0, 5e-4),
            "nothing was paid"
        );
        port.receive(1e-3);
        port.receive(5e-4);
        let mut x = 0.0;
        for _ in 0..100 {
            let way = port.allowed(wanted, TICK_S);
            port.moved(way);
            x += way.x;
        }
        assert!((x - 0.5e-3).abs() < 1e-12, "1 mJ at 2 N: {x} m");
    }

    #[test]
    fn a_force_that_may_be_noise_is_none_and_the_speed_is_limited() {
        let mut port = ToolPort::new(0.01, 0.6);
        port.measured(Vec2::new(0.03, 0.02));
        assert_eq!(port.held(), Vec2::zeros());
        assert!((port.allowed(Vec2::new(1.0, 0.0), TICK_S).x - 0.6e-3).abs() < 1e-12);
        // a tick that is longer leaves it its speed
        assert!((port.allowed(Vec2::new(1.0, 0.0), 3.0 * TICK_S).x - 1.8e-3).abs() < 1e-12);
    }
}
