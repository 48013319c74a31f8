//! Held-out prediction: friction fitted on some of the pushes, the forces of the others predicted.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::rng::Substream;
use mmt_shared::stats::values::{mean, median};
use serde::Serialize;

use super::config::ReplayConfig;
use super::fit::fit;
use super::surface::{Law, PushMotion};
use mmt_server::contact_prediction::Observation;

/// | |predicted| − |measured| | / |measured|.
pub(super) fn relative_error(predicted: Vec2, measured: Vec2) -> f64 {
    (predicted.norm() - measured.norm()).abs() / measured.norm()
}

/// How well a law predicts pushes that it was not fitted on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// The law.
    pub law: Law,
    /// Of each repeat: the median over the held-out pushes of the relative |F| error.
    pub median_errors: Vec<f64>,
    /// Their mean; none if nothing was held out.
    pub median_error: Option<f64>,
    /// The median over the held-out pushes of all repeats together.
    pub pooled_median_error: Option<f64>,
}

/// Numbers of the pushes fitted on and held out in one repeat.
pub(super) struct Split {
    fitted: Vec<usize>,
    held_out: Vec<usize>,
}

impl Split {
    /// A random split of `count` pushes; a pure function of the seed and the repeat's number.
    pub(super) fn draw(config: &ReplayConfig, count: usize, repeat: u32) -> Self {
        let mut random = Substream::new(config.seed, "replay/split", u64::from(repeat));
        let mut keyed: Vec<(u64, usize)> = (0..count).map(|push| (random.bits(), push)).collect();
        keyed.sort_unstable();
        let fitted = (count as f64 * config.fitted_share.clamp(0.0, 1.0)) as usize;
        let numbers = || keyed.iter().map(|(_, push)| *push);
        Self {
            fitted: numbers().take(fitted).collect(),
            held_out: numbers().skip(fitted).collect(),
        }
    }

    /// Relative |F| errors of the held-out pushes under a law.
    pub(super) fn errors(
        &self,
        config: &ReplayConfig,
        law: Law,
        all: &[Observation<PushMotion>],
    ) -> Vec<f64> {
        let of = |numbers: &[usize]| -> Vec<Observation<PushMotion>> {
            numbers
                .iter()
                .filter_map(|push| all.get(*push))
                .copied()
                .collect()
        };
        let surface = fit(law, &config.start, &config.start, &of(&self.fitted));
        of(&self.held_out)
            .iter()
            .map(|push| relative_error(law.force(&surface, &push.motion), push.force))
            .collect()
    }
}

/// Sums up the errors of all repeats under a law.
pub(super) fn summary(law: Law, repeats: &[Vec<f64>]) -> HeldOut {
    let medians = repeats
        .iter()
        .filter_map(|errors| median(errors.iter().copied()));
    let median_errors: Vec<f64> = medians.collect();
    HeldOut {
        law,
        median_error: mean(median_errors.iter().copied()),
        median_errors,
        pooled_median_error: median(repeats.iter().flatten().copied()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_takes_every_push_once_and_depends_on_seed_and_repeat_only() {
        let config = ReplayConfig::default();
        let split = Split::draw(&config, 50, 0);
        assert_eq!((split.fitted.len(), split.held_out.len()), (37, 13));
        let mut all: Vec<usize> = split
            .fitted
            .iter()
            .chain(&split.held_out)
            .copied()
            .collect();
        all.sort_unstable();
        assert_eq!(all, (0..50).collect::<Vec<_>>());
        assert_eq!(Split::draw(&config, 50, 0).held_out, split.held_out);
        assert_ne!(Split::draw(&config, 50, 1).held_out, split.held_out);
        let other = ReplayConfig { seed: 2, ..config };
        assert_ne!(Split::draw(&other, 50, 0).held_out, split.held_out);
    }

    #[test]
    fn the_summary_is_the_mean_of_the_repeats_medians() {
        let held_out = summary(Law::Decoupled, &[vec![0.1, 0.2, 0.6], vec![0.4]]);
        assert_eq!(held_out.median_errors, [0.2, 0.4]);
        assert!((held_out.median_error.unwrap() - 0.3).abs() < 1e-12);
        assert!((held_out.pooled_median_error.unwrap() - 0.3).abs() < 1e-12);
        assert_eq!(summary(Law::Decoupled, &[]).median_error, None);
    }
}
