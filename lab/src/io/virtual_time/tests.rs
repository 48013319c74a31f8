//! quinn in virtual time: exact, repeatable, and what the targets say.

use std::time::Duration;

use mmt_netem::Probability;

use super::*;
use crate::transport::{Bottleneck, Case, Conditions, Flow, Outcome, Stack};

const MS: Duration = Duration::from_millis(1);

fn clean(stack: Stack, flow: Flow, round_trip: Duration) -> Case {
    Case {
        stack,
        flow,
        conditions: Conditions {
            round_trip,
            loss: Probability::ZERO,
            jitter: Duration::ZERO,
            outage: Duration::ZERO,
            bottleneck: None,
        },
        duration: 10_000 * MS,
        seed: 1,
    }
}

#[test]
fn explore() {
    for stack in [Stack::Stock, Stack::Ours] {
        for (name, loss, jitter, outage, narrow) in [
            ("clean", 0.0, 0, 0, false),
            ("loss 1", 1.0, 0, 0, false),
            ("loss 5", 5.0, 0, 0, false),
            ("jitter 5", 0.0, 5, 0, false),
            ("outage", 0.0, 0, 1000, false),
            ("narrow", 0.0, 0, 0, true),
        ] {
            let mut case = clean(stack, Flow::EverySample, 100 * MS);
            case.conditions.loss = Probability::from_percent(loss).unwrap();
            case.conditions.jitter = jitter * MS;
            case.conditions.outage = outage * MS;
            case.conditions.bottleneck = narrow.then_some(Bottleneck::NARROW);
            let begun = std::time::Instant::now();
            let o = run(&case).unwrap();
            println!("{stack:?} {name}: {:?} {:?} {:?} share {:?} stale {} fresh {:?} up {:?} down {:?} {:?} {}",
                o.added_p50_ms, o.added_p99_ms, o.added_max_ms, o.share(), o.stale, o.fresh_ms, o.up, o.down, begun.elapsed(), &o.digest[..8]);
        }
    }
}
