//! The dashboard's panels of numbers. What is not known is a dash.

use mmt_shared::model::update::Cause;
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Wrap};

use super::{Caption, History, Missing, Snapshot};

fn panel(title: impl Into<String>, lines: Vec<String>) -> Paragraph<'static> {
    let lines: Vec<Line<'_>> = lines.into_iter().map(Line::from).collect();
    Paragraph::new(lines).block(Block::bordered().title(title.into()))
}

/// A number with a unit, or a dash.
fn shown(value: Option<f64>, decimals: usize, unit: &str) -> String {
    value.map_or_else(
        || "-".to_owned(),
        |value| format!("{value:.decimals$}{unit}"),
    )
}

/// Updates by cause: so far and per second.
pub(super) fn update_panel(history: &History) -> Paragraph<'static> {
    let now = history.newest();
    let rates = history.rates_hz();
    let counts = now.slave.map(|slave| slave.updates);
    let row = |(index, cause): (usize, Cause)| {
        let rate = rates.and_then(|rates| rates.get(index).copied());
        let count = counts.and_then(|counts| counts.get(index).copied());
        let count = count.map_or_else(|| "-".to_owned(), |count| count.to_string());
        let name = cause.name();
        let name = name.strip_suffix("_contact").unwrap_or(name);
        let name = name.replace('_', " ");
        format!("{name:12}{count:>5}{:>6}", shown(rate, 1, ""))
    };
    let mut lines: Vec<String> = Cause::ALL.into_iter().enumerate().map(row).collect();
    let applied = now.master.map(|master| master.updates_applied as f64);
    lines.push(format!("{:12}{:>5}", "applied", shown(applied, 0, "")));
    panel("updates ─── sent per s", lines)
}

/// m, b, c: estimated, true, in use; pushes.
pub(super) fn model_panel(caption: &Caption, now: &Snapshot) -> Paragraph<'static> {
    let estimate = now.slave.map(|slave| slave.estimate);
    let in_use = now.master.map(|master| master.params);
    let mut lines = vec![format!(
        "{:8}{:>8}{:>7}{:>7}",
        "", "estimate", "truth", "master"
    )];
    for (index, label) in ["m kg", "b N s/m", "c N"].into_iter().enumerate() {
        let of = |values: Option<[f64; 3]>| {
            shown(values.and_then(|values| values.get(index).copied()), 3, "")
        };
        let (estimate, truth, in_use) = (of(estimate), of(caption.truth), of(in_use));
        lines.push(format!("{label:8}{estimate:>8}{truth:>7}{in_use:>7}"));
    }
    let hand = now.master.map(|master| master.hand_force.norm());
    let pushes = now.master.and_then(|master| master.pushes);
    lines.push(format!("force on the hand {:>8}", shown(hand, 2, " N")));
    lines.push(format!(
        "pushes            {:>8}",
        shown(pushes.map(|n| n as f64), 0, "")
    ));
    panel("model", lines)
}

/// Round trip, loss, what was not sent, state.
pub(super) fn link_panel(caption: &Caption, now: &Snapshot) -> Paragraph<'static> {
    if let Some(tried_s) = now.connecting_s {
        // a narrow panel breaks the line at its blank
        let slave = format!("{}, {tried_s:.0} s", caption.slave);
        return panel("link: connecting to", vec![slave]).wrap(Wrap { trim: true });
    }
    let [up, down] = now.missing();
    let percent = |way: &Missing| shown(way.share.map(|share| share * 100.0), 1, " %");
    let unsent = |way: &Missing| shown(way.unsent.map(|n| n as f64), 0, "");
    let state = now.master.map_or("-", |master| master.link.name());
    panel(
        now.stopped().unwrap_or_else(|| format!("link: {state}")),
        vec![
            format!("round trip {}", shown(now.rtt_ms(), 1, " ms")),
            format!("{} up {}", up.name(), percent(&up)),
            format!("{} down {}", down.name(), percent(&down)),
            format!("unsent up {} down {}", unsent(&up), unsent(&down)),
        ],
    )
}

/// The haptic loop.
pub(super) fn loop_panel(now: &Snapshot) -> Paragraph<'static> {
    let late = now.master.map(|master| master.lateness_p99_us);
    let skipped = now.master.map(|master| master.skipped as f64);
    panel(
        "haptic loop",
        vec![
            format!("lateness p99 {}", shown(late, 0, " us")),
            format!("skipped {}", shown(skipped, 0, "")),
        ],
    )
}
