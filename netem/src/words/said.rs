//! What has been said of a link so far, each thing once, and the settings that it comes to.

use std::sync::Arc;
use std::time::Duration;

use super::{ParseError, Reason, Word};
use crate::config::{
    Chance, Codel, Correlation, Delay, LinkConfig, Loss, Order, Outage, Probability, Queue, Rate,
    Reorder, Slot,
};
use crate::distribution::{Cdf, Table};
use crate::trace::path::Replay;

/// How a delay was said.
pub(super) enum DelaySaid {
    /// Its middle, perhaps with a jitter.
    Times(Duration, Option<Duration>),
    Measured(Cdf),
}

/// The distribution of a jitter.
pub(super) enum Shape {
    Uniform,
    Normal,
    Pareto,
    ParetoNormal,
    LogNormal,
    Gamma,
    Table(Table),
}

impl Shape {
    /// The distribution of this shape.
    pub(super) fn delay(self, mean: Duration, jitter: Duration) -> Delay {
        let (sigma, scale, half_width) = (jitter, jitter, jitter);
        match self {
            Self::Uniform => Delay::Uniform { mean, half_width },
            Self::Normal => Delay::Normal { mean, sigma },
            Self::Pareto => Delay::Pareto { mean, scale },
            Self::ParetoNormal => Delay::ParetoNormal { mean, scale },
            Self::LogNormal => Delay::LogNormal { mean, sigma },
            Self::Gamma => Delay::Gamma { mean, sigma },
            Self::Table(table) => {
                let table = Arc::new(table);
                Delay::Table { mean, scale, table }
            }
        }
    }
}

/// What has been said, with the word that said it where it may turn out to be out of place.
#[derive(Default)]
pub(super) struct Said<'a> {
    pub(super) anything: bool,
    pub(super) none: bool,
    pub(super) preset: Option<LinkConfig>,
    pub(super) delay: Option<DelaySaid>,
    pub(super) correlation: Option<Correlation>,
    pub(super) distribution: Option<(Word<'a>, Shape)>,
    pub(super) order: Option<Order>,
    pub(super) reorder: Option<(Word<'a>, Chance)>,
    pub(super) gap: Option<(Word<'a>, u32)>,
    pub(super) slot: Option<Slot>,
    pub(super) loss: Option<(Word<'a>, Loss)>,
    pub(super) ecn: Option<Word<'a>>,
    pub(super) seed: Option<(Word<'a>, u64)>,
    pub(super) outages: Vec<Outage>,
    pub(super) duplicate: Option<Chance>,
    pub(super) corrupt: Option<Chance>,
    pub(super) mtu: Option<u32>,
    pub(super) rate: Option<Rate>,
    pub(super) queue: Option<(Word<'a>, Queue)>,
    pub(super) codel: Option<(Word<'a>, Codel)>,
    pub(super) limit: Option<u32>,
    pub(super) replay: Option<(Word<'a>, Replay)>,
}

/// Says a thing that can be said once.
pub(super) fn once<T>(slot: &mut Option<T>, value: T, word: Word<'_>) -> Result<(), ParseError> {
    match slot.replace(value) {
        Some(_) => Err(word.wrong(Reason::Repeated)),
        None => Ok(()),
    }
}

impl Said<'_> {
    pub(super) fn finish(mut self) -> Result<LinkConfig, ParseError> {
        if let Some((word, _)) = &self.replay
            && (self.delay.is_some() || self.loss.is_some())
        {
            return Err(word.expected("no delay and no loss beside a trace: it has its own"));
        }
        let mut config = self.preset.take().unwrap_or_default();
        if let Some(delay) = self.take_delay()? {
            config.delay = delay;
            config.correlation = self.correlation.unwrap_or_default();
        }
        self.finish_order(&mut config)?;
        config.slot = self.slot.take().or(config.slot);
        if let Some((_, loss)) = self.loss {
            config.loss = loss;
        }
        if let Some((_, replay)) = self.replay {
            config.replay = Some(replay);
            (config.delay, config.loss) = (Delay::default(), Loss::default());
        }
        if !self.outages.is_empty() {
            config.outages = self.outages;
        }
        config.duplicate = self.duplicate.unwrap_or(config.duplicate);
        config.corrupt = self.corrupt.unwrap_or(config.corrupt);
        config.mtu = self.mtu.or(config.mtu);
        config.rate = self.rate.or(config.rate);
        config.seed = self.seed.map(|(_, seed)| seed);
        config.limit = self.limit.unwrap_or(config.limit);
        if let Some((word, queue)) = self.queue {
            with_rate(word, &config)?;
            config.queue = queue;
        }
        if let Some((word, codel)) = self.codel {
            with_rate(word, &config)?;
            config.queue.codel = Some(codel);
        }
        if let Some(word) = self.ecn {
            if config.loss == Loss::None && config.queue.codel.is_none() {
                return Err(word.expected("loss or codel beside it: nothing else marks"));
            }
            config.ecn = true;
        }
        Ok(config)
    }

    fn take_delay(&mut self) -> Result<Option<Delay>, ParseError> {
        let shape = self.distribution.take();
        let (mean, jitter) = match (self.delay.take(), &shape) {
            (Some(DelaySaid::Times(mean, Some(jitter))), _) => (mean, jitter),
            (_, Some((word, _))) => {
                return Err(word.expected("delay with a jitter beside a distribution"));
            }
            (Some(DelaySaid::Times(delay, None)), None) => {
                return Ok(Some(Delay::Constant { delay }));
            }
            (Some(DelaySaid::Measured(cdf)), None) => {
                return Ok(Some(Delay::Empirical(Arc::new(cdf))));
            }
            (None, None) => return Ok(None),
        };
        let shape = shape.map_or(Shape::Uniform, |(_, shape)| shape);
        Ok(Some(shape.delay(mean, jitter)))
    }

    fn finish_order(&mut self, config: &mut LinkConfig) -> Result<(), ParseError> {
        config.order = self.order.unwrap_or(config.order);
        // a gap alone: every candidate overtakes, as in tc
        let certain = Chance {
            probability: Probability::ONE,
            correlation: Probability::ZERO,
        };
        let alone = self.gap.map(|(word, _)| (word, certain));
        let Some((word, chance)) = self.reorder.or(alone) else {
            return Ok(());
        };
        if config.delay == Delay::default() {
            return Err(word.expected("a delay beside it: without one nothing can overtake"));
        }
        let gap = self.gap.map_or(1, |(_, gap)| gap);
        config.reorder = Some(Reorder { chance, gap });
        Ok(())
    }
}

fn with_rate(word: Word<'_>, config: &LinkConfig) -> Result<(), ParseError> {
    match config.rate {
        Some(_) => Ok(()),
        None => Err(word.expected("a rate beside it: without one nothing ever waits")),
    }
}
