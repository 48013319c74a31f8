//! The master's core of a bilateral architecture: HIP in, the slave's force out.
//!
//! Position–force holds the newest force that came (zero order), and may damp the hand's own motion; TDPA damps it
//! where the energy is not covered; waves turn the hand's velocity and the wave that came back into a force. It must
//! never wait, allocate or read a clock, and force leaves it through the limiter only.

use mmt_client::limiter::ForceLimiter;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::{ForceCounts, HipCounts, HipSample};
use mmt_shared::passivity::{PortEnergy, RESERVE_J, impedance_controller};
use mmt_shared::time::{TICK_S, Time};

use super::message::{ToMaster, ToSlave};
use super::wave::{WaveImpedance, WaveReceiver, WaveSender, WaveSum};
use super::{Baseline, Tuning};

/// What one haptic tick gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BilateralTick {
    /// Goes to the slave.
    pub message: ToSlave,
    /// f_m: force on the object as the law gives it, N, before the limiter.
    pub displayed: Vec2,
    /// Goes to the device: force on the hand, N, limited.
    pub hand_force: Vec2,
}

/// The master between the device and the link.
#[derive(Clone, Debug)]
pub struct BilateralMaster {
    baseline: Baseline,
    tuning: Tuning,
    limiter: ForceLimiter,
    hip: HipCounts,
    last_hip: Option<Vec2>,
    last_velocity: Vec2,
    /// Force on the object that the device has held since the last tick, N.
    held: Vec2,
    newest: Option<Time>,
    received: Vec2,
    other_in_j: f64,
    port: PortEnergy,
    /// All the work that the hand did, J.
    put_in_j: f64,
    impedance: WaveImpedance,
    waves_in: WaveReceiver,
    waves_out: WaveSender,
}

impl BilateralMaster {
    /// A master that has received nothing yet. `smoothing_ticks` is the waves' smoothing time.
    #[must_use]
    pub fn new(
        (baseline, tuning): (Baseline, &Tuning),
        smoothing_ticks: u16,
        mut limiter: ForceLimiter,
    ) -> Self {
        limiter.engage();
        Self {
            baseline,
            tuning: *tuning,
            limiter,
            hip: HipCounts::default(),
            last_hip: None,
            last_velocity: Vec2::zeros(),
            held: Vec2::zeros(),
            newest: None,
            received: Vec2::zeros(),
            other_in_j: 0.0,
            port: PortEnergy::with_reserve(RESERVE_J),
            put_in_j: 0.0,
            impedance: WaveImpedance::new(tuning.wave_impedance_ns_per_m),
            waves_in: WaveReceiver::new(smoothing_ticks),
            waves_out: WaveSender::default(),
        }
    }

    /// Energy that passed the hand's port and the reserve, J.
    #[must_use]
    pub fn port(&self) -> PortEnergy {
        self.port
    }

    /// Takes in a message; one that is older than the newest is of no use any more.
    pub fn receive(&mut self, message: &ToMaster) {
        if self.newest.is_some_and(|newest| message.sent <= newest) {
            return;
        }
        self.newest = Some(message.sent);
        self.received = message.force.newtons();
        self.other_in_j = self.other_in_j.max(message.in_j);
        self.waves_in.receive(message.wave);
    }

    /// One sample period. `stamp` is the tick's time, `reading` the device's HIP (m, world).
    pub fn tick(&mut self, stamp: Time, reading: Vec2) -> BilateralTick {
        if reading.x.is_finite() && reading.y.is_finite() {
            self.hip = HipCounts::nearest(reading);
        }
        let hip = self.hip.metres();
        let way = hip - self.last_hip.unwrap_or(hip);
        self.last_hip = Some(hip);
        // E(k) = E(k−1) + f(k−1)·(x(k) − x(k−1)): exact, since the device held f
        let work_j = self.held.dot(&way);
        self.put_in_j += work_j;
        self.port.push(work_j, self.other_in_j);
        let v = way / TICK_S;
        // the velocity that the force of this tick will meet
        let next_v = v * 2.0 - self.last_velocity;
        self.last_velocity = v;

        let (displayed, wave) = self.law(v, next_v);
        let hand_force = self.limiter.limit(-displayed);
        self.held = -hand_force;
        BilateralTick {
            message: ToSlave {
                sample: HipSample {
                    stamp,
                    hip: self.hip,
                    force: ForceCounts::nearest(displayed),
                },
                in_j: self.port.in_j,
                wave,
            },
            displayed,
            hand_force,
        }
    }

