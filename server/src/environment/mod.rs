//! The remote environment: a body on a rough plane, pushed by the slave's position-controlled tool.
//!
//! This is the truth that the estimator looks for. Each step of T = 1 ms: the contact force of the tool
//! on the real surface by (6) with damping, the velocity without the ground
//! v* = v + T f/m, omega* = omega + T M/I, ground friction as one implicit step (`ground.rs`), then rapier
//! integrates the pose (`body.rs`). It must never take in a number that is not finite.

mod body;
mod config;
mod ground;

pub use config::{EnvironmentConfig, EnvironmentError};

use mmt_shared::contact::{Coupling, GodObject, Touch, contact_force};
use mmt_shared::geometry::{BoxFootprint, Pose, Twist, Vec2, cross, rotate};
use mmt_shared::params::ModelParams;
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;

use body::Body;
use ground::{Load, Patch};

/// Greatest force (N) and torque (N m) taken in; beyond, a wrench counts as not finite.
const WRENCH_MAX: f64 = 1e6;

/// What the tool met in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Contact force f on the object, world frame, N; positive when the tool pushes.
    pub force: Vec2,
    /// Where the tool touches; none in free space. The force acts at its proxy.
    pub touch: Option<Touch>,
}

/// A cube on a plane: the real object, its ground and the tool's contact with it.
pub struct Environment {
    config: EnvironmentConfig,
    truth: ModelParams,
    load: Load,
    footprint: BoxFootprint,
    patch: Patch,
    body: Body,
    tool: GodObject,
    refused: u64,
}

impl Environment {
    /// The environment at rest at the configuration's pose.
    ///
    /// # Errors
    /// Names the first number that is not finite or outside its range.
    pub fn try_new(config: EnvironmentConfig) -> Result<Self, EnvironmentError> {
        config.check()?;
        let truth = config.truth()?;
        let load = load(&config, &truth);
        Ok(Self {
            truth,
            load,
            footprint: BoxFootprint::square(config.side_m),
            patch: Patch::square(config.side_m),
            body: Body::square(config.side_m, load.m, load.inertia, config.pose),
            tool: GodObject::default(),
            refused: 0,
            config,
        })
    }

    /// Advances T = 1 ms with the tool at `tool` (m) moving at `tool_velocity` (m/s), both world frame.
    ///
    /// Returns the contact at the beginning of the step: the object's pose of before, the tool of now.
    /// A tool that is not finite touches nothing and is counted.
    pub fn step(&mut self, tool: Vec2, tool_velocity: Vec2) -> Contact {
        let contact = self.touch(tool, tool_velocity);
        let lever = contact
            .touch
            .map_or_else(Vec2::zeros, |touch| touch.proxy - self.pose().position);
        self.step_with_wrench(contact.force, cross(lever, contact.force));
        contact
    }

    /// Advances T = 1 ms under a force (N) at the centre and a torque (N m), both in the world frame,
    /// without a tool. A wrench that is not finite counts as none and is counted.
    pub fn step_with_wrench(&mut self, force: Vec2, torque: f64) {
        let (force, torque) = if within(&[force.x, force.y, torque]) {
            (force, torque)
        } else {
            self.refused += 1;
            (Vec2::zeros(), 0.0)
        };
        let (angle, twist, load) = (self.pose().angle, self.twist(), &self.load);
        let v = rotate(-angle, twist.linear);
        let before = Vector3::new(v.x, v.y, twist.angular);
        // v* = v + T f/m, omega* = omega + T M/I
        let gain = rotate(-angle, force) * (TICK_S / load.m);
        let gained = Vector3::new(gain.x, gain.y, torque * TICK_S / load.inertia);
        let u = self.patch.step(load, before, before + gained);
        self.body.advance(Twist {
            linear: rotate(angle, u.xy()),
            angular: u.z,
        });
    }

