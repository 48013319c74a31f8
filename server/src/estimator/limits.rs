//! What an estimator's settings may be: whatever comes from a file passes here before it is used.
//!
//! Within these limits no division by zero and no growing filter is possible. Nothing here changes a
//! number; what is out of range is named.

use super::{EstimatorConfig, PaperConfig, RecommendedConfig};

/// A setting of an estimator is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("estimator setting {name} is {value}; give a number from {min} to {max}")]
pub struct SettingOutOfRange {
    /// The setting.
    pub name: &'static str,
    /// What it was.
    pub value: f64,
    /// Least accepted value.
    pub min: f64,
    /// Greatest accepted value.
    pub max: f64,
}

type Bound = (&'static str, f64, f64, f64);

impl EstimatorConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// Names the first setting that is out of range or not a number.
    pub fn check(&self) -> Result<(), SettingOutOfRange> {
        match self {
            Self::Paper(config) => check(&paper(config)).and(check(&prior(config.prior))),
            Self::Recommended(config) => check(&recommended(config))
                .and(check(&recursive(config)))
                .and(check(&prior(config.recursive.prior))),
        }
    }
}

fn check(bounds: &[Bound]) -> Result<(), SettingOutOfRange> {
    // written so that NaN is outside
    let outside = |(_, value, min, max): &&Bound| !(value >= min && value <= max);
    match bounds.iter().find(outside) {
        None => Ok(()),
        Some(&(name, value, min, max)) => Err(SettingOutOfRange {
            name,
            value,
            min,
            max,
        }),
    }
}

fn prior([m, b, c]: [f64; 3]) -> [Bound; 3] {
    [
        ("prior m (kg)", m, 0.05, 50.0),
        ("prior b (N s/m)", b, 0.0, 200.0),
        ("prior c (N)", c, 0.0, 200.0),
    ]
}

fn paper(config: &PaperConfig) -> [Bound; 3] {
    [
        ("window_s", config.window_s, 0.002, 60.0),
        ("position_noise_m", config.kalman.position_noise_m, 0.0, 0.1),
        ("jerk_density", config.kalman.jerk_density, 1e-9, 1e9),
    ]
}

fn recommended(config: &RecommendedConfig) -> [Bound; 8] {
    let (coupling, gate) = (&config.coupling, &config.gate);
    [
        ("stiffness_n_per_m", coupling.stiffness_n_per_m, 1.0, 1e12),
        ("damping_ns_per_m", coupling.damping_ns_per_m, 0.0, 1e6),
        ("cutoff_rad_per_s", config.cutoff_rad_per_s, 1.0, 3000.0),
        ("position_noise_m", config.position_noise_m, 0.0, 0.1),
        (
            "time_constant_s",
            config.direction.time_constant_s,
            0.001,
            10.0,
        ),
        (
            "direction.force_min_n",
            config.direction.force_min_n,
            1e-6,
            1e3,
        ),
        ("gate.force_min_n", gate.force_min_n, 0.0, 1e3),
        ("gate.speed_min_m_per_s", gate.speed_min_m_per_s, 0.0, 10.0),
    ]
}

fn recursive(config: &RecommendedConfig) -> [Bound; 10] {
    let recursive = &config.recursive;
    let ([prior_b, prior_c], [held_b, held_c]) =
        (recursive.prior_deviation, recursive.held_deviation);
    let change = recursive.change.unwrap_or_default();
    [
        ("forgetting", recursive.forgetting, 0.5, 1.0),
        ("prior_deviation of b", prior_b, 1e-6, 1e6),
        ("prior_deviation of c", prior_c, 1e-6, 1e6),
        ("held_deviation of b", held_b, 1e-6, 1e6),
        ("held_deviation of c", held_c, 1e-6, 1e6),
        // less, and taking the noise away could leave nothing
        ("excitation", recursive.excitation, 2.0, 1e6),
        ("damping_force_n", recursive.damping_force_n, 0.0, 1e6),
        ("error_share", change.error_share, 0.0, 1e6),
        ("after_s", change.after_s, 0.0, 60.0),
        ("trust", change.trust, 0.0, 1.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::contact::Coupling;
    use mmt_shared::model::settings::Mode;

    #[test]
    fn the_defaults_of_both_modes_are_accepted() {
        for mode in [Mode::Paper, Mode::Recommended] {
            let config = EstimatorConfig::of_mode(mode, Coupling::for_stiffness(3000.0));
            assert_eq!(config.check(), Ok(()));
        }
    }

    #[test]
    fn a_setting_out_of_range_is_named_with_its_range() {
        let mut config = RecommendedConfig::new(Coupling::for_stiffness(1000.0));
        config.cutoff_rad_per_s = 0.0;
        let error = EstimatorConfig::Recommended(config).check().unwrap_err();
        assert_eq!(
            error.to_string(),
            "estimator setting cutoff_rad_per_s is 0; give a number from 1 to 3000"
        );
        config.cutoff_rad_per_s = 120.0;
        config.recursive.prior = [0.4, f64::NAN, 1.0];
        let error = EstimatorConfig::Recommended(config).check().unwrap_err();
        assert_eq!(error.name, "prior b (N s/m)");
        config.recursive.prior = [0.4, 0.0, 1.0];
        config.recursive.forgetting = 1.001;
        assert!(EstimatorConfig::Recommended(config).check().is_err());
        let paper = PaperConfig {
            window_s: f64::INFINITY,
            ..PaperConfig::default()
        };
        assert!(EstimatorConfig::Paper(paper).check().is_err());
    }
}