    /// The force on the object (N) for the hand's velocity and the one that it is about to have (m/s), and all waves sent.
    fn law(&mut self, v: Vec2, next_v: Vec2) -> (Vec2, WaveSum) {
        match self.baseline {
            Baseline::PositionForce => {
                let force = self.received * self.tuning.force_gain;
                (force, WaveSum::default())
            }
            Baseline::DampedPositionForce => {
                // f' = f + B v
                let force = self.received + v * self.tuning.injected_damping_ns_per_m;
                (force, WaveSum::default())
            }
            Baseline::DeadbandForce => (self.received, WaveSum::default()),
            Baseline::Tdpa | Baseline::TdpaDeadband => {
                let margin_j = self.port.margin_j(self.other_in_j);
                let force = impedance_controller(
                    self.received,
                    next_v,
                    margin_j,
                    self.tuning.repayment_ns_per_m,
                );
                (force, WaveSum::default())
            }
            Baseline::Waves => {
                let w = self.waves_in.take();
                let taken_in_j = self.waves_in.energy_j() + self.put_in_j;
                let u = self.impedance.master_wave(v, w);
                let wave = self.waves_out.send(u, taken_in_j);
                (self.impedance.master_force(v, w), wave)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_client::limiter::{Limits, RAMP_TICKS};

    fn master(baseline: Baseline) -> BilateralMaster {
        let limiter = ForceLimiter::try_new(Limits::default()).unwrap();
        let mut master = BilateralMaster::new((baseline, &Tuning::default()), 1, limiter);
        // past the ramp, at rest
        for n in 0..u64::from(RAMP_TICKS) {
            master.tick(Time::from_millis(n), Vec2::zeros());
        }
        master
    }

    fn message(sent_ms: u64, force: Vec2, in_j: f64) -> ToMaster {
        ToMaster {
            sent: Time::from_millis(sent_ms),
            force: ForceCounts::nearest(force),
            in_j,
            wave: WaveSum::default(),
        }
    }

    fn tick(master: &mut BilateralMaster, ms: u64, x: f64) -> BilateralTick {
        master.tick(Time::from_millis(200 + ms), Vec2::new(x, 0.0))
    }

    #[test]
    fn position_force_holds_the_newest_force_and_the_hand_gets_its_opposite() {
        let mut master = master(Baseline::PositionForce);
        master.receive(&message(5, Vec2::new(1.0, 0.5), 0.0));
        master.receive(&message(4, Vec2::new(9.0, 9.0), 0.0));
        for ms in 0..50 {
            let tick = tick(&mut master, ms, 0.0);
            assert_eq!(tick.displayed, Vec2::new(1.0, 0.5));
            assert_eq!(tick.hand_force, -tick.displayed);
        }
    }

    #[test]
    fn with_passivity_control_a_hand_that_is_pushed_gets_no_more_than_the_slave_took_in() {
        for in_j in [RESERVE_J, 5e-3] {
            let mut master = master(Baseline::Tdpa);
            master.receive(&message(5, Vec2::new(1.5, 0.0), in_j));
            // the hand gives way at 0.1 m/s for a second: 150 mJ, if it were let
            for ms in 0..1000 {
                tick(&mut master, ms, -1e-4 * ms as f64);
            }
            let out_j = master.port().out_j;
            assert!(master.port().in_j < 1e-15);
            assert!((out_j - in_j).abs() < 1e-5, "{out_j} of {in_j} J");
        }
    }

    #[test]
    fn with_waves_a_hand_against_silence_feels_the_wave_impedance() {
        let mut master = master(Baseline::Waves);
        let last = (0..100).map(|ms| tick(&mut master, ms, 1e-4 * ms as f64).displayed);
        let b = Tuning::default().wave_impedance_ns_per_m;
        assert!((last.last().unwrap().x - 0.1 * b).abs() < 1e-6);
    }

    #[test]
    fn a_reading_that_is_no_number_is_replaced_by_the_one_before() {
        for baseline in Baseline::ALL {
            let mut master = master(baseline);
            let tick = master.tick(Time::from_millis(300), Vec2::new(f64::NAN, 0.0));
            assert_eq!(tick.message.sample.hip, HipCounts::default());
            assert!(tick.hand_force.x.is_finite());
        }
    }
}
