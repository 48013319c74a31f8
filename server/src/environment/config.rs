//! What an environment is made of, with the default scenario, and the checks on it.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Face, Pose, Vec2};
use mmt_shared::model::params::{DAMPING_NS_PER_M, GRAVITY, ModelParams, ParamsError, WORKSPACE_M};
use mmt_shared::range::{OutOfRange, in_range};
use serde::{Deserialize, Serialize};

use super::bounded::Bounded;
use super::outline::{Outline, OutlineError, Shape, convex, simple};
use super::terrain::{GroundPatch, PATCHES_MAX, Ripple, Terrain};
use super::wall::{ANGLE_RAD, Wall};

/// Accepted side l, m: the accepted face offsets of the local model, doubled.
pub(crate) const SIDE_M: (f64, f64) = (0.02, 2.0);
/// Accepted friction coefficient mu: rubber on rubber stays below 2.
const FRICTION_COEFFICIENT: (f64, f64) = (0.0, 5.0);
/// Accepted rotational damping, N m s.
const ROTATIONAL_DAMPING_NMS: (f64, f64) = (0.0, 200.0);
/// Accepted gravity, m/s²: up to Jupiter's.
const GRAVITY_M_PER_S2: (f64, f64) = (0.0, 25.0);
/// Accepted contact stiffness `k_p`, N/m: ten times the stiffest device profile.
const STIFFNESS_N_PER_M: (f64, f64) = (1.0, 30_000.0);
/// Accepted contact damping `k_d`, N s/m.
const CONTACT_DAMPING_NS_PER_M: (f64, f64) = (0.0, 300.0);
/// Accepted ratio of static to sliding friction: wood on wood is near 1.5.
const STATIC_RATIO: (f64, f64) = (1.0, 5.0);
/// Accepted share of the ripple: at 1 there are places without friction.
const RIPPLE_SHARE: (f64, f64) = (0.0, 1.0);
/// Accepted period of the ripple, m.
const RIPPLE_PERIOD_M: (f64, f64) = (0.01, 10.0);
/// Accepted coordinates of the corners of a ground patch, m.
const GROUND_M: (f64, f64) = (-1000.0, 1000.0);

/// A body on a plane. The default is the default scenario of the model study: a cube on plain ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EnvironmentConfig {
    /// Side l of the square footprint, m. Default 0.36: the real cube of section IV-A.
    pub side_m: f64,
    /// The footprint. Default: the square of side `side_m`, which other shapes do not read.
    pub shape: Shape,
    /// Centre of mass from the centroid of the footprint, object frame, m; inside the footprint.
    /// Default: none. Pressure stays uniform, and I about the centre of mass that of a uniform body.
    pub centre_of_mass_m: Vec2,
    /// Mass m, kg. Default 0.7: the real cube's.
    pub mass_kg: f64,
    /// Friction coefficient mu between sliding body and ground. Default 0.3, a choice: the paper gives none.
    pub friction_coefficient: f64,
    /// What breaks a resting body away, by what brakes a sliding one. Default 1.
    pub static_ratio: f64,
    /// A smooth ripple of mu over the ground. Default: none.
    pub ripple: Option<Ripple>,
    /// Up to 8 rectangles of the ground with a mu of their own. Default: none.
    pub patches: Bounded<GroundPatch, PATCHES_MAX>,
    /// A wall that stops the body. Default: none.
    pub wall: Option<Wall>,
    /// Viscous damping b, N s/m. Default 3, a choice: the paper gives none, and (1) has something to find.
    pub damping_ns_per_m: f64,
    /// Rotational damping, N m s; none means that of a film under the footprint, b l²/6 for a square.
    /// The local model lacks it on purpose.
    pub rotational_damping_nms: Option<f64>,
    /// Acceleration of gravity g, m/s². Default 9.81.
    pub gravity_m_per_s2: f64,
    /// Where the centroid of the body's footprint rests at the start. Default: the origin.
    pub pose: Pose,
    /// `k_p` and `k_d` of the real contact between tool and surface. Default 1000 N/m, 10 N s/m.
    pub coupling: Coupling,
    /// `k_p` and `k_d` of the real contact where they are others than `coupling`, which is the session's and all that the
    /// slave knows of it. Default: the same.
    pub contact: Option<Coupling>,
}

impl Default for EnvironmentConfig {
    fn default() -> Self {
        Self {
            side_m: 0.36,
            shape: Shape::Square,
            centre_of_mass_m: Vec2::zeros(),
            mass_kg: 0.7,
            friction_coefficient: 0.3,
            static_ratio: 1.0,
            ripple: None,
            patches: Bounded::default(),
            wall: None,
            damping_ns_per_m: 3.0,
            rotational_damping_nms: None,
            gravity_m_per_s2: GRAVITY,
            pose: Pose::default(),
            coupling: Coupling::for_stiffness(1000.0),
            contact: None,
        }
    }
}

/// Why an environment cannot be made of these numbers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentError {
    /// A number lies outside its accepted range or is not a number.
    #[error("environment: {0}")]
    OutOfRange(#[from] OutOfRange),
    /// m, b, c, I or e could not be a model's parameters, so that no estimate of them could be right.
    #[error("environment: {0}")]
    Parameters(#[from] ParamsError),
    /// The footprint is no convex polygon.
    #[error("environment: {0}")]
    Outline(#[from] OutlineError),
    /// The centre of mass lies outside the footprint.
    #[error(
        "environment: centre of mass ({x}, {y}) m is outside the accepted places: inside the footprint"
    )]
    CentreOfMass {
        /// x of what it was, m.
        x: f64,
        /// y of what it was, m.
        y: f64,
    },
    /// A body of the scene is wrong; the first has number 1.
    #[error("scene: body {0}: {1}")]
    Body(usize, Box<EnvironmentError>),
    /// A wall of the scene is wrong, or a body stands in it at the start; the first has number 1.
    #[error("wall {0} of the scene: {1}")]
    Wall(usize, OutOfRange),
    /// Two bodies of the scene are in each other at the start.
    #[error("scene: bodies {0} and {1} overlap")]
    Overlap(usize, usize),
}

