//! When the packets of cross traffic come: a Poisson process in continuous time, a function of the seed and of time
//! alone, whoever else sends.

use std::time::Duration;

use super::streams::substream;
use super::timeline::Timeline;
use crate::config::Cross;
use crate::direction::LinkId;
use mmt_shared::rng::Substream;

/// After a silence in which more packets would have come, the process begins anew.
const SILENCE_MAX: f64 = (1 << 20) as f64;

/// The process. Times are counted from the origin of the link.
#[derive(Clone, Debug)]
pub(super) struct Arrivals {
    stream: Substream,
    /// How far the process has gone.
    at: Duration,
    /// How long the next packet takes from there, in mean gaps.
    left: f64,
}

impl Arrivals {
    pub(super) fn new(seed: u64, id: LinkId) -> Self {
        let stream = substream(id, seed, "netem/up/cross", "netem/down/cross");
        let mut arrivals = Self {
            stream,
            at: Duration::ZERO,
            left: 0.0,
        };
        arrivals.left = arrivals.gap();
        arrivals
    }

    /// The time to the next packet, in mean gaps.
    fn gap(&mut self) -> f64 {
        // 1 - u lies in (0, 1]: the logarithm is finite
        -libm::log(1.0 - self.stream.uniform())
    }

    /// From `time` on, whatever was before.
    pub(super) fn skip_to(&mut self, time: Duration) {
        self.at = self.at.max(time);
    }

    /// Goes on to the next packet that comes by `until`; without one, to `until`.
    pub(super) fn next(
        &mut self,
        timeline: &Timeline,
        until: Duration,
    ) -> Option<(Duration, Cross)> {
        while self.at < until {
            let change = timeline.next_change(self.at);
            let end = change.map_or(until, |change| change.min(until));
            if let Some(cross) = timeline.at(self.at).cross {
                let mean = cross.mean_gap_s();
                let gaps = end.saturating_sub(self.at).as_secs_f64() / mean;
                if self.left <= gaps && gaps <= SILENCE_MAX {
                    self.at = self
                        .at
                        .saturating_add(Duration::from_secs_f64(self.left * mean));
                    self.left = self.gap();
                    return Some((self.at, cross));
                }
                if self.left > gaps {
                    self.left -= gaps;
                }
            }
            self.at = end;
        }
        None
    }
}
