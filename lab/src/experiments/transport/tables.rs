//! What is printed and kept of the runs.

use mmt_netem::Probability;

use super::grid::{FlowRun, Kind, NARROW, OUTAGE, PLAIN, kind, largest, outcomes};
use crate::experiment::prelude::*;
use crate::transport::{Case, Flow, FlowOutcome, Stack};

/// The round trip of the examples, and the shortest one of the promise about bottlenecks.
const LONG: Duration = Duration::from_millis(100);

fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

/// Every run.
#[rustfmt::skip]
pub(super) fn all(runs: &[FlowRun]) -> Table {
    Table::of(
        "Delay added by the protocol",
        runs,
        &[
            column("stack", "", 0, |(case, _)| case.stack.name()),
            column("messages_per_s", "Hz", 0, |(case, _)| u64::from(case.flow.rate_hz)),
            column("message_bytes", "B", 0, |(case, _)| case.flow.bytes as u64),
            column("round_trip_ms", "ms", 0, |(case, _)| millis(case.conditions.round_trip)),
            column("loss_percent", "%", 1, |(case, _)| case.conditions.loss_percent()),
            column("jitter_ms", "ms", 0, |(case, _)| millis(case.conditions.jitter)),
            column("outage_ms", "ms", 0, |(case, _)| millis(case.conditions.outage)),
            column("bottleneck_mbit_per_s", "Mbit/s", 1, |(case, _)| {
                Some(case.conditions.bottleneck?.bits_per_s as f64 * 1e-6)
            }),
            column("seed", "", 0, |(case, _)| case.seed),
            column("added_p50_ms", "ms", 3, |(_, outcome)| outcome.added_p50_ms),
            column("added_p99_ms", "ms", 3, |(_, outcome)| outcome.added_p99_ms),
            column("added_max_ms", "ms", 3, |(_, outcome)| outcome.added_max_ms),
            column("possible", "", 0, |(_, outcome)| outcome.possible),
            column("delivered", "", 0, |(_, outcome)| outcome.delivered),
            column("share_delivered", "", 4, |(_, outcome)| outcome.share()),
            column("stale", "", 0, |(_, outcome)| outcome.stale),
            column("fresh_ms", "ms", 3, |(_, outcome)| outcome.fresh_ms),
            column("packets_up", "", 0, |(_, outcome)| outcome.up.packets),
            column("bytes_up", "", 0, |(_, outcome)| outcome.up.bytes),
            column("packets_down", "", 0, |(_, outcome)| outcome.down.packets),
            column("bytes_down", "", 0, |(_, outcome)| outcome.down.bytes),
        ],
    )
}

/// A promise: in which cases, what of them, and how much it may be, ms.
struct Promise {
    what: &'static str,
    holds_for: fn(&Case) -> bool,
    value: fn(&FlowOutcome) -> Option<f64>,
    limit_ms: f64,
}

#[rustfmt::skip]
static PROMISES: [Promise; 3] = [
    Promise {
        what: "nothing added at any random loss or reordering (max)",
        holds_for: |case| kind(&case.conditions) == PLAIN,
        value: |outcome| outcome.added_max_ms,
        limit_ms: 0.0,
    },
    Promise {
        what: "after an outage the next message on time, without random loss (wait)",
        holds_for: |case| kind(&case.conditions) == OUTAGE && case.conditions.loss == Probability::ZERO,
        value: |outcome| outcome.fresh_ms,
        limit_ms: 0.0,
    },
    Promise {
        what: "at the bottleneck, round trip of 100 ms or more (median)",
        holds_for: |case| kind(&case.conditions) == NARROW && case.conditions.round_trip >= LONG,
        value: |outcome| outcome.added_p50_ms,
        limit_ms: 25.0,
    },
];

impl Promise {
    /// How often it is kept.
    fn kept(&self, outcomes: &[&FlowOutcome]) -> u64 {
        let values = outcomes.iter().filter_map(|outcome| (self.value)(outcome));
        values.filter(|value| *value <= self.limit_ms).count() as u64
    }
}

