//! mmt with a recording as its world.

use std::time::Duration;

use mmt_netem::LinkConfig;
use mmt_netem::config::Delay;
use mmt_server::environment::EnvironmentConfig;
use mmt_server::estimator::{EstimatorConfig, QuasiStaticConfig};
use mmt_server::plant::{PlantAnswer, PlantConfig};
use mmt_server::sensing::{SensingConfig, VisionConfig};
use mmt_server::slave::{SlaveConfig, StartModel};
use mmt_server::trigger::{ContactConfig, Scheme, TriggerConfig};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;
use mmt_shared::time::{TICK, TICK_S, Time};

use super::course::Course;
use super::measures::Run;
use crate::replay::config::ReplayConfig;
use crate::world::{World, WorldConfig, WorldError, WorldTick};

/// k_p, N/m: the stiffest that the default device renders. The real contact is ten times as stiff.
const STIFFNESS_N_PER_M: f64 = 3000.0;
/// Side of the box that is felt, m: no larger than any block that a finger pushes, and longer than it slips.
const SIDE_M: f64 = 0.04;
/// Noise of the recorded poses, m and rad.
const POSE_NOISE: (f64, f64) = (3e-4, 3e-3);
/// The block is met when both forces have been there for so long: what the contact takes to give.
const DEBOUNCE: Duration = Duration::from_millis(50);
/// A box on its way to the HIP may take so long, to within the room that it keeps and over that at 3 mm/s.
const MISMATCH_REPEAT: Duration = Duration::from_millis(400);
/// (12) is judged by the means over so long: the ripple of the board is shorter.
const JUDGED_OVER: Duration = Duration::from_millis(200);
/// The box of a contact that is expected is sent where the master's is off by more, m; one turned by 0.1 rad is off by this.
const EXPECTED_M: f64 = 2e-3;
/// How long the world goes on after the recording, for what is on its way.
const AFTER: Duration = Duration::from_millis(600);

/// Runs a course over a network with this one-way delay.
pub(super) fn run(course: &Course, scheme: Scheme, delay: Duration) -> Result<Run, WorldError> {
    let mut run = Run::default();
    drive(course, scheme, delay, |t_s, tick| {
        let Some(slave) = &tick.slave else { return };
        run.sent += u64::from(slave.update.is_some());
        run.push(course, t_s, slave.f_m);
    })?;
    Ok(run)
}

/// Steps the world through a course; `watch` gets each tick in which the slave played a sample, with the sample's time, s.
pub(super) fn drive(
    course: &Course,
    scheme: Scheme,
    delay: Duration,
    mut watch: impl FnMut(f64, &WorldTick),
) -> Result<(), WorldError> {
    let Some(hand) = course.hand() else {
        return Ok(());
    };
    let mut world = World::along(&config(course, scheme, delay), hand.clone())?;
    let last = Time::ZERO + hand.duration() + delay * 2 + AFTER;
    let mut plug = Plug::default();
    loop {
        let tick = world.step();
        if tick.now > last {
            return Ok(());
        }
        if let Some(slave) = &tick.slave {
            // the hand's time
            let elapsed = slave.stamp.saturating_since(Time::ZERO + TICK);
            let t_s = elapsed.as_secs_f64();
            watch(t_s, &tick);
            world.answer_of_plant(plug.answer(course, t_s, hand.at(elapsed)));
        }
    }
}

/// The recording as a plant. The plug takes its tool to give by the force law; the recorded finger did not.
#[derive(Default)]
struct Plug {
    given: Vec2,
}

impl Plug {
    /// What the recording measured by then, a tick after the last answer.
    fn answer(&mut self, course: &Course, t_s: f64, finger: Vec2) -> PlantAnswer {
        let force = course.force_at(t_s);
        let coupling = Coupling::for_stiffness(STIFFNESS_N_PER_M);
        let given = |f, before| coupling.penetration(f, before, TICK_S);
        self.given = force.zip_map(&self.given, given);
        PlantAnswer {
            tool: finger - self.given,
            force,
            object: course.image_at(t_s),
            ..PlantAnswer::default()
        }
    }
}

fn config(course: &Course, scheme: Scheme, delay: Duration) -> WorldConfig {
    let link = LinkConfig {
        delay: Delay::constant(delay),
        ..LinkConfig::default()
    };
    let slave = SlaveConfig {
        plant: PlantConfig {
            link: true,
            ..PlantConfig::default()
        },
        environment: EnvironmentConfig {
            side_m: SIDE_M,
            pose: course.first_pose(),
            ..EnvironmentConfig::default()
        },
        start: StartModel {
            side_m: SIDE_M,
            ..StartModel::default()
        },
        sensing: SensingConfig {
            vision: VisionConfig {
                position_noise_m: POSE_NOISE.0,
                angle_noise_rad: POSE_NOISE.1,
                ..VisionConfig::default()
            },
            ..SensingConfig::default()
        },
        estimator: Some(EstimatorConfig::QuasiStatic(QuasiStaticConfig::default())),
        trigger: trigger(scheme),
        ..SlaveConfig::of_mode(Mode::Recommended)
    };
    WorldConfig {
        slave,
        stiffness_n_per_m: Some(STIFFNESS_N_PER_M),
        ..WorldConfig::over(link)
    }
}

fn trigger(scheme: Scheme) -> TriggerConfig {
    let thresholds = ReplayConfig::default();
    TriggerConfig {
        scheme,
        contact: ContactConfig {
            on_n: thresholds.contact_on_n,
            off_n: thresholds.contact_off_n,
            ..ContactConfig::default()
        },
        judged_over: JUDGED_OVER,
        judge_sticking: true,
        free_space_error_m: EXPECTED_M,
        // what the last instants of a push taught comes with its end: a place that is off by less than 2 mm sends nothing
        contact_lost: true,
        mismatch_debounce: DEBOUNCE,
        mismatch_repeat: MISMATCH_REPEAT,
        ..TriggerConfig::of_mode(Mode::Recommended)
    }
}
