//! What is printed and kept of the runs.

use std::time::Duration;

use mmt_netem::Probability;

use super::{Run, largest, of};
use crate::table::{Column, Table, column};
use crate::transport::{Conditions, Flow, Outcome, Stack};

/// The round trip of the examples, and the shortest one of the promise about bottlenecks.
const LONG: Duration = Duration::from_millis(100);

/// What the path does to packets beyond loss and jitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Plain,
    Outage,
    Bottleneck,
    Both,
}

impl Kind {
    const ALL: [Self; 4] = [Self::Plain, Self::Outage, Self::Bottleneck, Self::Both];

    fn of(conditions: &Conditions) -> Self {
        match (conditions.outage.is_zero(), conditions.bottleneck) {
            (true, None) => Self::Plain,
            (false, None) => Self::Outage,
            (true, Some(_)) => Self::Bottleneck,
            (false, Some(_)) => Self::Both,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Plain => "loss and jitter",
            Self::Outage => "and 1 s outage",
            Self::Bottleneck => "and 1 Mbit/s",
            Self::Both => "and both",
        }
    }
}

fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

/// Every run.
#[rustfmt::skip]
pub(super) fn all(runs: &[Run]) -> Table {
    Table::of(
        "Delay added by the protocol",
        runs,
        &[
            column("stack", "", 0, |(case, _)| case.stack.name()),
            column("messages_per_s", "Hz", 0, |(case, _)| u64::from(case.flow.rate_hz())),
            column("message_bytes", "B", 0, |(case, _)| case.flow.bytes() as u64),
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

/// A promise: in which runs, what of them, and how much it may be, ms.
struct Promise {
    what: &'static str,
    holds_for: fn(&Run) -> bool,
    value: fn(&Outcome) -> Option<f64>,
    limit_ms: f64,
}

static PROMISES: [Promise; 3] = [
    Promise {
        what: "nothing added at any random loss or reordering (max)",
        holds_for: |(case, _)| Kind::of(&case.conditions) == Kind::Plain,
        value: |outcome| outcome.added_max_ms,
        limit_ms: 0.0,
    },
    Promise {
        what: "after an outage the next message on time, without random loss (wait)",
        holds_for: |(case, _)| {
            let conditions = &case.conditions;
            Kind::of(conditions) == Kind::Outage && conditions.loss == Probability::ZERO
        },
        value: |outcome| outcome.fresh_ms,
        limit_ms: 0.0,
    },
    Promise {
        what: "at the bottleneck, round trip of 100 ms or more (median)",
        holds_for: |(case, _)| {
            let conditions = &case.conditions;
            Kind::of(conditions) == Kind::Bottleneck && conditions.round_trip >= LONG
        },
        value: |outcome| outcome.added_p50_ms,
        limit_ms: 25.0,
    },
];

/// The runs of a promise by stack.
struct Kept<'a> {
    promise: &'static Promise,
    stock: Vec<Run<'a>>,
    ours: Vec<Run<'a>>,
}

/// What the transport promises and how far it is kept.
#[rustfmt::skip]
pub(super) fn promises(runs: &[Run]) -> Table {
    let rows = PROMISES.iter().map(|promise| {
        let [stock, ours] = Stack::ALL.map(|stack| {
            let runs = of(runs, stack).into_iter();
            runs.filter(promise.holds_for).collect()
        });
        Kept {
            promise,
            stock,
            ours,
        }
    });
    Table::of(
        "Promises: the worst case of the grid, ms, and in how many cases each is kept",
        &rows.collect::<Vec<_>>(),
        &[
            column("promise", "", 0, |row| row.promise.what),
            column("at_most_ms", "ms", 0, |row| row.promise.limit_ms),
            column("stock_worst_ms", "ms", 1, |row| largest(&row.stock, row.promise.value)),
            column("ours_worst_ms", "ms", 1, |row| largest(&row.ours, row.promise.value)),
            column("cases", "", 0, |row| row.ours.len() as u64),
            column("stock_kept", "", 0, |row| row.promise.kept(&row.stock)),
            column("ours_kept", "", 0, |row| row.promise.kept(&row.ours)),
        ],
    )
}

impl Promise {
    /// In how many runs it is kept.
    fn kept(&self, runs: &[Run]) -> u64 {
        let values = runs.iter().filter_map(|(_, outcome)| (self.value)(outcome));
        values.filter(|value| *value <= self.limit_ms).count() as u64
    }
}

/// A path by name, with the worst of each measure over its runs.
struct Path<'a> {
    flow: Flow,
    name: &'static str,
    stack: Stack,
    runs: Vec<Run<'a>>,
}

impl Path<'_> {
    fn worst(&self, of: fn(&Outcome) -> Option<f64>) -> Option<f64> {
        largest(&self.runs, of)
    }
}

