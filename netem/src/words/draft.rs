//! Settings as far as they are read, and which words were seen.

use super::word::Word;
use super::{ParseError, Reason};
use crate::config::{Chance, Delay, LinkConfig, Loss, Probability, Reorder, Shape};

/// Settings as far as they are read.
#[derive(Default)]
pub(super) struct Draft<'a> {
    pub(super) config: LinkConfig,
    /// The shape of the jitter, which may stand before the delay.
    pub(super) shape: Option<Shape>,
    /// The words that began the sentences so far, each by its first spelling.
    seen: Vec<(&'a str, Word<'a>)>,
}

impl<'a> Draft<'a> {
    pub(super) fn is_empty(&self) -> bool {
        self.seen.is_empty()
    }

    /// The word that began the sentence of this name, if there was one.
    pub(super) fn seen(&self, name: &str) -> Option<Word<'a>> {
        let mut seen = self.seen.iter();
        seen.find(|(seen, _)| *seen == name).map(|(_, word)| *word)
    }

    /// Takes note of a sentence that may come more than once.
    pub(super) fn note(&mut self, name: &'a str, word: Word<'a>) {
        self.seen.push((name, word));
    }

    /// Takes note of a sentence that may come once.
    pub(super) fn once(&mut self, name: &'a str, word: Word<'a>) -> Result<(), ParseError> {
        if self.seen(name).is_some() {
            return Err(word.wrong(Reason::Repeated));
        }
        self.note(name, word);
        Ok(())
    }

    /// Sets how packets overtake; what is not given stays.
    pub(super) fn reorder(&mut self, chance: Option<Chance>, gap: Option<u32>) {
        // a gap alone: every candidate overtakes, as in tc
        let alone = Reorder {
            chance: Chance {
                probability: Probability::ONE,
                correlation: Probability::ZERO,
            },
            gap: 1,
        };
        let reorder = self.config.reorder.get_or_insert(alone);
        reorder.chance = chance.unwrap_or(reorder.chance);
        reorder.gap = gap.unwrap_or(reorder.gap);
    }

    /// The settings, if the sentences go together.
    pub(super) fn finish(mut self) -> Result<LinkConfig, ParseError> {
        let trace = self.seen("trace");
        if let Some(word) = trace
            && (self.seen("delay").or(self.seen("loss"))).is_some()
        {
            return Err(word.expected("no delay and no loss beside a trace: it has its own"));
        }
        if let (Some(word), Some(shape)) = (self.seen("distribution"), self.shape.take()) {
            if self.config.delay.shape != Shape::Uniform || self.seen("delay").is_none() {
                return Err(word.expected("delay with a jitter beside a distribution"));
            }
            self.config.delay.shape = shape;
        }
        if let Some(word) = self.seen("reorder").or(self.seen("gap"))
            && self.config.delay == Delay::default()
        {
            return Err(word.expected("a delay beside it: without one nothing can overtake"));
        }
        if trace.is_some() {
            (self.config.delay, self.config.loss) = (Delay::default(), Loss::default());
        }
        let before_it = ["queue", "codel", "cross"];
        if let Some(word) = before_it.into_iter().find_map(|name| self.seen(name))
            && self.config.rate.is_none()
        {
            return Err(word.expected("a rate beside it: without one nothing ever waits"));
        }
        if let Some(word) = self.seen("ecn")
            && self.config.loss == Loss::None
            && self.config.queue.codel.is_none()
        {
            return Err(word.expected("loss or codel beside it: nothing else marks"));
        }
        Ok(self.config)
    }
}
