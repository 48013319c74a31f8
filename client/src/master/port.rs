//! The passivity observer at the haptic port: what the hand has put in, less what it got back.
//!
//! It watches the force that is really sent and where the device really goes, so that the model, the limiter
//! and the sampling all count. It observes and changes nothing.

use mmt_shared::model::geometry::Vec2;

/// Integrates f·v at the port. A force is held for a tick, so a tick's share is the force (N, on the hand)
/// times the way (m) that the device makes until the next: E = −Σ f_hand(n)·(x(n+1) − x(n)), which is exact
/// for a force that is held (Hannaford and Ryu, "Time-domain passivity control of haptic interfaces",
/// 2002, with the force of the past sample).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PortObserver {
    last: Option<(Vec2, Vec2)>,
    energy_j: f64,
    least_j: f64,
}

impl PortObserver {
    /// Takes one tick: where the device is (m, world; the HIP may be elsewhere) and the force on the hand (N) from now on.
    pub fn push(&mut self, hip: Vec2, force_on_hand: Vec2) {
        if let Some((from, force)) = self.last {
            self.energy_j -= force.dot(&(hip - from));
            self.least_j = self.least_j.min(self.energy_j);
        }
        self.last = Some((hip, force_on_hand));
    }

    /// Energy that the hand has put in so far, J.
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// The least that it ever was, J: at most 0, and below 0 by what the port has given for nothing.
    pub fn least_j(&self) -> f64 {
        self.least_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spring of 1000 N/m that is pressed by 10 mm and let go, as the port sees it.
    fn pressed(held: impl Fn(f64) -> f64) -> PortObserver {
        let mut port = PortObserver::default();
        let depths = (0..=100).chain((0..100).rev()).map(|k| f64::from(k) * 1e-4);
        for depth in depths {
            port.push(Vec2::new(depth, 0.0), Vec2::new(-held(depth), 0.0));
        }
        port
    }

    #[test]
    fn a_sampled_spring_gives_half_a_step_for_nothing_on_each_way() {
        // in: Σ k x dx from below, out: from above; the difference is k (0.1 mm)² per step of 100
        let port = pressed(|depth| 1000.0 * depth);
        let expected = -1000.0 * 1e-4 * 1e-4 * 100.0;
        assert!((port.energy_j() - expected).abs() < 1e-12);
        assert_eq!(port.energy_j(), port.least_j());
    }

    #[test]
    fn work_that_the_hand_does_counts_up_and_is_not_forgotten_in_the_least() {
        let mut port = PortObserver::default();
        port.push(Vec2::zeros(), Vec2::new(-2.0, 0.0));
        port.push(Vec2::new(0.5, 0.0), Vec2::new(3.0, 0.0));
        assert_eq!((port.energy_j(), port.least_j()), (1.0, 0.0));
        // pushed along by 3 N over a metre
        port.push(Vec2::new(1.5, 0.0), Vec2::zeros());
        port.push(Vec2::new(9.0, 0.0), Vec2::zeros());
        assert_eq!((port.energy_j(), port.least_j()), (-2.0, -2.0));
    }
}
