//! The dashboard: charts of the forces and the scene above, panels of numbers below, messages at the bottom.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Sparkline};

use super::panels::{link_panel, loop_panel, model_panel, update_panel};
use super::scene::render_scene;
use super::screen::MESSAGES_MAX;
use super::{Caption, History, Snapshot};

/// Height of a panel of numbers, lines.
const PANEL_HEIGHT: u16 = 10;
/// Widths of the panels; the last one takes what is left.
const UPDATES_WIDTH: u16 = 25;
const MODEL_WIDTH: u16 = 32;
/// Width of the scene beside the charts.
const SCENE_WIDTH: u16 = 30;
/// The least full scale of a force chart, N: noise shall not fill it.
const SCALE_MIN_N: f64 = 1.0;

/// A number of a snapshot, if it has one.
type Reading = fn(&Snapshot) -> Option<f64>;

/// The charts: name, what is drawn, colour.
const CHARTS: [(&str, Reading, Color); 3] = [
    ("|f_s|  measured at the slave", Snapshot::f_s, Color::Green),
    ("|f_m|  rendered by the master", Snapshot::f_m, Color::Cyan),
    (
        "|error|  f_s - f_m of one sample",
        Snapshot::error,
        Color::Red,
    ),
];

/// Draws everything.
pub(crate) fn render(
    frame: &mut Frame<'_>,
    caption: &Caption,
    history: &History,
    messages: &[String],
) {
    let below = if messages.is_empty() {
        0
    } else {
        MESSAGES_MAX as u16
    };
    let rows = Layout::vertical([
        Constraint::Length(2),
        Constraint::Min(6),
        Constraint::Length(PANEL_HEIGHT),
        Constraint::Length(below),
    ]);
    let [head, charts, panels, bottom] = rows.areas(frame.area());
    render_head(frame, head, caption, &history.newest());
    let [charts, scene] =
        Layout::horizontal([Constraint::Min(0), Constraint::Length(SCENE_WIDTH)]).areas(charts);
    render_charts(frame, charts, history);
    render_scene(frame, scene, history.newest().master.as_ref());
    render_panels(frame, panels, caption, history);
    let lines: Vec<Line<'_>> = messages
        .iter()
        .map(|text| Line::from(text.as_str()))
        .collect();
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
    let first = Line::from(vec![
        Span::styled(format!("mmt {}", caption.command), bold),
        Span::raw(format!("   {:.1}{of} s", now.elapsed_s())),
        Span::raw(contact(
            "master",
            now.master.map(|master| master.in_contact),
        )),
        Span::raw(contact("slave", now.slave.map(|slave| slave.in_contact))),
        Span::styled("   q ends, space stops", Style::new().fg(Color::DarkGray)),
    ]);
    let second = Line::from(caption.setting.as_str()).style(Style::new().fg(Color::DarkGray));
    frame.render_widget(Paragraph::new(vec![first, second]), area);
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
        let title = format!("{name}: {value}   (full scale {scale_n:.1} N)");
        let data = history.last(wide, of).into_iter().map(centinewtons);
        let chart = Sparkline::default()
            .block(Block::new().title(title))
            .max(centinewtons(Some(scale_n)).unwrap_or(1))
            .style(Style::new().fg(colour))
            .data(data.collect::<Vec<Option<u64>>>());
        frame.render_widget(chart, *area);
    }
}

/// The chart wants whole numbers; the cast saturates.
fn centinewtons(force_n: Option<f64>) -> Option<u64> {
    force_n.map(|force| (force * 100.0) as u64)
}

fn render_panels(frame: &mut Frame<'_>, area: Rect, caption: &Caption, history: &History) {
    let [updates, model, right] = Layout::horizontal([
        Constraint::Length(UPDATES_WIDTH),
        Constraint::Length(MODEL_WIDTH),
        Constraint::Min(0),
    ])
    .areas(area);
    let [link, loops] = Layout::vertical([Constraint::Length(6), Constraint::Fill(1)]).areas(right);
    for (panel, area) in [
        (update_panel(history), updates),
        (model_panel(caption, &history.newest()), model),
        (link_panel(caption, &history.newest()), link),
        (loop_panel(&history.newest()), loops),
    ] {
        frame.render_widget(panel, area);
    }
}
