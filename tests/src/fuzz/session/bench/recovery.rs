//! What must hold of a session, whatever came before: its reports and checks, and that it works again or is over.

use std::time::Duration;

use mmt_client::failsafe::LinkState;
use mmt_shared::model::geometry::Vec2;

use super::Bench;
use super::network::Network;
use crate::fuzz::session::judge::{MasterJudge, SlaveJudge};

impl Bench {
    /// What holds of the session as a whole.
    pub(in crate::fuzz::session) fn judge_all(&self) {
        let ends = &self.ends;
        MasterJudge::reports(&ends.master);
        SlaveJudge::reports(&ends.slave);
        for verdict in [ends.master_checks.verdict(), ends.slave_checks.verdict()] {
            assert!(verdict.holds(), "{verdict}");
        }
    }

    /// Everybody behaves again: the session works, or it is over after two seconds at either end, as it is where an enemy used
    /// up its numbers or set an emergency stop with one that is yet to come, and the next one works.
    pub(in crate::fuzz::session) fn recover(&mut self) {
        self.path.network = Network::Direct;
        (self.stops, self.engaged, self.velocity) = ([false; 2], true, Vec2::zeros());
        self.rest(2300);
        let over = self.releasing
            || self.ends.master.channel().silence(self.master_now) > Duration::from_secs(1);
        if over {
            // the ramp
            self.rest(200);
        }
        let released = self.ends.master.master().limiter().at_rest();
        let stopped = self.ends.are_stopped();
        assert!(
            !stopped || self.enemy,
            "an emergency stop that nobody holds"
        );
        // a master that never had an answer waits longer for one: the path may be of 4 s
        let unheard = self.ends.slave.channel().silence(self.slave_now) > Duration::from_secs(2);
        if over || released || unheard || stopped || self.ends.slave.is_disengaged() {
            assert!(
                released || !over,
                "the hand of a session that is over is not released"
            );
            self.begin_again(true, Vec2::new(-0.5, 0.1));
            for _ in 0..200 {
                self.tick();
            }
        }
        self.works();
    }

    /// The hand is where the tool is.
    fn rest(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.reading = self.ends.slave.slave().tool_at();
            self.tick();
        }
    }

    /// Samples come through, updates would, and the hand is held.
    fn works(&mut self) {
        let before = self.ends.slave.counts().samples;
        let mut link = LinkState::Released;
        // a command of 32 samples takes 96 ms where congestion leaves two of three samples out
        for _ in 0..120 {
            self.tick();
            link = LinkState::of_silence(self.ends.master.channel().silence(self.master_now));
        }
        let ends = &self.ends;
        // an enemy that used up the numbers of this session has ended it as far as it could
        assert_eq!(link, LinkState::Fresh, "the link does not come back");
        assert!(ends.slave.counts().samples > before, "no samples come");
        assert!(
            !ends.slave.is_disengaged() && !ends.are_stopped(),
            "the tool stands"
        );
        assert!(
            ends.master.master().limiter().engaged(),
            "the hand is not held"
        );
    }
}
