//! What is printed and kept of the runs.

use std::time::Duration;

use mmt_netem::Probability;

use super::runs::{Run, largest, of};
use super::{Conditions, Flow, Outcome, Stack};
use crate::table::{Cell, Table};

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

/// Every run.
pub(super) fn all(runs: &[Run]) -> Table {
    let mut table = Table::new(
        "Delay added by the protocol",
        &[
            ("stack", 0),
            ("messages_per_s", 0),
            ("message_bytes", 0),
            ("round_trip_ms", 0),
            ("loss_percent", 1),
            ("jitter_ms", 0),
            ("outage_ms", 0),
            ("bottleneck_mbit_per_s", 1),
            ("seed", 0),
            ("added_p50_ms", 3),
            ("added_p99_ms", 3),
            ("added_max_ms", 3),
            ("possible", 0),
            ("delivered", 0),
            ("share_delivered", 4),
            ("stale", 0),
            ("fresh_ms", 3),
            ("packets_up", 0),
            ("bytes_up", 0),
            ("packets_down", 0),
            ("bytes_down", 0),
        ],
    );
    for (case, outcome) in runs {
        let conditions = &case.conditions;
        let narrow = conditions.bottleneck.map(|b| b.bits_per_s as f64 * 1e-6);
        table.push([
            case.stack.name().into(),
            u64::from(case.flow.rate_hz()).into(),
            (case.flow.bytes() as u64).into(),
            millis(conditions.round_trip).into(),
            percent(conditions).into(),
            millis(conditions.jitter).into(),
            millis(conditions.outage).into(),
            narrow.into(),
            case.seed.into(),
            outcome.added_p50_ms.into(),
            outcome.added_p99_ms.into(),
            outcome.added_max_ms.into(),
            outcome.possible.into(),
            outcome.delivered.into(),
            outcome.share().into(),
            outcome.stale.into(),
            outcome.fresh_ms.into(),
            outcome.up.packets.into(),
            outcome.up.bytes.into(),
            outcome.down.packets.into(),
            outcome.down.bytes.into(),
        ]);
    }
    table
}

/// A promise: in which runs, what of them, and how much it may be, ms.
struct Promise {
    what: &'static str,
    holds_for: fn(&Run) -> bool,
    value: fn(&Outcome) -> Option<f64>,
    limit_ms: f64,
}

const PROMISES: [Promise; 3] = [
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

/// What the transport promises and how far it is kept.
pub(super) fn promises(runs: &[Run]) -> Table {
    let mut table = Table::new(
        "Promises: the worst case of the grid, ms, and in how many cases each is kept",
        &[
            ("promise", 0),
            ("at_most_ms", 0),
            ("stock_worst_ms", 1),
            ("ours_worst_ms", 1),
            ("cases", 0),
            ("stock_kept", 0),
            ("ours_kept", 0),
        ],
    );
    for promise in &PROMISES {
        let [stock, ours] = Stack::ALL.map(|stack| {
            let runs = of(runs, stack).into_iter().filter(promise.holds_for);
            runs.collect::<Vec<Run>>()
        });
        let kept = |runs: &[Run]| {
            let values = runs
                .iter()
                .filter_map(|(_, outcome)| (promise.value)(outcome));
            values.filter(|value| *value <= promise.limit_ms).count() as u64
        };
        table.push([
            promise.what.into(),
            promise.limit_ms.into(),
            largest(stock.iter().copied(), promise.value).into(),
            largest(ours.iter().copied(), promise.value).into(),
            (ours.len() as u64).into(),
            kept(&stock).into(),
            kept(&ours).into(),
        ]);
    }
    table
}

const MEASURES: [(&str, usize); 5] = [
    ("added_p50_ms", 1),
    ("added_p99_ms", 1),
    ("added_max_ms", 1),
    ("share_delivered", 3),
    ("fresh_ms", 1),
];

/// A sample of each, and the order of the stacks in it.
pub(super) fn examples(runs: &[Run]) -> Table {
    let columns = [("path", 0), ("stack", 0)].into_iter().chain(MEASURES);
    let mut table = Table::new(
        "1000 messages/s, round trip 100 ms, first seed",
        &columns.collect::<Vec<_>>(),
    );
    for (loss, jitter_ms, kind) in [
        (0.0, 0, Kind::Plain),
        (1.0, 0, Kind::Plain),
        (5.0, 0, Kind::Plain),
        (0.0, 5, Kind::Plain),
        (0.0, 20, Kind::Plain),
        (0.0, 0, Kind::Outage),
        (0.0, 0, Kind::Bottleneck),
    ] {
        let wanted = |(case, _): &&Run| {
            let conditions = &case.conditions;
            case.flow == Flow::EverySample
                && case.seed == 1
                && conditions.round_trip == LONG
                && (percent(conditions) - loss).abs() < 1e-9
                && millis(conditions.jitter) == jitter_ms
                && Kind::of(conditions) == kind
        };
        for (case, outcome) in runs.iter().filter(wanted) {
            let path = match (loss, jitter_ms, kind) {
                (0.0, 0, Kind::Plain) => "clean".to_owned(),
                (0.0, 0, _) => kind.name().trim_start_matches("and ").to_owned(),
                (0.0, _, _) => format!("jitter {jitter_ms} ms"),
                _ => format!("loss {loss} %"),
            };
            table.push([
                path.into(),
                case.stack.name().into(),
                outcome.added_p50_ms.into(),
                outcome.added_p99_ms.into(),
                outcome.added_max_ms.into(),
                outcome.share().into(),
                outcome.fresh_ms.into(),
            ]);
        }
    }
    table
}

/// The worst of each kind of path.
pub(super) fn worst(runs: &[Run]) -> Table {
    let columns = [
        ("messages_per_s", 0),
        ("path", 0),
        ("stack", 0),
        ("cases", 0),
    ];
    let mut table = Table::new(
        "The worst of each measure over round trips, losses and jitters",
        &columns.into_iter().chain(MEASURES).collect::<Vec<_>>(),
    );
    for flow in Flow::ALL {
        for kind in Kind::ALL {
            for stack in Stack::ALL {
                let group: Vec<Run> = of(runs, stack)
                    .into_iter()
                    .filter(|(case, _)| case.flow == flow && Kind::of(&case.conditions) == kind)
                    .collect();
                let worst = |of: fn(&Outcome) -> Option<f64>| -> Cell {
                    largest(group.iter().copied(), of).into()
                };
                let least = largest(group.iter().copied(), |outcome| Some(-outcome.share()?));
                table.push([
                    u64::from(flow.rate_hz()).into(),
                    kind.name().into(),
                    stack.name().into(),
                    (group.len() as u64).into(),
                    worst(|outcome| outcome.added_p50_ms),
                    worst(|outcome| outcome.added_p99_ms),
                    worst(|outcome| outcome.added_max_ms),
                    least.map(|share| -share).into(),
                    worst(|outcome| outcome.fresh_ms),
                ]);
            }
        }
    }
    table
}

pub(super) fn percent(conditions: &Conditions) -> f64 {
    f64::from(conditions.loss.parts_per_billion()) / 1e7
}

pub(super) fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}
