//! Multiple-model estimation (Magill 1965) behind a contact whose stiffness nobody knows: an estimator for each of five
//! stiffnesses, and the one that leaves least of the force unexplained is believed.
//!
//! For a tool that gives by a spring of its own, which is meant for contacts of one to ten times k_p. The tool knows how far
//! it gives; how far the contact gives under the same force is what the five differ in. With a wrong one the surface seems to
//! shake with the hand, and an object that seems to shake is taken to be lighter than it is. Before an object slides it stands, and
//! with a wrong stiffness it seems to give way.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;

use super::estimate::Estimate;
use super::measured::Measured;
use super::obstacle::Hand;
use super::recommended::{RecommendedConfig, RecommendedEstimator};

/// Stiffnesses of the contact over k_p, equal ratios apart: 10^0.1 to 10^0.9.
const TIMES: [f64; 5] = [1.259, 1.995, 3.162, 5.012, 7.943];
/// The one that is believed before anything was seen.
const FIRST: usize = 2;
/// Rows before an estimator is compared with others.
const ROWS_MIN: u64 = 15;
/// Share of the believed one's misfit that another must be below.
const BETTER: f64 = 0.97;
/// An object that is pressed with less does not show yet how far the contact gives, N.
const PRESSED_N: f64 = 1.5;
/// A surface that has strayed by less stands, m.
const STANDS_M: f64 = 0.2e-3;
/// Another stiffness is believed where the surface that it gives has strayed by less than this share of what the believed one
/// gives, and less by this as well, m: the noise of the tool's position.
const STEADIER: (f64, f64) = (0.5, 0.025e-3);
/// What a wrong stiffness leaves of the force is no change of friction: a row is doubted from so many root mean squares of it on.
const DOUBT_DEVIATIONS: f64 = 3.0;

/// The five.
#[derive(Clone, Copy, Debug)]
pub(super) struct MultipleModel {
    estimators: [RecommendedEstimator; TIMES.len()],
    believed: usize,
    /// k_p.
    device_n_per_m: f64,
}

impl MultipleModel {
    /// At the prior. `config` has k_p.
    #[must_use]
    pub(super) fn new(config: &RecommendedConfig, hand: Hand) -> Self {
        let of = |times: f64| {
            let coupling = Coupling {
                stiffness_n_per_m: times * config.coupling.stiffness_n_per_m,
                ..config.coupling
            };
            let config = RecommendedConfig {
                coupling,
                ..*config
            };
            RecommendedEstimator::new(&config, hand).doubting_from(DOUBT_DEVIATIONS)
        };
        Self {
            estimators: TIMES.map(of),
            believed: FIRST,
            device_n_per_m: config.coupling.stiffness_n_per_m,
        }
    }

    /// The forces of all ticks so far were this many times as large.
    pub(super) fn rescale(&mut self, times: f64) {
        for estimator in &mut self.estimators {
            estimator.rescale(times);
        }
    }

    /// Takes one tick.
    pub(super) fn step(&mut self, measured: &Measured) {
        let at_the_contact = Measured {
            tool: measured.tool - measured.back,
            ..*measured
        };
        for estimator in &mut self.estimators {
            estimator.step(&at_the_contact);
        }
        self.believe(measured.force.norm());
    }

    /// Under this force, N.
    fn believe(&mut self, force: f64) {
        let Some(now) = compared(self.believed()) else {
            if force > PRESSED_N {
                self.believe_what_stands();
            }
            return;
        };
        let all = self.estimators.iter().enumerate();
        let best = all
            .filter_map(|(index, of)| Some((index, compared(of)?)))
            .min_by(|(_, one), (_, other)| one.total_cmp(other));
        if let Some((index, _)) = best.filter(|(_, least)| *least < BETTER * now) {
            self.believed = index;
        }
    }

