//! What must hold of both ends in every tick. The whole contract is judged by the checker of the lab, the counters too; here stand
//! once more those promises that can be told in a line.

use mmt_client::end::MasterEnd;
use mmt_client::limiter::Limits;
use mmt_client::master::MasterTick;
use mmt_server::end::SlaveEnd;
use mmt_server::slave::SlaveTick;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;
use mmt_shared::wire::{Datagram, Message, Side};

/// Rounding.
const HAIR: f64 = 1e-9;

fn finite(of: Vec2) -> bool {
    of.x.is_finite() && of.y.is_finite()
}

/// What is known of the master's end so far.
pub(super) struct MasterJudge {
    limits: Limits,
    force: Vec2,
    applied: u32,
    left: u32,
}

impl MasterJudge {
    pub(super) fn new(limits: Limits) -> Self {
        Self {
            limits,
            force: Vec2::zeros(),
            applied: 0,
            left: 0,
        }
    }

    pub(super) fn ticked(&mut self, done: &MasterTick, end: &MasterEnd) {
        let force = done.hand_force;
        assert!(
            finite(force) && force.norm() <= self.limits.force_max_n + HAIR,
            "{force:?} N on the hand"
        );
        let step = (force - self.force).norm();
        assert!(step <= self.limits.step_max_n + HAIR, "{step} N in a tick");
        self.force = force;
        let model = end.master().model();
        assert_eq!(model.not_finite(), 0, "the model broke");
        let pose = model.state().pose;
        assert!(finite(pose.position) && pose.angle.is_finite(), "{pose:?}");
        let [m, b, c, ..] = model.state().params.to_array();
        assert!(
            (0.05..=50.0).contains(&m) && (0.0..=200.0).contains(&b) && (0.0..=200.0).contains(&c),
            "{m} {b} {c}"
        );
        let applied = end.counts().newest_applied;
        assert!(
            applied >= self.applied,
            "update {applied} after {}",
            self.applied
        );
        self.applied = applied;
    }

    pub(super) fn left(&mut self, now: Time, bytes: &[u8]) {
        left(Side::Master, &mut self.left, now, bytes);
    }

    /// Its report can be written.
    pub(super) fn reports(end: &MasterEnd) {
        let sent = end.channel().counts();
        assert_eq!(sent.messages_unsendable, 0, "what it makes can be sent");
        serde_json::to_string(&end.half(1.0)).unwrap();
    }
}

/// What is known of the slave's end so far.
#[derive(Default)]
pub(super) struct SlaveJudge {
    sequence: u32,
    left: u32,
}

impl SlaveJudge {
    pub(super) fn ticked(&mut self, done: &SlaveTick) {
        for of in [
            done.tool,
            done.f_s,
            done.true_force,
            done.f_shadow,
            done.truth.position,
        ] {
            assert!(finite(of), "{done:?}");
        }
        assert!(done.f_m.is_none_or(finite));
        if let Some(update) = &done.update {
            assert_eq!(
                update.sequence,
                self.sequence + 1,
                "updates are numbered one by one"
            );
            self.sequence = update.sequence;
            crate::fuzz::wire::judge_state(&update.state);
        }
    }

    pub(super) fn left(&mut self, now: Time, bytes: &[u8]) {
        left(Side::Slave, &mut self.left, now, bytes);
    }

    /// No wrench was none, and its report can be written.
    pub(super) fn reports(end: &SlaveEnd) {
        assert_eq!(
            end.slave().environment().refused(),
            0,
            "wrenches that are none"
        );
        let sent = end.channel().counts();
        assert_eq!(sent.messages_unsendable, 0, "what it makes can be sent");
        serde_json::to_string(&end.half(1.0)).unwrap();
    }
}

/// What leaves is a datagram of this side, numbered one by one and stamped with when it leaves.
fn left(side: Side, newest: &mut u32, now: Time, bytes: &[u8]) {
    let read = Datagram::decode(bytes, side).unwrap();
    *newest += 1;
    assert_eq!((read.envelope.number, read.envelope.sent), (*newest, now));
    if let Message::Update(update) = &read.message {
        assert!(update.sequence > 0);
    }
}
