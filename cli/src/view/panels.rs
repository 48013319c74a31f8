//! The dashboard's numbers, each section in lines of at most 30 columns. What is not known is a dash.

use mmt_client::failsafe::LinkState;
use mmt_shared::model::update::Cause;

use super::{Caption, History, Missing, Snapshot};

/// A number with a unit, or a dash.
fn shown(value: Option<f64>, decimals: usize, unit: &str) -> String {
    value.map_or_else(
        || "-".to_owned(),
        |value| format!("{value:.decimals$}{unit}"),
    )
}

/// State of the link, round trip; what does not arrive and what was not sent, each way.
pub(super) fn link(caption: &Caption, now: &Snapshot) -> Vec<String> {
    if let Some(tried_s) = now.connecting_s {
        let slave = format!("{}, {tried_s:.0} s", caption.slave);
        return vec!["link: connecting to".to_owned(), slave];
    }
    let state = now.link().map_or("-", LinkState::name);
    let state = now.stopped().unwrap_or_else(|| format!("link: {state}"));
    let way = |(name, way): (&str, &Missing)| {
        let share = shown(way.share.map(|share| share * 100.0), 1, " %");
        let unsent = shown(way.unsent.map(|n| n as f64), 0, "");
        format!("{name:5}{} {share}, unsent {unsent}", way.name())
    };
    let missing = now.missing();
    let ways = ["up", "down"].into_iter().zip(&missing).map(way);
    let held = now.tool_holds().map(str::to_owned);
    let state = format!("{state}  rtt {}", shown(now.rtt_ms(), 1, " ms"));
    std::iter::once(state).chain(ways).chain(held).collect()
}

/// m, b, c: estimated, true, in use; the force on the hand, pushes.
pub(super) fn model(caption: &Caption, now: &Snapshot) -> Vec<String> {
    let estimate = now.slave.map(|slave| slave.estimate);
    let newest = if now.observer.is_some() {
        "update"
    } else {
        "master"
    };
    let mut lines = vec![format!(
        "{:7}{:>9}{:>7}{:>7}",
        "model", "estimate", "truth", newest
    )];
    for (index, label) in ["m kg", "b N s/m", "c N"].into_iter().enumerate() {
        let of = |values: Option<[f64; 3]>| {
            shown(values.and_then(|values| values.get(index).copied()), 3, "")
        };
        let (estimate, truth, in_use) = (of(estimate), of(caption.truth), of(now.params()));
        lines.push(format!("{label:7}{estimate:>9}{truth:>7}{in_use:>7}"));
    }
    let hand = shown(now.master.map(|master| master.hand_force.norm()), 2, " N");
    let pushes = now.master.and_then(|master| master.pushes);
    let pushes = shown(pushes.map(|n| n as f64), 0, "");
    lines.push(format!("hand {hand}   pushes {pushes}"));
    lines
}

/// Forces and their difference, where no chart has them.
pub(super) fn forces(now: &Snapshot) -> String {
    let [f_s, f_m] = [now.f_s(), now.f_m()].map(|force| shown(force, 2, ""));
    let error = shown(now.error(), 2, " N");
    format!("f_s {f_s} f_m {f_m} error {error}")
}

/// Updates by cause, a line each: how many so far, and per second.
pub(super) fn updates(history: &History) -> Vec<String> {
    let now = history.newest();
    let (counts, rates) = (now.updates(), history.rates_hz());
    let counted = |cause: Cause| counts.and_then(|counts| counts.get(cause.number()).copied());
    let row = |cause: Cause| {
        let count = counted(cause);
        let rate = rates.and_then(|rates| rates.get(cause.number()).copied());
        let count = shown(count.map(|n| n as f64), 0, "");
        format!("{:12}{count:>7}{:>7}", short(cause), shown(rate, 1, ""))
    };
    let head = format!("{:12}{:>7}{:>7}", title(&now), "so far", "per s");
    // one scheme alone knows this cause, and 24 lines have no room for what never comes
    let is_rare = |cause: &Cause| *cause == Cause::EverySample && counted(*cause).unwrap_or(0) == 0;
    let causes = Cause::ALL.into_iter().filter(|cause| !is_rare(cause));
    let lines = std::iter::once(head).chain(causes.map(row));
    lines.chain(now.slave.map(|_| applied(&now))).collect()
}

/// Updates in words, in lines of this width, for a terminal that has no room for a table: those causes that there were.
pub(super) fn updates_in_words(history: &History, width: usize) -> Vec<String> {
    let now = history.newest();
    let counts = now.updates().unwrap_or_default();
    let rate = history.rates_hz().map(|rates| rates.iter().sum());
    let all: u64 = counts.iter().sum();
    let rate = shown(rate, 1, "");
    let mut words = vec![format!("{} {all}", title(&now)), format!("{rate} per s")];
    let by_cause = Cause::ALL.into_iter().zip(counts);
    let there = by_cause.filter(|(_, count)| *count > 0);
    words.extend(there.map(|(cause, count)| format!("{} {count}", short(cause))));
    words.extend(now.slave.map(|_| applied(&now)));
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        match lines.last_mut() {
            Some(line) if line.len() + ", ,".len() + word.len() <= width => {
                *line += ", ";
                *line += &word;
            }
            _ => lines.push(word),
        }
    }
    lines
}

/// What the counts of updates are of.
fn title(now: &Snapshot) -> &'static str {
    if now.slave.is_some() || now.observer.is_some() {
        "updates"
    } else {
        "applied"
    }
}

fn applied(now: &Snapshot) -> String {
    let applied = now.master.map(|master| master.updates_applied);
    let applied = applied.map(|by_cause| by_cause.iter().sum::<u64>() as f64);
    format!("applied {}", shown(applied, 0, ""))
}

fn short(cause: Cause) -> String {
    let name = cause.name();
    let name = name.strip_suffix("_contact").unwrap_or(name);
    name.replace('_', " ")
}

/// The haptic loop.
pub(super) fn haptic_loop(now: &Snapshot) -> String {
    let late = now.master.map(|master| master.lateness_p99_us);
    let skipped = now.master.map(|master| master.skipped as f64);
    let (late, skipped) = (shown(late, 0, " us"), shown(skipped, 0, ""));
    format!("lateness p99 {late}, skipped {skipped}")
}
