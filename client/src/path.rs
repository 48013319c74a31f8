//! The path of a session as its master saw it, to be met again as a trace of the emulated network.
//!
//! Half of each round trip stands for each way, and what never arrived from the slave is lost: as `ping -D`
//! would have found it at the same time. It must never measure by itself: it sends nothing.

use std::time::Duration;

use mmt_netem::trace::path::PathTrace;
use mmt_netem::trace::{Sample, lost_between};
use mmt_shared::channel::peer::Peer;
use mmt_shared::time::Time;

/// The most samples kept: ten hours at the 25 a second of an ordinary session. What comes later is left out.
const SAMPLES_MAX: usize = 1_000_000;

/// What a session met so far.
#[derive(Clone, Debug, Default)]
pub struct PathRecorder {
    samples: Vec<Sample>,
    /// Round trips and missing packets already among the samples.
    trips: u64,
    missing: u32,
}

impl PathRecorder {
    /// A recorder that never allocates: all samples have their room from the start.
    pub fn with_room() -> Self {
        Self {
            samples: Vec::with_capacity(SAMPLES_MAX),
            ..Self::default()
        }
    }

    /// Looks at what the newest message brought; `now` is its arrival.
    pub fn note(&mut self, now: Time, peer: &Peer) {
        self.note_missing(now, peer.incoming().lost());
        let trips = peer.round_trip().histogram().total();
        if let Some(trip) = peer.round_trip().latest()
            && trips > self.trips
        {
            self.trips = trips;
            self.push(now, trip / 2);
        }
    }

    fn note_missing(&mut self, now: Time, missing: u32) {
        if self.missing < missing {
            let since = self.samples.last().map_or(Duration::ZERO, |last| last.at);
            let until = now.saturating_since(Time::ZERO);
            let lost = lost_between(since, until, (missing - self.missing).into());
            let room = SAMPLES_MAX.saturating_sub(self.samples.len());
            self.samples.extend(lost.take(room));
            self.missing = missing;
        }
        while self.missing > missing {
            // it was late, not lost
            self.missing -= 1;
            if let Some(at) = self
                .samples
                .iter()
                .rposition(|sample| sample.delay.is_none())
            {
                self.samples.remove(at);
            }
        }
    }

    fn push(&mut self, now: Time, delay: Duration) {
        if self.samples.len() < SAMPLES_MAX {
            let (at, delay) = (now.saturating_since(Time::ZERO), Some(delay));
            self.samples.push(Sample { at, delay });
        }
    }

    /// The path.
    ///
    /// # Errors
    /// In words: no round trip was measured.
    pub fn path(&self) -> Result<PathTrace, &'static str> {
        PathTrace::try_new(self.samples.clone())
    }
}

#[cfg(test)]
mod tests {
    use mmt_netem::trace::mmt::path_text;

    use super::*;

    const DOWN_MS: u64 = 20;
    const UP_MS: u64 = 30;

    #[test]
    fn half_of_each_round_trip_and_what_never_came_make_the_path() {
        let (mut here, mut there) = (Peer::default(), Peer::default());
        let mut recorder = PathRecorder::default();
        assert!(recorder.path().is_err());
        let ms = Time::from_millis;
        for k in 1..=10 {
            let question = here.stamp(ms(100 * k)).unwrap();
            there.handle(ms(100 * k + UP_MS), &question);
            let answer = there.stamp(ms(100 * k + UP_MS)).unwrap();
            let now = ms(100 * k + UP_MS + DOWN_MS);
            // the fourth and the fifth answer never arrive
            if !(4..=5).contains(&k) {
                here.handle(now, &answer);
                recorder.note(now, &here);
                // looking twice adds nothing
                recorder.note(now, &here);
            }
        }
        let path = recorder.path().unwrap();
        let delays: Vec<_> = path.samples().iter().map(|sample| sample.delay).collect();
        let half = Some(Duration::from_millis((UP_MS + DOWN_MS) / 2));
        let (before, after) = (vec![half; 3], vec![half; 5]);
        assert_eq!(delays, [before, vec![None; 2], after].concat());
        // a packet that meets the path later is lost where those were: two of the three steps from 200 to 500 ms
        let replayed = PathTrace::parse(&path_text(path.samples()), None).unwrap();
        for (at_ms, met) in [(250, half), (350, None), (450, None), (550, half)] {
            assert_eq!(replayed.at(Duration::from_millis(at_ms)), met, "{at_ms} ms");
        }
    }

    #[test]
    fn what_comes_late_was_not_lost() {
        let (mut here, mut there) = (Peer::default(), Peer::default());
        let mut recorder = PathRecorder::default();
        let ms = Time::from_millis;
        let mut answers = Vec::new();
        for k in 1..=3 {
            let question = here.stamp(ms(k)).unwrap();
            there.handle(ms(k), &question);
            answers.push(there.stamp(ms(k)).unwrap());
        }
        for (at, number) in [(10, 0), (11, 2), (12, 1)] {
            here.handle(ms(at), &answers[number]);
            recorder.note(ms(at), &here);
        }
        assert_eq!(recorder.path().unwrap().loss(), 0.0);
    }
}
