//! The dashboard: the scene in the left half of the screen; in the right one charts of the forces, as far as there is room,
//! and the numbers; messages at the bottom.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Sparkline};

use super::panels;
use super::scene::render_scene;
use super::screen::MESSAGES_MAX;
use super::{Caption, History, Snapshot};

/// A terminal of fewer lines has one line of head.
const LOW: u16 = 20;
/// A terminal of fewer columns has no place for who touches: the forces show it.
const NARROW: u16 = 75;
/// Lines of the terminal for one of a message.
const LINES_PER_MESSAGE: u16 = 10;
/// The least height of a chart, lines: its title and the bars.
const CHART_HEIGHT: u16 = 2;
/// The least full scale of a force chart, N: noise shall not fill it.
const SCALE_MIN_N: f64 = 1.0;

/// A number of a snapshot, if it has one.
type Reading = fn(&Snapshot) -> Option<f64>;

/// The charts: name, what is drawn, colour.
const CHARTS: [(&str, Reading, Color); 3] = [
    ("|f_s| slave", Snapshot::f_s, Color::Green),
    ("|f_m| master", Snapshot::f_m, Color::Cyan),
    ("|error|", Snapshot::error, Color::Red),
];

/// Draws everything.
pub(crate) fn render(
    frame: &mut Frame<'_>,
    caption: &Caption,
    history: &History,
    messages: &[String],
) {
    let area = frame.area();
    let head = if area.height < LOW { 1 } else { 2 };
    let shown = (messages.len().min(MESSAGES_MAX) as u16).min(area.height / LINES_PER_MESSAGE);
    let rows = [
        Constraint::Length(head),
        Constraint::Min(0),
        Constraint::Length(shown),
    ];
    let [head, middle, bottom] = Layout::vertical(rows).areas(area);
    let halves = [Constraint::Fill(1), Constraint::Fill(1)];
    let [left, right] = Layout::horizontal(halves).areas(middle);
    render_head(frame, head, caption, &history.newest());
    render_scene(frame, left, &history.newest());
    render_numbers(frame, right, caption, history);
    let newest = messages.iter().rev().take(usize::from(shown)).rev();
    let lines: Vec<Line<'_>> = newest.map(|text| Line::from(text.as_str())).collect();
    frame.render_widget(Paragraph::new(lines), bottom);
}

fn render_head(frame: &mut Frame<'_>, area: Rect, caption: &Caption, now: &Snapshot) {
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let of = caption
        .duration_s
        .map_or_else(String::new, |s| format!(" of {s:.0}"));
    let contact = |side: &str, touches: Option<bool>| match touches {
        Some(true) => format!("   {side} touches"),
        Some(false) => format!("   {side} free"),
        None => String::new(),
    };
    let wide = area.width >= NARROW;
    let master = now.master.filter(|_| wide).map(|master| master.in_contact);
    let slave = now.slave.map(|slave| slave.in_contact);
    let slave = slave.or(now.observer.map(|observer| observer.in_contact));
    let keys = if now.observer.is_some() {
        "   q ends"
    } else {
        "   q ends, space stops"
    };
    let first = Line::from(vec![
        Span::styled(format!("mmt {}", caption.command), bold),
        Span::raw(format!("   {:.1}{of} s", now.elapsed_s())),
        Span::raw(contact("master", master)),
        Span::raw(contact("slave", slave.filter(|_| wide))),
        Span::styled(keys, Style::new().fg(Color::DarkGray)),
    ]);
    let second = Line::from(caption.setting.as_str()).style(Style::new().fg(Color::DarkGray));
    frame.render_widget(Paragraph::new(vec![first, second]), area);
}

/// The numbers, and above them the charts where there is room; else the forces in a line.
fn render_numbers(frame: &mut Frame<'_>, area: Rect, caption: &Caption, history: &History) {
    let now = history.newest();
    let about = |updates: Vec<String>| {
        let lines = [panels::link(caption, &now), panels::model(caption, &now)];
        let lines = lines.into_iter().flatten().chain(updates);
        lines.chain([panels::haptic_loop(&now)]).collect()
    };
    let words = || panels::updates_in_words(history, usize::from(area.width));
    let room = area
        .height
        .saturating_sub(CHARTS.len() as u16 * CHART_HEIGHT);
    let mut lines: Vec<String> = about(panels::updates(history));
    if lines.len() > usize::from(room) {
        lines = about(words());
    }
    let has_charts = lines.len() <= usize::from(room);
    if !has_charts {
        lines.insert(0, panels::forces(&now));
    }
    let parts = [Constraint::Fill(1), Constraint::Length(lines.len() as u16)];
    let [charts, numbers] = Layout::vertical(parts).areas(area);
    if has_charts {
        render_charts(frame, charts, history);
    }
    let lines: Vec<Line<'_>> = lines.into_iter().map(Line::from).collect();
    frame.render_widget(Paragraph::new(lines), numbers);
}

fn render_charts(frame: &mut Frame<'_>, area: Rect, history: &History) {
    let forces = [Snapshot::f_s as Reading, Snapshot::f_m];
    let wide = usize::from(area.width);
    let readings = forces.map(|of| history.last(wide, of));
    let largest = readings.iter().flatten().flatten().copied();
    let scale_n = largest.fold(SCALE_MIN_N, f64::max);
    let areas = Layout::vertical(CHARTS.map(|_| Constraint::Fill(1))).split(area);
    for ((name, of, colour), area) in CHARTS.into_iter().zip(areas.iter()) {
        let now = history.newest();
        let value = of(&now).map_or_else(|| "-".to_owned(), |n| format!("{n:.2} N"));
        let title = format!("{name} {value}  (of {scale_n:.1} N)");
        let data = history.last(wide, of).into_iter().map(centinewtons);
        let chart = Sparkline::default()
            .block(Block::new().title(title))
            .max(centinewtons(Some(scale_n)).unwrap_or(1))
            .style(Style::new().fg(colour))
            .data(data.collect::<Vec<Option<u64>>>());
        frame.render_widget(chart, *area);
    }
}

/// The chart takes whole numbers; the cast saturates.
fn centinewtons(force_n: Option<f64>) -> Option<u64> {
    force_n.map(|force| (force * 100.0) as u64)
}
