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
        }
    }

    /// The update that answers `stamp`. `model` is the copy of the master's model with every update that was sent.
    pub(super) fn step(
        &mut self,
        cause: Cause,
        stamp: Time,
        in_contact: bool,
        object: &ObjectEstimate,
        model: &LocalModel,
    ) -> Update {
        self.sequence = self.sequence.saturating_add(1);
        let omega = model.state().twist.angular;
        let found = ModelState {
            params: object.params,
            footprint: object.observer.footprint(),
            pose: object.observer.pose_ahead(omega, self.lag_s),
            twist: object.observer.twist(),
        };
        // what the model had at the stamp: nothing is left to be corrected there
        let parameters_only = cause == Cause::Timer && !self.timer_carries_pose;
        let own = model.history().at(stamp).filter(|_| parameters_only);
        let state = own.map_or(found, |own| ModelState {
            footprint: model.state().footprint,
            pose: own.motion.pose,
            twist: own.motion.twist,
            ..found
        });
        Update {
            sequence: self.sequence,
            cause,
            answers: stamp,
            newest_command: 0,
            slave_in_contact: in_contact,
            state,
        }
    }
}
