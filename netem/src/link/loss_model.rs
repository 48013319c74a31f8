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

    /// As in the kernel: the state decides about this packet, then moves on.
    fn gemodel(&mut self, chain: &GilbertElliott, draw: f64) -> f64 {
        let (loss, leaves) = if self.bad {
            (chain.loss_in_bad, chain.to_good)
        } else {
            (chain.loss_in_good, chain.to_bad)
        };
        self.bad ^= draw < leaves.get();
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

/// Bursts in time: a function of time alone.
#[derive(Clone, Debug)]
struct Bursts {
    start: Substream,
    stream: Substream,
    settings: Option<TimedBursts>,
    on: bool,
    /// When the state ends, nanoseconds.
    until: u64,
}

impl Bursts {
    fn new(start: Substream) -> Self {
        Self {
            stream: start.clone(),
            start,
            settings: None,
            on: false,
            until: 0,
        }
    }

    /// Whether a burst is on at `elapsed`.
    fn on(&mut self, settings: &TimedBursts, elapsed: Duration) -> bool {
        let share = settings.share.get();
        if share <= 0.0 || share >= 1.0 {
            return share >= 1.0;
        }
        let elapsed = duration_nanos(elapsed);
        let timing = |s: &TimedBursts| (s.share, s.mean);
        if self.settings.as_ref().map(timing) != Some(timing(settings)) {
            self.stream = self.start.clone();
            self.settings = Some(*settings);
            self.begin(settings, 0);
        }
        let mut steps = 0;
        while self.until <= elapsed {
            self.on = !self.on;
            let lasts = self.duration(settings);
            self.until = self.until.saturating_add(lasts);
            steps += 1;
            if steps > CATCH_UP_STEPS {
                self.begin(settings, elapsed);
            }
        }
        self.on
    }

    /// Begins at a random point of the stationary process: exponential times have no memory.
    fn begin(&mut self, settings: &TimedBursts, now: u64) {
        self.on = self.stream.uniform() < settings.share.get();
        let lasts = self.duration(settings);
        self.until = now.saturating_add(lasts);
    }

    /// How long the present state lasts, nanoseconds.
    fn duration(&mut self, settings: &TimedBursts) -> u64 {
        let share = settings.share.get();
        let burst = duration_nanos(settings.mean) as f64;
        let mean = if self.on {
            burst
        } else {
            burst * (1.0 - share) / share
        };
        let nanos = -libm::log1p(-self.stream.uniform()) * mean;
        (nanos as u64).saturating_add(1)
    }
}