impl EnvironmentConfig {
    /// The footprint about its centroid.
    pub(super) fn outline(&self) -> Result<Outline, EnvironmentError> {
        match &self.shape {
            Shape::Square => {
                in_range("side", "m", self.side_m, SIDE_M)?;
                Ok(Outline::rectangle(self.side_m, self.side_m))
            }
            Shape::Brick { length_m, width_m } => {
                in_range("brick length", "m", *length_m, SIDE_M)?;
                in_range("brick width", "m", *width_m, SIDE_M)?;
                Ok(Outline::rectangle(*length_m, *width_m))
            }
            Shape::Disc { diameter_m } => {
                in_range("disc diameter", "m", *diameter_m, SIDE_M)?;
                Ok(Outline::Circle(diameter_m / 2.0))
            }
            Shape::Polygon { vertices_m } => Ok(Outline::polygon(vertices_m, convex)?),
            Shape::Compound { vertices_m } => Ok(Outline::polygon(vertices_m, simple)?),
        }
    }

    /// Stiffness and damping of the real contact.
    pub(super) fn real_contact(&self) -> Coupling {
        self.contact.unwrap_or(self.coupling)
    }

    /// The friction coefficient over the ground.
    pub(super) fn terrain(&self) -> Terrain<'_> {
        Terrain {
            mu: self.friction_coefficient,
            ripple: self.ripple,
            patches: self.patches.as_slice(),
        }
    }

    /// Rotational damping, N m s: as given, else that of a film under the footprint.
    pub(super) fn rotational_damping(&self, outline: &Outline) -> f64 {
        let b = self.damping_ns_per_m;
        let spread = match self.shape {
            Shape::Square => b * self.side_m * self.side_m / 6.0,
            _ => b * outline.mean_square_arm(),
        };
        self.rotational_damping_nms.unwrap_or(spread)
    }

    /// The real m, b, c, I and e.
    pub(super) fn truth(&self, outline: &Outline) -> Result<ModelParams, EnvironmentError> {
        let (m, b) = (self.mass_kg, self.damping_ns_per_m);
        let c = self.friction_coefficient * m * self.gravity_m_per_s2;
        let coupling = &self.coupling;
        let truth = match self.shape {
            Shape::Square => ModelParams::of_square(m, b, c, self.side_m, coupling),
            _ => {
                let (inertia, e) = (m * outline.mean_square_arm(), c * outline.mean_arm());
                ModelParams::try_new(m, b, c, inertia, e, coupling)
            }
        };
        Ok(truth?)
    }

    pub(super) fn check(&self, outline: &Outline) -> Result<(), EnvironmentError> {
        let place = (-WORKSPACE_M, WORKSPACE_M);
        let mu = self.friction_coefficient;
        let b_r = self.rotational_damping(outline);
        let g = self.gravity_m_per_s2;
        in_range("friction coefficient", "", mu, FRICTION_COEFFICIENT)?;
        in_range("static ratio", "", self.static_ratio, STATIC_RATIO)?;
        in_range("damping", "N s/m", self.damping_ns_per_m, DAMPING_NS_PER_M)?;
        in_range("rotational damping", "N m s", b_r, ROTATIONAL_DAMPING_NMS)?;
        in_range("gravity", "m/s^2", g, GRAVITY_M_PER_S2)?;
        for coupling in [self.coupling, self.real_contact()] {
            let (k_p, k_d) = (coupling.stiffness_n_per_m, coupling.damping_ns_per_m);
            in_range("contact stiffness", "N/m", k_p, STIFFNESS_N_PER_M)?;
            in_range("contact damping", "N s/m", k_d, CONTACT_DAMPING_NS_PER_M)?;
        }
        in_range("position x", "m", self.pose.position.x, place)?;
        in_range("position y", "m", self.pose.position.y, place)?;
        in_range("angle", "rad", self.pose.angle, ANGLE_RAD)?;
        let (x, y) = (self.centre_of_mass_m.x, self.centre_of_mass_m.y);
        let held = match self.shape {
            // the centroid of a body with notches may lie in one
            Shape::Compound { .. } => {
                let bounds = outline.bounding_box();
                let within =
                    |face: Face| face.outward().dot(&self.centre_of_mass_m) <= bounds.offset(face);
                Face::ALL.into_iter().all(within)
            }
            _ => outline.holds(self.centre_of_mass_m),
        };
        if !held {
            return Err(EnvironmentError::CentreOfMass { x, y });
        }
        self.check_ground()
    }

    fn check_ground(&self) -> Result<(), EnvironmentError> {
        if let Some(ripple) = &self.ripple {
            in_range("ripple share", "", ripple.share, RIPPLE_SHARE)?;
            in_range("ripple period", "m", ripple.period_m, RIPPLE_PERIOD_M)?;
        }
        for patch in self.patches.as_slice() {
            let (from, to, mu) = (patch.from_m, patch.to_m, patch.friction_coefficient);
            in_range("patch friction coefficient", "", mu, FRICTION_COEFFICIENT)?;
            in_range("patch from x", "m", from.x, GROUND_M)?;
            in_range("patch from y", "m", from.y, GROUND_M)?;
            in_range("patch to x", "m", to.x, (from.x, GROUND_M.1))?;
            in_range("patch to y", "m", to.y, (from.y, GROUND_M.1))?;
        }
        Ok(())
    }
}
