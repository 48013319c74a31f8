//! `CoDel` against a second implementation: the pseudo-code of RFC 8289, section 5, on a real queue.
//!
//! Both must drop the same packets and send the others at the same times. The reference leaves out what the
//! link leaves out: the exemption of a queue of less than one MTU.

use std::collections::VecDeque;

use mmt_shared::rng::Substream;

use super::*;

const TARGET: u64 = 5_000_000;
const INTERVAL: u64 = 100_000_000;
/// 1000 bytes at 8 Mbit/s.
const SENDING: u64 = 1_000_000;

/// A packet that waits: number and time of arrival, ns.
type Waiting = (usize, u64);

/// The variables of RFC 8289, section 5.3, with its names.
#[derive(Default)]
struct Router {
    queue: VecDeque<Waiting>,
    first_above_time: u64,
    drop_next: u64,
    count: u32,
    lastcount: u32,
    dropping: bool,
    dropped: Vec<usize>,
}

impl Router {
    /// Section 5.6: the packet at the head, and whether it may be dropped.
    fn dodequeue(&mut self, now: u64) -> (Option<Waiting>, bool) {
        let Some(packet) = self.queue.pop_front() else {
            self.first_above_time = 0;
            return (None, false);
        };
        if now - packet.1 < TARGET {
            self.first_above_time = 0;
        } else if self.first_above_time == 0 {
            self.first_above_time = now + INTERVAL;
        } else if now >= self.first_above_time {
            return (Some(packet), true);
        }
        (Some(packet), false)
    }

    fn control_law(&self, t: u64) -> u64 {
        t + (INTERVAL as f64 / f64::from(self.count).sqrt()) as u64
    }

    /// Section 5.5.
    fn dequeue(&mut self, now: u64) -> Option<Waiting> {
        let (mut packet, mut ok_to_drop) = self.dodequeue(now);
        if self.dropping {
            if !ok_to_drop {
                self.dropping = false;
            }
            while now >= self.drop_next && self.dropping {
                self.dropped.extend(packet.map(|(number, _)| number));
                self.count += 1;
                (packet, ok_to_drop) = self.dodequeue(now);
                if ok_to_drop {
                    self.drop_next = self.control_law(self.drop_next);
                } else {
                    self.dropping = false;
                }
            }
        } else if ok_to_drop {
            self.dropped.extend(packet.map(|(number, _)| number));
            (packet, _) = self.dodequeue(now);
            self.dropping = true;
            let delta = self.count.saturating_sub(self.lastcount);
            let recently = now.saturating_sub(self.drop_next) < 16 * INTERVAL;
            self.count = if delta > 1 && recently { delta } else { 1 };
            self.drop_next = self.control_law(now);
            self.lastcount = self.count;
        }
        packet
    }
}

/// When each packet has been sent, `None` if it was dropped, for arrivals in ascending order.
fn reference(arrivals: &[u64]) -> Vec<Option<u64>> {
    let mut router = Router::default();
    let mut sent = vec![None; arrivals.len()];
    let mut coming = arrivals.iter().copied().enumerate().peekable();
    let mut free_at = 0;
    loop {
        if router.queue.is_empty() {
            // the wire asks in vain once, then waits for the next packet
            router.dequeue(free_at);
            let Some((number, at)) = coming.next() else {
                return sent;
            };
            free_at = free_at.max(at);
            router.queue.push_back((number, at));
        }
        while let Some((number, at)) = coming.next_if(|(_, at)| *at <= free_at) {
            router.queue.push_back((number, at));
        }
        if let Some((number, _)) = router.dequeue(free_at) {
            free_at += SENDING;
            sent[number] = Some(free_at);
        }
    }
}

/// Packets whose rate swings between too little and too much for the wire.
fn arrivals(seed: u64) -> Vec<u64> {
    let mut stream = Substream::new(seed, "netem/test/arrivals", 0);
    let mut at = 0_u64;
    let arrival = |packet: u64| {
        let swing = 1.0 + 0.4 * libm::sin(packet as f64 / 1500.0);
        let gap = -libm::log1p(-stream.uniform()) * SENDING as f64 * swing;
        at += gap as u64 + 1;
        at
    };
    (0..60_000).map(arrival).collect()
}

#[test]
fn codel_drops_the_packets_that_the_code_of_the_rfc_drops() {
    for seed in [1, 2, 3, 4] {
        let arrivals = arrivals(seed);
        let expected = reference(&arrivals);
        let mut link = link("rate 8mbit codel limit 1000000", 9, LinkId::UP);
        let offers = arrivals
            .iter()
            .map(|at| (Time::from_nanos(*at), Packet::new(1000, ())));
        let mut dropped = 0;
        for (out, expected) in run(&mut link, offers).iter().zip(&expected) {
            let due = met(out).ok().map(Time::as_nanos);
            assert_eq!(due, *expected, "seed {seed}, {out:?}");
            dropped += u32::from(due.is_none());
        }
        // several phases of dropping, and phases without
        assert!((200..6000).contains(&dropped), "{dropped}");
    }
}