    /// The one by which the object that is pressed has stood from the first: nobody has seen it slide.
    fn believe_what_stands(&mut self) {
        let all = self.estimators.iter().enumerate();
        let steadiest = all
            .filter_map(|(index, of)| Some((index, of.strayed()?)))
            .min_by(|(_, one), (_, other)| one.total_cmp(other));
        let (share, less) = STEADIER;
        if let (Some((index, least)), Some(now)) = (steadiest, self.believed().strayed())
            && least < STANDS_M.min(share * now - less)
        {
            self.believed = index;
        }
    }

    fn believed(&self) -> &RecommendedEstimator {
        let [first, ..] = &self.estimators;
        self.estimators.get(self.believed).unwrap_or(first)
    }

    /// The believed one's.
    #[must_use]
    pub(super) fn estimate(&self) -> &Estimate {
        &self.believed().estimate
    }

    /// Stiffness of the contact that is believed, N/m; none before they were compared.
    pub(super) fn contact_n_per_m(&self) -> Option<f64> {
        compared(self.believed()).map(|_| self.believed_n_per_m())
    }

    /// Between two of them by the parabola through the misfits of three: they are equal ratios apart.
    fn believed_n_per_m(&self) -> f64 {
        let [first, second, ..] = TIMES;
        let times = TIMES.get(self.believed).unwrap_or(&first);
        let steps = self.off_by().unwrap_or_default();
        times * libm::pow(second / first, steps) * self.device_n_per_m
    }

    /// How many of their steps the least misfit lies above the believed one, at most a half; none before they were compared.
    fn off_by(&self) -> Option<f64> {
        let middle = self.believed.clamp(1, TIMES.len() - 2);
        let of = |index: usize| self.estimators.get(index).and_then(compared);
        let (below, at, above) = (of(middle - 1)?, of(middle)?, of(middle + 1)?);
        let bend = below - 2.0 * at + above;
        let least = (bend > 0.0).then(|| 0.5 * (below - above) / bend)?;
        let steps = middle as f64 - self.believed as f64 + least;
        Some(steps.clamp(-0.5, 0.5))
    }

    /// [`Estimator::beyond_m`](super::Estimator::beyond_m), by the stiffness that is believed.
    pub(super) fn beyond_m(&self, back: Vec2, force: Vec2) -> f64 {
        let size = force.norm();
        if size <= 0.0 {
            return 0.0;
        }
        let contact = size / self.believed_n_per_m() - size / self.device_n_per_m;
        back.dot(&force) / size + contact
    }
}

