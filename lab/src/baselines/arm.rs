//! The slave's arm under wave variables: a tool with a mass, held by a spring and a damper to where the waves lead it.
//!
//! Niemeyer and Slotine 1991: `f = K (x_d − x) + B (v_d − v)`, `m dv/dt = f − f_s`, `b v_d + f = √(2b) u`, with the damper
//! matched to the waves (B = b) so that they are not reflected. The controller's f, not the measured force, goes back.
//! It must never move faster than the tool may.

use super::wave::WaveImpedance;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// Mass of the tool, kg: light against a hand (0.5 kg) and the box (0.7 kg), heavy enough for 1 kHz
/// ((k_p + K) T² / m = 0.01 at 1000 N/m each).
const TOOL_MASS_KG: f64 = 0.2;

/// The arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arm {
    stiffness_n_per_m: f64,
    speed_max_m_per_s: f64,
    impedance: WaveImpedance,
    /// x_d − x, m.
    stretch: Vec2,
    velocity: Vec2,
}

impl Arm {
    /// An arm at rest. `stiffness_n_per_m` is K; the tool stays below `speed_max_m_per_s`.
    pub(super) fn new(
        stiffness_n_per_m: f64,
        speed_max_m_per_s: f64,
        impedance: WaveImpedance,
    ) -> Self {
        Self {
            stiffness_n_per_m,
            speed_max_m_per_s,
            impedance,
            stretch: Vec2::zeros(),
            velocity: Vec2::zeros(),
        }
    }

    /// One tick T under the wave u (√W) and the force f_s that the tool exerts (N): the way of the tool (m) and the
    /// wave w back (√W).
    pub(super) fn step(&mut self, u: Vec2, f_s: Vec2) -> (Vec2, Vec2) {
        let spring = self.stretch * self.stiffness_n_per_m;
        let aim = self.impedance.slave_velocity(u, spring, self.velocity);
        // f = K (x_d − x) + B (v_d − v)
        let f = spring + (aim - self.velocity) * self.impedance.damping_ns_per_m();
        // m dv/dt = f − f_s
        let free = self.velocity + (f - f_s) * (TICK_S / TOOL_MASS_KG);
        let most = self.speed_max_m_per_s;
        self.velocity = free * (most / free.norm().max(most));
        self.stretch += (aim - self.velocity) * TICK_S;
        (self.velocity * TICK_S, self.impedance.slave_wave(u, f))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::wave::WAVE_IMPEDANCE_NS_PER_M;

    const WAVES: fn() -> WaveImpedance = || WaveImpedance::new(WAVE_IMPEDANCE_NS_PER_M);

    #[test]
    fn a_free_tool_takes_the_velocity_of_the_wave_and_sends_it_back_whole() {
        let mut arm = Arm::new(1000.0, 1.0, WAVES());
        // u = √(b/2) v is what a master at 0.1 m/s sends when the tool follows freely
        let b = WAVES().damping_ns_per_m();
        let u = Vec2::new(f64::sqrt(b / 2.0) * 0.1, 0.0);
        let (mut way, mut w) = (Vec2::zeros(), Vec2::zeros());
        for _ in 0..2000 {
            (way, w) = arm.step(u, Vec2::zeros());
        }
        assert!((way.x - 1e-4).abs() < 1e-9, "{way}");
        assert!((w - u).norm() < 1e-6);
    }

    #[test]
    fn a_blocked_tool_sends_back_the_force_that_blocks_it() {
        let mut arm = Arm::new(1000.0, 1.0, WAVES());
        let (u, wall) = (Vec2::new(0.5, 0.0), Vec2::new(20_000.0, 0.0));
        let (mut x, mut w) = (Vec2::zeros(), Vec2::zeros());
        for _ in 0..5000 {
            let way;
            (way, w) = arm.step(u, x.component_mul(&wall));
            x += way;
        }
        // v = 0: f = √(2b) u and w = −u
        let b = WAVES().damping_ns_per_m();
        assert!((x.x * wall.x - f64::sqrt(2.0 * b) * u.x).abs() < 1e-3);
        assert!((w + u).norm() < 1e-4);
    }
}
