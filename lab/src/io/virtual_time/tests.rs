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
    let which = std::env::var("STACK").unwrap_or_default();
    let cases: Vec<Case> = crate::transport::cases(20_000 * MS, 1)
        .into_iter()
        .filter(|c| {
            which.contains(c.stack.name())
                && c.conditions.bottleneck.is_some()
                && c.flow == Flow::EverySample
        })
        .collect();
    let begun = std::time::Instant::now();
    let outcomes = crate::io::Pool::new(None)
        .run(&cases, |_, case| run(case), |_| {})
        .unwrap();
    println!("{} cases {:?}", cases.len(), begun.elapsed());
    for (case, o) in cases.iter().zip(&outcomes) {
        let c = &case.conditions;
        let f = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.1}"));
        println!(
            "{} {:4} rtt {:3} loss {:3} jit {:2} out {} narrow {} | {:>7} {:>7} {:>7} share {:.4} stale {} fresh {} up {} down {}",
            case.stack.name(),
            case.flow.rate_hz(),
            c.round_trip.as_millis(),
            c.loss.get() * 100.0,
            c.jitter.as_millis(),
            u8::from(!c.outage.is_zero()),
            u8::from(c.bottleneck.is_some()),
            f(o.added_p50_ms),
            f(o.added_p99_ms),
            f(o.added_max_ms),
            o.share().unwrap(),
            o.stale,
            f(o.fresh_ms),
            o.up.packets,
            o.down.packets
        );
    }
}
