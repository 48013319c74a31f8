//! Wave variables: velocity and force packed into waves whose energy is on the way and nowhere else.
//!
//! Niemeyer and Slotine, "Stable adaptive teleoperation", IEEE J. Oceanic Engineering 16(1), 1991 (the transformation);
//! "Towards force-reflecting teleoperation over the Internet", ICRA 1998 (wave integral and energy sent along, for
//! delays that vary and packets that are lost); "Telemanipulation with time delays", Int. J. Robotics Research 23(9),
//! 2004. f and v are positive towards the object on both sides:
//! `u = (b v + f)/√(2b)` goes to the slave, `w = (b v − f)/√(2b)` comes back, and f·v = (|u|² − |w|²)/2.
//! A wave must never leave a side, or be taken in by one, without the energy for it.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// Credit of each sending side, J: covers what sampling shifts by a tick (F v T = 0.4 mJ at 2.5 N and 0.15 m/s).
pub(super) const CREDIT_J: f64 = 4e-4;

/// b where nobody tunes it, N s/m: near the damping of a hand (25 N s/m), so that waves are hardly reflected by it.
pub(super) const WAVE_IMPEDANCE_NS_PER_M: f64 = 20.0;

/// The wave impedance b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WaveImpedance {
    b: f64,
    root_2b: f64,
}

impl WaveImpedance {
    /// An impedance b, N s/m, above zero.
    #[must_use]
    pub(super) fn new(b: f64) -> Self {
        Self {
            b,
            root_2b: f64::sqrt(2.0 * b),
        }
    }

    /// b, N s/m.
    #[must_use]
    pub(super) fn damping_ns_per_m(&self) -> f64 {
        self.b
    }

    /// The master's force on the object, N, for the hand's velocity v (m/s) and the wave w that came back.
    #[must_use]
    pub(super) fn master_force(&self, v: Vec2, w: Vec2) -> Vec2 {
        // f = b v − √(2b) w
        v * self.b - w * self.root_2b
    }

    /// The master's wave to the slave, √W.
    #[must_use]
    pub(super) fn master_wave(&self, v: Vec2, w: Vec2) -> Vec2 {
        // u = √(2b) v − w
        v * self.root_2b - w
    }

    /// The velocity (m/s) that the slave's controller aims at, when that controller is f = `force` + b (v_d − `v`).
    #[must_use]
    pub(super) fn slave_velocity(&self, u: Vec2, force: Vec2, v: Vec2) -> Vec2 {
        // b v_d + f = √(2b) u, solved for v_d with the controller's own f: no algebraic loop is left
        (u * self.root_2b - force + v * self.b) / (2.0 * self.b)
    }

    /// The slave's wave to the master, √W, for the force f (N) of its controller.
    #[must_use]
    pub(super) fn slave_wave(&self, u: Vec2, f: Vec2) -> Vec2 {
        // w = u − √(2/b) f
        u - f * (2.0 / self.root_2b)
    }
}

/// The sum of all waves so far, which a packet carries: a lost packet takes nothing away with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WaveSum {
    /// ∫u dt, √W s.
    pub integral: Vec2,
    /// ∫|u|²/2 dt, J. Only grows.
    pub energy_j: f64,
}

/// A wave that follows the integral of another one as far as there is energy for it.
///
/// What is missing is made up for over a smoothing time. At one tick the wave is the other one itself as long as nothing
/// is lost. On a path that loses packets a longer time keeps energy in hand for catching up: what was sent evenly over
/// ten ticks costs ten times as much in one. Without packets the wave fades to nothing; with them positions meet again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct BoundedWave {
    sum: WaveSum,
}

impl BoundedWave {
    /// What has been let out so far.
    #[must_use]
    pub(super) fn sum(&self) -> WaveSum {
        self.sum
    }

    /// The wave of this tick, √W: towards `integral` (√W s) within `ticks`, its energy so far at most `energy_j`.
    pub(super) fn follow(&mut self, integral: Vec2, energy_j: f64, ticks: f64) -> Vec2 {
        let wanted = (integral - self.sum.integral) / (TICK_S * ticks);
        let costs_j = 0.5 * wanted.norm_squared() * TICK_S;
        let margin_j = (energy_j - self.sum.energy_j).max(0.0);
        let wave = if costs_j > margin_j {
            wanted * (margin_j / costs_j).sqrt()
        } else {
            wanted
        };
        self.sum.integral += wave * TICK_S;
        self.sum.energy_j += 0.5 * wave.norm_squared() * TICK_S;
        wave
    }
}

/// Sends a side's own waves within what the side took in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WaveSender {
    wanted: Vec2,
    sent: BoundedWave,
}

impl WaveSender {
    /// Sends a wave (√W); `taken_in_j` is all the energy that this side has taken in, by waves and through its port, J.
    pub(super) fn send(&mut self, wave: Vec2, taken_in_j: f64) -> WaveSum {
        self.wanted += wave * TICK_S;
        self.sent.follow(self.wanted, taken_in_j + CREDIT_J, 1.0);
        self.sent.sum()
    }
}

