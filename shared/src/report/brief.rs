//! The report in a sentence and ten lines.

use std::fmt;

use super::table::{Cell, Row, after, count, estimate, number, row, section, share};
use super::{LoopReport, RunReport};

/// The share of skipped ticks from which on the numbers are the host's as well.
const SKIPPED_MOST: f64 = 0.01;

/// A report in a sentence and ten lines; the report by itself is shown whole.
#[derive(Clone, Copy, Debug)]
pub struct Brief<'a, C>(pub &'a RunReport<C>);

impl<C> fmt::Display for Brief<'_, C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let report = self.0;
        writeln!(f, "{}", report.head())?;
        let rows = report.ten().into_iter().map(|(label, cells)| {
            let has_number = |cell: &Cell| cell.as_deref().is_some_and(|text| !is_zero(text));
            (label, cells.into_iter().filter(has_number).collect())
        });
        section(f, &report.verdict(), rows.collect())
    }
}

/// Whether the only number in a text is zero.
fn is_zero(text: &str) -> bool {
    let mut digits = text.chars().filter(char::is_ascii_digit).peekable();
    digits.peek().is_some() && digits.all(|digit| digit == '0')
}

/// The share of its ticks that a loop skipped.
fn skipped(of: &LoopReport) -> Option<f64> {
    let (ticks, skipped) = (of.ticks? as f64, of.skipped? as f64);
    (ticks > 0.0).then(|| skipped / (ticks + skipped))
}

impl<C> RunReport<C> {
    /// What the run came to. What spoils its numbers comes before what they are.
    fn verdict(&self) -> String {
        if self.ending == Some("failed") {
            return "The session failed: the messages above name the reason.".to_owned();
        }
        let loops = [&self.haptic_loop, &self.slave_loop];
        let skipped = loops.into_iter().filter_map(skipped).fold(0.0, f64::max);
        if skipped > SKIPPED_MOST {
            let percent = skipped * 100.0;
            return format!(
                "This host skipped {percent:.0} % of the ticks of a loop: the numbers are partly the host's."
            );
        }
        let emulation = [&self.emulation.up, &self.emulation.down];
        if emulation.iter().any(|way| way.degraded == Some(true)) {
            return "This host was too slow for the emulated network: delays and force errors are partly the host's.".to_owned();
        }
        let rate = number(self.updates.sent.rate_hz, 1, " updates a second");
        let round_trip = number(self.link.rtt_ms.p50, 0, " ms");
        match (share(self.force.errors.relative_error), rate, round_trip) {
            (Some(error), Some(rate), Some(rtt)) => {
                format!(
                    "The force that was felt was off by {error}, with {rate} over a round trip of {rtt}."
                )
            }
            (None, Some(rate), Some(rtt)) => {
                format!("There were {rate} over a round trip of {rtt}.")
            }
            _ => "There was no contact to judge.".to_owned(),
        }
    }

    /// The numbers that most people want.
    #[rustfmt::skip]
    fn ten(&self) -> Vec<Row> {
        let (sent, received) = (&self.updates.sent, &self.updates.received);
        let (errors, hand, link) = (&self.force.errors, &self.force.hand, &self.link);
        let mm = |word, of: super::Number| after(word, number(of.times(1e3), 1, " mm"));
        let p = |name, of| after(name, number(of, 1, " ms"));
        let late = |of: &LoopReport| after("p99", number(of.lateness_us.p99, 1, " us"));
        let breaks = number(self.pushes.contact_breaks_per_push, 2, " breaks each");
        let contact = number(sent.contact_rate_hz, 2, " /s of contact");
        let rms = after("r.m.s.", number(errors.error_rms_n, 3, " N"));
        let largest = after("max", number(hand.largest_n, 2, " N"));
        let injected = number(self.passivity.energy_injected_j.times(1e3), 3, " mJ");
        vec![
            row("pushes", [count(self.pushes.completed, ""), breaks]),
            row("updates", [number(sent.rate_hz, 2, " /s"), contact, count(received.applied, " applied")]),
            row("force error", [share(errors.relative_error), rms]),
            row("force on the hand", [largest, number(hand.largest_step_n, 2, " N in a tick")]),
            row("mass", estimate(&self.model.mass_kg, " kg")),
            row("position error", [mm("r.m.s.", self.pose.position_rms_m), mm("max", self.pose.position_max_m)]),
            row("energy by updates", [injected]),
            row("round trip", [p("p50", link.rtt_ms.p50), p("p99", link.rtt_ms.p99)]),
            row("loss", [after("up", share(link.loss_up)), after("down", share(link.loss_down))]),
            row("loops late", [late(&self.haptic_loop), late(&self.slave_loop)]),
        ]
    }
}
