//! The settings of loss: by packet, in time, by schedule.

use std::sync::Arc;
use std::time::Duration;

use mmt_shared::time::duration_nanos;

use super::Probability;

/// The shortest mean burst in time.
pub const BURST_MIN: Duration = Duration::from_millis(1);

/// How packets are lost on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Loss {
    /// None.
    #[default]
    None,
    /// Each packet by itself with the same probability.
    Independent {
        /// The probability that a packet is lost.
        probability: Probability,
    },
    /// The same share, in runs: a Gaussian first-order process behind the draws.
    Correlated {
        /// The probability that a packet is lost.
        probability: Probability,
        /// The correlation of the Gaussian numbers of neighbouring packets.
        correlation: Probability,
    },
    /// Gilbert–Elliott, a step with each packet.
    Gemodel(GilbertElliott),
    /// The four-state chain of `tc netem`, a step with each packet.
    FourState(FourState),
    /// Gilbert–Elliott in time: bursts last milliseconds, whatever the packet rate.
    Bursts(TimedBursts),
    /// Every n-th packet.
    Every(u64),
    /// Named packets, by their number from 0.
    Listed(Arc<PacketList>),
}

/// The two-state chain per packet: E. N. Gilbert, Bell Syst. Tech. J. 39 (1960); E. O. Elliott, Bell
/// Syst. Tech. J. 42 (1963). Names as in `tc netem`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GilbertElliott {
    /// p: from good to bad, at each packet.
    pub to_bad: Probability,
    /// r: from bad to good, at each packet. The mean burst is 1 / r packets.
    pub to_good: Probability,
    /// 1 - h: loss in the bad state.
    pub loss_in_bad: Probability,
    /// 1 - k: loss in the good state.
    pub loss_in_good: Probability,
}

/// The four-state chain of `tc netem` (S. Salsano et al., "Definition of a general and intuitive loss
/// model for packet networks", 2010): 1 good, 2 good within a burst, 3 lost in a burst, 4 lost alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FourState {
    /// From 1 to 3.
    pub p13: Probability,
    /// From 3 to 1.
    pub p31: Probability,
    /// From 3 to 2.
    pub p32: Probability,
    /// From 2 to 3.
    pub p23: Probability,
    /// From 1 to 4; 4 always goes back to 1.
    pub p14: Probability,
}

impl FourState {
    /// Whether the ways out of each state are no more than certain.
    #[must_use]
    pub fn is_chain(&self) -> bool {
        self.p13.get() + self.p14.get() <= 1.0 && self.p31.get() + self.p32.get() <= 1.0
    }

    /// The share of packets lost in the long run, from the balance of the chain.
    fn share(&self) -> f64 {
        let [p13, p31, p32, p23, p14] =
            [self.p13, self.p31, self.p32, self.p23, self.p14].map(Probability::get);
        if p13 == 0.0 {
            return p14 / (1.0 + p14);
        }
        // weights of the states, 3 taken as 1: what flows from 1 to 3 flows back, and so between 2 and 3
        let (one, two) = (p31 / p13, if p32 == 0.0 { 0.0 } else { p32 / p23 });
        let four = one * p14;
        if two.is_infinite() {
            return 0.0;
        }
        (1.0 + four) / (one + two + 1.0 + four)
    }
}

/// Two states that last exponentially distributed times: a pure function of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedBursts {
    /// The share of time in a burst.
    pub share: Probability,
    /// The mean length of a burst, at least [`BURST_MIN`].
    pub mean: Duration,
    /// Loss within a burst.
    pub loss_inside: Probability,
    /// Loss between bursts.
    pub loss_between: Probability,
}

/// A time at which everything is lost, counted from the start of the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outage {
    /// When it begins.
    pub at: Duration,
    /// How long it lasts.
    pub length: Duration,
    /// When it comes again, counted from its beginning; none: once.
    pub every: Option<Duration>,
}

impl Outage {
    /// Whether it is on at `elapsed` after the start.
    #[must_use]
    pub fn covers(&self, elapsed: Duration) -> bool {
        let Some(since) = elapsed.checked_sub(self.at) else {
            return false;
        };
        let since = match self.every {
            Some(every) if !every.is_zero() => {
                Duration::from_nanos(duration_nanos(since) % duration_nanos(every))
            }
            _ => since,
        };
        since < self.length
    }
}

