//! What an estimator has found after a tick.

use nalgebra::{Matrix3, Vector3};

/// Below this speed along the normal the object is taken to stick, m/s: four standard deviations of the
/// smoothed speed at the default position noise.
pub const STICK_SPEED: f64 = 0.005;

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
    pub(super) fn at(values: Vector3<f64>) -> Self {
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

    pub(super) fn set(&mut self, values: Vector3<f64>, covariance: Matrix3<f64>) {
        (self.m, self.b, self.c) = (values.x, values.y, values.z);
        self.covariance = covariance;
    }

    /// Contact was lost: the parameters stay, the motion is unknown.
    pub(super) fn release(&mut self) {
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
