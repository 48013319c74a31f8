//! The scripted operator goes on where somebody else has left the HIP.

use mmt_shared::model::geometry::Vec2;

use super::{Phase, Scripted};
use crate::operator::hand::Hand;

impl Scripted {
    /// Goes on from a HIP (m, world), at rest there, to the face that it had in mind. The tremor begins anew.
    pub fn go_on_from(&mut self, hip: Vec2) {
        self.hand = Hand::new(self.config.hand, self.config.seed, hip);
        (self.wanted, self.wanted_velocity) = (hip, Vec2::zeros());
        self.pushed = 0.0;
        self.nudge.begin();
        self.enter(Phase::Travel);
    }
}
