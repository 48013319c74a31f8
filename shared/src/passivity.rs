//! The time-domain passivity approach (TDPA): energy in and out at a port, and the two passivity controllers.
//!
//! Hannaford and Ryu, "Time-domain passivity control of haptic interfaces", IEEE Trans. Robotics and Automation 18(1),
//! 2002 (observer, series and parallel controller); Ryu, Artigas and Preusche, "A passive bilateral control scheme
//! for a teleoperator with time-varying communication delay", Mechatronics 20(7), 2010 (energy split per port and sent
//! along). The law: what leaves the network at one port never exceeds what came in at the other as far as is known
//! here, `E_out(k) <= E_in_other(k − delay)`. E_in never falls, so an old value is a safe one, at any delay, jitter or loss.
//! It must never take in a credit twice.

use crate::model::geometry::Vec2;
use crate::time::TICK_S;

/// Most damping that pays back a debt, N s/m: of the order of the damping of a hand (25 N s/m), so that it is felt as
/// drag and not as a jolt. A debt is what one tick's prediction of the velocity was wrong by.
pub const REPAYMENT_NS_PER_M: f64 = 20.0;
/// What the master's port keeps back, J: when a hand turns round, the limiter takes 8 N away in four ticks of 0.1 mm.
pub const RESERVE_J: f64 = 2e-3;
/// Below this speed a motion has no direction to damp, m/s: a tenth of a count of the HIP per tick.
const AT_REST_M_PER_S: f64 = 1e-5;

/// Energy that passed a port, seen from the network between the two ports.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PortEnergy {
    /// E_in: went into the network and may leave at the other port, J. Only grows.
    pub in_j: f64,
    /// E_out: came out of the network and was not paid back, J.
    pub out_j: f64,
}

impl PortEnergy {
    /// A port that begins in debt by `reserve_j`, J: what is paid for it covers later errors and is nobody's credit.
    pub fn with_reserve(reserve_j: f64) -> Self {
        Self {
            in_j: 0.0,
            out_j: reserve_j,
        }
    }

    /// Takes the work done on the network in one tick, J: f(k−1)·(x(k) − x(k−1)), exact for a force that is held.
    ///
    /// `other_in_j` is E_in of the other port as far as is known. What comes in while this port is in debt pays the
    /// debt first: it must not be a credit at the other port as well.
    pub fn push(&mut self, work_j: f64, other_in_j: f64) {
        // E_in + = max(P, 0) T, E_out + = max(−P, 0) T
        if work_j > 0.0 {
            let pays = (-self.margin_j(other_in_j)).clamp(0.0, work_j);
            self.out_j -= pays;
            self.in_j += work_j - pays;
        } else if work_j < 0.0 {
            self.out_j -= work_j;
        }
    }

    /// W = E_in of the other port − E_out of this one, J: what may still leave here.
    pub fn margin_j(&self, other_in_j: f64) -> f64 {
        other_in_j - self.out_j
    }
}

/// The passivity controller in impedance causality, for the master: f' = f + alpha v.
///
/// `f` is the force on the object to be displayed (N), `v` the velocity that the hand is expected to keep for the next
/// tick (m/s), `margin_j` W. Where the network would give more than W it gives W; a debt (W < 0) is paid back by damping,
/// by `repayment_ns_per_m` (N s/m) at most.
pub fn impedance_controller(f: Vec2, v: Vec2, margin_j: f64, repayment_ns_per_m: f64) -> Vec2 {
    let speed2 = v.norm_squared();
    if speed2 < AT_REST_M_PER_S * AT_REST_M_PER_S {
        return f;
    }
    let out_j = -f.dot(&v) * TICK_S;
    let excess_j = (out_j - margin_j.max(0.0)).max(0.0);
    // alpha = (E_out − W) / (T |v|²)
    let alpha = excess_j / (TICK_S * speed2);
    let debt_j = (-margin_j).max(0.0);
    let repayment = (debt_j / (TICK_S * speed2)).min(repayment_ns_per_m);
    f + v * (alpha + repayment)
}

