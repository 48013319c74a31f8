//! The live view of a relay: what goes in and out of each direction, what is on the way, how long it takes, and what was
//! lost of what. Shows what the relay counted; counts nothing.

use std::io;
use std::time::{Duration, Instant};

use mmt_netem::counters::Tally;
use mmt_netem::io::driver::DirectionCounters;
use mmt_netem::io::relay::{RelayHandle, RelaySnapshot};
use mmt_shared::stats::histogram::Quantiles;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::start::DEGRADED;
use super::table::{ALWAYS, ROWS};
use crate::log::Messages;
use crate::view::{Screen, Wish};

/// The time that rates and delays are of.
const WINDOW: Duration = Duration::from_secs(1);

/// What does not change while it is shown.
pub(super) struct Caption {
    /// From where to where.
    pub(super) path: String,
    /// How long it runs; none: until somebody ends it.
    pub(super) duration: Option<Duration>,
}

/// Two moments of a relay, a window apart.
pub(super) struct Moments {
    /// Since the start.
    elapsed: Duration,
    /// Between the two.
    window: Duration,
    before: RelaySnapshot,
    now: RelaySnapshot,
    /// Delays of what left between the two, up and down.
    delays: [Quantiles; 2],
}

/// The view on the terminal.
pub(super) struct Gauge {
    caption: Caption,
    screen: Screen,
    began: Instant,
    taken: Instant,
    moments: Moments,
}

impl Gauge {
    /// Takes the terminal; none where there is none.
    pub(super) fn take(caption: Caption, messages: &Messages) -> Option<Self> {
        let now = Instant::now();
        Some(Self {
            caption,
            screen: Screen::take(messages)?,
            began: now,
            taken: now,
            moments: Moments {
                elapsed: Duration::ZERO,
                window: WINDOW,
                before: RelaySnapshot::default(),
                now: RelaySnapshot::default(),
                delays: [Quantiles::default(); 2],
            },
        })
    }

    /// Shows what the relay does, and waits for a key, no longer than `patience`; whether it was one that ends the run.
    ///
    /// # Errors
    /// The terminal cannot be written to or read from.
    pub(super) fn look(&mut self, relay: &RelayHandle, patience: Duration) -> io::Result<bool> {
        let window = self.taken.elapsed();
        if window >= WINDOW {
            self.taken = Instant::now();
            self.moments = Moments {
                elapsed: self.began.elapsed(),
                window,
                before: self.moments.now,
                now: relay.snapshot(),
                delays: relay.take_delays(),
            };
        }
        let (caption, moments) = (&self.caption, &self.moments);
        let draw = |frame: &mut Frame<'_>, messages: &[String]| {
            render(frame, caption, moments, messages);
        };
        self.screen.draw(draw)?;
        let wish = self.screen.wish(patience)?;
        Ok(wish == Some(Wish::End))
    }
}

fn render(frame: &mut Frame<'_>, caption: &Caption, moments: &Moments, messages: &[String]) {
    let below = messages.len() as u16;
    let rows = Layout::vertical([
        Constraint::Length(3),
        Constraint::Min(0),
        Constraint::Length(below),
    ]);
    let [head, table, bottom] = rows.areas(frame.area());
    let of = caption.duration;
    let of = of.map_or_else(String::new, |of| format!(" of {:.0}", of.as_secs_f64()));
    let elapsed = moments.elapsed.as_secs_f64();
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let head_lines = vec![
        Line::from(format!("mmt netem   {elapsed:.1}{of} s   q ends it")).style(bold),
        Line::from(caption.path.as_str()),
    ];
    frame.render_widget(Paragraph::new(head_lines), head);
    let lines = lines(moments).into_iter().map(Line::from);
    frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()), table);
    let messages = messages.iter().map(|text| Line::from(text.as_str()));
    frame.render_widget(Paragraph::new(messages.collect::<Vec<_>>()), bottom);
}

fn row(label: &str, up: &str, down: &str) -> String {
    format!("{label:20} {up:>20} {down:>20}")
}

