//! What a screen sees of a haptic loop.

use mmt_shared::model::tool::Scene;
use mmt_shared::time::Time;

use super::HapticLoop;
use crate::io::{MasterLive, PersonLive};
use crate::master::MasterTick;

impl HapticLoop {
    /// The loop after a tick at `now`.
    pub(super) fn snapshot(&self, done: &MasterTick, now: Time) -> MasterLive {
        let (master, peer) = (self.end.master(), self.end.channel().peer());
        let state = master.model().state();
        let params = &state.params;
        let rtt = peer.round_trip().histogram().quantile(0.5);
        let (tool_state, tool_energy_holds) = self.end.slave_tool();
        let age = |scene: &Scene| now.saturating_since(scene.answers).as_secs_f64();
        MasterLive {
            elapsed_s: self.elapsed.as_secs_f64(),
            hip: done.sample.hip.metres(),
            f_m: done.displayed,
            hand_force: done.hand_force,
            model: state.pose,
            footprint: Some(state.footprint),
            params: [params.m(), params.b(), params.c()],
            in_contact: master.view().in_contact,
            proxy: done.rendered.touch.map(|touch| touch.proxy),
            engaged: master.limiter().engaged(),
            stopped_by: self.end.stopped_by(),
            tool_state,
            tool_energy_holds,
            person: self.operator.person().map(PersonLive::from),
            change: self.end.change().copied(),
            updates_applied: master.applied(),
            pushes: self.operator.pushes_completed(),
            link: done.link,
            scene: self.end.scene().copied(),
            scene_age_s: self.end.scene().map(age),
            rtt_ms: rtt.map(|rtt| rtt.as_secs_f64() * 1e3),
            up: peer.outgoing_at(now),
            down: peer.incoming(),
            unsent: 0,
            lateness_p99_us: self.timing.lateness.p99.as_secs_f64() * 1e6,
            skipped: self.skipped,
            ended: self.why,
        }
    }
}
