//! The body of the reference motions, and what follows from its numbers.

use mmt_server::environment::{Environment, EnvironmentConfig, EnvironmentError};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::params::{GRAVITY, friction_torque_of_square, inertia_of_square};

/// A square body on plain ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass m, kg. Default 0.7: the real cube of section IV-A.
    pub mass_kg: f64,
    /// Side l, m. Default 0.36: the real cube's.
    pub side_m: f64,
    /// Friction coefficient mu, above zero. Default 0.3, a choice: the paper gives none.
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

/// The body with what follows from its numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dynamics {
    pub(super) config: EnvironmentConfig,
    pub(super) m: f64,
    pub(super) b: f64,
    pub(super) c: f64,
    pub(super) side: f64,
    pub(super) inertia: f64,
    /// Rotational damping, N m s.
    pub(super) b_r: f64,
    pub(super) e: f64,
}

impl Body {
    /// The environment's configuration: no tool touches the body, so the coupling is the softest.
    pub(super) fn environment(&self) -> EnvironmentConfig {
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

    pub(super) fn checked(&self) -> Result<Dynamics, PhysicsError> {
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
