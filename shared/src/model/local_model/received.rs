//! What an update changes at once: parameters, footprint, and what remains to be corrected of the pose.

use super::LocalModel;
use crate::model::geometry::{Vec2, rotate};
use crate::model::params::ModelParams;
use crate::model::settings::Smoothing;
use crate::model::update::{Cause, Update};

impl LocalModel {
    pub(super) fn take_params(&mut self, received: &ModelParams) {
        self.target = *received;
        if let Smoothing::PerPacket { lambda } = self.settings.smoothing {
            // (4)
            self.body.state.params = self.body.state.params.blend(received, lambda);
            self.target = self.body.state.params;
        }
    }

    /// The paper's way: an update carries "both geometry and impedance" (IV-A), and the geometry is set, whatever caused the
    /// update. A velocity is neither: the box goes on with its own, but where a contact of one side only sets it elsewhere.
    pub(super) fn snap(&mut self, update: &Update) {
        self.aim(update);
        let state = &mut self.body.state;
        state.footprint = update.state.footprint();
        self.correction.snap(&mut state.pose);
        self.correction.remaining = Default::default();
        match update.cause {
            Cause::MasterOnlyContact
            | Cause::SlaveOnlyContact
            | Cause::ContactLost
            | Cause::Elsewhere => state.twist = update.state.twist(),
            Cause::Deadband | Cause::EverySample | Cause::Timer => {}
        }
        if let Some((_, hip)) = self.previous {
            let state = &self.body.state;
            self.body.god.after_jump(&state.footprint, &state.pose, hip);
        }
    }

    /// Compares at the stamp that the update answers; the ticks bleed the difference in.
    pub(super) fn match_stamps(&mut self, update: &Update) {
        let retracted = !update.slave_in_contact();
        let shift = self.take_footprint(update, retracted);
        self.correction.count(shift);
        self.aim(update);
    }

    fn aim(&mut self, update: &Update) {
        let Some(then) = self.history.at(update.answers) else {
            return;
        };
        self.correction
            .aim(&update.state.pose(), &then.motion.pose, &then.corrected);
    }

    /// Begins to replay the HIP from the sample that the update answers; the ticks go on with it. Until it
    /// has caught up the face goes on to where the last replay has it: with the old centre and the new
    /// offset it would recede from a hand that it may not have to leave.
    pub(super) fn restart(&mut self, update: &Update) {
        self.take_footprint(update, false);
        self.replay.begin(update, &self.history);
    }

    /// Takes over the face offsets. The face that the HIP touches, or is in front of, stays where it is:
    /// the centre moves instead (which no force notices), and the bleed brings the plane to its place.
    /// Only where it is `retracted` does a face that recedes do so at once. Returns the centre's shift.
    fn take_footprint(&mut self, update: &Update, retracted: bool) -> Vec2 {
        let received = update.state.footprint();
        let Some((_, hip)) = self.previous else {
            self.body.state.footprint = received;
            return Vec2::zeros();
        };
        // the box may have moved from under the HIP since the sample: what it touched then it may be beside now
        let touched = self.body.touch(hip).map(|touch| touch.face);
        let face = touched.unwrap_or_else(|| self.body.gap(hip).0);
        let state = &mut self.body.state;
        let growth = received.offset(face) - state.footprint.offset(face);
        state.footprint = received;
        if growth <= 0.0 && retracted {
            return Vec2::zeros();
        }
        let shift = -rotate(state.pose.angle, face.outward()) * growth;
        state.pose.position += shift;
        shift
    }
}
