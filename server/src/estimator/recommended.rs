//! Recommended mode: the surface's motion along the contact normal, filtered like the force, and
//! recursive least squares for m, b, c of (1).
//!
//! Order of a tick: direction of the force, surface from the force law, gate, the shared filter,
//! regression. It must never let a sticking tick or a tick without contact reach the regression.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Vec2, rotate};
use mmt_shared::time::TICK_S;
use serde::{Deserialize, Serialize};

use super::creep::Creep;
use super::direction::{DirectionConfig, ForceDirection};
use super::estimate::{Estimate, STICK_SPEED};
use super::filter::{Row, StateVariableFilter, stage_weight};
use super::gate::{Gate, GateConfig, GateState};
use super::immovable::Immovable;
use super::measured::{Measured, Seen};
use super::obstacle::{Friction, Hand, MotionState, Obstacle, Stays};
use super::off_centre;
use super::recursive::{RecursiveConfig, RecursiveLeastSquares, RowNoise, Verdict};
use super::surface::{Surface, SurfaceMotion};
use super::way::Way;

/// Rows between two copies of the regression. On an obstacle the older copy returns: what was learned while
/// the object ran up against it is no friction.
const COPY_ROWS: u64 = 250;

/// After so many ticks a wrong sample of the force is forgotten.
const RESPONSE_TICKS: u32 = 500;

/// On the first press the surface may seem to move by so much, m, and by this share of the depth, although the object stands: the
/// stiffness of the contact is known that badly.
const SEEMS: (f64, f64) = (0.3e-3, 0.5);

/// Settings of `RecommendedEstimator`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecommendedConfig {
    /// k_p and k_d between the tool and the object, as the slave's contact has them.
    pub coupling: Coupling,
    /// Corner of each of the three stages that force and motion share, rad/s. 120; 60 for position noise
    /// of 30 µm and more.
    pub cutoff_rad_per_s: f64,
    /// Standard deviation of the measured tool position, m.
    pub position_noise_m: f64,
    /// The direction of the force.
    pub direction: DirectionConfig,
    /// When a tick counts.
    pub gate: GateConfig,
    /// The regression.
    pub recursive: RecursiveConfig,
}

impl RecommendedConfig {
    /// The defaults under a coupling.
    #[must_use]
    pub fn new(coupling: Coupling) -> Self {
        Self {
            coupling,
            cutoff_rad_per_s: 120.0,
            position_noise_m: 10e-6,
            direction: DirectionConfig::default(),
            gate: GateConfig::default(),
            recursive: RecursiveConfig::default(),
        }
    }

    /// Standard deviation of the speed that opens the gate (one first-order stage), m/s.
    fn speed_noise(&self) -> f64 {
        let w = stage_weight(self.cutoff_rad_per_s);
        w * self.position_noise_m / TICK_S * (2.0 / (2.0 - w)).sqrt()
    }

    /// Variance of the noise in the filtered acceleration, (m/s²)²: white position noise through ω² and
    /// three stages, σ² T/(2π) ∫ ω⁴/(1 + (ω/ω₀)²)³ dω = (3/16) σ² T ω₀⁵.
    fn acceleration_noise(&self) -> f64 {
        let (s, w) = (self.position_noise_m, self.cutoff_rad_per_s);
        0.1875 * s * s * TICK_S * w * w * w * w * w
    }

    /// What white noise of the force puts into a filtered row, for each N²: the surface is found through the force, so that its noise is in
    /// the motion as well. Of the response to one wrong sample: what it adds to the sums, all other samples add likewise.
    fn force_noise(&self) -> RowNoise {
        let normal = Vec2::new(1.0, 0.0);
        let mut surface = Surface::new(self.coupling);
        let mut filter = StateVariableFilter::new(self.cutoff_rad_per_s);
        let mut noise = RowNoise::ZERO;
        for tick in 0..RESPONSE_TICKS {
            let wrong = if tick == 2 { normal } else { Vec2::zeros() };
            if let Some(motion) = surface.step(Vec2::zeros(), wrong, normal) {
                let Row {
                    regressor, force, ..
                } = filter.step(motion.row);
                noise.gram += regressor * regressor.transpose();
                noise.moment += regressor * force;
            }
        }
        noise
    }
}

/// The recommended estimator.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecommendedEstimator {
    direction: ForceDirection,
    surface: Surface,
    speed_weight: f64,
    gate: Gate,
    creep: Creep,
    filter: StateVariableFilter,
    recursive: RecursiveLeastSquares,
    /// The regression as it was, newest last.
    copies: [RecursiveLeastSquares; 2],
    obstacle: Obstacle,
    stays: Stays,
    /// The regression as it was before the object ran against something in this contact; it returns when contact ends.
    before_hit: Option<RecursiveLeastSquares>,
    /// The way of the surface in this contact.
    way: Option<Way>,
    immovable: Immovable,
    pub(super) estimate: Estimate,
}

