//! How long the model took to follow a change of the object, and what it cost.
//!
//! The time is contact time: nothing can be learned of friction without touching. Recovered means that
//! the relative force error, averaged over 100 ms of contact, is at most 10 % and stays there for the
//! next 300 ms of contact. It must never call a change recovered that the force has not shown yet.

use mmt_server::slave::SlaveTick;
use mmt_shared::time::TICK_S;

/// The force error is averaged over so many ticks of contact: 100 ms.
const AVERAGE: usize = 100;
/// The mean must stay low for so many further ticks of contact: 300 ms.
const STAYS: u32 = 300;
/// Greatest relative force error of a model that has recovered.
const ERROR_MAX: f64 = 0.10;
/// Least force that the error is relative to, N: the floor of (12) in recommended mode.
const FLOOR_N: f64 = 0.3;

/// How a change was followed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Recovery {
    /// Contact time from the change to the beginning of the low error, s; none if it never stayed low.
    pub contact_s: Option<f64>,
    /// Updates sent from the change to the recovery, or to the end of the run.
    pub updates: u64,
    /// Largest mean error seen from the change to the recovery.
    pub worst_error: f64,
}

/// Watches a run from the change on.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    errors: [f64; AVERAGE],
    /// Ticks of contact so far.
    ticks: u32,
    updates: u64,
    low_since: Option<(u32, u64)>,
    worst: f64,
    done: Option<Recovery>,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            errors: [0.0; AVERAGE],
            ticks: 0,
            updates: 0,
            low_since: None,
            worst: 0.0,
            done: None,
        }
    }
}

impl Watch {
    pub(super) fn take(&mut self, tick: &SlaveTick) {
        if self.done.is_some() {
            return;
        }
        self.updates += u64::from(tick.update.is_some());
        if !tick.in_contact {
            return;
        }
        let error = (tick.f_s - tick.f_shadow).norm() / tick.f_s.norm().max(FLOOR_N);
        if let Some(slot) = self.errors.get_mut(self.ticks as usize % AVERAGE) {
            *slot = error;
        }
        self.ticks += 1;
        if (self.ticks as usize) < AVERAGE {
            return;
        }
        let mean = self.errors.iter().sum::<f64>() / AVERAGE as f64;
        if mean > ERROR_MAX {
            self.low_since = None;
            self.worst = self.worst.max(mean);
            return;
        }
        let (since, updates) = *self.low_since.get_or_insert((self.ticks, self.updates));
        if self.ticks - since >= STAYS {
            self.done = Some(Recovery {
                contact_s: Some(f64::from(since) * TICK_S),
                updates,
                worst_error: self.worst,
            });
        }
    }

    pub(super) fn recovery(self) -> Recovery {
        self.done.unwrap_or(Recovery {
            contact_s: None,
            updates: self.updates,
            worst_error: self.worst,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::geometry::{Pose, Vec2};
    use mmt_shared::time::Time;

    fn tick(error: f64, in_contact: bool) -> SlaveTick {
        SlaveTick {
            stamp: Time::ZERO,
            tool: Vec2::zeros(),
            f_s: Vec2::new(2.0, 0.0),
            true_force: Vec2::new(2.0, 0.0),
            f_shadow: Vec2::new(2.0 * (1.0 - error), 0.0),
            f_m: None,
            in_contact,
            truth: Pose::default(),
            update: None,
        }
    }

    fn after(errors: impl IntoIterator<Item = (f64, bool)>) -> Recovery {
        let mut watch = Watch::default();
        for (error, in_contact) in errors {
            watch.take(&tick(error, in_contact));
        }
        watch.recovery()
    }

    #[test]
    fn the_time_is_contact_time_until_the_mean_is_low_and_stays_low() {
        // 200 ms at 50 %, then 0: the mean of 100 ms is at 10 % after another 80 ms
        let high = std::iter::repeat_n((0.5, true), 200);
        let apart = std::iter::repeat_n((0.5, false), 500);
        let low = std::iter::repeat_n((0.0, true), 1000);
        let recovery = after(high.chain(apart).chain(low));
        assert!(
            (recovery.contact_s.unwrap() - 0.280).abs() < 1e-9,
            "{recovery:?}"
        );
        assert!((recovery.worst_error - 0.5).abs() < 1e-12);
    }

    #[test]
    fn an_error_that_comes_back_is_no_recovery() {
        let waves = (0..20).flat_map(|_| {
            std::iter::repeat_n((0.5, true), 100).chain(std::iter::repeat_n((0.0, true), 300))
        });
        assert_eq!(after(waves).contact_s, None);
    }
}