/// A promise with what stock quinn and ours came to where it holds.
type Kept<'a> = (&'static Promise, [Vec<&'a FlowOutcome>; 2]);

/// What the transport promises and how far it is kept.
#[rustfmt::skip]
pub(super) fn promises(runs: &[FlowRun]) -> Table {
    let rows = PROMISES.iter().map(|promise| {
        (promise, Stack::ALL.map(|stack| outcomes(runs, stack, promise.holds_for)))
    });
    let rows: Vec<Kept> = rows.collect();
    Table::of(
        "Promises: the worst case of the grid, ms, and in how many cases each is kept",
        &rows,
        &[
            column("promise", "", 0, |(promise, _)| promise.what),
            column("at_most_ms", "ms", 0, |(promise, _)| promise.limit_ms),
            column("stock_worst_ms", "ms", 1, |(promise, [stock, _])| largest(stock, promise.value)),
            column("ours_worst_ms", "ms", 1, |(promise, [_, ours])| largest(ours, promise.value)),
            column("cases", "", 0, |(_, [_, ours])| ours.len() as u64),
            column("stock_kept", "", 0, |(promise, [stock, _])| promise.kept(stock)),
            column("ours_kept", "", 0, |(promise, [_, ours])| promise.kept(ours)),
        ],
    )
}

/// Messages over a path of this name by a stack.
type Group<'a> = grid::Group<(Flow, &'static str, Stack), &'a FlowOutcome>;

/// The worst of each measure.
#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Group<'a>>; 9] {
    [
        column("messages_per_s", "Hz", 0, |group| u64::from(group.case.0.rate_hz)),
        column("path", "", 0, |group| group.case.1),
        column("stack", "", 0, |group| group.case.2.name()),
        column("cases", "", 0, |group| group.runs.len() as u64),
        column("added_p50_ms", "ms", 1, |group| group.largest(|outcome| outcome.added_p50_ms)),
        column("added_p99_ms", "ms", 1, |group| group.largest(|outcome| outcome.added_p99_ms)),
        column("added_max_ms", "ms", 1, |group| group.largest(|outcome| outcome.added_max_ms)),
        column("share_delivered", "", 3, |group| group.values(|outcome| outcome.share()).reduce(f64::min)),
        column("fresh_ms", "ms", 1, |group| group.largest(|outcome| outcome.fresh_ms)),
    ]
}

/// A sample of each kind of path.
pub(super) fn examples(runs: &[FlowRun]) -> Table {
    let first_seed = runs.iter().map(|(case, _)| case.seed).min();
    let mut rows = Vec::new();
    for (name, loss, jitter_ms, of_kind) in [
        ("clean", 0.0, 0, PLAIN),
        ("loss 1 %", 1.0, 0, PLAIN),
        ("loss 5 %", 5.0, 0, PLAIN),
        ("jitter 5 ms", 0.0, 5, PLAIN),
        ("jitter 20 ms", 0.0, 20, PLAIN),
        ("1 s outage", 0.0, 0, OUTAGE),
        ("1 Mbit/s", 0.0, 0, NARROW),
    ] {
        let wanted = |case: &Case| {
            let conditions = &case.conditions;
            (case.flow, Some(case.seed)) == (Flow::EVERY_SAMPLE, first_seed)
                && conditions.round_trip == LONG
                && (conditions.loss_percent() - loss).abs() < 1e-9
                && millis(conditions.jitter) == jitter_ms
                && kind(conditions) == of_kind
        };
        rows.extend(Stack::ALL.map(|stack| Group {
            case: (Flow::EVERY_SAMPLE, name, stack),
            runs: outcomes(runs, stack, wanted),
        }));
    }
    let title = "1000 messages/s, round trip 100 ms, first seed";
    Table::of(title, &rows, &columns()).without(&["messages_per_s", "cases"])
}

/// The worst of each kind of path.
pub(super) fn worst(runs: &[FlowRun]) -> Table {
    let kinds: [(&str, Kind); 4] = [
        ("loss and jitter", PLAIN),
        ("and 1 s outage", OUTAGE),
        ("and 1 Mbit/s", NARROW),
        ("and both", (true, true)),
    ];
    let mut rows = Vec::new();
    for flow in Flow::ALL {
        for (name, of_kind) in kinds {
            let wanted = |case: &Case| case.flow == flow && kind(&case.conditions) == of_kind;
            rows.extend(Stack::ALL.map(|stack| Group {
                case: (flow, name, stack),
                runs: outcomes(runs, stack, wanted),
            }));
        }
    }
    let title = "The worst of each measure over round trips, losses and jitters";
    Table::of(title, &rows, &columns())
}
