//! What a piece of the system costs in CPU time, which other processes on the machine do not change much.

use mmt_server::estimator::{Estimator, EstimatorConfig, Measured, Seen, ToolGives};
use mmt_shared::io::clock::thread_cpu_time;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;
use mmt_shared::time::TICK_S;

/// Ticks over which the mean is taken.
const TICKS: u32 = 100_000;

/// Mean CPU time of one tick of a mode's estimator while the tool pushes, ms.
#[must_use]
pub fn estimator_tick_ms(mode: Mode) -> f64 {
    let coupling = Coupling::for_stiffness(1000.0);
    let mut estimator = Estimator::new(
        &EstimatorConfig::of_mode(mode, coupling),
        coupling,
        8.0,
        ToolGives::No,
    );
    let began = thread_cpu_time();
    for k in 0..TICKS {
        let t = f64::from(k) * TICK_S;
        let v = 0.16 + 0.05 * libm::sin(4.0 * t);
        // seen and turning, so that every tick pays for it
        let seen = Seen {
            centre: Vec2::new(0.16 * t + 0.18, 0.0),
            turning: 0.01,
            body_turning: 0.01,
            side: 0.36,
        };
        estimator.step(&Measured {
            back: Vec2::zeros(),
            force_noise_n: 0.0,
            held_back: false,
            tool: Vec2::new(0.16 * t + 0.0125 * (1.0 - libm::cos(4.0 * t)), 0.0),
            force: Vec2::new(0.7 * 0.2 * libm::cos(4.0 * t) + 3.0 * v + 2.06, 0.0),
            normal: Some(Vec2::new(1.0, 0.0)),
            seen: Some(seen),
        });
    }
    let spent = thread_cpu_time().saturating_sub(began);
    std::hint::black_box(estimator.estimate());
    spent.as_secs_f64() * 1e3 / f64::from(TICKS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimator_tick_takes_cpu_time_and_less_than_a_tick() {
        for mode in [Mode::Paper, Mode::Recommended] {
            let ms = estimator_tick_ms(mode);
            assert!(ms > 0.0 && ms < 1.0, "{ms}");
        }
    }
}
