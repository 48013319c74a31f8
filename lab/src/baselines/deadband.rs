//! The perceptual deadband on a force stream: a force is sent when it is perceptibly another than the last sent.
//!
//! Hinterseer, Hirche, Chaudhuri, Steinbach and Buss, "Perception-based data reduction and transmission of haptic data
//! in telepresence and teleaction systems", IEEE Trans. Signal Processing 56(2), 2008; for vectors the isotropic
//! deadzone of the same authors. The receiver holds the last force. It must never stay silent for ever: a lost force
//! that nothing follows would be held for good.

use std::time::Duration;

use mmt_shared::metrics::F_MIN_N;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;

/// Delta: a change smaller than this share of the last force is not felt (Weber's law), the upper end of the
/// just noticeable difference.
pub(super) const DELTA: f64 = 0.10;
/// The last force is sent again after this long: half of what a hand needs to react to a touch.
pub(super) const REPEAT: Duration = Duration::from_millis(100);

/// Decides which forces are sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PerceptualDeadband {
    delta: f64,
    sent: Option<(Time, Vec2)>,
}

impl PerceptualDeadband {
    /// Nothing sent yet; `delta` is Delta, as a share.
    pub(super) fn new(delta: f64) -> Self {
        Self { delta, sent: None }
    }

    /// Whether `f` (N) is sent at `now`; what is sent becomes the centre of the deadband.
    ///
    /// Sent are the first force, one with |f − f_sent| > max(Delta |f_sent|, F_min), and a repeat when
    /// [`REPEAT`] has passed.
    pub(super) fn offer(&mut self, now: Time, f: Vec2) -> bool {
        let sends = self.sent.is_none_or(|(then, sent)| {
            let threshold = (self.delta * sent.norm()).max(F_MIN_N);
            (f - sent).norm() > threshold || now.saturating_since(then) >= REPEAT
        });
        if sends {
            self.sent = Some((now, f));
        }
        sends
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(n: u64) -> Time {
        Time::from_millis(n)
    }

    #[test]
    fn a_change_at_the_deadband_is_not_sent_and_the_next_number_is() {
        for (last, edge) in [(2.0, 2.2), (0.1, 0.1 + F_MIN_N), (0.0, F_MIN_N)] {
            let mut deadband = PerceptualDeadband::new(DELTA);
            assert!(deadband.offer(ms(0), Vec2::new(last, 0.0)), "the first");
            let just_inside = Vec2::new(edge - 1e-12, 0.0);
            assert!(!deadband.offer(ms(1), just_inside));
            assert!(deadband.offer(ms(2), Vec2::new(edge + 1e-12, 0.0)));
        }
    }

    #[test]
    fn the_centre_is_the_last_sent_and_not_the_last_seen() {
        let mut deadband = PerceptualDeadband::new(DELTA);
        deadband.offer(ms(0), Vec2::new(1.0, 0.0));
        // each step is far below the deadband, their sum is not
        let sent: Vec<u64> = (1..=60)
            .filter(|n| deadband.offer(ms(*n), Vec2::new(1.0 + 0.0052 * *n as f64, 0.0)))
            .collect();
        // 20 steps are 0.104 above 1; 22 are 0.1144 above 1.104, whose tenth is 0.1104
        assert_eq!(sent, [20, 42]);
    }

    #[test]
    fn a_turned_force_counts_as_another() {
        let mut deadband = PerceptualDeadband::new(DELTA);
        deadband.offer(ms(0), Vec2::new(1.0, 0.0));
        assert!(!deadband.offer(ms(1), Vec2::new(1.0, 0.099)));
        assert!(deadband.offer(ms(2), Vec2::new(1.0, 0.101)));
    }

    #[test]
    fn silence_ends_after_the_repeat_time_and_not_a_tick_before() {
        let mut deadband = PerceptualDeadband::new(DELTA);
        deadband.offer(ms(0), Vec2::new(1.0, 0.0));
        let sent: Vec<u64> = (1..=250)
            .filter(|n| deadband.offer(ms(*n), Vec2::new(1.0, 0.0)))
            .collect();
        assert_eq!(sent, [100, 200]);
    }
}