/// The rows for both directions: the last window first, then all since the start.
fn lines(moments: &Moments) -> Vec<String> {
    let Moments { before, now, .. } = moments;
    let s = moments.window.as_secs_f64();
    let per_s = |of: fn(&DirectionCounters) -> Tally| {
        [(&now.up, &before.up), (&now.down, &before.down)].map(|(now, before)| {
            let (now, before) = (of(now), of(before));
            let packets = now.packets.saturating_sub(before.packets) as f64 / s;
            let bits = 8.0 * now.bytes.saturating_sub(before.bytes) as f64 / s;
            format!("{packets:.0} /s {:.0} kbit/s", bits / 1e3)
        })
    };
    let mut lines = vec![row("", "up", "down")];
    let mut add = |label: &str, [up, down]: [String; 2]| lines.push(row(label, &up, &down));
    add("offered", per_s(|direction| direction.link.offered));
    add("sent on", per_s(|direction| direction.sent));
    add(
        "on the way",
        [now.up, now.down].map(|direction| direction.in_flight.to_string()),
    );
    for (label, of) in DELAYS {
        let shown = |delays: &Quantiles| {
            let ms = of(delays).as_secs_f64() * 1e3;
            (delays.count > 0).then(|| format!("{ms:.2} ms"))
        };
        let shown = |delays: Quantiles| shown(&delays).unwrap_or_else(|| "-".to_owned());
        add(label, moments.delays.map(shown));
    }
    for (label, count) in ROWS.into_iter().skip(ALWAYS) {
        let of = [&now.up, &now.down].map(|direction| {
            let offered = direction.link.offered.packets.max(1) as f64;
            (count(direction).packets, offered)
        });
        if of.iter().any(|(packets, _)| *packets > 0) {
            let shown = |(packets, offered): (u64, f64)| {
                format!("{packets} ({:.2} %)", 100.0 * packets as f64 / offered)
            };
            add(label, of.map(shown));
        }
    }
    let late = &now.lateness;
    let host = format!(
        "released late        p50 {:.0} us, p99.9 {:.0} us",
        late.p50_us, late.p999_us
    );
    lines.push(String::new());
    lines.push(host);
    let unread = now.overflows_up + now.overflows_down;
    if unread > 0 {
        lines.push(format!("not read in time     {unread}"));
    }
    lines.push(format!("masters              {}", now.clients));
    if late.degraded() {
        lines.push(DEGRADED.to_owned());
    }
    lines
}

/// A delay of a window.
type Delay = fn(&Quantiles) -> Duration;

/// The delays that are shown.
const DELAYS: [(&str, Delay); 4] = [
    ("delay p50", |delays| delays.p50),
    ("      p99", |delays| delays.p99),
    ("      p99.9", |delays| delays.p999),
    ("      longest", |delays| delays.max),
];

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;

    fn moments() -> Moments {
        let mut now = RelaySnapshot::default();
        let tally = |packets| Tally {
            packets,
            bytes: 100 * packets,
        };
        now.up.link.offered = tally(2000);
        now.up.sent = tally(1970);
        now.up.in_flight = 10;
        now.up.link.dropped.loss = tally(15);
        now.up.link.dropped.queue = tally(5);
        now.clients = 1;
        let mut before = now;
        before.up.link.offered = tally(1000);
        before.up.sent = tally(980);
        let ms = Duration::from_millis;
        let delays = Quantiles {
            count: 990,
            p50: ms(50),
            p99: ms(55),
            p999: ms(56),
            max: ms(57),
        };
        Moments {
            elapsed: ms(2000),
            window: ms(1000),
            before,
            now,
            delays: [delays, Quantiles::default()],
        }
    }

    fn caption() -> Caption {
        Caption {
            path: "127.0.0.1:4434 to 127.0.0.1:4433".to_owned(),
            duration: Some(Duration::from_secs(60)),
        }
    }

    #[test]
    fn both_directions_show_rates_of_the_window_delays_and_losses_by_cause() {
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
        let messages = ["a message".to_owned()];
        let draw = |frame: &mut Frame<'_>| render(frame, &caption(), &moments(), &messages);
        terminal.draw(draw).unwrap();
        let shown = terminal.backend().to_string();
        for part in [
            "mmt netem   2.0 of 60 s   q ends it",
            "127.0.0.1:4434 to 127.0.0.1:4433",
            "offered                1000 /s 800 kbit/s",
            "sent on                 990 /s 792 kbit/s",
            "on the way                             10                    0",
            "delay p50                        50.00 ms                    -",
            "      longest                    57.00 ms",
            "lost on the link              15 (0.75 %)           0 (0.00 %)",
            "queue full                     5 (0.25 %)",
            "masters              1",
            "a message",
        ] {
            assert!(shown.contains(part), "{part}\n{shown}");
        }
        assert!(
            !shown.contains("CoDel"),
            "what never happened is left out\n{shown}"
        );
    }

    #[test]
    fn no_size_of_terminal_is_too_small() {
        for (width, height) in [(1, 1), (10, 5), (300, 100)] {
            let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
            let draw = |frame: &mut Frame<'_>| render(frame, &caption(), &moments(), &[]);
            terminal.draw(draw).unwrap();
        }
    }
}
