//! The model's parameters and the only road by which numbers become parameters.
//!
//! Holds (8) and (9), the accepted ranges and the stability bound of the local model. Whatever comes off
//! the wire passes `ModelParams::try_new` and `ModelState::try_new` or never reaches a model.

use serde::Serialize;

use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Face};
use crate::range::{self, OutOfRange};
use crate::time::TICK_S;

mod state;

pub use state::ModelState;

/// Acceleration of gravity g, m/s².
pub const GRAVITY: f64 = 9.81;

/// Accepted mass m, kg: below, the discrete model nears its stability bound; above, a hand cannot push.
pub const MASS_KG: (f64, f64) = (0.05, 50.0);
/// Accepted viscous damping b, N s/m.
pub const DAMPING_NS_PER_M: (f64, f64) = (0.0, 200.0);
/// Accepted Coulomb friction c, N.
pub const FRICTION_N: (f64, f64) = (0.0, 200.0);
/// Accepted inertia I about z, kg m²: that of 0.05 kg at a side of 2 cm to 50 kg at 2 m.
pub const INERTIA_KG_M2: (f64, f64) = (3e-6, 34.0);
/// Accepted friction torque e about z, N m.
pub const FRICTION_TORQUE_NM: (f64, f64) = (0.0, 200.0);
/// Accepted distance from the reference point to a face, m.
pub const FACE_OFFSET_M: (f64, f64) = (0.01, 1.0);
/// Accepted distance of the object from the world's origin, m: the workspace.
pub const WORKSPACE_M: f64 = 5.0;
/// Accepted orientation, rad: a thousand turns, far beyond use and far within f64's precision.
pub const ANGLE_RAD: f64 = 6283.0;
/// Accepted speed of the object, m/s.
pub const SPEED_M_PER_S: f64 = 10.0;
/// Accepted turning rate of the object, rad/s.
pub const TURN_RATE_RAD_PER_S: f64 = 100.0;

/// Margin of the stability bound: the accepted mass is this factor above the proven one.
pub const STABILITY_MARGIN: f64 = 4.0;
/// rho = 6 s²/l² for a contact at the face's end (s = l/2): the worst lever arm.
pub const RHO_MAX: f64 = 1.5;

/// Why numbers were not accepted as model parameters or state.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ParamsError {
    /// A number is NaN or infinite.
    #[error("{name} is not a finite number")]
    NotFinite {
        /// Which number.
        name: &'static str,
    },
    /// A number lies outside its accepted range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The discrete local model would be near its stability bound.
    #[error(
        "{name} {value} {unit} is below {least} {unit}, the least that is stable with margin at this stiffness, damping and size"
    )]
    Unstable {
        /// Which number: the mass or the inertia.
        name: &'static str,
        /// Its unit.
        unit: &'static str,
        /// What it was.
        value: f64,
        /// The least that is accepted with the other numbers.
        least: f64,
    },
}

/// Checks that `value` is finite and within `range`; names it if not.
pub(crate) fn in_range(
    name: &'static str,
    unit: &'static str,
    value: f64,
    range: (f64, f64),
) -> Result<(), ParamsError> {
    if !value.is_finite() {
        return Err(ParamsError::NotFinite { name });
    }
    Ok(range::in_range(name, unit, value, range)?)
}

/// The impedance of the box on the plane: what the estimator finds and the local model is made of.
///
/// Not `Deserialize` on purpose: numbers from outside become parameters by [`ModelParams::try_new`] only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModelParams {
    m: f64,
    b: f64,
    c: f64,
    inertia: f64,
    e: f64,
}

impl ModelParams {
    /// Parameters from m (kg), b (N s/m), c (N), I (kg m²) and e (N m).
    ///
    /// # Errors
    /// Names the first number that is not finite, outside its range, or, for the mass, below the
    /// stability bound of the local model under `coupling` with [`STABILITY_MARGIN`].
    pub fn try_new(
        m: f64,
        b: f64,
        c: f64,
        inertia: f64,
        e: f64,
        coupling: &Coupling,
    ) -> Result<Self, ParamsError> {
        in_range("mass", "kg", m, MASS_KG)?;
        in_range("damping", "N s/m", b, DAMPING_NS_PER_M)?;
        in_range("friction", "N", c, FRICTION_N)?;
        in_range("inertia", "kg m^2", inertia, INERTIA_KG_M2)?;
        in_range("friction torque", "N m", e, FRICTION_TORQUE_NM)?;
        let least = least_stable_mass(b, coupling);
        if m < least {
            return Err(ParamsError::Unstable {
                name: "mass",
                unit: "kg",
                value: m,
                least,
            });
        }
        Ok(Self {
            m,
            b,
            c,
            inertia,
            e,
        })
    }

