//! The one number of each architecture that is tuned, and the six values that are tried.
//!
//! As many for each: no architecture is looked at more closely than another. What it is run with where nobody tunes
//! it is one of them.

use std::time::Duration;

use mmt_server::trigger::Scheme;

use crate::architecture::ComparedArchitecture;
use crate::baselines::{Baseline, Tuning};
use crate::experiment::findings::ExperimentError;
use crate::experiments::delay::grid_point::GridPoint;
use crate::world::WorldConfig;

/// A number that is tuned.
pub(super) struct Number {
    /// Name and unit, as in tables.
    pub(super) name: &'static str,
    /// What is tried.
    pub(super) values: [f64; 6],
}

/// The number of an architecture.
pub(super) const fn number(architecture: ComparedArchitecture) -> Number {
    let (name, values) = match architecture {
        ComparedArchitecture::Bilateral(Baseline::PositionForce) => {
            ("force gain", [0.2, 0.4, 0.6, 0.8, 0.9, 1.0])
        }
        ComparedArchitecture::Bilateral(Baseline::DampedPositionForce) => {
            ("damping, N s/m", [1.0, 2.0, 5.0, 10.0, 20.0, 40.0])
        }
        ComparedArchitecture::Bilateral(Baseline::DeadbandForce | Baseline::TdpaDeadband) => {
            ("Delta", [0.02, 0.05, 0.10, 0.15, 0.20, 0.30])
        }
        ComparedArchitecture::Bilateral(Baseline::Tdpa) => {
            ("repayment, N s/m", [1.0, 2.0, 5.0, 10.0, 20.0, 40.0])
        }
        ComparedArchitecture::Bilateral(Baseline::Waves) => {
            ("b, N s/m", [1.0, 2.0, 5.0, 10.0, 20.0, 40.0])
        }
        ComparedArchitecture::Mediated(_) => {
            ("T_update, ms", [20.0, 50.0, 100.0, 150.0, 300.0, 1000.0])
        }
    };
    Number { name, values }
}

/// A point of the delay experiment with a value for the number of its architecture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    pub(super) point: GridPoint,
    pub(super) value: f64,
}

impl Choice {
    /// Every value at a point.
    pub(super) fn at(point: GridPoint) -> impl Iterator<Item = Self> {
        let values = number(point.architecture).values;
        values.into_iter().map(move |value| Self { point, value })
    }

    /// Whether it is what the architecture is run with where nobody tunes it.
    pub(super) fn is_default(&self) -> Result<bool, ExperimentError> {
        let untuned = (Tuning::default(), self.point.world()?);
        Ok(self.setting()? == untuned)
    }

    /// Tuning and world.
    pub(super) fn setting(&self) -> Result<(Tuning, WorldConfig), ExperimentError> {
        let (mut tuning, mut world) = (Tuning::default(), self.point.world()?);
        match self.point.architecture {
            ComparedArchitecture::Bilateral(baseline) => {
                *of_baseline(&mut tuning, baseline) = self.value
            }
            ComparedArchitecture::Mediated(_) => {
                if let Scheme::Useful { t_update, .. } = &mut world.slave.trigger.scheme {
                    *t_update = Duration::from_secs_f64(1e-3 * self.value);
                }
            }
        }
        Ok((tuning, world))
    }
}

fn of_baseline(tuning: &mut Tuning, baseline: Baseline) -> &mut f64 {
    match baseline {
        Baseline::PositionForce => &mut tuning.force_gain,
        Baseline::DampedPositionForce => &mut tuning.injected_damping_ns_per_m,
        Baseline::DeadbandForce | Baseline::TdpaDeadband => &mut tuning.delta,
        Baseline::Tdpa => &mut tuning.repayment_ns_per_m,
        Baseline::Waves => &mut tuning.wave_impedance_ns_per_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Else a value would be tried that is no other, or the comparison with the default would be of something else.
    #[test]
    fn every_value_changes_its_run_and_one_of_them_is_the_default() {
        for architecture in ComparedArchitecture::ALL {
            let choices: Vec<Choice> = Choice::at(GridPoint::plain(architecture, 50)).collect();
            let settings: Vec<_> = choices.iter().map(|c| c.setting().unwrap()).collect();
            for (k, setting) in settings.iter().enumerate() {
                assert!(!settings[..k].contains(setting), "{architecture:?} {k}");
            }
            let defaults = choices.iter().filter(|c| c.is_default().unwrap());
            assert_eq!(defaults.count(), 1, "{architecture:?}");
        }
    }
}