impl RecommendedEstimator {
    /// At the prior.
    #[must_use]
    pub(super) fn new(config: &RecommendedConfig, hand: Hand) -> Self {
        let speed_min = config
            .gate
            .speed_min_m_per_s
            .max(3.0 * config.speed_noise());
        let gate = GateConfig {
            speed_min_m_per_s: speed_min,
            ..config.gate
        };
        let noise = RowNoise::of_acceleration(config.acceleration_noise());
        let recursive = RecursiveLeastSquares::new(config.recursive, noise, config.force_noise());
        let mut estimate = Estimate::at(recursive.estimate);
        estimate.covariance = recursive.covariance;
        Self {
            direction: ForceDirection::new(&config.direction),
            surface: Surface::new(config.coupling),
            speed_weight: stage_weight(config.cutoff_rad_per_s),
            gate: Gate::new(gate),
            creep: Creep::new(std::f64::consts::SQRT_2 * config.position_noise_m / TICK_S),
            filter: StateVariableFilter::new(config.cutoff_rad_per_s),
            recursive,
            copies: [recursive; 2],
            obstacle: Obstacle::new(hand),
            stays: Stays::default(),
            before_hit: None,
            way: None,
            immovable: Immovable::default(),
            estimate,
        }
    }

    /// The same that doubts a row only if it is off by more than so many root mean squares of what it usually leaves.
    #[must_use]
    pub(super) fn doubting_from(mut self, deviations: f64) -> Self {
        self.recursive = self.recursive.doubting_from(deviations);
        self.copies = [self.recursive; 2];
        self
    }

    /// The same of a tool that stands at the surface: noise of the force is not in its motion.
    #[must_use]
    pub(super) fn at_the_surface(mut self) -> Self {
        self.recursive = self.recursive.without_force_noise();
        self.copies = [self.recursive; 2];
        self
    }

    /// Mean square of the force that the estimate leaves unexplained, N²; none before anything counted.
    #[must_use]
    pub(super) fn misfit(&self) -> Option<f64> {
        self.recursive.misfit()
    }

    /// How far the surface has been from where this contact began, m; none without contact.
    #[must_use]
    pub(super) fn strayed(&self) -> Option<f64> {
        self.way.map(|way| way.farthest())
    }

    /// The forces of all ticks so far were this many times as large.
    pub(super) fn rescale(&mut self, times: f64) {
        let copies = self.copies.iter_mut().chain(&mut self.before_hit);
        for regression in copies.chain([&mut self.recursive]) {
            regression.rescale(times);
        }
        self.publish();
    }

    /// Takes one tick; a tick with numbers that no sensor gives ends the contact for the regression.
    pub(super) fn step(&mut self, measured: &Measured) {
        let usable = measured.is_usable();
        let force = if usable {
            measured.force
        } else {
            Vec2::zeros()
        };
        let angle = self.direction.step(force, measured.force_noise_n);
        let normal = measured.normal.filter(|_| usable);
        let seen = measured.seen.filter(|_| usable);
        self.immovable
            .see(seen.map(|seen| seen.centre), normal.is_some());
        match normal {
            Some(normal) => self.touch(measured, angle, normal),
            None => self.release(),
        }
        self.publish();
    }

    fn touch(&mut self, measured: &Measured, angle: Option<f64>, normal: Vec2) {
        let normal = angle.map_or(normal, |angle| rotate(angle, Vec2::new(1.0, 0.0)));
        self.estimate.heading = angle;
        let motion = self.surface.step(measured.tool, measured.force, normal);
        let Some(motion) = motion else {
            self.recursive.hold();
            return;
        };
        let v = motion.row.regressor.y;
        self.estimate.speed += (v - self.estimate.speed) * self.speed_weight;
        let creeps = self.creep.step(v);
        self.estimate.sticking = !creeps && self.estimate.speed.abs() < STICK_SPEED;
        let gate = self.gate.step(
            motion.row.force,
            self.estimate.speed,
            creeps,
            measured.force_noise_n,
        );
        let row = self.row(&motion, normal, measured.seen.as_ref());
        self.slide(gate, &row, measured.force_noise_n);
        let way = self.way.get_or_insert(Way::new(motion.point));
        let way = way.step(motion.point, normal, self.speed_weight);
        let stayed = self.stays.step(motion.point, normal);
        let seen = measured.seen.as_ref();
        let share = seen.map_or(1.0, |seen| {
            off_centre::slow_share(motion.point, normal, seen)
        });
        let slides_on = gate == GateState::Open;
        let pressed = (motion.row.force, measured.held_back);
        // no push draws an object towards the tool: that it seems to come is a force that is none
        let slides = self.stand(pressed, slides_on, way, stayed, share) && v > 0.0;
        let holding = self.obstacle.holding();
        self.immovable.press(holding, slides);
        self.estimate.holding = self.immovable.holding().or(holding);
    }

