//! The box as it should be: restarted where the slave saw it, then taken through the HIP samples since.
//!
//! An update carries the pose of the object at one HIP sample of the past. From there the stored samples are
//! replayed with the received parameters, a bounded number per tick, until the replay has caught up; from
//! then on it takes each new sample as well. What it is away from the box that is felt is what remains to
//! be corrected. It must never touch the box that is felt, and never take longer in a tick than its share.

use super::body::{Body, BodyState};
use crate::model::contact::{GodObject, Touch};
use crate::model::correction::{Correction, ROOM_M};
use crate::model::geometry::{Face, Pose, Vec2};
use crate::model::history::History;
use crate::model::params::ModelState;
use crate::model::settings::ModelSettings;
use crate::model::update::Update;
use crate::time::Time;

/// Most samples replayed in a tick, each at the cost of the model's own step: half of a haptic tick's budget of 10 µs. A second of
/// history, 1000 samples and one more a tick, is caught up with in 21 ticks; the hand feels an update only then. Counted, not timed,
/// so that both sides replay alike.
pub const REPLAYED_PER_TICK: usize = 50;

/// A box that is found this far from where it was, m, with the HIP hardly in it, is met anew.
const JUMP_M: f64 = 0.01;
/// A HIP no deeper than this, m, is hardly in a box.
const FLAT_M: f64 = 0.005;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Progress {
    /// No update yet.
    Idle,
    /// The next sample to replay is the first that is not before this stamp.
    Behind(Time),
    /// The newest sample has been replayed; it was of this stamp.
    Live(Time),
}

/// A replay and the update that waits for it to catch up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Replay {
    body: Body,
    /// No tool pushes harder, N. Before an update came, the hand may have gone where the box is, and the coupling alone would shoot
    /// it away.
    tool_force_max_n: f64,
    progress: Progress,
    waiting: Option<Update>,
}

impl Replay {
    pub(super) fn new(start: ModelState, tool_force_max_n: f64) -> Self {
        Self {
            body: Body::new(start),
            tool_force_max_n,
            progress: Progress::Idle,
            waiting: None,
        }
    }

    /// Whether a replay has not caught up yet.
    pub(super) fn is_busy(&self) -> bool {
        matches!(self.progress, Progress::Behind(_))
    }

    /// Whether its pose is that at the newest sample.
    pub(super) fn is_live(&self) -> bool {
        matches!(self.progress, Progress::Live(_))
    }

    /// Whether the box as it should be is clear of a HIP (m, world).
    pub(super) fn is_clear_of(&self, hip: Vec2) -> bool {
        self.body.gap(hip).1 > ROOM_M
    }

    /// Whether a HIP (m, world) is outside of the box as it should be, or hardly in it.
    pub(super) fn is_hardly_entered(&self, hip: Vec2) -> bool {
        self.body.gap(hip).1 > -FLAT_M
    }

    /// What a HIP (m, world) touches of the box as it should be.
    pub(super) fn touch(&self, hip: Vec2) -> Option<Touch> {
        self.body.touch(hip)
    }

    /// The face of the box as it should be that a HIP (m, world) is in front of.
    pub(super) fn face(&self, hip: Vec2) -> Face {
        self.body.gap(hip).0
    }

    /// Gives up what it replays.
    pub(super) fn stop(&mut self) {
        (self.progress, self.waiting) = (Progress::Idle, None);
    }

    /// Sets a box to where it should be, touched as it should be.
    pub(super) fn hand_over(&self, body: &mut Body, correction: &mut Correction) {
        correction.snap(&mut body.state.pose);
        body.god = self.body.god;
    }

    /// Puts an update off until the replay has caught up; a newer one takes the place of an older one.
    pub(super) fn wait(&mut self, update: &Update) {
        self.waiting = Some(*update);
    }

    /// The update that waits, once.
    pub(super) fn take_waiting(&mut self) -> Option<Update> {
        self.waiting.take()
    }

    /// Restarts at the sample that an update answers. One that is older than the history shows nothing of
    /// where the box is now.
    pub(super) fn begin(&mut self, update: &Update, history: &History) {
        let Some(then) = history.nearest(update.answers) else {
            return;
        };
        let (state, mut god) = (BodyState::from(update.state), then.god);
        if let Some(face) = update.touched_face {
            god.enter_by(face);
        } else {
            let jump = (state.pose.position - then.motion.pose.position).norm();
            let hip_in_object = state.pose.point_to_object(then.hip);
            let (_, gap) = state.footprint.nearest(hip_in_object);
            if jump > JUMP_M && gap > -FLAT_M && god.touched().is_none() {
                // where the HIP was seen from another place shows nothing of the face that it is at
                god = GodObject::default();
            }
            god.after_jump(&state.footprint, &state.pose, then.hip);
        }
        self.body = Body { state, god };
        self.progress = Progress::Behind(then.stamp);
    }

    /// Replays a tick's share of samples; where the box should be, once the newest has been replayed.
    pub(super) fn advance(&mut self, settings: &ModelSettings, history: &History) -> Option<Pose> {
        let from = match self.progress {
            Progress::Idle => return None,
            Progress::Behind(stamp) => history.first_not_before(stamp),
            Progress::Live(stamp) => history.first_after(stamp),
        };
        let until = history.len().min(from + REPLAYED_PER_TICK);
        for moment in (from..until).filter_map(|index| history.nth(index)) {
            let (hip, velocity) = (moment.hip, moment.hip_velocity);
            self.body
                .step_within(settings, hip, velocity, self.tool_force_max_n);
        }
        let next = history.nth(until).map(|moment| moment.stamp);
        let newest = history.newest().map(|moment| moment.stamp);
        self.progress = match (next, newest) {
            (Some(next), _) => Progress::Behind(next),
            (None, Some(newest)) => Progress::Live(newest),
            (None, None) => Progress::Idle,
        };
        self.is_live().then_some(self.body.state.pose)
    }
}
