//! The estimators: mass m, damping b and friction c of the pushed object, (1)–(3) of the paper.
//!
//! *Paper mode* is section II-A as printed; *recommended mode* filters force and motion alike and looks
//! along the contact normal. I and e follow from m and c by (8) and (9), which `mmt_shared::model::params`
//! holds. The estimators are pure and take one tick of T = 1 ms at a time; they must never allocate in
//! a tick, and never poison themselves with a number that is not finite.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

mod creep;
mod direction;
mod filter;
mod gate;
mod kalman;
mod limits;
mod obstacle;
mod paper;
mod quadratic;
mod quasi_static;
mod recommended;
mod recursive;
mod surface;
#[cfg(test)]
mod tests;
mod turning;
mod windowed;

pub use direction::DirectionConfig;
pub use gate::GateConfig;
pub use kalman::KalmanConfig;
pub use obstacle::OBSTACLE_N;
pub use paper::{ObjectMotion, PaperConfig};
pub use quasi_static::QuasiStaticConfig;
pub use recommended::RecommendedConfig;
pub use recursive::{ChangeTest, RecursiveConfig};
pub use turning::Seen;
pub use windowed::Rows;

use paper::PaperEstimator;
use quasi_static::QuasiStaticEstimator;
use recommended::RecommendedEstimator;

/// Below this speed along the normal the object is taken to stick, m/s: four standard deviations of the
/// smoothed speed at the default position noise.
pub const STICK_SPEED: f64 = 0.005;
/// No sensor of this system gives a position beyond this, m.
const POSITION_LIMIT: f64 = 100.0;
/// No sensor of this system gives a force beyond this, N.
const FORCE_LIMIT: f64 = 1e4;

/// What the slave measured in one tick: tool and force of the same instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Tool position, world frame, m.
    pub tool: Vec2,
    /// f_s, contact force on the object, world frame, N; positive when the tool pushes the object.
    pub force: Vec2,
    /// Noise of the force per axis, N, where it is more than the settings are made for; else 0.
    pub force_noise_n: f64,
    /// Inward unit normal of the touched face as the pose observer has it; none when not in contact. It
    /// serves until the direction of the force is known.
    pub normal: Option<Vec2>,
    /// Where the slave sees the object; none: it is taken to be pushed through its centre.
    pub seen: Option<Seen>,
}

impl Measured {
    fn is_usable(&self) -> bool {
        // written so that NaN fails
        let within = |v: &Vec2, limit: f64| v.x.abs() <= limit && v.y.abs() <= limit;
        within(&self.tool, POSITION_LIMIT)
            && within(&self.force, FORCE_LIMIT)
            && self.normal.is_none_or(|normal| within(&normal, 1.0))
            && self.seen.is_none_or(|seen| seen.is_usable())
    }
}

/// What an estimator has found after a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mass m, kg.
    pub m: f64,
    /// Viscous damping b, N s/m.
    pub b: f64,
    /// Coulomb friction force c, N.
    pub c: f64,
    /// Covariance of (m, b, c) in the units above, as if the errors of the rows were independent.
    pub covariance: Matrix3<f64>,
    /// Condition number of the data in memory with every regressor scaled to length 1 (√3 is perfect);
    /// infinite before there are data.
    pub condition: f64,
    /// Whether this tick brought data from which m, b and c can be found; if not, values are held.
    pub excited: bool,
    /// Ticks that counted, so far.
    pub samples: u64,
    /// Angle of the force, which is that of the inward normal, world frame, rad, in (−π, π]; none when
    /// not in contact or when the force is too small to have a direction.
    pub heading: Option<f64>,
    /// Speed v·n of the touched surface along the normal, smoothed, m/s; 0 when not in contact.
    pub speed: f64,
    /// Acceleration a·n of the touched surface along the normal, smoothed, m/s²; 0 when not sliding.
    pub acceleration: f64,
    /// In contact, and slower than [`STICK_SPEED`]: static friction holds the object.
    pub sticking: bool,
    /// The friction (N) that a model needs to stand as the object does, which something beyond its own
    /// friction holds; none usually, and never in paper mode.
    pub holding: Option<f64>,
}

impl Estimate {
    /// No data yet: `values` are m, b, c.
    fn at(values: Vector3<f64>) -> Self {
        Self {
            m: values.x,
            b: values.y,
            c: values.z,
            covariance: Matrix3::identity(),
            condition: f64::INFINITY,
            excited: false,
            samples: 0,
            heading: None,
            speed: 0.0,
            acceleration: 0.0,
            sticking: false,
            holding: None,
        }
    }

    fn set(&mut self, values: Vector3<f64>, covariance: Matrix3<f64>) {
        (self.m, self.b, self.c) = (values.x, values.y, values.z);
        self.covariance = covariance;
    }

    /// Contact was lost: the parameters stay, the motion is unknown.
    fn release(&mut self) {
        self.excited = false;
        self.heading = None;
        (self.speed, self.acceleration) = (0.0, 0.0);
        self.sticking = false;
        self.holding = None;
    }

    /// Standard deviation of m a + b v + c in the present motion, N.
    #[must_use]
    pub fn force_deviation(&self) -> f64 {
        let motion = Vector3::new(self.acceleration, self.speed, 1.0);
        motion.dot(&(self.covariance * motion)).max(0.0).sqrt()
    }
}

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

/// The slave's estimator of m, b and c.
#[derive(Clone, Debug)]
pub struct Estimator(Kind);

#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, and it never moves"
)]
enum Kind {
    /// Section II-A as printed.
    Paper(PaperEstimator),
    /// Along the normal, filtered alike, recursive.
    Recommended(RecommendedEstimator),
    /// Friction alone.
    QuasiStatic(QuasiStaticEstimator),
}

impl Estimator {
    /// An estimator at its prior, of an object touched through `coupling`. Settings from outside pass
    /// [`EstimatorConfig::check`] first.
    #[must_use]
    pub fn new(config: &EstimatorConfig, coupling: Coupling) -> Self {
        Self(match config {
            EstimatorConfig::Paper(config) => Kind::Paper(PaperEstimator::new(config, coupling)),
            EstimatorConfig::Recommended(config) => {
                Kind::Recommended(RecommendedEstimator::new(config))
            }
            EstimatorConfig::QuasiStatic(config) => {
                Kind::QuasiStatic(QuasiStaticEstimator::new(config))
            }
        })
    }

    /// Takes one tick and returns the estimate. Allocates nothing.
    pub fn step(&mut self, measured: &Measured) -> Estimate {
        match &mut self.0 {
            Kind::Paper(estimator) => estimator.step(measured),
            Kind::Recommended(estimator) => estimator.step(measured),
            Kind::QuasiStatic(estimator) => estimator.step(measured),
        }
        *self.estimate()
    }

    /// The estimate after the last tick.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        match &self.0 {
            Kind::Paper(estimator) => &estimator.estimate,
            Kind::Recommended(estimator) => &estimator.estimate,
            Kind::QuasiStatic(estimator) => &estimator.estimate,
        }
    }
}
