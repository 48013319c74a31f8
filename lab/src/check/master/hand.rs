//! What the hand is pushed with, and the model that pushes it.

use mmt_client::failsafe::LinkState;
use mmt_client::limiter::Limits;
use mmt_shared::model::settings::PoseCorrection;

use super::{MasterChecks, MasterTicked};
use crate::check::Invariant;

/// Rounding of forces, N.
const HAIR_N: f64 = 1e-9;
/// Energy that is none, J.
const HAIR_J: f64 = 1e-9;
/// m (kg), b (N s/m) and c (N), as accepted.
const ACCEPTED: [(f64, f64); 3] = [(0.05, 50.0), (0.0, 200.0), (0.0, 200.0)];

/// The ramps take 200 ms.
const RAMP_TICKS: u32 = 200;

impl MasterChecks {
    pub(super) fn judge_force(&mut self, tick: &MasterTicked<'_>) {
        let (now, done, end) = (tick.now, tick.done, tick.end);
        let stops = tick.given.stops || self.channel.other_stops();
        self.ended |= tick.given.releases || end.master().model().not_finite() > 0;
        let held = tick.given.engaged && !stops && !self.ended && done.link < LinkState::Released;
        let ramp = if held {
            self.ramp + 1
        } else {
            self.ramp.saturating_sub(1)
        };
        self.ramp = ramp.min(RAMP_TICKS);
        let Limits {
            force_max_n,
            step_max_n,
        } = self.about.limits;
        let (force, before) = (done.hand_force.norm(), self.force.norm());
        let cap = force_max_n * f64::from(self.ramp) / f64::from(RAMP_TICKS);
        let ramp = self.ramp;
        self.verdict
            .judge(Invariant::ForceCap, now, force <= cap + HAIR_N, || {
                format!("{force} N of {cap} N, the ramp being at {ramp} of {RAMP_TICKS}")
            });
        let step = (done.hand_force - self.force).norm();
        self.verdict.judge(
            Invariant::ForceStep,
            now,
            step <= step_max_n + HAIR_N,
            || format!("{step} N of {step_max_n} N"),
        );
        let holds = held || force <= before + HAIR_N;
        self.verdict.judge(Invariant::ForceFalls, now, holds, || {
            format!("{force} N after {before} N on a hand that is released")
        });
        self.stopped = stops.then(|| {
            let (from, ticks) = self.stopped.unwrap_or((before, 0));
            (from, ticks + 1)
        });
        if let Some((from, ticks)) = self.stopped {
            let most = (from - f64::from(ticks) * step_max_n).max(0.0);
            self.verdict
                .judge(Invariant::ForceStops, now, force <= most + HAIR_N, || {
                    format!("{force} N in tick {ticks} of an emergency stop that began at {from} N")
                });
        }
    }

    pub(super) fn judge_model(&mut self, tick: &MasterTicked<'_>) {
        let (now, model) = (tick.now, tick.end.master().model());
        let state = model.state();
        let [m, b, c, ..] = state.params.to_array();
        let pose = state.pose;
        let within = |value: f64, (least, most): (f64, f64)| value >= least && value <= most;
        let holds = [m, b, c]
            .into_iter()
            .zip(ACCEPTED)
            .all(|(value, range)| within(value, range))
            && [pose.position.x, pose.position.y, pose.angle]
                .into_iter()
                .all(f64::is_finite);
        self.verdict
            .judge(Invariant::ModelAccepted, now, holds, || {
                format!("m {m} kg, b {b} N s/m, c {c} N at {pose:?}")
            });
        // the paper's ways of correcting the pose cost what they cost, and a device that jumps flings the box
        if self.about.settings.correction == PoseCorrection::Replay && !self.jumped {
            let injected = model.energy_injected_j();
            self.verdict
                .judge(Invariant::EnergyPaid, now, injected <= HAIR_J, || {
                    format!("{injected} J")
                });
        }
    }
}
