//! The estimators: mass m, damping b and friction c of the pushed object, (1)–(3) of the paper.
//!
//! *Paper mode* is section II-A as printed; *recommended mode* filters force and motion alike and looks
//! along the contact normal. I and e follow from m and c by (8) and (9), which `mmt_shared::model::params`
//! holds. The estimators are pure and take one tick of T = 1 ms at a time; they must never allocate in
//! a tick, and never poison themselves with a number that is not finite.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;
use serde::{Deserialize, Serialize};

mod creep;
mod direction;
mod estimate;
mod filter;
mod gate;
mod immovable;
mod kalman;
mod limits;
mod measured;
mod multiple_model;
mod obstacle;
mod off_centre;
mod paper;
mod quadratic;
mod quasi_static;
mod recommended;
mod recursive;
mod surface;
#[cfg(test)]
mod tests;
mod way;
mod windowed;

pub use direction::DirectionConfig;
pub use gate::GateConfig;
pub use kalman::KalmanConfig;
pub use obstacle::OBSTACLE_N;
pub use paper::{ObjectMotion, PaperConfig};
pub use quasi_static::QuasiStaticConfig;
pub use recommended::RecommendedConfig;
pub use recursive::{ChangeTest, RecursiveConfig};
pub use windowed::Rows;

pub use estimate::{Estimate, STICK_SPEED};
pub use measured::{Measured, Seen};
use multiple_model::MultipleModel;
use obstacle::Hand;
use paper::PaperEstimator;
use quasi_static::QuasiStaticEstimator;
use recommended::RecommendedEstimator;

/// Which estimator, and how.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorConfig {
    /// Section II-A as printed.
    Paper(PaperConfig),
    /// Along the normal, filtered alike, recursive.
    Recommended(RecommendedConfig),
    /// For pushes of some mm/s: friction alone.
    QuasiStatic(QuasiStaticConfig),
}

impl EstimatorConfig {
    /// The defaults of a mode under the coupling of the slave's contact.
    #[must_use]
    pub fn of_mode(mode: Mode, coupling: Coupling) -> Self {
        match mode {
            Mode::Paper => Self::Paper(PaperConfig::default()),
            Mode::Recommended => Self::Recommended(RecommendedConfig::new(coupling)),
        }
    }

    /// The same with another prior of m (kg), b (N s/m), c (N).
    #[must_use]
    pub fn starting_at(mut self, prior: [f64; 3]) -> Self {
        match &mut self {
            Self::Paper(config) => config.prior = prior,
            Self::Recommended(config) => config.recursive.prior = prior,
            Self::QuasiStatic(config) => config.prior = prior,
        }
        self
    }
}

/// What gives while the tool presses, and with that how the surface is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolGives {
    /// Not the tool: the contact does, by k_p and k_d. The surface is found through the force.
    No,
    /// The tool, by a spring of the slave's, and behind it a contact whose stiffness nobody knows.
    BySlave,
    /// The tool of a plant, by k_p and k_d. The plant reports where its tool is, and that is the surface: noise of the force is not
    /// in it.
    ByPlant,
}

/// The slave's estimator of m, b and c. On the heap: a slave is moved about on stacks of 2 MB.
#[derive(Clone, Debug)]
pub struct Estimator(Box<Kind>);

#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, and it stands on the heap"
)]
enum Kind {
    /// Section II-A as printed.
    Paper(PaperEstimator),
    /// Along the normal, filtered alike, recursive.
    Recommended(RecommendedEstimator),
    /// The same behind a contact of unknown stiffness.
    MultipleModel(MultipleModel),
    /// Friction alone.
    QuasiStatic(QuasiStaticEstimator),
}

impl Estimator {
    /// An estimator at its prior, of an object touched through `coupling` by a hand that presses with no more than
    /// `hand_force_max_n`, N, with a tool that `gives` so. Settings from outside pass
    /// [`EstimatorConfig::check`] first.
    #[must_use]
    pub fn new(
        config: &EstimatorConfig,
        coupling: Coupling,
        hand_force_max_n: f64,
        gives: ToolGives,
    ) -> Self {
        let hand = Hand {
            force_max_n: hand_force_max_n,
            device_n_per_m: coupling.stiffness_n_per_m,
        };
        Self(Box::new(match config {
            EstimatorConfig::Paper(config) => Kind::Paper(PaperEstimator::new(config, coupling)),
            EstimatorConfig::Recommended(config) => match gives {
                ToolGives::BySlave => Kind::MultipleModel(MultipleModel::new(config, hand)),
                ToolGives::No => Kind::Recommended(RecommendedEstimator::new(config, hand)),
                ToolGives::ByPlant => {
                    let through_force = RecommendedEstimator::new(config, hand);
                    Kind::Recommended(through_force.at_the_surface())
                }
            },
            EstimatorConfig::QuasiStatic(config) => {
                Kind::QuasiStatic(QuasiStaticEstimator::new(config))
            }
        }))
    }

    /// Takes one tick and returns the estimate. Allocates nothing.
    pub fn step(&mut self, measured: &Measured) -> Estimate {
        match &mut *self.0 {
            Kind::Paper(estimator) => estimator.step(measured),
            Kind::Recommended(estimator) => estimator.step(measured),
            Kind::MultipleModel(estimator) => estimator.step(measured),
            Kind::QuasiStatic(estimator) => estimator.step(measured),
        }
        *self.estimate()
    }

    /// The forces of all ticks so far were this many times as large: the gain of the sensor has been found. What has a short memory
    /// forgets them by itself.
    pub fn rescale(&mut self, times: f64) {
        match &mut *self.0 {
            Kind::Recommended(estimator) => estimator.rescale(times),
            Kind::MultipleModel(estimator) => estimator.rescale(times),
            Kind::Paper(_) | Kind::QuasiStatic(_) => {}
        }
    }

    /// The estimate after the last tick.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        match &*self.0 {
            Kind::Paper(estimator) => &estimator.estimate,
            Kind::Recommended(estimator) => &estimator.estimate,
            Kind::MultipleModel(estimator) => estimator.estimate(),
            Kind::QuasiStatic(estimator) => &estimator.estimate,
        }
    }

    /// How much farther a tool that gives by `back` (m) is behind the surface than a contact of k_p would let it under this
    /// force (N), m; 0 where the contact is taken for one of k_p.
    #[must_use]
    pub fn beyond_m(&self, back: Vec2, force: Vec2) -> f64 {
        match &*self.0 {
            Kind::MultipleModel(estimator) => estimator.beyond_m(back, force),
            _ => 0.0,
        }
    }

    /// Stiffness of the contact, N/m, where it is estimated and something has shown it.
    #[must_use]
    pub fn contact_n_per_m(&self) -> Option<f64> {
        match &*self.0 {
            Kind::MultipleModel(estimator) => estimator.contact_n_per_m(),
            _ => None,
        }
    }
}
