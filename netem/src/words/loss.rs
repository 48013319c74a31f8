//! The sentences about loss.

use std::sync::Arc;
use std::time::Duration;

use super::number::{percentage, time, time_from, whole};
use super::word::Word;
use super::{ParseError, Parser};
use crate::config::{
    BURST_MIN, FourState, GilbertElliott, Loss, Outage, PacketList, Probability, TimedBursts,
};

impl<'a> Parser<'a, '_> {
    pub(super) fn loss(&mut self) -> Result<Loss, ParseError> {
        let word = self.argument();
        match word.text {
            "random" => {
                let first = self.argument();
                self.independent(first)
            }
            "state" => self.four_state(word),
            "gemodel" => self.gemodel(),
            "burst" => self.bursts(),
            "every" => whole(self.argument(), 1, u64::MAX, "packets").map(Loss::Every),
            "list" => packet_list(self.argument()).map(|list| Loss::Listed(Arc::new(list))),
            _ => self.independent(word),
        }
    }

    fn independent(&mut self, first: Word<'a>) -> Result<Loss, ParseError> {
        let probability = percentage(first)?;
        let correlation = self.percentage_or(Probability::ZERO)?;
        Ok(if correlation == Probability::ZERO {
            Loss::Independent { probability }
        } else {
            Loss::Correlated {
                probability,
                correlation,
            }
        })
    }

    fn gemodel(&mut self) -> Result<Loss, ParseError> {
        let to_bad = percentage(self.argument())?;
        Ok(Loss::Gemodel(GilbertElliott {
            to_bad,
            to_good: self.percentage_or(to_bad.complement())?,
            loss_in_bad: self.percentage_or(Probability::ONE)?,
            loss_in_good: self.percentage_or(Probability::ZERO)?,
        }))
    }

    fn four_state(&mut self, word: Word<'a>) -> Result<Loss, ParseError> {
        let p13 = percentage(self.argument())?;
        let chain = FourState {
            p13,
            p31: self.percentage_or(p13.complement())?,
            p32: self.percentage_or(Probability::ZERO)?,
            p23: self.percentage_or(Probability::ONE)?,
            p14: self.percentage_or(Probability::ZERO)?,
        };
        if !chain.is_chain() {
            return Err(word.expected("p13 and p14, and p31 and p32, to be 100% together at most"));
        }
        Ok(Loss::FourState(chain))
    }

    fn bursts(&mut self) -> Result<Loss, ParseError> {
        Ok(Loss::Bursts(TimedBursts {
            share: percentage(self.argument())?,
            mean: time_from(self.argument(), BURST_MIN)?,
            loss_inside: self.percentage_or(Probability::ONE)?,
            loss_between: self.percentage_or(Probability::ZERO)?,
        }))
    }

    pub(super) fn outage(&mut self) -> Result<Outage, ParseError> {
        let at = time(self.argument())?;
        let word = self.argument();
        if word.text != "for" {
            return Err(word.expected("for and how long"));
        }
        let length = time_from(self.argument(), Duration::from_nanos(1))?;
        let mut every = None;
        if self.takes("every") {
            let word = self.argument();
            every = Some(time(word)?).filter(|every| *every > length);
            if every.is_none() {
                return Err(word.expected("a time longer than the outage"));
            }
        }
        Ok(Outage { at, length, every })
    }
}

/// Packets such as `3,17,100-120`.
fn packet_list(word: Word<'_>) -> Result<PacketList, ParseError> {
    const RANGES_MAX: usize = 100_000;
    let range = |text: &str| {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let range: (u64, u64) = (first.parse().ok()?, last.parse().ok()?);
        (range.0 <= range.1).then_some(range)
    };
    let ranges: Option<Vec<_>> = word.text.split(',').map(range).collect();
    match ranges.filter(|ranges| ranges.len() <= RANGES_MAX) {
        Some(ranges) => Ok(PacketList::new(ranges)),
        None => Err(word.expected("numbers of packets from 0, such as 3,17,100-120")),
    }
}
