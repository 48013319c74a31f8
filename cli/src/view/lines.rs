//! A run in one plain line, for logs and pipes.

use std::fmt::Write;

use mmt_client::failsafe::LinkState;

use super::{Caption, History};

/// What is known now; a number that is not known is left out.
pub(crate) fn line(caption: &Caption, history: &History) -> String {
    let now = history.newest();
    if let Some(tried_s) = now.connecting_s {
        return format!("connecting to {}, {tried_s:.0} s", caption.slave);
    }
    let mut text = format!("{:6.1} s", now.elapsed_s());
    let mut add = |label: &str, value: Option<f64>, decimals: usize, unit: &str| {
        if let Some(value) = value {
            // writing into a string cannot fail
            let _ = write!(text, "  {label} {value:.decimals$}{unit}");
        }
    };
    add("f_s", now.f_s(), 2, " N");
    add("f_m", now.f_m(), 2, " N");
    add("error", now.error(), 2, " N");
    let updates = now.updates().map(|by_cause| by_cause.iter().sum::<u64>());
    add("updates", updates.map(|n| n as f64), 0, "");
    add(
        "rate",
        history.rates_hz().map(|rates| rates.iter().sum()),
        1,
        " /s",
    );
    add("rtt", now.rtt_ms(), 0, " ms");
    for (way, missing) in ["up", "down"].into_iter().zip(now.missing()) {
        let percent = missing.share.map(|share| share * 100.0);
        add(&format!("{} {way}", missing.name()), percent, 1, " %");
        let unsent = missing.unsent.filter(|n| *n > 0).map(|n| n as f64);
        add(&format!("unsent {way}"), unsent, 0, "");
    }
    let model = now.slave.map(|slave| slave.estimate).or(now.params());
    add("mass", model.map(|[mass, _, _]| mass), 3, " kg");
    add(
        "pushes",
        now.master
            .and_then(|master| master.pushes)
            .map(|n| n as f64),
        0,
        "",
    );
    let seen = now.observer.and(now.scene_age_s());
    add("scene", seen.map(|age_s| age_s * 1e3), 0, " ms old");
    if let Some(stopped) = now.stopped() {
        let _ = write!(text, "  {stopped}");
    }
    if let Some(holds) = now.tool_holds() {
        let _ = write!(text, "  {holds}");
    }
    if let Some(state) = now.link().filter(|state| *state != LinkState::Fresh) {
        let _ = write!(text, "  link {}", state.name());
    }
    text
}
