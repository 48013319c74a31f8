//! What a relay reports when masters find no place, or give theirs to others.

use std::time::{Duration, Instant};

use mmt_netem::io::relay::RelaySnapshot;

/// Strangers may come at any rate; a warning comes once in this time.
const EVERY: Duration = Duration::from_secs(60);

/// What a relay with so many places has reported of its clients.
#[derive(Debug)]
pub(super) struct Places {
    most: usize,
    refused: Warned,
    displaced: Warned,
}

impl Places {
    pub(super) fn new(most: usize) -> Self {
        Self {
            most,
            refused: Warned::default(),
            displaced: Warned::default(),
        }
    }

    /// What to warn of at `now`.
    pub(super) fn warnings(&mut self, seen: &RelaySnapshot, now: Instant) -> Vec<String> {
        let most = self.most;
        let refused = self.refused.more(seen.refused.packets, now);
        let displaced = self.displaced.more(seen.clients_displaced, now);
        let refused = refused.map(|packets| {
            format!(
                "a master was turned away ({packets} packets): there are {most} already (--clients), or no socket is to be had"
            )
        });
        let displaced = displaced.map(|clients| {
            format!(
                "masters that did not talk with the slave ({clients}) made room for newer ones: there are {most} places (--clients), or no more sockets are to be had"
            )
        });
        refused.into_iter().chain(displaced).collect()
    }
}

/// A count that is warned of when it rises.
#[derive(Debug, Default)]
struct Warned {
    of: u64,
    at: Option<Instant>,
}

impl Warned {
    /// By how much it rose since the last warning, if it is time for one.
    fn more(&mut self, count: u64, now: Instant) -> Option<u64> {
        let lately = |at: Instant| now.saturating_duration_since(at) < EVERY;
        if count == self.of || self.at.is_some_and(lately) {
            return None;
        }
        let more = count.saturating_sub(self.of);
        (self.of, self.at) = (count, Some(now));
        Some(more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_that_rises_is_warned_of_at_once_and_then_once_a_minute() {
        let (mut places, began) = (Places::new(64), Instant::now());
        let mut seen = RelaySnapshot::default();
        let mut after = |seen: &RelaySnapshot, s| {
            places
                .warnings(seen, began + Duration::from_secs(s))
                .join("\n")
        };
        assert_eq!(after(&seen, 0), "");
        seen.refused.packets = 3;
        let first = after(&seen, 1);
        assert!(
            first.contains("(3 packets)") && first.contains("64 already (--clients)"),
            "{first}"
        );
        seen.refused.packets = 10;
        seen.clients_displaced = 5;
        let other = after(&seen, 2);
        assert!(
            other.contains("(5) made room") && !other.contains("turned away"),
            "{other}"
        );
        seen.clients_displaced = 6;
        assert_eq!(after(&seen, 60), "");
        assert!(after(&seen, 61).contains("(7 packets)"));
        assert!(after(&seen, 62).contains("(1) made room"));
        assert_eq!(after(&seen, 200), "");
    }
}
