//! What has been said of a link so far, each thing once, and the settings that it comes to.

use std::sync::Arc;
use std::time::Duration;

use super::{ParseError, Reason, Word};
use crate::config::{
    Chance, Codel, Correlation, Delay, LinkConfig, Loss, Order, Outage, Queue, Rate, Reorder,
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
    pub(super) loss: Option<(Word<'a>, Loss)>,
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
        config.limit = self.limit.unwrap_or(config.limit);
        if let Some((word, queue)) = self.queue {
            with_rate(word, &config)?;
            config.queue = queue;
        }
        if let Some((word, codel)) = self.codel {
            with_rate(word, &config)?;
            config.queue.codel = Some(codel);
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
        let (sigma, scale, half_width) = (jitter, jitter, jitter);
        Ok(Some(match shape.map(|(_, shape)| shape) {
            None | Some(Shape::Uniform) => Delay::Uniform { mean, half_width },
            Some(Shape::Normal) => Delay::Normal { mean, sigma },
            Some(Shape::Pareto) => Delay::Pareto { mean, scale },
            Some(Shape::ParetoNormal) => Delay::ParetoNormal { mean, scale },
            Some(Shape::LogNormal) => Delay::LogNormal { mean, sigma },
            Some(Shape::Gamma) => Delay::Gamma { mean, sigma },
            Some(Shape::Table(table)) => {
                let table = Arc::new(table);
                Delay::Table { mean, scale, table }
            }
        }))
    }

    fn finish_order(&mut self, config: &mut LinkConfig) -> Result<(), ParseError> {
        config.order = self.order.unwrap_or(config.order);
        match (self.reorder, self.gap) {
            (Some((word, _)), _) if config.delay == Delay::default() => {
                Err(word.expected("a delay beside it: without one nothing can overtake"))
            }
            (Some((_, chance)), gap) => {
                let gap = gap.map_or(1, |(_, gap)| gap);
                config.reorder = Some(Reorder { chance, gap });
                Ok(())
            }
            (None, Some((word, _))) => Err(word.expected("reorder beside a gap")),
            (None, None) => Ok(()),
        }
    }
}

fn with_rate(word: Word<'_>, config: &LinkConfig) -> Result<(), ParseError> {
    match config.rate {
        Some(_) => Ok(()),
        None => Err(word.expected("a rate beside it: without one nothing ever waits")),
    }
}