    /// Position and orientation of the object: `world_from_object`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.body.pose()
    }

    /// Velocity of the object's centre in the world, and its turning rate.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.body.twist()
    }

    /// The object's real footprint.
    #[must_use]
    pub fn footprint(&self) -> BoxFootprint {
        self.footprint
    }

    /// The real m, b, c = mu m g, I by (8) and e by (9): what a perfect estimator would find.
    #[must_use]
    pub fn truth(&self) -> ModelParams {
        self.truth
    }

    /// The configuration, with the changes made since the start except for pose.
    #[must_use]
    pub fn config(&self) -> &EnvironmentConfig {
        &self.config
    }

    /// How many tools and wrenches were refused because they were not finite.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Changes the friction coefficient mu from the next step on.
    ///
    /// # Errors
    /// As [`Environment::try_new`]; nothing is changed then.
    pub fn set_friction(&mut self, mu: f64) -> Result<(), EnvironmentError> {
        self.reconfigure(EnvironmentConfig {
            friction_coefficient: mu,
            ..self.config
        })
    }

    /// Changes the mass m (kg), and with it c, I and e, from the next step on. The velocity stays.
    ///
    /// # Errors
    /// As [`Environment::try_new`]; nothing is changed then.
    pub fn set_mass(&mut self, m: f64) -> Result<(), EnvironmentError> {
        self.reconfigure(EnvironmentConfig {
            mass_kg: m,
            ..self.config
        })?;
        self.body.set_inertia(self.load.m, self.load.inertia);
        Ok(())
    }

    /// Gives the object a velocity, at once: initial conditions of tests and studies.
    pub fn set_twist(&mut self, twist: Twist) {
        self.body.set_twist(twist);
    }

    /// Kinetic energy of the object, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        let twist = self.twist();
        0.5 * self.load.m * twist.linear.norm_squared()
            + 0.5 * self.load.inertia * twist.angular * twist.angular
    }

    fn reconfigure(&mut self, config: EnvironmentConfig) -> Result<(), EnvironmentError> {
        config.check()?;
        self.truth = config.truth()?;
        self.load = load(&config, &self.truth);
        self.config = config;
        Ok(())
    }

    fn touch(&mut self, tool: Vec2, tool_velocity: Vec2) -> Contact {
        if !within(&[tool.x, tool.y, tool_velocity.x, tool_velocity.y]) {
            self.refused += 1;
            return Contact::default();
        }
        let (pose, twist) = (self.pose(), self.twist());
        let touch = self.tool.follow(&self.footprint, &pose, tool);
        let coupling: &Coupling = &self.config.coupling;
        let force = touch.map_or_else(Vec2::zeros, |touch| {
            contact_force(coupling, &touch, tool_velocity, &twist, pose.position)
        });
        Contact { force, touch }
    }
}

fn load(config: &EnvironmentConfig, truth: &ModelParams) -> Load {
    Load {
        m: truth.m(),
        inertia: truth.inertia(),
        b: truth.b(),
        b_r: config.rotational_damping(),
        c: truth.c(),
        e: truth.e(),
    }
}

