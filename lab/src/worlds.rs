//! The one generator of random worlds: object, contact, sensor, device, hand and network, drawn from one distribution.
//!
//! `docs/reproduce.md` has the distribution as a table. A world is a function of its number. Each quantity has a substream of its
//! own, so that changing how one is drawn leaves all others as they are.

use std::f64::consts::{PI, TAU};

use mmt_client::operator::scripted::{START_M, ScriptedConfig};
use mmt_netem::LinkConfig;
use mmt_server::environment::{BodyConfig, EnvironmentConfig, SceneConfig, Wall};
use mmt_server::sensing::{SensingConfig, VisionConfig};
use mmt_server::slave::SlaveConfig;
use mmt_server::tool::compliance::spring_for;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::params::GRAVITY;
use mmt_shared::rng::Substream;

use crate::world::WorldConfig;

/// Error of the size that images show, m r.m.s. per face: that of the position in one image.
pub(crate) const SIZE_NOISE_M: f64 = 1e-3;
/// A second body is at least this far from where the hand begins, m.
const HAND_ROOM_M: f64 = 0.02;
/// The hand gives no more than this, N: what takes more does not move.
pub const MOVABLE_N: f64 = 8.0;

/// What stands in the object's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// Nothing.
    None,
    /// A wall.
    Wall,
    /// A second body that can be moved.
    Body,
}

impl Obstacle {
    /// In files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Wall => "wall",
            Self::Body => "body",
        }
    }
}

/// A random world.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomWorld {
    /// Its number.
    pub number: u64,
    /// All that a run depends on.
    pub config: WorldConfig,
    /// Coulomb friction c of the object, N.
    pub friction_n: f64,
    /// Delay one way, ms.
    pub delay_ms: f64,
    /// What stands in the way.
    pub obstacle: Obstacle,
}

/// The draws of one world, each quantity by its name.
struct Draws(u64);

impl Draws {
    fn stream(&self, name: &str) -> Substream {
        Substream::new(self.0, name, 0)
    }

    fn uniform(&self, name: &str, low: f64, high: f64) -> f64 {
        self.stream(name).uniform_in(low, high)
    }

    fn log_uniform(&self, name: &str, low: f64, high: f64) -> f64 {
        libm::exp(self.uniform(name, libm::log(low), libm::log(high)))
    }

    fn chance(&self, name: &str, probability: f64) -> bool {
        self.stream(name).chance(probability)
    }
}

impl RandomWorld {
    /// World number `number`.
    #[must_use]
    pub fn new(number: u64) -> Self {
        let draws = Draws(number);
        let (link, delay_ms) = network(&draws);
        let k_p = draws.log_uniform("worlds/k_p", 300.0, 3000.0);
        let (mut environment, friction_n) = object(&draws, k_p);
        let (scene, wall, obstacle) = in_the_way(&draws, &environment);
        environment.wall = wall;
        let default = SlaveConfig::default();
        let config = WorldConfig {
            slave: SlaveConfig {
                environment,
                scene,
                sensing: sensor(&draws, default.sensing),
                tool_compliance: Some(spring_for(Coupling::for_stiffness(k_p))),
                ..default
            },
            stiffness_n_per_m: Some(k_p),
            operator: operator(&draws),
            up: link.clone(),
            down: link,
            ..WorldConfig::default()
        };
        Self {
            number,
            config: config.seeded(number),
            friction_n,
            delay_ms,
            obstacle,
        }
    }

    /// Whether a hand can move the object.
    #[must_use]
    pub fn is_movable(&self) -> bool {
        self.friction_n < MOVABLE_N
    }

    /// The least round trip, ms.
    #[must_use]
    pub fn round_trip_ms(&self) -> f64 {
        2.0 * self.delay_ms
    }
}