/// Misfit of an estimator, N², once it has enough rows to be compared by it.
fn compared(of: &RecommendedEstimator) -> Option<f64> {
    of.misfit().filter(|_| of.estimate.samples >= ROWS_MIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::rng::Substream;
    use mmt_shared::time::TICK_S;
    use std::f64::consts::TAU;

    use crate::estimator::{Estimator, EstimatorConfig, ToolGives};
    use crate::tool::compliance::{Compliance, spring_for};

    const TRUTH: [f64; 3] = [2.0, 3.0, 1.0];

    /// A hand that pushes m (kg), b (N s/m), c (N) with a tremor of 0.2 mm at 10 Hz through a spring, on a contact of so many
    /// times k_p; what is measured in 4 s.
    fn push(seed: u64, times: f64, [m, b, c]: [f64; 3]) -> Vec<Measured> {
        let contact = Coupling {
            stiffness_n_per_m: times * COUPLING.stiffness_n_per_m,
            ..COUPLING
        };
        let mut random = Substream::new(seed, "multiple model", 0);
        let mut spring = Compliance::try_new(Some(spring_for(COUPLING))).unwrap();
        let (mut position, mut velocity, mut force, mut depth) = (0.0, 0.0_f64, 0.0, 0.0);
        let mut tick = |k: u32| {
            let t = f64::from(k) * TICK_S;
            let speed = 0.12 + 0.06 * libm::sin(TAU * 0.6 * t);
            let hip = 0.12 * t
                + 0.06 * (1.0 - libm::cos(TAU * 0.6 * t)) / (TAU * 0.6)
                + 2e-4 * libm::sin(TAU * 10.0 * t);
            debug_assert!(speed > 0.0);
            let (back, _) = spring.step(Vec2::new(force, 0.0), TICK_S);
            let before = depth;
            depth = hip - back.x - position;
            force = contact.force(depth, (depth - before) / TICK_S);
            let free = m * velocity + TICK_S * force;
            let left = (free.abs() - TICK_S * c).max(0.0);
            velocity = left.copysign(free) / (m + TICK_S * b);
            position += TICK_S * velocity;
            let ((tool, _), (noise, _)) = (random.normal_pair(), random.normal_pair());
            Measured {
                tool: Vec2::new(hip + 10e-6 * tool, 0.0),
                back,
                force: Vec2::new(force + 0.03 * noise, 0.0),
                force_noise_n: 0.03,
                held_back: false,
                normal: (depth > 0.0).then_some(Vec2::new(1.0, 0.0)),
                seen: None,
            }
        };
        (1..4000).map(&mut tick).collect()
    }

    const HAND: Hand = Hand {
        force_max_n: 8.0,
        device_n_per_m: COUPLING.stiffness_n_per_m,
    };

    #[test]
    fn a_mass_behind_a_contact_of_unknown_stiffness_is_found_although_the_hand_trembles() {
        let mut off = [0.0, 0.0];
        for (seed, times) in [(1, 1.2), (2, 2.5), (3, 5.0), (4, 9.0)] {
            let measured = push(seed, times, TRUTH);
            let config = RecommendedConfig::new(COUPLING);
            let mut many = MultipleModel::new(&config, HAND);
            let mut single = Estimator::new(
                &EstimatorConfig::Recommended(config),
                COUPLING,
                8.0,
                ToolGives::No,
            );
            for tick in &measured {
                many.step(tick);
                single.step(tick);
            }
            let found = many.estimate();
            let (m, alone) = (found.m / TRUTH[0], single.estimate().m / TRUTH[0]);
            let believed = many.contact_n_per_m().unwrap() / COUPLING.stiffness_n_per_m;
            println!("{times}: {believed} times, {m} against {alone}");
            // 2.5 lies in the middle between two of them
            assert!((0.8..1.1).contains(&m), "{times}: {m}");
            assert!((found.c - TRUTH[2]).abs() < 0.15, "{times}: {found:?}");
            let ratio = believed / times;
            assert!((0.9..1.1).contains(&ratio), "{times}: {believed}");
            off[0] += (m - 1.0).abs();
            off[1] += (alone - 1.0).abs();
        }
        assert!(off[1] > 2.0 * off[0], "{off:?}");
    }

    #[test]
    fn an_object_that_stands_while_it_is_pressed_shows_how_far_the_contact_gives() {
        for (seed, times) in [(1, 1.2), (2, 1.9), (3, 3.0), (4, 8.5)] {
            let mut many = MultipleModel::new(&RecommendedConfig::new(COUPLING), HAND);
            let pressed = push(seed, times, [2.0, 3.0, 6.0]);
            let stands = pressed.iter().take_while(|tick| tick.force.x < 5.0);
            let last = stands.inspect(|tick| many.step(tick)).last().unwrap();
            let believed = many.believed_n_per_m() / COUPLING.stiffness_n_per_m;
            let beyond_m = many.beyond_m(last.back, last.force);
            let gives_m = last.tool.x - last.force.x / COUPLING.stiffness_n_per_m;
            println!("{times}: {believed} times, {beyond_m} m of {gives_m} m");
            assert!(
                (0.6..1.7).contains(&(believed / times)),
                "{times}: {believed}"
            );
            assert!((beyond_m - gives_m).abs() < 1e-3, "{times}: {beyond_m} m");
            assert_eq!(many.contact_n_per_m(), None, "nobody has compared them");
        }
    }
}
