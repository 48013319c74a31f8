//! The sentences of the language, one method each.

use std::sync::Arc;

use super::number::{
    QueueLimit, bits_per_second, percentage, queue_limit, signed_bytes, time, time_from, whole,
};
use super::said::{DelaySaid, Said, Shape, once};
use super::{A_WORD, ParseError, Parser, Reason, Word};
use crate::config::{
    Chance, Codel, Correlation, Framing, LIMIT_MAX, Order, Probability, Queue, Rate, STEPS_MAX,
    Service, Slot, SlotGap, TAU_MIN,
};
use crate::direction::Direction;
use crate::distribution::{Cdf, Table};
use crate::presets;
use crate::trace::mahimahi::Opportunities;
use crate::trace::path::{PathTrace, Replay};

impl<'a> Parser<'a, '_> {
    pub(super) fn sentence(
        &mut self,
        said: &mut Said<'a>,
        word: Word<'a>,
    ) -> Result<(), ParseError> {
        let first = !std::mem::replace(&mut said.anything, true);
        if said.none {
            return Err(word.expected("nothing beside none"));
        }
        match word.text {
            "none" if first => said.none = true,
            "none" => return Err(word.expected("nothing beside none")),
            "preset" if first => said.preset = Some(self.preset()?),
            "preset" => return Err(word.expected("the preset before everything else")),
            "delay" | "latency" => self.delay(said, word)?,
            "distribution" => {
                let shape = self.shape()?;
                once(&mut said.distribution, (word, shape), word)?;
            }
            "order" => {
                let order = self.order()?;
                once(&mut said.order, order, word)?;
            }
            "reorder" => {
                let chance = self.chance()?;
                once(&mut said.reorder, (word, chance), word)?;
            }
            "gap" => {
                let gap = whole(self.argument(), 1, 1_000_000, "packets")?;
                let gap = u32::try_from(gap).unwrap_or(u32::MAX);
                once(&mut said.gap, (word, gap), word)?;
            }
            "loss" | "drop" => {
                let loss = self.loss()?;
                once(&mut said.loss, (word, loss), word)?;
            }
            "outage" if said.outages.len() < STEPS_MAX => said.outages.push(self.outage()?),
            "duplicate" => {
                let chance = self.chance()?;
                once(&mut said.duplicate, chance, word)?;
            }
            "corrupt" => {
                let chance = self.chance()?;
                once(&mut said.corrupt, chance, word)?;
            }
            _ => return self.sentence_of_the_bottleneck(said, word),
        }
        Ok(())
    }

    fn sentence_of_the_bottleneck(
        &mut self,
        said: &mut Said<'a>,
        word: Word<'a>,
    ) -> Result<(), ParseError> {
        match word.text {
            "mtu" => {
                let mtu = whole(self.argument(), 1, u32::MAX.into(), "bytes")?;
                once(&mut said.mtu, u32::try_from(mtu).unwrap_or(u32::MAX), word)
            }
            "rate" => {
                let rate = self.rate()?;
                once(&mut said.rate, rate, word)
            }
            "queue" => {
                let queue = self.queue()?;
                once(&mut said.queue, (word, queue), word)
            }
            "codel" => {
                let codel = self.codel()?;
                once(&mut said.codel, (word, codel), word)
            }
            "limit" => {
                let limit = whole(self.argument(), 1, LIMIT_MAX.into(), "packets")?;
                let limit = u32::try_from(limit).unwrap_or(LIMIT_MAX);
                once(&mut said.limit, limit, word)
            }
            "trace" => {
                let replay = self.replay()?;
                once(&mut said.replay, (word, replay), word)
            }
            "slot" => {
                let slot = self.slot()?;
                once(&mut said.slot, slot, word)
            }
            "ecn" => once(&mut said.ecn, word, word),
            "seed" => {
                let seed = whole(self.argument(), 0, u64::MAX, "of 64 bits")?;
                once(&mut said.seed, (word, seed), word)
            }
            _ => Err(word.expected(A_WORD)),
        }
    }

    fn preset(&mut self) -> Result<crate::LinkConfig, ParseError> {
        let word = self.argument();
        match presets::named(word.text) {
            // the words of a preset are our own and tested: they parse
            Some(preset) => preset.words.parse(),
            None => Err(word.expected(presets::NAMES)),
        }
    }

    /// What a file that a word names makes.
    fn file<T, E: std::fmt::Display>(
        &mut self,
        word: Word<'a>,
        make: impl FnOnce(&str, &str) -> Result<T, E>,
    ) -> Result<T, ParseError> {
        if word.text.is_empty() || word.text == ";" {
            return Err(word.expected("the name of a file"));
        }
        let wrong = |reason| word.wrong(Reason::File { reason });
        let text = (self.read)(word.text).map_err(wrong)?;
        make(word.text, &text).map_err(|error| wrong(error.to_string()))
    }

    fn delay(&mut self, said: &mut Said<'a>, word: Word<'a>) -> Result<(), ParseError> {
        if self.takes("cdf") {
            let points = self.argument();
            let cdf = match points.text.contains('@') {
                true => inline_cdf(points)?,
                false => self.file(points, Cdf::parse)?,
            };
            once(&mut said.delay, DelaySaid::Measured(cdf), word)?;
        } else {
            let delay = time(self.argument())?;
            let jitter = match self.number() {
                Some(word) => Some(time(word)?),
                None => None,
            };
            once(&mut said.delay, DelaySaid::Times(delay, jitter), word)?;
            if jitter.is_some()
                && let Some(word) = self.number()
            {
                said.correlation = Some(Correlation::PerPacket(percentage(word)?));
            }
            if jitter.is_none() {
                return Ok(());
            }
        }
        if said.correlation.is_none() && self.takes("tau") {
            let tau = time_from(self.argument(), TAU_MIN)?;
            said.correlation = Some(Correlation::InTime(tau));
        }
        Ok(())
    }

    fn shape(&mut self) -> Result<Shape, ParseError> {
        let word = self.argument();
        match word.text {
            "uniform" => Ok(Shape::Uniform),
            "normal" => Ok(Shape::Normal),
            "pareto" => Ok(Shape::Pareto),
            "paretonormal" => Ok(Shape::ParetoNormal),
            "lognormal" => Ok(Shape::LogNormal),
            "gamma" => Ok(Shape::Gamma),
            "table" => {
                let name = self.argument();
                self.file(name, Table::parse).map(Shape::Table)
            }
            "experimental" => Err(word.not_yet("a table by name (`distribution table FILE`)")),
            _ => Err(word
                .expected("uniform, normal, pareto, paretonormal, lognormal, gamma or table FILE")),
        }
    }

    fn slot(&mut self) -> Result<Slot, ParseError> {
        let gap = match self.takes("distribution") {
            true => {
                let shape = self.shape()?;
                let (mean, jitter) = (time(self.argument())?, time(self.argument())?);
                SlotGap::Drawn(shape.delay(mean, jitter))
            }
            false => {
                let least = time(self.argument())?;
                let most = match self.number() {
                    Some(word) => time_from(word, least)?,
                    None => least,
                };
                SlotGap::Uniform { least, most }
            }
        };
        let (mut packets, mut bytes) = (None, None);
        loop {
            if self.takes("packets") {
                let most = whole(self.argument(), 1, u32::MAX.into(), "packets")?;
                packets = Some(u32::try_from(most).unwrap_or(u32::MAX));
            } else if self.takes("bytes") {
                bytes = Some(whole(self.argument(), 1, u64::MAX, "bytes")?);
            } else {
                return Ok(Slot {
                    gap,
                    packets,
                    bytes,
                });
            }
        }
    }

    fn order(&mut self) -> Result<Order, ParseError> {
        let word = self.argument();
        match word.text {
            "fifo" => Ok(Order::Fifo),
            "free" => Ok(Order::Free),
            _ => Err(word.expected("fifo or free")),
        }
    }

    fn chance(&mut self) -> Result<Chance, ParseError> {
        let probability = percentage(self.argument())?;
        let correlation = self.percentage_or(Probability::ZERO)?;
        Ok(Chance {
            probability,
            correlation,
        })
    }

    /// The next percentage, or this one if none is given.
    pub(super) fn percentage_or(&mut self, absent: Probability) -> Result<Probability, ParseError> {
        self.number().map_or(Ok(absent), percentage)
    }

    fn rate(&mut self) -> Result<Rate, ParseError> {
        let service = match self.takes("trace") {
            true => {
                let name = self.argument();
                Service::Opportunities(Arc::new(self.file(name, Opportunities::parse)?))
            }
            false => Service::Constant {
                bits_per_second: bits_per_second(self.argument())?,
            },
        };
        let mut framing = Framing::default();
        if let Some(word) = self.number() {
            framing.overhead = signed_bytes(word)?;
            if let Some(word) = self.number() {
                let cell = whole(word, 0, 65_535, "bytes")?;
                framing.cell = u32::try_from(cell).unwrap_or(0);
                if let Some(word) = self.number() {
                    framing.cell_overhead = signed_bytes(word)?;
                }
            }
        }
        Ok(Rate { service, framing })
    }

    fn queue(&mut self) -> Result<Queue, ParseError> {
        let mut queue = Queue::default();
        let mut word = self.argument();
        loop {
            match queue_limit(word)? {
                QueueLimit::Bytes(bytes) => once(&mut queue.bytes, bytes, word)?,
                QueueLimit::Packets(packets) => once(&mut queue.packets, packets, word)?,
                QueueLimit::Wait(wait) => once(&mut queue.wait, wait, word)?,
            }
            match self.number() {
                Some(next) => word = next,
                None => return Ok(queue),
            }
        }
    }

    fn codel(&mut self) -> Result<Codel, ParseError> {
        let Some(target) = self.number() else {
            return Ok(Codel::default());
        };
        let least = std::time::Duration::from_nanos(1);
        Ok(Codel {
            target: time_from(target, least)?,
            interval: time_from(self.argument(), least)?,
        })
    }

    fn replay(&mut self) -> Result<Replay, ParseError> {
        let name = self.argument();
        let direction = match (self.takes("up"), self.takes("down")) {
            (true, _) => Some(Direction::Up),
            (_, true) => Some(Direction::Down),
            _ => None,
        };
        let path = self.file(name, |_, text| PathTrace::parse(text, direction))?;
        Ok(Replay {
            name: name.text.to_owned(),
            direction,
            path: Arc::new(path),
        })
    }
}

/// Points such as `40ms@0%,50ms@90%,200ms@100%`.
fn inline_cdf(word: Word<'_>) -> Result<Cdf, ParseError> {
    let mut points = Vec::new();
    for point in word.text.split(',') {
        let Some((delay, share)) = point.split_once('@') else {
            return Err(word.expected("points such as 40ms@0%,50ms@90%,200ms@100%"));
        };
        let part = |text| Word { text, ..word };
        let delay = time(part(delay)).map_err(|error| word.wrong(error.reason))?;
        let share = percentage(part(share)).map_err(|error| word.wrong(error.reason))?;
        points.push((mmt_shared::time::duration_nanos(delay), share.get()));
    }
    Cdf::try_new(None, &points).map_err(|why| word.expected(why))
}