/// Receives the other side's waves in any order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WaveReceiver {
    ticks: f64,
    received: WaveSum,
    taken: BoundedWave,
}

impl WaveReceiver {
    /// Nothing received yet; `ticks` is the smoothing time, at least one tick.
    #[must_use]
    pub(super) fn new(ticks: u16) -> Self {
        Self {
            ticks: f64::from(ticks.max(1)),
            received: WaveSum::default(),
            taken: BoundedWave::default(),
        }
    }

    /// Takes in the sum of a packet; one that is older than the newest changes nothing.
    pub(super) fn receive(&mut self, sum: WaveSum) {
        if sum.energy_j > self.received.energy_j {
            self.received = sum;
        }
    }

    /// The wave of this tick, √W.
    pub(super) fn take(&mut self) -> Vec2 {
        self.taken
            .follow(self.received.integral, self.received.energy_j, self.ticks)
    }

    /// Energy taken in so far, J.
    #[must_use]
    pub(super) fn energy_j(&self) -> f64 {
        self.taken.sum().energy_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;

    fn random(stream: &mut Substream) -> Vec2 {
        Vec2::new(stream.normal(), stream.normal())
    }

    #[test]
    fn the_power_at_each_port_is_the_difference_of_the_waves_power() {
        let (waves, mut stream) = (
            WaveImpedance::new(WAVE_IMPEDANCE_NS_PER_M),
            Substream::new(1, "wave", 0),
        );
        for _ in 0..100 {
            let (v, w) = (random(&mut stream), random(&mut stream));
            let (f, u) = (waves.master_force(v, w), waves.master_wave(v, w));
            let difference = 0.5 * (u.norm_squared() - w.norm_squared());
            assert!((f.dot(&v) - difference).abs() < 1e-9);

            let (spring, tool) = (random(&mut stream), random(&mut stream));
            let v = waves.slave_velocity(u, spring, tool);
            let f = spring + (v - tool) * waves.damping_ns_per_m();
            let back = waves.slave_wave(u, f);
            let difference = 0.5 * (u.norm_squared() - back.norm_squared());
            assert!((f.dot(&v) - difference).abs() < 1e-9);
        }
    }

    #[test]
    fn without_delay_both_sides_have_the_same_force_and_velocity() {
        let waves = WaveImpedance::new(WAVE_IMPEDANCE_NS_PER_M);
        let (v, w) = (Vec2::new(0.2, -0.1), Vec2::new(0.3, 0.4));
        let (f, u) = (waves.master_force(v, w), waves.master_wave(v, w));
        assert!((waves.slave_wave(u, f) - w).norm() < 1e-12);
        // the tool already moves with v: the controller's spring carries the force
        assert!((waves.slave_velocity(u, f, v) - v).norm() < 1e-12);
    }

    #[test]
    fn a_wave_arrives_as_it_was_sent_when_nothing_is_lost() {
        let (mut sender, mut receiver) = (WaveSender::default(), WaveReceiver::new(1));
        let mut stream = Substream::new(2, "wave", 0);
        for _ in 0..1000 {
            let wave = random(&mut stream);
            receiver.receive(sender.send(wave, 1e9));
            assert!((receiver.take() - wave).norm() < 1e-9);
        }
    }

    #[test]
    fn loss_and_reordering_neither_add_energy_nor_lose_position() {
        let (mut sender, mut receiver) = (WaveSender::default(), WaveReceiver::new(20));
        let mut stream = Substream::new(3, "wave", 0);
        let mut late = WaveSum::default();
        for n in 0..5000 {
            let smooth = libm::sin(f64::from(n) * 0.01);
            let sum = sender.send(Vec2::new(smooth, -0.5 * smooth), 1e9);
            if stream.chance(0.3) {
                receiver.receive(sum);
            }
            if stream.chance(0.1) {
                receiver.receive(late);
            }
            if stream.chance(0.05) {
                late = sum;
            }
            receiver.take();
            assert!(receiver.energy_j() <= sum.energy_j + 1e-12);
        }
        receiver.receive(sender.send(Vec2::zeros(), 1e9));
        for _ in 0..500 {
            receiver.take();
        }
        let missing = (receiver.taken.sum().integral - sender.wanted).norm();
        assert!(missing < 1e-3, "of an amplitude of 0.2: {missing}");
    }

    #[test]
    fn a_sender_never_sends_more_than_was_taken_in() {
        let mut sender = WaveSender::default();
        let mut taken_in_j = 0.0;
        for _ in 0..1000 {
            taken_in_j += 1e-5;
            let sum = sender.send(Vec2::new(1.0, 1.0), taken_in_j);
            assert!(sum.energy_j <= taken_in_j + CREDIT_J + 1e-15);
        }
    }
}