    /// Whether something beyond friction holds the object where it is `pressed`, as [`Obstacle::step`] takes that.
    /// `way` (m) is how far its surface seems to have gone in this contact, `stayed` for how many ticks it has stayed where
    /// it is, `share` that of c which a slow push meets there. Whether it slides for certain.
    fn stand(
        &mut self,
        pressed: (f64, bool),
        slides_on: bool,
        way: f64,
        stayed: u32,
        share: f64,
    ) -> bool {
        let [older, _] = self.copies;
        let known = older.samples > 0;
        let moves = self.gate.moves(self.estimate.speed);
        let motion = match (moves, self.estimate.sticking) {
            (true, _) if slides_on => MotionState::SlidesOn,
            (true, _) => MotionState::Slides,
            (false, true) => MotionState::Sticks,
            (false, false) => MotionState::Slowly,
        };
        let motion = match motion {
            MotionState::Slowly if self.seems_to_move(way) => MotionState::Sticks,
            _ => motion,
        };
        let found = if known { &older } else { &self.recursive }.estimate;
        let needed = found.x * self.estimate.acceleration + found.y * self.estimate.speed;
        let friction = Friction {
            c: found.z,
            known,
            seen: self.recursive.samples > 0,
            share,
        };
        let stands = (self.obstacle).step(pressed, needed, motion, stayed, friction);
        if stands && known {
            self.go_back_to(older);
        }
        if self.obstacle.is_hit() {
            self.before_hit.get_or_insert(older);
        }
        moves
    }

    /// Forgets what was learned since `copy` was the regression.
    fn go_back_to(&mut self, copy: RecursiveLeastSquares) {
        self.recursive = copy;
        self.copies = [copy; 2];
    }

    /// Whether a way (m) of the surface of an object that nobody has seen slide may be the give of the contact alone.
    fn seems_to_move(&self, way: f64) -> bool {
        let (least, share) = SEEMS;
        self.recursive.samples == 0 && way < least + share * self.surface.depth()
    }

    /// The row of (1) that a motion gives while the object slides.
    fn row(&self, motion: &SurfaceMotion, normal: Vec2, seen: Option<&Seen>) -> Row {
        let speed = self.estimate.speed;
        match seen {
            Some(seen) if self.gate.slides(speed) => {
                off_centre::shared(motion, normal, speed, seen)
            }
            Some(seen) => off_centre::creeping(motion, normal, seen),
            None => motion.row.pushed(),
        }
    }

    fn slide(&mut self, gate: GateState, row: &Row, force_noise_n: f64) {
        if gate == GateState::Closed {
            self.estimate.acceleration = 0.0;
            return self.recursive.hold();
        }
        if gate == GateState::Begins {
            self.filter.restart();
        }
        let filtered = self.filter.step(*row);
        self.estimate.acceleration = filtered.regressor.x;
        if gate == GateState::Open {
            if self.recursive.update(&filtered, force_noise_n) == Verdict::Changed {
                self.gate.close();
            }
            let [_, newer] = self.copies;
            if self.recursive.samples >= newer.samples + COPY_ROWS {
                self.copies = [newer, self.recursive];
            }
        } else {
            self.recursive.hold();
        }
    }

    fn release(&mut self) {
        self.surface.reset();
        self.gate.close();
        self.creep.reset();
        self.obstacle.clear();
        self.stays = Stays::default();
        // what it ran against is no friction
        if let Some(before) = self.before_hit.take() {
            self.go_back_to(before);
        }
        self.way = None;
        self.recursive.hold();
        self.estimate.release();
        self.estimate.holding = self.immovable.holding();
    }

    fn publish(&mut self) {
        let (estimate, found) = (&mut self.estimate, &self.recursive);
        estimate.set(found.estimate, found.covariance);
        estimate.condition = found.condition;
        estimate.excited = found.excited;
        estimate.samples = found.samples;
    }
}

#[cfg(test)]
mod tests {
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::rng::Substream;
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    #[test]
    fn the_noise_that_one_wrong_sample_leaves_is_the_one_of_many() {
        let normal = Vec2::new(1.0, 0.0);
        let config = RecommendedConfig::new(COUPLING);
        let mut surface = Surface::new(config.coupling);
        let mut filter = StateVariableFilter::new(config.cutoff_rad_per_s);
        let mut random = Substream::new(1, "force noise", 0);
        let (mut gram, mut moment, mut rows) = (Matrix3::zeros(), Vector3::zeros(), 0);
        for k in 0..400_000 {
            let (noise, _) = random.normal_pair();
            let Some(motion) = surface.step(Vec2::zeros(), normal * noise, normal) else {
                continue;
            };
            let row = filter.step(motion.row);
            if k > 1000 {
                gram += row.regressor * row.regressor.transpose();
                moment += row.regressor * row.force;
                rows += 1;
            }
        }
        let known = config.force_noise();
        let (gram, moment) = (gram / f64::from(rows), moment / f64::from(rows));
        let within = |many: f64, one: f64| (many / one - 1.0).abs() < 0.03;
        assert!(within(gram.m11, known.gram.m11), "{gram} {known:?}");
        assert!(within(gram.m22, known.gram.m22), "{gram} {known:?}");
        assert!(within(moment.x, known.moment.x), "{moment} {known:?}");
    }
}
