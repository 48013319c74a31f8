//! A scene: the bodies and walls that the tool may push about. `docs/scenes.md` describes the file.

use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::range::in_range;
use serde::{Deserialize, Serialize};

use super::config::{EnvironmentConfig, EnvironmentError};
use super::object::Object;
use super::outline::Shape;
use super::wall::Wall;
use super::world::World;

/// Accepted friction coefficient between bodies, and between bodies and walls.
const CONTACT_FRICTION: (f64, f64) = (0.0, 5.0);

/// Bodies and walls. The default has none: the world is the body of `[environment]`, the paper's cube.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneConfig {
    /// Friction coefficient between bodies, and between bodies and walls. Default 0: smooth, as the tool is.
    pub contact_friction: f64,
    /// The bodies. They replace the body of `[environment]`, whose ground, gravity and wall stay.
    pub bodies: Vec<BodyConfig>,
    /// Walls.
    pub walls: Vec<Wall>,
}

/// One body of a scene: the keys and defaults of a body in `[environment]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BodyConfig {
    /// Whether nothing moves it. Default: no.
    pub fixed: bool,
    /// Side l of a square footprint, m.
    pub side_m: f64,
    /// The footprint.
    pub shape: Shape,
    /// Centre of mass from the centroid of the footprint, object frame, m.
    pub centre_of_mass_m: Vec2,
    /// Mass m, kg.
    pub mass_kg: f64,
    /// Friction coefficient mu between sliding body and ground, where no patch lies.
    pub friction_coefficient: f64,
    /// What breaks a resting body away, by what brakes a sliding one.
    pub static_ratio: f64,
    /// Viscous damping b, N s/m.
    pub damping_ns_per_m: f64,
    /// Rotational damping, N m s.
    pub rotational_damping_nms: Option<f64>,
    /// Initial pose of the footprint's centroid.
    pub pose: Pose,
}

impl Default for BodyConfig {
    fn default() -> Self {
        Self::of(&EnvironmentConfig::default())
    }
}

impl BodyConfig {
    fn of(config: &EnvironmentConfig) -> Self {
        Self {
            fixed: false,
            side_m: config.side_m,
            shape: config.shape,
            centre_of_mass_m: config.centre_of_mass_m,
            mass_kg: config.mass_kg,
            friction_coefficient: config.friction_coefficient,
            static_ratio: config.static_ratio,
            damping_ns_per_m: config.damping_ns_per_m,
            rotational_damping_nms: config.rotational_damping_nms,
            pose: config.pose,
        }
    }

    /// This body on the ground of `config`.
    fn on(&self, config: &EnvironmentConfig) -> EnvironmentConfig {
        EnvironmentConfig {
            side_m: self.side_m,
            shape: self.shape,
            centre_of_mass_m: self.centre_of_mass_m,
            mass_kg: self.mass_kg,
            friction_coefficient: self.friction_coefficient,
            static_ratio: self.static_ratio,
            damping_ns_per_m: self.damping_ns_per_m,
            rotational_damping_nms: self.rotational_damping_nms,
            pose: self.pose,
            ..*config
        }
    }
}

impl SceneConfig {
    /// Puts the scene's bodies and walls into the world: the first body, and the others.
    pub(super) fn objects(
        &self,
        config: &EnvironmentConfig,
        world: &mut World,
    ) -> Result<(Object, Vec<Object>), EnvironmentError> {
        let alone = [BodyConfig::of(config)];
        let (first, others) = match self.bodies.split_first() {
            Some((first, others)) => (first, others),
            None => (&alone[0], &alone[1..]),
        };
        let mut object = |number: usize, body: &BodyConfig| {
            let object = Object::try_new(number, body.on(config), body.fixed, world);
            object.map_err(|error| self.named(number, error))
        };
        let first = object(0, first)?;
        let others = (1..).zip(others).map(|(number, body)| object(number, body));
        let others = others.collect::<Result<Vec<_>, _>>()?;
        in_range(
            "contact friction",
            "",
            self.contact_friction,
            CONTACT_FRICTION,
        )?;
        self.collide(config, world, &first, &others)?;
        Ok((first, others))
    }

    /// Checks that nothing stands in anything else, and lets everything collide.
    fn collide(
        &self,
        config: &EnvironmentConfig,
        world: &mut World,
        first: &Object,
        others: &[Object],
    ) -> Result<(), EnvironmentError> {
        // the wall of `[environment]` has no number
        let of_scene = || (1..).map(Some).zip(&self.walls);
        let walls = || {
            config
                .wall
                .iter()
                .map(|wall| (None, wall))
                .chain(of_scene())
        };
        let objects = || std::iter::once(first).chain(others);
        for (number, wall) in walls() {
            for object in objects().filter(|object| !object.fixed) {
                let started = wall.check_start(&object.outline, &object.pose());
                let named = |error| match number {
                    Some(number) => EnvironmentError::Wall(number, error),
                    None => error.into(),
                };
                started.map_err(|error| self.named(object.number, named(error)))?;
            }
            world.insert_wall(wall, self.contact_friction);
        }
        for one in objects() {
            for other in objects().filter(|other| other.number > one.number) {
                if one.solid.overlaps(&one.pose(), &other.solid, &other.pose()) {
                    let numbers = (one.number + 1, other.number + 1);
                    return Err(EnvironmentError::Overlap(numbers.0, numbers.1));
                }
            }
            // a lone body meets nothing
            if !others.is_empty() || walls().next().is_some() {
                let centre_of_mass = one.config.centre_of_mass_m;
                world.collide(&one.body, &one.solid, centre_of_mass, self.contact_friction);
            }
        }
        Ok(())
    }

    /// The error of a body, with the body's number in a scene.
    fn named(&self, number: usize, error: EnvironmentError) -> EnvironmentError {
        if self.bodies.is_empty() {
            return error;
        }
        EnvironmentError::Body(number + 1, Box::new(error))
    }
}