/// The choke point for what comes from outside: every number finite and not absurd.
fn within(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.abs() <= WRENCH_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn default() -> Environment {
        Environment::try_new(EnvironmentConfig::default()).unwrap()
    }

    /// Pushes the west face off-centre at 0.15 m/s for the given ticks, then goes back.
    fn pushed(environment: &mut Environment, ticks: u32) {
        for tick in 0..ticks {
            let x = -0.19 + 0.15e-3 * f64::from(tick);
            environment.step(Vec2::new(x, 0.03), Vec2::new(0.15, 0.0));
        }
    }

    fn bits(environment: &Environment) -> [u64; 6] {
        let (pose, twist) = (environment.pose(), environment.twist());
        [
            pose.position.x,
            pose.position.y,
            pose.angle,
            twist.linear.x,
            twist.linear.y,
            twist.angular,
        ]
        .map(f64::to_bits)
    }

    #[test]
    fn a_body_at_rest_stays_bitwise_at_rest() {
        for angle in [0.0, 0.3, -2.0, 3.2, 17.0] {
            let mut environment = Environment::try_new(EnvironmentConfig {
                pose: Pose::new(0.1, -0.2, angle),
                ..EnvironmentConfig::default()
            })
            .unwrap();
            let before = bits(&environment);
            for _ in 0..1_000 {
                environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros());
            }
            assert_eq!(bits(&environment), before);
        }
        // also where a push left it
        let mut environment = default();
        pushed(&mut environment, 1_000);
        assert!(environment.pose().angle.abs() > 0.01);
        for _ in 0..1_000 {
            environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros());
        }
        let before = bits(&environment);
        for _ in 0..1_000 {
            environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros());
        }
        assert_eq!(bits(&environment), before);
    }

    #[test]
    fn energy_does_not_grow_without_a_force() {
        let mut environment = default();
        environment.set_twist(Twist::new(0.3, -0.2, 4.0));
        let mut energy = environment.kinetic_energy();
        while energy > 0.0 {
            environment.step_with_wrench(Vec2::zeros(), 0.0);
            assert!(environment.kinetic_energy() < energy);
            energy = environment.kinetic_energy();
        }
        assert_eq!(environment.twist(), Twist::default());
    }

    #[test]
    fn two_runs_are_equal_to_the_bit() {
        let (mut one, mut two) = (default(), default());
        pushed(&mut one, 2_000);
        pushed(&mut two, 2_000);
        assert!(one.pose().position.x > 0.1);
        assert_eq!(bits(&one), bits(&two));
    }

    #[test]
    fn rapier_moves_the_body_by_exactly_its_velocity() {
        let mut environment = default();
        environment.set_twist(Twist::new(0.3, -0.2, 4.0));
        for _ in 0..30 {
            let before = environment.pose();
            environment.step_with_wrench(Vec2::zeros(), 0.0);
            let (after, twist) = (environment.pose(), environment.twist());
            assert_eq!(after.position, before.position + twist.linear * TICK_S);
            let turn = twist.angular * TICK_S;
            assert!((after.angle - before.angle - turn).abs() < turn.abs().powi(3) / 3.0 + 1e-15);
        }
    }

    #[test]
    fn the_angle_counts_whole_turns() {
        let mut environment = Environment::try_new(EnvironmentConfig {
            friction_coefficient: 0.0,
            damping_ns_per_m: 0.0,
            ..EnvironmentConfig::default()
        })
        .unwrap();
        environment.set_twist(Twist::new(0.0, 0.0, -9.0));
        for _ in 0..2_000 {
            environment.step_with_wrench(Vec2::zeros(), 0.0);
        }
        assert!((environment.pose().angle + 18.0).abs() < 1e-3);
    }

    #[test]
    fn the_tool_pushes_with_6_and_meets_the_real_surface() {
        let mut environment = default();
        let contact = environment.step(Vec2::new(-0.179, 0.0), Vec2::zeros());
        assert!((contact.force.x - 1.0).abs() < 1e-9 && contact.force.y == 0.0);
        assert!((contact.touch.unwrap().proxy.x + 0.18).abs() < 1e-12);
        assert_eq!(environment.pose(), Pose::default(), "1 N is held by 2.06 N");
        let free = environment.step(Vec2::new(-0.3, 0.0), Vec2::zeros());
        assert_eq!(free, Contact::default());
    }

    #[test]
    fn a_steady_push_is_answered_by_coulomb_and_damping() {
        let mut environment = default();
        let mut force = 0.0;
        for tick in 0..2_000 {
            let x = -0.181 + 0.15e-3 * f64::from(tick);
            force = environment
                .step(Vec2::new(x, 0.0), Vec2::new(0.15, 0.0))
                .force
                .x;
        }
        let expected = environment.truth().c() + environment.truth().b() * 0.15;
        assert!(
            (force / expected - 1.0).abs() < 1e-3,
            "{force} against {expected}"
        );
    }

    #[test]
    fn friction_and_mass_change_in_mid_run() {
        let mut environment = default();
        environment.set_friction(0.45).unwrap();
        assert!((environment.truth().c() - 0.45 * 0.7 * 9.81).abs() < 1e-12);
        environment.set_mass(1.4).unwrap();
        assert!((environment.truth().c() - 0.45 * 1.4 * 9.81).abs() < 1e-12);
        assert!((environment.truth().inertia() - 1.4 * 0.36 * 0.36 / 6.0).abs() < 1e-12);
        let before = environment.truth();
        assert!(environment.set_mass(f64::NAN).is_err());
        assert!(environment.set_friction(-0.1).is_err());
        assert_eq!(environment.truth(), before);
    }

    #[test]
    fn nothing_that_is_not_finite_gets_in() {
        let mut environment = default();
        pushed(&mut environment, 500);
        let bad = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            -f64::MAX,
        ];
        for value in bad {
            environment.step(Vec2::new(value, 0.0), Vec2::zeros());
            environment.step(Vec2::zeros(), Vec2::new(0.0, value));
            environment.step_with_wrench(Vec2::new(value, value), 0.0);
            environment.step_with_wrench(Vec2::zeros(), value);
            environment.set_twist(Twist::new(value, 0.0, value));
        }
        assert_eq!(environment.refused(), 20);
        // absurd but finite: still bounded, still answering
        for _ in 0..100 {
            environment.step_with_wrench(Vec2::new(9e5, -9e5), 9e5);
        }
        let twist = environment.twist();
        assert!(environment.pose().is_finite() && twist.linear.norm() <= 10.000_001);
        assert!(twist.angular <= 100.0 && twist.angular > 0.0);
    }

    #[test]
    fn a_wrong_configuration_is_named() {
        let wrong = |change: fn(&mut EnvironmentConfig)| {
            let mut config = EnvironmentConfig::default();
            change(&mut config);
            Environment::try_new(config).err().unwrap().to_string()
        };
        assert_eq!(
            wrong(|c| c.side_m = 0.0),
            "environment: side 0 is outside the accepted range 0.02 to 2 m"
        );
        assert!(wrong(|c| c.mass_kg = f64::NAN).contains("mass is not a finite number"));
        assert!(wrong(|c| c.friction_coefficient = -1.0).contains("friction coefficient -1"));
        assert!(wrong(|c| c.pose.angle = f64::INFINITY).contains("angle inf"));
        assert!(wrong(|c| c.coupling.stiffness_n_per_m = 1e9).contains("stiffness"));
        assert!(wrong(|c| c.rotational_damping_nms = Some(-1.0)).contains("rotational"));
    }
}