    /// Parameters of a square of side l (m): I by (8), e by (9).
    ///
    /// # Errors
    /// As [`ModelParams::try_new`].
    pub fn of_square(
        m: f64,
        b: f64,
        c: f64,
        side: f64,
        coupling: &Coupling,
    ) -> Result<Self, ParamsError> {
        Self::try_new(
            m,
            b,
            c,
            inertia_of_square(m, side),
            friction_torque_of_square(c, side),
            coupling,
        )
    }

    /// The raw numbers (m, b, c, I, e) in SI units.
    pub fn to_array(&self) -> [f64; 5] {
        [self.m, self.b, self.c, self.inertia, self.e]
    }

    /// Mass m, kg.
    pub fn m(&self) -> f64 {
        self.m
    }

    /// Viscous damping b, N s/m.
    pub fn b(&self) -> f64 {
        self.b
    }

    /// Coulomb friction force c = mu m g, N.
    pub fn c(&self) -> f64 {
        self.c
    }

    /// Inertia I about z, kg m².
    pub fn inertia(&self) -> f64 {
        self.inertia
    }

    /// Friction torque e about z, N m.
    pub fn e(&self) -> f64 {
        self.e
    }

    /// These parameters with at least the inertia that is stable at the footprint's longest lever: what a body computes
    /// with while its parameters and its faces come from different updates.
    pub(crate) fn steadied(&self, footprint: &BoxFootprint, coupling: &Coupling) -> Self {
        let least = least_stable_inertia(footprint, coupling);
        Self {
            inertia: self.inertia.max(least),
            ..*self
        }
    }

    /// These parameters moved towards `target`: each number becomes `own·keep + target·(1 − keep)`.
    ///
    /// The accepted set is convex (the stability bound is linear in m and b), so the blend of two
    /// accepted sets is accepted.
    pub fn blend(&self, target: &Self, keep: f64) -> Self {
        let keep = keep.clamp(0.0, 1.0);
        let mix = |own: f64, other: f64| own * keep + other * (1.0 - keep);
        Self {
            m: mix(self.m, target.m),
            b: mix(self.b, target.b),
            c: mix(self.c, target.c),
            inertia: mix(self.inertia, target.inertia),
            e: mix(self.e, target.e),
        }
    }
}

/// Least mass (kg) accepted for damping b under a coupling: the bound
/// `4 m > (1 + rho) k_p T² + 2 (b + (1 + rho) k_d) T` of the semi-implicit local model, with margin.
pub fn least_stable_mass(b: f64, coupling: &Coupling) -> f64 {
    let k_p = coupling.stiffness_n_per_m;
    let k_d = coupling.damping_ns_per_m;
    let bound =
        (1.0 + RHO_MAX) * k_p * TICK_S * TICK_S + 2.0 * (b + (1.0 + RHO_MAX) * k_d) * TICK_S;
    STABILITY_MARGIN * bound / 4.0
}

/// Least inertia (kg m²) accepted with a footprint under a coupling: `I ≥ s² (k_p T² + 2 k_d T)`, s the longest lever arm
/// of a force on a face.
///
/// With [`least_stable_mass`] it keeps `(1/m + s²/I)(k_p T² + 2 k_d T) + 2 b T/m` at 2 or below, half of what is proven
/// stable. Squares of an accepted mass have more inertia than that.
pub fn least_stable_inertia(footprint: &BoxFootprint, coupling: &Coupling) -> f64 {
    let lever = Face::ALL
        .into_iter()
        .map(|face| footprint.offset(face))
        .fold(0.0, f64::max);
    let k_p = coupling.stiffness_n_per_m;
    let k_d = coupling.damping_ns_per_m;
    lever * lever * (k_p * TICK_S * TICK_S + 2.0 * k_d * TICK_S)
}

/// Inertia about z of a square of mass m (kg) and side l (m), kg m².
pub fn inertia_of_square(m: f64, side: f64) -> f64 {
    // (8)
    m * side * side / 6.0
}

/// Friction torque about z of a square of side l (m) under uniform pressure with friction c (N), N m.
pub fn friction_torque_of_square(c: f64, side: f64) -> f64 {
    // (9) in closed form: e = c l (sqrt 2 + asinh 1) / 6
    c * side * (std::f64::consts::SQRT_2 + libm::asinh(1.0)) / 6.0
}

#[cfg(test)]
mod tests;
