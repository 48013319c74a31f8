//! The last seconds of a run, at the rate at which the screen is drawn.

use std::collections::VecDeque;

use mmt_shared::model::update::Cause;

use super::Snapshot;

/// Snapshots kept: 10 s at 20 a second.
const KEPT_MAX: usize = 200;
/// The window over which rates are taken, s.
const RATE_WINDOW_S: f64 = 2.0;

/// The last snapshots, oldest first; never more than [`KEPT_MAX`].
#[derive(Clone, Debug, Default)]
pub(crate) struct History(VecDeque<Snapshot>);

impl History {
    /// Adds what is seen now. When a new session begins, the old one is forgotten.
    pub(crate) fn push(&mut self, snapshot: Snapshot) {
        let newest = self.newest().elapsed_s();
        if snapshot.elapsed_s() < newest {
            self.0.clear();
        }
        if self.0.len() == KEPT_MAX {
            self.0.pop_front();
        }
        self.0.push_back(snapshot);
    }

    /// The newest snapshot; the default before the first.
    pub(crate) fn newest(&self) -> Snapshot {
        self.0.back().copied().unwrap_or_default()
    }

    /// A number of the last `count` snapshots, oldest first; none where there was none.
    pub(super) fn last(
        &self,
        count: usize,
        of: impl Fn(&Snapshot) -> Option<f64>,
    ) -> Vec<Option<f64>> {
        let skipped = self.0.len().saturating_sub(count);
        self.0.iter().skip(skipped).map(of).collect()
    }

    /// Updates per second by cause over the last two seconds; none before there is a second of them.
    pub(super) fn rates_hz(&self) -> Option<[f64; Cause::ALL.len()]> {
        let newest = self.newest();
        let from = self
            .0
            .iter()
            .find(|then| newest.elapsed_s() - then.elapsed_s() <= RATE_WINDOW_S)?;
        let seconds = newest.elapsed_s() - from.elapsed_s();
        let (now, then) = (newest.updates()?, from.updates()?);
        let mut rates = [0.0; Cause::ALL.len()];
        for (rate, (now, then)) in rates.iter_mut().zip(now.into_iter().zip(then)) {
            *rate = now.saturating_sub(then) as f64 / seconds;
        }
        (seconds >= 0.5 * RATE_WINDOW_S).then_some(rates)
    }
}

#[cfg(test)]
mod tests {
    use mmt_server::io::SlaveLive;

    use super::*;

    fn at(elapsed_s: f64, deadband: u64) -> Snapshot {
        let mut slave = SlaveLive {
            elapsed_s,
            ..SlaveLive::default()
        };
        slave.updates[0] = deadband;
        Snapshot::new(Some(slave), None, 0.0)
    }

    #[test]
    fn a_rate_is_taken_over_the_last_two_seconds_only() {
        let mut history = History::default();
        assert_eq!(history.rates_hz(), None);
        for tick in 0..=100_u32 {
            // 100 at once, then 3 a second
            let t_s = f64::from(tick) * 0.05;
            let late = (3.0 * t_s) as u64;
            history.push(at(t_s, if t_s < 2.0 { 0 } else { 100 + late }));
        }
        let rates = history.rates_hz().unwrap();
        assert!((rates[0] - 3.0).abs() < 0.6, "{rates:?}");
        assert_eq!(rates[1], 0.0);
    }

    #[test]
    fn the_history_is_bounded_and_a_new_session_starts_it_again() {
        let mut history = History::default();
        for tick in 0..1000_u32 {
            history.push(at(f64::from(tick), 0));
        }
        assert_eq!(history.last(10_000, Snapshot::f_s).len(), KEPT_MAX);
        assert_eq!(history.last(3, Snapshot::f_s).len(), 3);
        history.push(at(0.0, 0));
        assert_eq!(history.last(10_000, Snapshot::f_s).len(), 1);
    }
}