/// The passivity controller in admittance causality, for the slave: v' = v − beta f.
///
/// `step` is the way that the tool is to go in this tick (m), `f` the force that it exerts on the object (N), `margin_j`
/// W. Only the part of the way along the force is shortened, and never turned round.
pub fn admittance_controller(step: Vec2, f: Vec2, margin_j: f64) -> Vec2 {
    let out_j = f.dot(&step);
    let excess_j = out_j - margin_j.max(0.0);
    if excess_j <= 0.0 {
        return step;
    }
    // beta T = (E_out − W) / |f|²; out_j > 0, so f is not zero
    step - f * (excess_j / f.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a hand that pays back as it does by default.
    fn controlled(f: Vec2, v: Vec2, margin_j: f64) -> Vec2 {
        impedance_controller(f, v, margin_j, REPAYMENT_NS_PER_M)
    }

    #[test]
    fn energy_is_split_by_its_direction() {
        let mut port = PortEnergy::default();
        for work in [2.0, -0.5, 0.0, 1.0, -3.0] {
            port.push(work, 5.0);
        }
        assert_eq!((port.in_j, port.out_j), (3.0, 3.5));
        assert_eq!(port.margin_j(5.0), 1.5);
    }

    #[test]
    fn what_pays_a_debt_is_no_credit() {
        let mut port = PortEnergy::default();
        port.push(-3.0, 2.0);
        assert_eq!(port.margin_j(2.0), -1.0);
        port.push(0.25, 2.0);
        assert_eq!((port.in_j, port.margin_j(2.0)), (0.0, -0.75));
        port.push(1.0, 2.0);
        assert_eq!((port.in_j, port.margin_j(2.0)), (0.25, 0.0));
    }

    #[test]
    fn alpha_leaves_a_force_alone_that_takes_energy_or_is_covered() {
        let (f, v) = (Vec2::new(3.0, 1.0), Vec2::new(0.1, 0.2));
        assert_eq!(controlled(f, v, 0.0), f);
        let covered_j = f.dot(&v) * TICK_S;
        assert_eq!(controlled(f, -v, covered_j), f);
        assert_eq!(controlled(f, Vec2::zeros(), -1.0), f);
    }

    #[test]
    fn alpha_lets_out_exactly_the_margin() {
        let (f, v) = (Vec2::new(3.0, 1.0), Vec2::new(-0.1, 0.05));
        for margin_j in [0.0, 1e-5, 2e-4] {
            let out_j = -controlled(f, v, margin_j).dot(&v) * TICK_S;
            assert!((out_j - margin_j).abs() < 1e-15, "{out_j}");
        }
    }

    #[test]
    fn a_debt_is_paid_back_and_no_faster_than_the_damping_allows() {
        let (f, v) = (Vec2::zeros(), Vec2::new(0.1, 0.0));
        let paid = |debt_j: f64| controlled(f, v, -debt_j).dot(&v) * TICK_S;
        assert!((paid(1e-5) - 1e-5).abs() < 1e-18);
        let most = REPAYMENT_NS_PER_M * 0.01 * TICK_S;
        assert!((paid(1.0) - most).abs() < 1e-15);
    }

    #[test]
    fn beta_lets_out_exactly_the_margin_and_leaves_the_way_along_the_face_alone() {
        let (step, f) = (Vec2::new(2e-4, 1e-4), Vec2::new(4.0, 0.0));
        for margin_j in [0.0, 1e-4, 8e-4, 1.0] {
            let taken = admittance_controller(step, f, margin_j);
            assert!((f.dot(&taken) - margin_j.min(8e-4)).abs() < 1e-15);
            assert_eq!(taken.y, step.y);
        }
        assert_eq!(admittance_controller(-step, f, 0.0), -step, "going back");
        assert_eq!(admittance_controller(step, Vec2::zeros(), 0.0), step);
        assert!(admittance_controller(step, f, -1.0).x >= 0.0);
    }
}
