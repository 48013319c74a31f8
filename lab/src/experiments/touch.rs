//! First touch: the largest force of the tool over random starts, couplings and hands, on contacts as stiff as the
//! session knows and stiffer.
//!
//! The slave's core alone, without a network: whatever the samples are, the tool is what is judged.

use std::f64::consts::TAU;

use mmt_server::environment::EnvironmentConfig;
use mmt_server::slave::{Slave, SlaveConfig};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::{ForceCounts, HipCounts, HipSample};
use mmt_shared::model::settings::{CONTACT_DAMPING_NS_PER_M, STIFFNESS_N_PER_M};
use mmt_shared::rng::Substream;
use mmt_shared::stats::values::quantile;
use mmt_shared::time::{TICK_S, Time};

use crate::experiment::prelude::*;
use crate::trial::TrialError;

/// The first touches.
pub(super) const EXPERIMENT: Experiment = Experiment {
    duration: Duration::from_secs(1),
    ..Experiment::new(
        "touch",
        "The largest force, speed and acceleration of the tool over random starts, couplings and hands",
        10_000,
        run,
    )
};

/// Stiffness of the real contact over the one that the session knows.
const TIMES: [f64; 5] = [0.3, 1.0, 2.0, 5.0, 10.0];
/// The hand is somewhere up to this far from the object's centre at the beginning, m: also inside of it.
const START_M: f64 = 0.6;
/// A hand that a device loses and finds again jumps by up to this, m.
const JUMP_M: f64 = 0.5;
/// Draws before one that is accepted: most are refused, because a light object is not stable at the stiffest contacts.
const DRAWS: u64 = 1000;

/// A random start.
struct Start {
    coupling: Coupling,
    environment: EnvironmentConfig,
    /// Where the hello has the hand, m.
    hip: Vec2,
    /// The hand's velocity, m/s.
    velocity: Vec2,
    /// What the hand jumps by (m) and when (s).
    jump: (Vec2, f64),
}

/// What a start came to.
struct Reached {
    /// Largest true force, N; none without a touch.
    peak_n: Option<f64>,
    /// Largest speed of the tool, m/s.
    speed_m_per_s: f64,
    /// Largest acceleration in free space, m/s².
    acceleration_m_per_s2: f64,
}

impl Start {
    /// Start number `seed`, with a real contact that is `times` as stiff as the coupling: the first draw that a slave accepts with
    /// the stiffest contact, so that all stiffnesses have the same starts.
    fn new(seed: u64, times: f64) -> Result<Self, ExperimentError> {
        let stiffest = TIMES.into_iter().fold(1.0, f64::max);
        let accepted = |draw: &u64| Self::drawn(seed, *draw, stiffest).slave().is_ok();
        let draw = (0..DRAWS).find(accepted).unwrap_or(DRAWS);
        let start = Self::drawn(seed, draw, times);
        start.slave().map(|_| start)
    }

    fn drawn(seed: u64, draw: u64, times: f64) -> Self {
        let mut random = Substream::new(seed, "touch", draw);
        let mut log_uniform =
            |low: f64, high: f64| libm::exp(random.uniform_in(libm::log(low), libm::log(high)));
        let side_m = log_uniform(0.2, 0.6);
        let mass_kg = log_uniform(0.2, 5.0);
        // from what slides at a touch to what no hand moves
        let friction_coefficient = log_uniform(0.05, 5.0);
        let speed = log_uniform(0.02, 5.0);
        let coupling = Coupling {
            stiffness_n_per_m: log_uniform(STIFFNESS_N_PER_M.0, STIFFNESS_N_PER_M.1),
            damping_ns_per_m: log_uniform(0.1, CONTACT_DAMPING_NS_PER_M.1),
        };
        let mut place = |most: f64| {
            let (sin, cos) = libm::sincos(random.uniform_in(0.0, TAU));
            Vec2::new(cos, sin) * (most * random.uniform().sqrt())
        };
        let hip = place(START_M);
        let towards = place(0.5 * side_m) - hip;
        let jump = place(JUMP_M);
        let jumps = random.chance(0.25);
        let environment = EnvironmentConfig {
            side_m,
            mass_kg,
            friction_coefficient,
            coupling,
            contact: Some(Coupling {
                stiffness_n_per_m: times * coupling.stiffness_n_per_m,
                ..coupling
            }),
            ..EnvironmentConfig::default()
        };
        Self {
            coupling,
            environment,
            hip,
            velocity: towards * (speed / towards.norm().max(TICK_S)),
            jump: (jump * f64::from(u8::from(jumps)), random.uniform()),
        }
    }

