//! How likely a packet is to be lost: the state of the loss models.

use std::time::Duration;

use mmt_shared::rng::Substream;
use mmt_shared::time::duration_nanos;

use super::correlated::{ByPacket, CATCH_UP_STEPS};
use super::streams::Draws;
use crate::config::{FourState, GilbertElliott, Loss, TimedBursts};

/// The states of all loss models; those not in use rest.
#[derive(Clone, Debug)]
pub(super) struct LossModel {
    correlated: ByPacket,
    bad: bool,
    state: ChainState,
    bursts: Bursts,
}

/// The states of the four-state chain, by their numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum ChainState {
    #[default]
    One,
    Two,
    Three,
    Four,
}

/// The probability that a packet is lost, and the uniform number that decides: below it is lost.
#[derive(Clone, Copy, Debug)]
pub(super) struct LossDraw {
    pub(super) probability: f64,
    pub(super) draw: f64,
}

impl LossDraw {
    pub(super) fn is_lost(self) -> bool {
        self.draw < self.probability
    }
}

impl LossModel {
    pub(super) fn new(bursts: Substream) -> Self {
        Self {
            correlated: ByPacket::default(),
            bad: false,
            state: ChainState::default(),
            bursts: Bursts::new(bursts),
        }
    }

    /// The draw for packet `number`, `elapsed` after the start. Chains by packet take their step.
    pub(super) fn draw(
        &mut self,
        loss: &Loss,
        number: u64,
        elapsed: Duration,
        draws: &Draws,
    ) -> LossDraw {
        let certain = |lost: bool| if lost { 1.0 } else { 0.0 };
        let mut draw = draws.loss;
        let probability = match loss {
            Loss::None => 0.0,
            Loss::Independent { probability } => probability.get(),
            Loss::Correlated {
                probability,
                correlation,
            } => {
                draw = self.correlated.uniform(correlation.get(), draw);
                probability.get()
            }
            Loss::Gemodel(chain) => self.gemodel(chain, draws.state),
            Loss::FourState(chain) => {
                self.state = self.state.after(chain, draws.state);
                certain(matches!(self.state, ChainState::Three | ChainState::Four))
            }
            Loss::Bursts(bursts) if self.bursts.on(bursts, elapsed) => bursts.loss_inside.get(),
            Loss::Bursts(bursts) => bursts.loss_between.get(),
            Loss::Every(n) => certain(number % (*n).max(1) == (*n).max(1) - 1),
            Loss::Listed(list) => certain(list.holds(number)),
        };
        LossDraw { probability, draw }
    }

    /// As in the kernel: the state decides about this packet, then moves on. Low draws lead to the bad state
    /// from either, so that, for p + r up to 1, raising p only ever adds losses.
    fn gemodel(&mut self, chain: &GilbertElliott, draw: f64) -> f64 {
        let (loss, to_bad) = if self.bad {
            (chain.loss_in_bad, chain.to_good.complement())
        } else {
            (chain.loss_in_good, chain.to_bad)
        };
        self.bad = draw < to_bad.get();
        loss.get()
    }
}

impl ChainState {
    fn after(self, chain: &FourState, draw: f64) -> Self {
        let (first, second) = match self {
            Self::One => ((chain.p14, Self::Four), (chain.p13, Self::Three)),
            Self::Two => ((chain.p23, Self::Three), (chain.p23, Self::Three)),
            Self::Three => ((chain.p32, Self::Two), (chain.p31, Self::One)),
            Self::Four => return Self::One,
        };
        match draw {
            draw if draw < first.0.get() => first.1,
            _ if self == Self::Two => self,
            draw if draw < first.0.get() + second.0.get() => second.1,
            _ => self,
        }
    }
}

/// Bursts in time: a function of time alone, and of the share only by how early bursts begin.
///
/// A burst ends at a constant rate, 1 / mean; between ends, one begins an exponentially distributed time after
/// the last end. By the exponential distribution's lack of memory an end while no burst is on changes nothing.
#[derive(Clone, Debug)]
struct Bursts {
    start: Substream,
    stream: Substream,
    /// Nanoseconds; zero before its first use.
    mean: u64,
    /// The last end and the next one, nanoseconds.
    ended: i128,
    ends: i128,
    /// How long after the last end a burst begins, in mean times between bursts.
    rest: f64,
}

impl Bursts {
    fn new(start: Substream) -> Self {
        Self {
            stream: start.clone(),
            start,
            mean: 0,
            ended: 0,
            ends: 0,
            rest: 0.0,
        }
    }

    /// Whether a burst is on at `elapsed`.
    fn on(&mut self, settings: &TimedBursts, elapsed: Duration) -> bool {
        let (share, mean) = (settings.share.get(), duration_nanos(settings.mean));
        if share <= 0.0 || share >= 1.0 {
            return share >= 1.0;
        }
        let elapsed = i128::from(duration_nanos(elapsed));
        if self.mean != mean {
            self.stream = self.start.clone();
            self.mean = mean;
            self.begin(0);
        }
        let mut steps = 0;
        while self.ends <= elapsed {
            self.ended = self.ends;
            self.ends += self.duration();
            self.rest = self.exponential();
            steps += 1;
            if steps > CATCH_UP_STEPS {
                self.begin(elapsed);
            }
        }
        let between = mean as f64 * (1.0 - share) / share;
        (elapsed - self.ended) as f64 >= self.rest * between
    }

    /// Begins at a random point of the stationary process.
    fn begin(&mut self, now: i128) {
        self.ended = now - self.duration();
        self.ends = now + self.duration();
        self.rest = self.exponential();
    }

    /// A time from end to end, nanoseconds.
    fn duration(&mut self) -> i128 {
        let nanos = self.exponential() * self.mean as f64;
        1 + nanos as i128
    }

    fn exponential(&mut self) -> f64 {
        -libm::log1p(-self.stream.uniform())
    }
}
