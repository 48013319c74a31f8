//! The reference motions: what the environment does in cases whose outcome is known.
//!
//! Ten rows for a square body of any accepted parameters: a push, a push at 45°, a stop, a spin-down, a
//! turning coast, an off-centre wrench, and two pushes that must not move it. The reference is a closed
//! form where there is one, else a much finer patch integrated by code of its own (`reference.rs`). It
//! must never take a number from the environment as a reference.
//!
//! The motions are the same for every body: a body whose friction holds a push or a wrench stays, and that is
//! its reference. Only where a body would become faster than the environment accepts is a push shorter.

mod motion;
mod reference;

use mmt_server::environment::{Environment, EnvironmentConfig, EnvironmentError};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::params::{GRAVITY, friction_torque_of_square, inertia_of_square};

use motion::{Kind, Motion, Run};

/// A square body on plain ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass m, kg. Default 0.7: the real cube of section IV-A.
    pub mass_kg: f64,
    /// Side l, m. Default 0.36: the real cube's.
    pub side_m: f64,
    /// Friction coefficient mu, above zero. Default 0.3: a study's choice.
    pub friction_coefficient: f64,
    /// Viscous damping b, N s/m; turning is damped by b l²/6. Default 0: closed forms of Coulomb alone.
    pub damping_ns_per_m: f64,
}

impl Body {
    /// The body of section IV-A.
    pub const DEFAULT: Self = Self {
        mass_kg: 0.7,
        side_m: 0.36,
        friction_coefficient: 0.3,
        damping_ns_per_m: 0.0,
    };
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicsCase {
    /// Which motion, and of which quantity.
    pub case: &'static str,
    /// What is done to the body, in words and numbers.
    pub motion: String,
    /// Where the reference comes from.
    pub source: Source,
    /// Unit of reference and measured: `m`, `rad` or `s`.
    pub unit: &'static str,
    /// What should come out.
    pub reference: f64,
    /// What the environment did.
    pub measured: f64,
    /// |measured − reference| by max(|reference|, 1 mm, 1 mrad or 1 ms).
    pub relative_error: f64,
}

/// Where a reference comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A closed form of (1), (7) with the friction of (9).
    ClosedForm,
    /// The fine patch.
    FinePatch,
}

/// One quantity over the time of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicsTrace {
    /// The case whose quantity it is.
    pub case: &'static str,
    /// Unit of the values: `m` or `rad`.
    pub unit: &'static str,
    /// From the start of the motion to its end in the environment.
    pub points: Vec<TracePoint>,
}

/// One instant of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracePoint {
    /// Time since the start of the motion, s.
    pub t_s: f64,
    /// What the environment did.
    pub measured: f64,
    /// What it should have done.
    pub reference: f64,
}

/// Why there are no reference motions of a body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhysicsError {
    /// The body's numbers are not accepted.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// Without friction a body never comes to rest, and nothing holds it.
    #[error(
        "physics: friction coefficient {0} is too small: the motions end by friction, use 0.01 or more"
    )]
    NoFriction(f64),
}

/// The rows of the table, in the order in which they are named above.
///
/// # Errors
/// When the environment does not accept the body, or it has no friction.
pub fn cases(body: &Body) -> Result<Vec<PhysicsCase>, PhysicsError> {
    let motions = Motion::all(&body.checked()?);
    let mut cases = Vec::new();
    for motion in &motions {
        let run = Run::of(motion)?;
        for kind in motion.kinds() {
            cases.push(case(motion, &run, *kind));
        }
    }
    Ok(cases)
}

/// Every case of [`cases`] over the time that was measured, at most 401 points each. Spin-down shows the angle, whose end the
/// table gives as a time.
///
/// # Errors
/// As [`cases`].
pub fn traces(body: &Body) -> Result<Vec<PhysicsTrace>, PhysicsError> {
    let motions = Motion::all(&body.checked()?);
    let mut traces = Vec::new();
    for motion in &motions {
        let run = Run::of(motion)?;
        for kind in motion.kinds() {
            traces.push(PhysicsTrace {
                case: kind.case,
                unit: if kind.turns { "rad" } else { "m" },
                points: run.trace(kind.turns),
            });
        }
    }
    Ok(traces)
}

fn case(motion: &Motion, run: &Run, kind: Kind) -> PhysicsCase {
    let (unit, reference, measured) = if kind.timed {
        ("s", run.reference_seconds, run.measured_seconds)
    } else {
        let (reference, measured) = run.ends(kind.turns);
        (if kind.turns { "rad" } else { "m" }, reference, measured)
    };
    // 1 mm, 1 mrad or 1 ms
    let scale = reference.abs().max(1e-3);
    PhysicsCase {
        case: kind.case,
        motion: motion.words(),
        source: motion.source(),
        unit,
        reference,
        measured,
        relative_error: (measured - reference).abs() / scale,
    }
}

/// The body with what follows from its numbers.
#[derive(Clone, Copy, Debug)]
struct Dynamics {
    config: EnvironmentConfig,
    m: f64,
    b: f64,
    c: f64,
    side: f64,
    inertia: f64,
    /// Rotational damping, N m s.
    b_r: f64,
    e: f64,
}

impl Body {
    /// The environment's configuration: no tool touches the body, so the coupling is the softest.
    fn environment(&self) -> EnvironmentConfig {
        EnvironmentConfig {
            mass_kg: self.mass_kg,
            side_m: self.side_m,
            friction_coefficient: self.friction_coefficient,
            damping_ns_per_m: self.damping_ns_per_m,
            coupling: Coupling {
                stiffness_n_per_m: 1.0,
                damping_ns_per_m: 0.0,
            },
            ..EnvironmentConfig::default()
        }
    }

    fn checked(&self) -> Result<Dynamics, PhysicsError> {
        let config = self.environment();
        Environment::try_new(config)?;
        let mu = self.friction_coefficient;
        if mu < 0.01 {
            return Err(PhysicsError::NoFriction(mu));
        }
        let (m, b, side) = (self.mass_kg, self.damping_ns_per_m, self.side_m);
        let c = mu * m * GRAVITY;
        Ok(Dynamics {
            config,
            m,
            b,
            c,
            side,
            inertia: inertia_of_square(m, side),
            b_r: inertia_of_square(b, side),
            e: friction_torque_of_square(c, side),
        })
    }
}

#[cfg(test)]
mod tests;
