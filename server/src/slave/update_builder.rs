//! Makes an update of what the slave has found.

use mmt_shared::model::correction::{IN_CONTACT, IN_CONTACT_REPLAYED};
use mmt_shared::model::local_model::LocalModel;
use mmt_shared::model::params::ModelState;
use mmt_shared::model::settings::PoseCorrection;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::Time;

use super::object::ObjectEstimate;

/// Numbers updates and fills them.
#[derive(Clone, Copy, Debug)]
pub(super) struct UpdateBuilder {
    /// Number of the last update.
    sequence: u32,
    /// By how much the model's correction of its pose lags behind, s.
    lag_s: f64,
    /// Whether an update that only the timer asked for carries the object's pose.
    timer_carries_pose: bool,
    /// Updates whose state lay beyond what a master accepts.
    clamped: u64,
}

impl UpdateBuilder {
    pub(super) fn new(correction: PoseCorrection, timer_carries_pose: bool) -> Self {
        Self {
            sequence: 0,
            lag_s: match correction {
                PoseCorrection::Snap => 0.0,
                PoseCorrection::MatchedStamps => IN_CONTACT.tau_s,
                PoseCorrection::Replay => IN_CONTACT_REPLAYED.tau_s,
            },
            timer_carries_pose,
            clamped: 0,
        }
    }

    /// Updates whose state lay beyond what a master accepts and was brought to the edge of it.
    pub(super) fn clamped(&self) -> u64 {
        self.clamped
    }

    /// The update that answers `stamp`; none where what was found is not of numbers. The master accepts no object beyond
    /// the workspace, so one that has left it is at its edge. `model` is the copy of the master's model with every
    /// update that was sent.
    pub(super) fn step(
        &mut self,
        cause: Cause,
        stamp: Time,
        object: &ObjectEstimate,
        model: &LocalModel,
    ) -> Option<Update> {
        // what the model had at the stamp: nothing is left to be corrected there
        let parameters_only = cause == Cause::Timer && !self.timer_carries_pose;
        let own = model.history().at(stamp).filter(|_| parameters_only);
        let (footprint, pose, twist) = match own {
            Some(own) => (model.state().footprint, own.motion.pose, own.motion.twist),
            None => {
                let (observer, omega) = (&object.observer, model.state().twist.angular);
                let pose = observer.pose_ahead(omega, self.lag_s);
                (observer.footprint(), pose, observer.twist())
            }
        };
        let coupling = &model.settings().coupling;
        let state = match ModelState::try_new(object.params, footprint, pose, twist, coupling) {
            Ok(state) => state,
            Err(_) => {
                self.clamped += 1;
                ModelState::nearest(object.params, footprint, pose, twist, coupling).ok()?
            }
        };
        self.sequence = self.sequence.saturating_add(1);
        Some(Update {
            sequence: self.sequence,
            cause,
            answers: stamp,
            touched_face: object.observer.contact().map(|contact| contact.face),
            state,
        })
    }
}
