//! One random world, run and measured.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_server::estimator::Measured as Sensed;
use mmt_server::slave::Substitutes;
use mmt_shared::metrics::F_MIN_N;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, TICK_S};

use crate::experiment::findings::ExperimentError;
use crate::trial::TrialError;
use crate::two_ports::{TwoPorts, WORKING_S};
use crate::world::{Given, World, WorldConfig, WorldTick};

/// Beyond the hand's way in a round trip the pose is off by no more than this, m.
const POSE_M: f64 = 0.1;
/// Below this a force has no direction, N.
const LEAST_N: f64 = 0.5;
/// No body moves as far in a tick, m: the tool has touched another one.
const OTHER_BODY_M: f64 = 0.01;

/// What a world came to.
pub(super) struct Measured {
    /// Relative error of f_m against the true force; none without contact.
    pub(super) relative_error: Option<f64>,
    /// The same against the measured force.
    pub(super) measured_error: Option<f64>,
    pub(super) packets_hz: Option<f64>,
    pub(super) contact_s: f64,
    pub(super) pushes: u64,
    pub(super) breaks_per_push: Option<f64>,
    /// Of the model's place, m.
    pub(super) pose_rms_m: Option<f64>,
    pub(super) pose_max_m: f64,
    /// The most by which the pose was off beyond 0.1 m and the hand's way in a round trip, m; at most 0 if it never was.
    pub(super) pose_excess_m: f64,
    /// For how long it was, s.
    pub(super) pose_excess_s: f64,
    /// The most by which it was, m, where the way of the object in a round trip counts if that is longer.
    pub(super) pose_beyond_object_m: f64,
    /// Energy that updates added to the model and nothing paid, J.
    pub(super) injected_j: f64,
    /// The most by which the tool's work on the object exceeded the hand's work and the budget, J.
    pub(super) work_excess_j: f64,
    /// For how long the limit of the tool's energy held the tool, s.
    pub(super) energy_held_s: f64,
    /// Share of the time in contact at both ends in which f_m opposes the true force.
    pub(super) opposed_share: Option<f64>,
    /// Share of the time in contact in which f_m has no pair; none without contact.
    pub(super) unpaired_share: Option<f64>,
    pub(super) force_peak_n: Option<f64>,
    /// Invariants of `mmt check` that did not hold.
    pub(super) broken: String,
    pub(super) digest: String,
}

/// Runs a world, with the estimates of its slave, or from so much contact on with the true m, b and c of the body that is touched.
/// That something holds the body is no number of its own: this remains the slave's to find.
pub(super) fn reach(
    config: &WorldConfig,
    truth_from: Option<Duration>,
    duration: Duration,
) -> Result<Measured, ExperimentError> {
    let mut world = World::try_new(config).map_err(TrialError::from)?.judged();
    let path_s = (config.up.delay.middle() + config.down.delay.middle()).as_secs_f64();
    let slow_s = (config.up.delay.quantile(0.99) + config.down.delay.quantile(0.99)).as_secs_f64();
    let first = world.master().model().state().pose.position;
    let body = TouchedBody::new(first, slow_s + WORKING_S);
    let mut seen = Seen::new(TwoPorts::new(path_s), body);
    let mut contact = Duration::ZERO;
    for _ in 0..duration.as_millis() {
        let slave = world.slave();
        let free = slave.estimate().holding.is_none();
        let body = slave.environment().truth();
        let mut known = |_, sensed: &Sensed| {
            if sensed.normal.is_some() {
                contact += TICK;
            }
            truth_from
                .filter(|from| free && contact >= *from)
                .map(|_| [body.m(), body.b(), body.c()])
        };
        let tick = world.step_given(Given {
            slave: Substitutes {
                estimator: Some(&mut known),
                scheme: None,
            },
            ..Given::default()
        });
        seen.take(&world, &tick);
    }
    let (outcome, truth) = (world.outcome(), world.slave().true_force());
    let pushes = world.operator().pushes_completed().unwrap_or_default();
    let verdict = world.verdict().unwrap_or_default();
    let broken: Vec<&str> = verdict.broken().map(|(of, _)| of.name()).collect();
    Ok(Measured {
        relative_error: truth.relative_error_true.get(),
        measured_error: world.force().relative_error,
        packets_hz: outcome.updates.rate_hz(),
        contact_s: outcome.updates.contact_s(),
        pushes,
        breaks_per_push: outcome.breaks.per_push(pushes),
        pose_rms_m: outcome.pose.position_rms_m(),
        pose_max_m: outcome.pose.position_max_m().unwrap_or_default(),
        pose_excess_m: seen.pose_excess_m,
        pose_excess_s: seen.pose_excess_ticks as f64 * TICK_S,
        pose_beyond_object_m: seen.pose_beyond_object_m,
        injected_j: outcome.energy_injected_j,
        work_excess_j: seen.ports.excess_j(),
        energy_held_s: world.slave().tool_energy().held_ticks() as f64 * TICK_S,
        opposed_share: seen.opposed_share(),
        unpaired_share: seen.unpaired_share(),
        force_peak_n: outcome.on_hand.largest_n(),
        broken: broken.join(" "),
        digest: world.digest(),
    })
}