/// Packets by their numbers: ranges in ascending order that do not overlap, both ends included.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PacketList(Vec<(u64, u64)>);

impl PacketList {
    /// A list of ranges in any order; those that overlap are joined.
    #[must_use]
    pub fn new(mut ranges: Vec<(u64, u64)>) -> Self {
        ranges.sort_unstable();
        let mut joined: Vec<(u64, u64)> = Vec::with_capacity(ranges.len());
        for (first, last) in ranges {
            match joined.last_mut() {
                Some((_, end)) if first <= *end => *end = last.max(*end),
                _ => joined.push((first, last)),
            }
        }
        Self(joined)
    }

    /// The ranges.
    #[must_use]
    pub fn ranges(&self) -> &[(u64, u64)] {
        &self.0
    }

    /// Whether packet `number` is on the list.
    #[must_use]
    pub fn holds(&self, number: u64) -> bool {
        let begun = self.0.partition_point(|(first, _)| *first <= number);
        let last_begun = begun.checked_sub(1).and_then(|at| self.0.get(at));
        last_begun.is_some_and(|(_, last)| number <= *last)
    }
}

impl Loss {
    /// The share of packets lost in the long run; `None` where it depends on how many packets there are.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        match self {
            Self::None => Some(0.0),
            Self::Independent { probability } | Self::Correlated { probability, .. } => {
                Some(probability.get())
            }
            Self::Gemodel(chain) => {
                let (p, r) = (chain.to_bad.get(), chain.to_good.get());
                // a chain that never moves stays in its first state, the good one
                let bad = if p == 0.0 { 0.0 } else { p / (p + r) };
                Some(bad * chain.loss_in_bad.get() + (1.0 - bad) * chain.loss_in_good.get())
            }
            Self::FourState(chain) => Some(chain.share()),
            Self::Bursts(bursts) => {
                let bad = bursts.share.get();
                Some(bad * bursts.loss_inside.get() + (1.0 - bad) * bursts.loss_between.get())
            }
            Self::Every(n) => Some(1.0 / (*n).max(1) as f64),
            Self::Listed(_) => None,
        }
    }

    /// The mean length of a run of lost packets in an even stream, packets; `None` where no formula is
    /// known for it.
    #[must_use]
    pub fn mean_burst(&self, rate_hz: f64) -> Option<f64> {
        match self {
            Self::Independent { probability } if *probability > Probability::ZERO => {
                Some(1.0 / (1.0 - probability.get()))
            }
            Self::Gemodel(chain)
                if (chain.loss_in_bad, chain.loss_in_good)
                    == (Probability::ONE, Probability::ZERO)
                    && chain.to_bad > Probability::ZERO =>
            {
                Some(1.0 / chain.to_good.get())
            }
            Self::Bursts(bursts)
                if (bursts.loss_inside, bursts.loss_between)
                    == (Probability::ONE, Probability::ZERO)
                    && bursts.share > Probability::ZERO =>
            {
                // a run goes on if the burst lasts, or is over and a new one has begun, at the next packet
                let (bad, interval) = (bursts.share.get(), 1.0 / rate_hz);
                let relaxation = bursts.mean.as_secs_f64() * (1.0 - bad);
                let stays = bad + (1.0 - bad) * libm::exp(-interval / relaxation);
                Some(1.0 / (1.0 - stays))
            }
            _ => None,
        }
        .filter(|packets| packets.is_finite())
    }

    /// Whether no packet is ever lost. A chain may lose some before it comes to rest, and none in the long run.
    pub(super) fn never(&self) -> bool {
        let zero = |p: Probability| p == Probability::ZERO;
        match self {
            Self::Gemodel(chain) => {
                zero(chain.loss_in_good) && (zero(chain.to_bad) || zero(chain.loss_in_bad))
            }
            Self::FourState(chain) => zero(chain.p13) && zero(chain.p14),
            _ => self.share() == Some(0.0),
        }
    }
}