#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Path<'a>>; 9] {
    [
        column("messages_per_s", "Hz", 0, |path| u64::from(path.flow.rate_hz())),
        column("path", "", 0, |path| path.name),
        column("stack", "", 0, |path| path.stack.name()),
        column("cases", "", 0, |path| path.runs.len() as u64),
        column("added_p50_ms", "ms", 1, |path| path.worst(|outcome| outcome.added_p50_ms)),
        column("added_p99_ms", "ms", 1, |path| path.worst(|outcome| outcome.added_p99_ms)),
        column("added_max_ms", "ms", 1, |path| path.worst(|outcome| outcome.added_max_ms)),
        column("share_delivered", "", 3, |path| {
            path.worst(|outcome| Some(-outcome.share()?))
                .map(|least| -least)
        }),
        column("fresh_ms", "ms", 1, |path| path.worst(|outcome| outcome.fresh_ms)),
    ]
}

/// A sample of each kind of path.
pub(super) fn examples(runs: &[Run]) -> Table {
    let mut rows = Vec::new();
    for (name, loss, jitter_ms, kind) in [
        ("clean", 0.0, 0, Kind::Plain),
        ("loss 1 %", 1.0, 0, Kind::Plain),
        ("loss 5 %", 5.0, 0, Kind::Plain),
        ("jitter 5 ms", 0.0, 5, Kind::Plain),
        ("jitter 20 ms", 0.0, 20, Kind::Plain),
        ("1 s outage", 0.0, 0, Kind::Outage),
        ("1 Mbit/s", 0.0, 0, Kind::Bottleneck),
    ] {
        let wanted = |(case, _): &&Run| {
            let conditions = &case.conditions;
            case.flow == Flow::EverySample
                && case.seed == 1
                && conditions.round_trip == LONG
                && (conditions.loss_percent() - loss).abs() < 1e-9
                && millis(conditions.jitter) == jitter_ms
                && Kind::of(conditions) == kind
        };
        rows.extend(runs.iter().filter(wanted).map(|run| Path {
            flow: run.0.flow,
            name,
            stack: run.0.stack,
            runs: vec![*run],
        }));
    }
    let title = "1000 messages/s, round trip 100 ms, first seed";
    Table::of(title, &rows, &columns()).without(&["messages_per_s", "cases"])
}

/// The worst of each kind of path.
pub(super) fn worst(runs: &[Run]) -> Table {
    let mut rows = Vec::new();
    for flow in Flow::ALL {
        for kind in Kind::ALL {
            rows.extend(Stack::ALL.map(|stack| {
                let runs = of(runs, stack).into_iter();
                let runs = runs
                    .filter(|(case, _)| case.flow == flow && Kind::of(&case.conditions) == kind);
                Path {
                    flow,
                    name: kind.name(),
                    stack,
                    runs: runs.collect(),
                }
            }));
        }
    }
    let title = "The worst of each measure over round trips, losses and jitters";
    Table::of(title, &rows, &columns())
}
