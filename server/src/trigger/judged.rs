//! What (12) is judged by where the ground's ripple lies in the force: the means since the last update.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, duration_nanos};

/// Both forces of the newest ticks since the last update.
#[derive(Clone, Debug)]
pub(super) struct Judged {
    /// How many ticks make a mean; 0: each force is judged by itself.
    ticks: usize,
    /// f_s and f_m, N.
    recent: VecDeque<[Vec2; 2]>,
}

impl Judged {
    /// Means over `window`; none where that is zero.
    pub(super) fn over(window: Duration) -> Self {
        let ticks = (duration_nanos(window) / duration_nanos(TICK)) as usize;
        Self {
            ticks,
            recent: VecDeque::with_capacity(ticks),
        }
    }

    /// Takes f_s and f_m (N) of a tick.
    pub(super) fn push(&mut self, forces: [Vec2; 2]) {
        if self.ticks == 0 {
            return;
        }
        if self.recent.len() >= self.ticks {
            self.recent.pop_front();
        }
        self.recent.push_back(forces);
    }

    /// What went before an update shows nothing of what it left.
    pub(super) fn begin(&mut self) {
        self.recent.clear();
    }

    /// What is to be judged in a tick with these forces (N): they themselves or the means; none as long as there is no mean.
    pub(super) fn forces(&self, now: [Vec2; 2]) -> Option<[Vec2; 2]> {
        if self.ticks == 0 {
            return Some(now);
        }
        let sum = self.recent.iter().fold([Vec2::zeros(); 2], |sum, tick| {
            [sum[0] + tick[0], sum[1] + tick[1]]
        });
        let mean = sum.map(|force| force / self.ticks as f64);
        (self.recent.len() == self.ticks).then_some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn newtons(x: f64) -> Vec2 {
        Vec2::new(x, 0.0)
    }

    #[test]
    fn without_a_window_each_force_is_judged_by_itself() {
        let mut judged = Judged::over(Duration::ZERO);
        judged.push([newtons(1.0), newtons(2.0)]);
        let now = [newtons(3.0), newtons(4.0)];
        assert_eq!(judged.forces(now), Some(now));
    }

    #[test]
    fn a_mean_is_of_the_whole_window_since_the_last_update() {
        let mut judged = Judged::over(Duration::from_millis(4));
        let now = [newtons(9.0), newtons(9.0)];
        for f_s in [100.0, 1.0, 2.0, 3.0] {
            assert_eq!(judged.forces(now), None);
            judged.push([newtons(f_s), newtons(1.0)]);
        }
        judged.push([newtons(4.0), newtons(1.0)]);
        assert_eq!(judged.forces(now), Some([newtons(2.5), newtons(1.0)]));
        judged.begin();
        assert_eq!(judged.forces(now), None);
    }
}
