//! The few messages that must arrive: each is repeated until there is a receipt, one at a time.
//!
//! A state machine without a clock or a socket: who drives it repeats and sends.

use std::collections::VecDeque;

/// Letters that may wait to be read. One more gets no receipt, and is repeated.
const WAITING_MAX: usize = 8;

/// Both directions of a connection's letters.
#[derive(Debug, Default)]
pub(super) struct Letters {
    /// The number of the next letter that this side writes.
    next_out: u32,
    /// Letters below this have receipts.
    receipts: u32,
    /// The number of the next letter that is taken in.
    next_in: u32,
    waiting: VecDeque<Vec<u8>>,
}

impl Letters {
    /// Those of the side that was opened by letter 0.
    pub(super) fn opened() -> Self {
        Self {
            next_in: 1,
            ..Self::default()
        }
    }

    /// The number of a letter that is about to be written.
    pub(super) fn number(&mut self) -> u32 {
        let number = self.next_out;
        self.next_out = number.wrapping_add(1);
        number
    }

    /// Takes in a letter that came; the number of the receipt that it gets, if any.
    pub(super) fn take(&mut self, number: u32, message: &[u8]) -> Option<u32> {
        if number == self.next_in && self.waiting.len() < WAITING_MAX {
            self.waiting.push_back(message.to_owned());
            self.next_in = number.wrapping_add(1);
        }
        // one that came before has lost its receipt
        (number < self.next_in).then_some(number)
    }

    /// Takes in a receipt; whether it is news.
    pub(super) fn receipt(&mut self, number: u32) -> bool {
        let news = number < self.next_out && number >= self.receipts;
        if news {
            self.receipts = number.saturating_add(1);
        }
        news
    }

    /// Whether the letter of that number has come.
    pub(super) fn has_come(&self, number: u32) -> bool {
        number < self.receipts
    }

    /// The next letter to read.
    pub(super) fn read(&mut self) -> Option<Vec<u8>> {
        self.waiting.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_letter_is_read_once_however_often_it_comes_and_gets_a_receipt_each_time() {
        let mut letters = Letters::opened();
        assert_eq!(letters.take(1, b"hello"), Some(1));
        assert_eq!(letters.take(1, b"hello"), Some(1));
        assert_eq!(letters.read().as_deref(), Some(&b"hello"[..]));
        assert_eq!(letters.read(), None);
        // letter 0 again: its receipt was lost
        assert_eq!(letters.take(0, b"mmt"), Some(0));
        assert_eq!(letters.read(), None);
    }

    #[test]
    fn a_letter_out_of_turn_gets_none() {
        let mut letters = Letters::opened();
        assert_eq!(letters.take(2, b"early"), None);
        assert_eq!(letters.read(), None);
    }

    #[test]
    fn more_than_may_wait_get_a_receipt_only_when_there_is_room() {
        let mut letters = Letters::default();
        for number in 0..8 {
            assert_eq!(letters.take(number, b"x"), Some(number));
        }
        assert_eq!(letters.take(8, b"x"), None);
        letters.read().unwrap();
        assert_eq!(letters.take(8, b"x"), Some(8));
    }

    #[test]
    fn a_receipt_counts_once_and_only_for_what_was_written() {
        let mut letters = Letters::default();
        assert!(!letters.receipt(0), "nothing was written");
        assert_eq!(letters.number(), 0);
        assert!(!letters.has_come(0));
        assert!(letters.receipt(0) && letters.has_come(0));
        assert!(!letters.receipt(0) && !letters.receipt(9));
    }
}