    fn slave(&self) -> Result<Slave, ExperimentError> {
        let mut config = SlaveConfig {
            environment: self.environment,
            ..SlaveConfig::default()
        };
        // this hand feels nothing, so it would be credited with no work
        config.tool_energy.bounded = false;
        let made = Slave::try_new(&config, self.coupling);
        Ok(made.map_err(|wrong| TrialError::World(wrong.into()))?)
    }

    /// The hand at an instant, m.
    fn hand(&self, s: f64) -> Vec2 {
        let (jump, at_s) = self.jump;
        self.hip + self.velocity * s + jump * f64::from(u8::from(s > at_s))
    }

    fn reach(&self, duration: Duration) -> Result<Reached, ExperimentError> {
        let mut slave = self.slave()?;
        slave.start_at(self.hip);
        let mut reached = Reached {
            peak_n: None,
            speed_m_per_s: 0.0,
            acceleration_m_per_s2: 0.0,
        };
        let (mut tool, mut before, mut touched) = (slave.tool_at(), Vec2::zeros(), false);
        for k in 0..duration.as_millis() as u64 {
            let now = Time::from_millis(k);
            let sample = HipSample {
                stamp: now,
                hip: HipCounts::nearest(self.hand(now.as_secs_f64())),
                force: ForceCounts::default(),
            };
            slave.handle_sample(now, &sample, 0);
            let Some(tick) = slave.tick(now) else {
                continue;
            };
            let velocity = (tick.tool - tool) / TICK_S;
            let force = tick.true_force.norm();
            let touches = force > 0.0;
            if touches {
                reached.peak_n = Some(reached.peak_n.map_or(force, |peak| peak.max(force)));
            }
            reached.speed_m_per_s = reached.speed_m_per_s.max(velocity.norm());
            if !touches && !touched {
                let acceleration = (velocity - before).norm() / TICK_S;
                reached.acceleration_m_per_s2 = reached.acceleration_m_per_s2.max(acceleration);
            }
            (tool, before, touched) = (tick.tool, velocity, touches);
        }
        Ok(reached)
    }
}

type Group = grid::Group<f64, Reached>;

/// Keeps `touch.csv` and `touch.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.grid("touch", extent.seeds, TIMES.to_vec(), |times, seed| {
        Start::new(seed, *times)?.reach(extent.duration)
    })?;
    let title = format!(
        "First touches, {} random starts for each stiffness",
        extent.seeds
    );
    let table = Table::of(title, &groups, &columns());
    runner.keep_table("touch.csv", &table)?;
    runner.keep_figure("touch.svg", &figure(&groups))?;
    let peaks = groups.iter().flat_map(|group| &group.runs);
    let peaks: Vec<String> = peaks.map(|run| format!("{:?}", run.peak_n)).collect();
    Ok(Findings {
        digest: crate::digest::of_runs(peaks.iter().map(String::as_str)),
        tables: vec![table],
        ..Findings::default()
    })
}

/// A quantile of the peaks of those that touched, N.
fn peak(group: &Group, share: f64) -> Option<f64> {
    let mut peaks: Vec<f64> = group.values(|run| run.peak_n).collect();
    peaks.sort_by(f64::total_cmp);
    quantile(&peaks, share)
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Group>> {
    vec![
        column("times_k_p", "", 1, |group: &Group| group.case),
        column("touches", "", 0, |group| group.values(|run| run.peak_n).count() as f64),
        Column::new("peak_median_n", "N", 2, |group| peak(group, 0.5).into()),
        Column::new("peak_p99_n", "N", 2, |group| peak(group, 0.99).into()),
        Column::new("peak_most_n", "N", 2, |group: &Group| group.largest(|run| run.peak_n).into()),
        Column::new("speed_most_m_per_s", "m/s", 3, |group: &Group| group.largest(|run| Some(run.speed_m_per_s)).into()),
        Column::new("acceleration_most_m_per_s2", "m/s²", 2, |group: &Group| group.largest(|run| Some(run.acceleration_m_per_s2)).into()),
    ]
}

fn figure(groups: &[Group]) -> Figure {
    let shares = [
        ("largest", 1.0, Colour::VERMILION, Mark::Cross),
        ("99 of 100", 0.99, Colour::BLUE, Mark::Circle),
    ];
    let series = shares.map(|(label, share, colour, mark)| {
        let dots = groups
            .iter()
            .filter_map(|group| Some(Dot::at(group.case, peak(group, share)?)));
        Series::line(label, colour, dots.collect()).marked(mark)
    });
    let panel = Panel::new(
        "First touches",
        Axis::log("stiffness of the real contact over the one that is known"),
        Axis::log("peak of the tool's force, N"),
        series,
    );
    Figure::of_alike([panel], Legend::UpperLeft, 1, (560, 420))
}