/// Half of the worlds have a round trip of up to 100 ms, half of up to 1 s.
fn network(draws: &Draws) -> (LinkConfig, f64) {
    let near = draws.chance("worlds/near", 0.5);
    let delay_ms = if near {
        draws.uniform("worlds/delay", 0.0, 50.0)
    } else {
        draws.uniform("worlds/delay", 50.0, 500.0)
    };
    let jitter_ms = draws.uniform("worlds/jitter", 0.0, (0.2 * delay_ms).min(20.0));
    let loss = draws.uniform("worlds/loss", 0.0, 5.0);
    let words = format!("delay {delay_ms:.3}ms {jitter_ms:.3}ms loss {loss:.3}%");
    // words of this form are always accepted; a test draws many
    (words.parse().unwrap_or_default(), delay_ms)
}

fn object(draws: &Draws, k_p: f64) -> (EnvironmentConfig, f64) {
    let side_m = draws.uniform("worlds/side", 0.20, 0.60);
    let immovable = draws.chance("worlds/immovable", 0.05);
    let (mass_kg, friction_n) = if immovable {
        (5.0, draws.log_uniform("worlds/friction", 18.0, 160.0))
    } else {
        let mass_kg = draws.log_uniform("worlds/mass", 0.2, 5.0);
        (mass_kg, draws.log_uniform("worlds/friction", 0.3, 7.5))
    };
    let off_m = draws.uniform("worlds/centre", 0.0, 0.1 * side_m);
    let (sin, cos) = libm::sincos(draws.uniform("worlds/centre angle", 0.0, TAU));
    let device = Coupling::for_stiffness(k_p);
    let environment = EnvironmentConfig {
        side_m,
        mass_kg,
        friction_coefficient: friction_n / (mass_kg * GRAVITY),
        centre_of_mass_m: Vec2::new(off_m * cos, off_m * sin),
        contact: Some(Coupling {
            stiffness_n_per_m: k_p * draws.log_uniform("worlds/contact", 1.0, 10.0),
            ..device
        }),
        ..EnvironmentConfig::default()
    };
    (environment, friction_n)
}

/// Where the hand begins, m: in front of the west face.
fn hand_start(side_m: f64) -> Vec2 {
    Vec2::new(-0.5 * side_m - START_M, 0.0)
}

/// In a fifth of the worlds a wall or a second body, in the direction of one of the first pushes or anywhere.
fn in_the_way(
    draws: &Draws,
    environment: &EnvironmentConfig,
) -> (SceneConfig, Option<Wall>, Obstacle) {
    let none = SceneConfig::default;
    if !draws.chance("worlds/obstacle", 0.2) {
        return (none(), None, Obstacle::None);
    }
    let side_m = environment.side_m;
    // half of the diagonal, and room to begin to move
    let reach_m = side_m * std::f64::consts::FRAC_1_SQRT_2 + 0.02;
    let angle_rad = draws.uniform("worlds/obstacle angle", -PI, PI);
    let gap_m = draws.uniform("worlds/obstacle gap", 0.0, 0.3);
    if draws.chance("worlds/obstacle wall", 0.5) {
        let distance_m = reach_m + gap_m;
        let wall = Wall {
            distance_m,
            angle_rad,
        };
        return (none(), Some(wall), Obstacle::Wall);
    }
    let other_m = draws.uniform("worlds/other side", 0.10, 0.40);
    let distance_m = reach_m + other_m * std::f64::consts::FRAC_1_SQRT_2 + gap_m;
    let (sin, cos) = libm::sincos(angle_rad);
    let drawn = Vec2::new(distance_m * cos, distance_m * sin);
    // no hand begins in a body
    let covers_hand = (drawn - hand_start(side_m)).amax() < 0.5 * other_m + HAND_ROOM_M;
    let other_at = if covers_hand { -drawn } else { drawn };
    let mass_kg = draws.log_uniform("worlds/other mass", 0.2, 2.0);
    let friction_n = draws.log_uniform("worlds/other friction", 0.3, 3.0);
    let first = BodyConfig {
        side_m,
        mass_kg: environment.mass_kg,
        friction_coefficient: environment.friction_coefficient,
        centre_of_mass_m: environment.centre_of_mass_m,
        ..BodyConfig::default()
    };
    let other = BodyConfig {
        side_m: other_m,
        mass_kg,
        friction_coefficient: friction_n / (mass_kg * GRAVITY),
        pose: Pose::new(other_at.x, other_at.y, 0.0),
        ..BodyConfig::default()
    };
    let scene = SceneConfig {
        bodies: vec![first, other],
        ..none()
    };
    (scene, None, Obstacle::Body)
}

