//! A tool that has gone back from what it pressed on touches it no more.

use mmt_shared::model::geometry::Vec2;

/// How far the tool has gone back from what it pressed on: a force that stays all the same is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Withdrawal {
    softest_n_per_m: f64,
    tool: Option<Vec2>,
    direction: Vec2,
    back_m: f64,
    /// Force where it began to go back, or where it last had fallen as that of a contact does, N.
    force_n: f64,
    /// Ticks for which the force has stayed although the tool is back, and its sum over them, N.
    stays: (u32, Vec2),
}

/// A tool that has gone back by less may still touch, m.
const BACK_M: f64 = 2e-3;
/// A force must stay for so many ticks: an ordinary end of contact takes fewer.
const STAYS_TICKS: u32 = 20;
/// Weight of the newest force in the direction: 50 ms.
const DIRECTION_WEIGHT: f64 = 0.02;

impl Withdrawal {
    pub(super) fn new(softest_n_per_m: f64) -> Self {
        Self {
            softest_n_per_m,
            tool: None,
            direction: Vec2::zeros(),
            back_m: 0.0,
            force_n: 0.0,
            stays: (0, Vec2::zeros()),
        }
    }

    pub(super) fn reset(&mut self) {
        *self = Self::new(self.softest_n_per_m);
    }

    /// Takes the steady force (N) and the tool (m) of a tick in contact. The force that stays, N, where the tool has gone
    /// back further than any object could have followed it.
    pub(super) fn step(&mut self, force: Vec2, tool: Vec2, doubt_n: f64) -> Option<Vec2> {
        let size = force.norm();
        let way = tool - self.tool.unwrap_or(tool);
        self.tool = Some(tool);
        self.direction += (force - self.direction) * DIRECTION_WEIGHT;
        let along = self.direction.dot(&way) / self.direction.norm().max(1e-9);
        self.back_m = (self.back_m - along).max(0.0);
        if self.back_m <= 0.0 {
            self.force_n = size;
        }
        if self.force_n - size > self.softest_n_per_m * self.back_m + doubt_n {
            // so it touched until here, and from here on it is judged anew
            (self.back_m, self.force_n) = (0.0, size);
        }
        let expected_n = self.softest_n_per_m * self.back_m;
        if self.back_m <= BACK_M || self.force_n - size + doubt_n >= expected_n {
            self.stays = (0, Vec2::zeros());
            return None;
        }
        let (ticks, sum) = self.stays;
        self.stays = (ticks + 1, sum + force);
        let (ticks, sum) = self.stays;
        (ticks >= STAYS_TICKS).then(|| sum / f64::from(ticks))
    }
}