/// What is summed up tick by tick.
struct Seen {
    ports: TwoPorts,
    body: TouchedBody,
    pose_excess_m: f64,
    pose_excess_ticks: u64,
    pose_beyond_object_m: f64,
    /// Ticks in which both forces have a direction and the master can know the body, and those of them in which they point apart.
    directed_ticks: u64,
    opposed_ticks: u64,
    /// Ticks in contact by the true force, and those of them in which f_m has no pair.
    contact_ticks: u64,
    unpaired_ticks: u64,
}

impl Seen {
    fn new(ports: TwoPorts, body: TouchedBody) -> Self {
        Self {
            ports,
            body,
            pose_excess_m: -POSE_M,
            pose_excess_ticks: 0,
            pose_beyond_object_m: -POSE_M,
            directed_ticks: 0,
            opposed_ticks: 0,
            contact_ticks: 0,
            unpaired_ticks: 0,
        }
    }

    fn take(&mut self, world: &World, tick: &WorldTick) {
        self.ports.take(world, tick);
        let Some(slave) = &tick.slave else {
            return;
        };
        let known = self.body.is_known(slave.truth.position);
        let then = world.master().model().history().at(slave.stamp);
        if let Some(then) = then.filter(|_| known) {
            let off = (then.motion.pose.position - slave.truth.position).norm();
            let (hand_m, object_m) = (self.ports.way_m(), self.body.way_m());
            self.pose_excess_m = self.pose_excess_m.max(off - POSE_M - hand_m);
            self.pose_excess_ticks += u64::from(off > POSE_M + hand_m);
            let beyond_m = off - POSE_M - hand_m.max(object_m);
            self.pose_beyond_object_m = self.pose_beyond_object_m.max(beyond_m);
        }
        if slave.true_force.norm() > F_MIN_N {
            self.contact_ticks += 1;
            self.unpaired_ticks += u64::from(slave.f_m.is_none());
        }
        let directed = slave
            .f_m
            .filter(|f_m| known && f_m.norm().min(slave.true_force.norm()) > LEAST_N);
        if let Some(f_m) = directed {
            self.directed_ticks += 1;
            self.opposed_ticks += u64::from(f_m.dot(&slave.true_force) < 0.0);
        }
    }

    fn opposed_share(&self) -> Option<f64> {
        let share = self.opposed_ticks as f64 / self.directed_ticks as f64;
        (self.directed_ticks > 0).then_some(share)
    }

    fn unpaired_share(&self) -> Option<f64> {
        let share = self.unpaired_ticks as f64 / self.contact_ticks as f64;
        (self.contact_ticks > 0).then_some(share)
    }
}

/// The body that the tool touches, or touched last. The master cannot know within a round trip that it is another one.
struct TouchedBody {
    /// Its place, m.
    place: Vec2,
    /// A round trip of slow packets: play-out waits for these.
    round_trip_ticks: usize,
    unknown_ticks: usize,
    /// Its way in each tick of the last such round trip, m.
    ways: VecDeque<f64>,
}

impl TouchedBody {
    /// The body of which the master received the place at the beginning, at `place` (m).
    fn new(place: Vec2, round_trip_s: f64) -> Self {
        Self {
            place,
            round_trip_ticks: (round_trip_s / TICK_S) as usize,
            unknown_ticks: 0,
            ways: VecDeque::new(),
        }
    }

    /// Takes the body's place (m) in a tick. Whether the master can know which body it is.
    fn is_known(&mut self, place: Vec2) -> bool {
        let before = std::mem::replace(&mut self.place, place);
        let way = (place - before).norm();
        self.ways.push_back(way);
        if way > OTHER_BODY_M {
            self.ways.clear();
            self.unknown_ticks = self.round_trip_ticks;
        } else {
            self.unknown_ticks = self.unknown_ticks.saturating_sub(1);
        }
        while self.ways.len() > self.round_trip_ticks {
            self.ways.pop_front();
        }
        self.unknown_ticks == 0
    }

    /// Its way in the last round trip, m.
    fn way_m(&self) -> f64 {
        self.ways.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_body_is_judged_by_a_round_trip_later_and_the_same_one_always() {
        let mut body = TouchedBody::new(Vec2::zeros(), 0.05);
        for n in 0..100 {
            // 1 m/s
            assert!(body.is_known(Vec2::new(1e-3 * f64::from(n), 0.0)));
        }
        let known: Vec<bool> = (0..60)
            .map(|_| body.is_known(Vec2::new(0.5, 0.0)))
            .collect();
        assert!(known.iter().take(50).all(|known| !known));
        assert!(known.iter().skip(50).all(|known| *known));
    }

    #[test]
    fn the_way_of_a_body_is_that_of_the_last_round_trip_and_no_way_from_another_body() {
        let mut body = TouchedBody::new(Vec2::zeros(), 0.05);
        for n in 0..100 {
            body.is_known(Vec2::new(1e-3 * f64::from(n), 0.0));
        }
        assert!((body.way_m() - 0.05).abs() < 1e-12, "{} m", body.way_m());
        body.is_known(Vec2::new(0.5, 0.0));
        assert_eq!(body.way_m(), 0.0);
    }

    #[test]
    fn a_first_touch_of_another_body_than_the_one_that_the_master_received_is_judged_later_too() {
        let mut body = TouchedBody::new(Vec2::zeros(), 0.05);
        let known: Vec<bool> = (0..60)
            .map(|_| body.is_known(Vec2::new(0.5, 0.0)))
            .collect();
        assert!(known.iter().take(50).all(|known| !known));
        assert!(known.iter().skip(50).all(|known| *known));
    }
}