fn sensor(draws: &Draws, default: SensingConfig) -> SensingConfig {
    SensingConfig {
        force_noise_n: draws.log_uniform("worlds/noise", 0.01, 0.1),
        force_bias_n: draws.uniform("worlds/bias", 0.0, 0.2),
        force_drift_n_per_s: draws.uniform("worlds/drift", 0.0, 0.01),
        force_lag_ms: draws.uniform("worlds/lag", 0.0, 5.0),
        force_gain: draws.uniform("worlds/gain", 0.9, 1.1),
        vision: VisionConfig {
            size_noise_m: Some(SIZE_NOISE_M),
            ..default.vision
        },
        ..default
    }
}

fn operator(draws: &Draws) -> ScriptedConfig {
    let slowest = draws.uniform("worlds/speed", 0.05, 0.20);
    let mut operator = ScriptedConfig {
        push_speed_m_per_s: (slowest, 1.5 * slowest),
        ..ScriptedConfig::default()
    };
    operator.hand.tremor_hz = draws.uniform("worlds/tremor rate", 8.0, 12.0);
    operator.hand.tremor_m = draws.log_uniform("worlds/tremor", 3e-5, 3e-4);
    operator
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn a_drift_of_the_sensor_does_not_lead_the_pose_away_with_the_tool() {
        // its bias drifts into contact in the first push, and the tool then goes to the next face
        let mut world = World::try_new(&RandomWorld::new(958).config).unwrap();
        let mut most_m = 0.0_f64;
        for _ in 0..20_000 {
            if let Some(tick) = world.step().slave {
                let pose = world.slave().observer().pose();
                most_m = most_m.max((pose.position - tick.truth.position).norm());
            }
        }
        assert!(most_m < 0.1, "{most_m} m");
    }

    #[test]
    fn an_object_that_a_wall_stops_after_a_slide_without_friction_is_sent_as_standing() {
        // a drag that is damping alone teaches a large radius e/c, and then a wall holds the object
        let mut world = World::try_new(&RandomWorld::new(14_463).config).unwrap();
        for _ in 0..10_000 {
            world.step();
        }
        assert_eq!(world.slave().refused_estimates(), 0);
        let stands = world.slave().environment().pose().position;
        let felt = world.master().model().state().pose.position;
        assert!((felt - stands).norm() < 0.05, "{felt} and {stands}");
    }

    #[test]
    fn no_hand_begins_in_a_body() {
        for number in 1..=1000 {
            let world = RandomWorld::new(number);
            let start = World::try_new(&world.config).unwrap().operator().start();
            for body in world.config.slave.scene.bodies {
                let off = (body.pose.position - start).amax();
                assert!(off > 0.5 * body.side_m, "world {number}: {off} m");
            }
        }
    }

    #[test]
    fn a_world_is_a_function_of_its_number_and_every_world_can_be_made() {
        let worlds: Vec<_> = (1..=300).map(RandomWorld::new).collect();
        assert_eq!(worlds.first(), Some(&RandomWorld::new(1)));
        for world in &worlds {
            let made = World::try_new(&world.config);
            assert!(made.is_ok(), "world {}: {:?}", world.number, made.err());
            assert!(world.delay_ms == 0.0 || world.config.up != LinkConfig::default());
        }
        let share = |of: fn(&RandomWorld) -> bool| {
            worlds.iter().filter(|world| of(world)).count() as f64 / worlds.len() as f64
        };
        let within = |share: f64, expected: f64| (share - expected).abs() < 0.06;
        assert!(within(share(|world| !world.is_movable()), 0.05));
        assert!(within(share(|world| world.obstacle != Obstacle::None), 0.2));
        assert!(within(share(|world| world.round_trip_ms() <= 100.0), 0.5));
    }
}
