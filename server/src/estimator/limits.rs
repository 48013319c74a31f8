//! What an estimator's settings may be: whatever comes from a file passes here before it is used.
//!
//! Within these limits no division by zero and no growing filter is possible. Nothing here changes a
//! number; what is out of range is named.

use mmt_shared::range::{Check, OutOfRange, all_in_range};

use super::{EstimatorConfig, PaperConfig, QuasiStaticConfig, RecommendedConfig};

impl EstimatorConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// Names the first setting that is out of range or not a number.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Paper(config) => {
                all_in_range(paper(config).into_iter().chain(prior(config.prior)))
            }
            Self::Recommended(config) => all_in_range(
                recommended(config)
                    .into_iter()
                    .chain(recursive(config))
                    .chain(prior(config.recursive.prior)),
            ),
            Self::QuasiStatic(config) => {
                all_in_range(quasi_static(config).into_iter().chain(prior(config.prior)))
            }
        }
    }
}

fn prior([m, b, c]: [f64; 3]) -> [Check; 3] {
    [
        ("estimator: prior m", "kg", m, (0.05, 50.0)),
        ("estimator: prior b", "N s/m", b, (0.0, 200.0)),
        ("estimator: prior c", "N", c, (0.0, 200.0)),
    ]
}

#[rustfmt::skip]
fn quasi_static(config: &QuasiStaticConfig) -> [Check; 2] {
    [
        ("estimator: memory_s", "s", config.memory_s, (0.001, 60.0)),
        ("estimator: way_min_m", "m", config.way_min_m, (0.0, 0.1)),
    ]
}

#[rustfmt::skip]
fn paper(config: &PaperConfig) -> [Check; 4] {
    let kalman = &config.kalman;
    [
        ("estimator: window_s", "s", config.window_s, (0.002, 60.0)),
        ("estimator: stable_after_s", "s", config.stable_after_s, (0.0, 60.0)),
        ("estimator: position_noise_m", "m", kalman.position_noise_m, (0.0, 0.1)),
        ("estimator: jerk_density", "m^2/s^5", kalman.jerk_density, (1e-9, 1e9)),
    ]
}

#[rustfmt::skip]
fn recommended(config: &RecommendedConfig) -> [Check; 8] {
    let (coupling, direction, gate) = (&config.coupling, &config.direction, &config.gate);
    let (k_p, k_d) = (coupling.stiffness_n_per_m, coupling.damping_ns_per_m);
    [
        ("estimator: stiffness_n_per_m", "N/m", k_p, (1.0, 1e12)),
        ("estimator: damping_ns_per_m", "N s/m", k_d, (0.0, 1e6)),
        ("estimator: cutoff_rad_per_s", "rad/s", config.cutoff_rad_per_s, (1.0, 3000.0)),
        ("estimator: position_noise_m", "m", config.position_noise_m, (0.0, 0.1)),
        ("estimator: time_constant_s", "s", direction.time_constant_s, (0.001, 10.0)),
        ("estimator: direction.force_min_n", "N", direction.force_min_n, (1e-6, 1e3)),
        ("estimator: gate.force_min_n", "N", gate.force_min_n, (0.0, 1e3)),
        ("estimator: gate.speed_min_m_per_s", "m/s", gate.speed_min_m_per_s, (0.0, 10.0)),
    ]
}

#[rustfmt::skip]
fn recursive(config: &RecommendedConfig) -> [Check; 10] {
    let recursive = &config.recursive;
    let ([prior_b, prior_c], [held_b, held_c]) =
        (recursive.prior_deviation, recursive.held_deviation);
    let change = recursive.change.unwrap_or_default();
    [
        ("estimator: forgetting", "", recursive.forgetting, (0.5, 1.0)),
        ("estimator: prior_deviation of b", "N s/m", prior_b, (1e-6, 1e6)),
        ("estimator: prior_deviation of c", "N", prior_c, (1e-6, 1e6)),
        ("estimator: held_deviation of b", "N s/m", held_b, (1e-6, 1e6)),
        ("estimator: held_deviation of c", "N", held_c, (1e-6, 1e6)),
        // less, and taking the noise away could leave nothing
        ("estimator: excitation", "", recursive.excitation, (2.0, 1e6)),
        ("estimator: damping_force_n", "N", recursive.damping_force_n, (0.0, 1e6)),
        ("estimator: error_share", "", change.error_share, (0.0, 1e6)),
        ("estimator: after_s", "s", change.after_s, (0.0, 60.0)),
        ("estimator: trust", "", change.trust, (0.0, 1.0)),
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
            "estimator: cutoff_rad_per_s 0 is outside the accepted range 1 to 3000 rad/s"
        );
        config.cutoff_rad_per_s = 120.0;
        config.recursive.prior = [0.4, f64::NAN, 1.0];
        let error = EstimatorConfig::Recommended(config).check().unwrap_err();
        assert_eq!(error.name, "estimator: prior b");
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
