//! The sentences of the language, one method each.

use std::sync::Arc;

use super::draft::Draft;
use super::number::{
    QueueLimit, bits_per_second, percentage, queue_limit, signed_bytes, time, time_from, whole,
};
use super::word::Word;
use super::{A_WORD, ParseError, Parser, Reason, SHAPES};
use crate::config::{
    Chance, Codel, Correlation, Cross, Delay, Framing, LIMIT_MAX, Limit, Order, Probability, Queue,
    Rate, STEPS_MAX, Service, Shape, Slot, SlotGap, TAU_MIN,
};
use crate::direction::Direction;
use crate::distribution::{Cdf, Table};
use crate::presets;
use crate::trace::mahimahi::Opportunities;
use crate::trace::path::{PathTrace, Replay};

impl<'a> Parser<'a, '_> {
    pub(super) fn sentence(
        &mut self,
        draft: &mut Draft<'a>,
        word: Word<'a>,
    ) -> Result<(), ParseError> {
        let first = draft.is_empty();
        if draft.seen("none").is_some() || (word.text == "none" && !first) {
            return Err(word.expected("nothing beside none"));
        }
        match word.text {
            "preset" if first => {
                draft.config = self.preset()?;
                draft.note("preset", word);
                return Ok(());
            }
            "preset" => return Err(word.expected("the preset before everything else")),
            "outage" => {
                if draft.seen("outage").is_none() {
                    draft.config.outages.clear();
                }
                if draft.config.outages.len() >= STEPS_MAX {
                    return Err(word.expected("1000 outages at most"));
                }
                draft.note("outage", word);
                draft.config.outages.push(self.outage()?);
                return Ok(());
            }
            _ => {}
        }
        let name = match word.text {
            "latency" => "delay",
            "drop" => "loss",
            name => name,
        };
        draft.once(name, word)?;
        self.clause(draft, name, word)
    }

    /// What comes after the first word of a sentence that may come once.
    fn clause(
        &mut self,
        draft: &mut Draft<'a>,
        name: &str,
        word: Word<'a>,
    ) -> Result<(), ParseError> {
        let config = &mut draft.config;
        match name {
            "delay" => (config.delay, config.correlation) = self.delay()?,
            "distribution" => draft.shape = Some(self.shape()?),
            "order" => config.order = self.order()?,
            "reorder" => draft.reorder(Some(self.chance()?), None),
            "gap" => {
                let gap = self.count(1_000_000, "packets")?;
                draft.reorder(None, Some(gap));
            }
            "loss" => config.loss = self.loss()?,
            "duplicate" => config.duplicate = self.chance()?,
            "corrupt" => config.corrupt = self.chance()?,
            "mtu" => config.mtu = Some(self.count(u32::MAX, "bytes")?),
            "rate" => config.rate = Some(self.rate()?),
            "queue" => {
                // without `codel` beside it the queue of a preset has none any more
                let codel = config.queue.codel;
                config.queue = self.queue()?;
                if draft.seen("codel").is_some() {
                    draft.config.queue.codel = codel;
                }
            }
            "codel" => config.queue.codel = Some(self.codel()?),
            "cross" => config.cross = Some(self.cross()?),
            "limit" => config.limit = self.limit()?,
            "trace" => config.replay = Some(self.replay()?),
            "slot" => config.slot = Some(self.slot()?),
            "ecn" => config.ecn = true,
            "seed" => config.seed = Some(whole(self.argument(), 0, u64::MAX, "of 64 bits")?),
            "none" => {}
            _ => return Err(word.expected(A_WORD)),
        }
        Ok(())
    }

    /// A whole number from 1 on.
    fn count(&mut self, most: u32, what: &'static str) -> Result<u32, ParseError> {
        let count = whole(self.argument(), 1, most.into(), what)?;
        Ok(u32::try_from(count).unwrap_or(most))
    }

    /// A time, if the next word is a number.
    fn time_if_given(&mut self) -> Result<Option<std::time::Duration>, ParseError> {
        self.number().map(time).transpose()
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

    fn delay(&mut self) -> Result<(Delay, Correlation), ParseError> {
        let delay = if self.takes("cdf") {
            let points = self.argument();
            let cdf = if points.text.contains('@') {
                inline_cdf(points)?
            } else {
                self.file(points, Cdf::parse)?
            };
            Delay {
                shape: Shape::Empirical(Arc::new(cdf)),
                ..Delay::default()
            }
        } else {
            let mean = time(self.argument())?;
            let Some(half_width) = self.time_if_given()? else {
                return Ok((Delay::constant(mean), Correlation::None));
            };
            let delay = Delay::uniform(mean, half_width);
            if let Some(word) = self.number() {
                return Ok((delay, Correlation::PerPacket(percentage(word)?)));
            }
            delay
        };
        let correlation = if self.takes("tau") {
            Correlation::InTime(time_from(self.argument(), TAU_MIN)?)
        } else {
            Correlation::None
        };
        Ok((delay, correlation))
    }

    fn shape(&mut self) -> Result<Shape, ParseError> {
        let word = self.argument();
        let shapes = SHAPES.iter().find(|(name, _)| *name == word.text);
        match (word.text, shapes) {
            (_, Some((_, shape))) => Ok(shape.clone()),
            ("table", _) => {
                let name = self.argument();
                let table = self.file(name, Table::parse)?;
                Ok(Shape::Table(Arc::new(table)))
            }
            ("experimental", _) => Err(word.not_yet("a table by name (`distribution table FILE`)")),
            _ => Err(word
                .expected("uniform, normal, pareto, paretonormal, lognormal, gamma or table FILE")),
        }
    }

    fn slot(&mut self) -> Result<Slot, ParseError> {
        let gap = if self.takes("distribution") {
            SlotGap::Drawn(Delay {
                shape: self.shape()?,
                mean: time(self.argument())?,
                jitter: time(self.argument())?,
            })
        } else {
            let least = time(self.argument())?;
            let most = self.number().map(|word| time_from(word, least));
            let most = most.transpose()?.unwrap_or(least);
            SlotGap::Uniform { least, most }
        };
        let (mut packets, mut bytes) = (None, None);
        loop {
            if self.takes("packets") {
                packets = Some(self.count(u32::MAX, "packets")?);
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
        let service = if self.takes("trace") {
            let name = self.argument();
            Service::Opportunities(Arc::new(self.file(name, Opportunities::parse)?))
        } else {
            let bits_per_second = bits_per_second(self.argument())?;
            Service::Constant { bits_per_second }
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
        let mut next = Some(self.argument());
        while let Some(word) = next {
            let repeated = match queue_limit(word)? {
                QueueLimit::Bytes(bytes) => queue.bytes.replace(bytes).is_some(),
                QueueLimit::Packets(packets) => queue.packets.replace(packets).is_some(),
                QueueLimit::Wait(wait) => queue.wait.replace(wait).is_some(),
            };
            if repeated {
                return Err(word.wrong(Reason::Repeated));
            }
            next = self.number();
        }
        queue.drop_head = self.takes("drop-head");
        // the default, as tc's queues have it
        if !queue.drop_head {
            self.takes("drop-tail");
        }
        Ok(queue)
    }

    fn limit(&mut self) -> Result<Limit, ParseError> {
        let packets = self.count(LIMIT_MAX, "packets")?;
        let bytes = match self.number().map(|word| (word, queue_limit(word))) {
            None => Limit::default().bytes,
            Some((_, Ok(QueueLimit::Bytes(bytes)))) => bytes,
            Some((word, _)) => return Err(word.expected("a size such as 64mb")),
        };
        Ok(Limit { packets, bytes })
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

    fn cross(&mut self) -> Result<Cross, ParseError> {
        let word = self.argument();
        let bits_per_second = bits_per_second(word)?;
        let arrivals = self.argument();
        if arrivals.text != "poisson" {
            return Err(arrivals.expected("poisson and the size of a packet"));
        }
        let cross = Cross {
            bits_per_second,
            bytes: self.count(65_535, "bytes")?,
        };
        if !cross.in_range() {
            return Err(word.expected("a rate of at most 1000000 packets/s"));
        }
        Ok(cross)
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
