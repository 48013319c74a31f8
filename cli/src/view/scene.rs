//! What the operator sees, from above: the local model with the HIP, and behind it, as a ghost, the remote scene as it
//! last came. An observer sees the object of the newest update in the model's place, and no HIP.
//!
//! The model is where it is felt; the title has the age of the ghost. Draws; moves nothing.

use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2, rotate};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::Block;
use ratatui::widgets::canvas::{Canvas, Context, Line as Stroke, Points};

use super::Snapshot;

/// Half of the width that is shown, m: the box and the way to any of its faces.
const HALF_WIDTH_M: f64 = 0.45;
/// A cell of a terminal is about twice as high as it is wide.
const CELL_HEIGHT: f64 = 2.0;
/// Between two dots of the ghost's outline, cells.
const DOTS_GAP: f64 = 1.5;
const MODEL: Color = Color::Cyan;
const HIP: Color = Color::White;
const GHOST: Color = Color::DarkGray;

/// What is drawn of the local model, or of what stands for it.
struct Model {
    pose: Pose,
    sides: BoxFootprint,
    hip: Option<Vec2>,
}

/// None before the session has begun.
fn model(now: &Snapshot) -> Option<Model> {
    let (pose, sides, hip) = match (&now.master, &now.observer) {
        (Some(master), _) => (master.model, master.footprint, Some(master.hip)),
        (None, Some(observer)) => (observer.model, observer.footprint, None),
        (None, None) => return None,
    };
    sides.map(|sides| Model { pose, sides, hip })
}

/// Draws the scene; nothing before the session has begun.
pub(super) fn render_scene(frame: &mut Frame<'_>, area: Rect, now: &Snapshot) {
    let inner_height = f64::from(area.height.saturating_sub(1).max(1));
    let half_height_m = HALF_WIDTH_M * CELL_HEIGHT * inner_height / f64::from(area.width.max(1));
    let known = model(now);
    // the box stays in the middle
    let middle = known
        .as_ref()
        .map_or(Vec2::zeros(), |model| model.pose.position);
    let canvas = Canvas::default()
        .block(Block::new().title(title(now)))
        .marker(Marker::Braille)
        .x_bounds([middle.x - HALF_WIDTH_M, middle.x + HALF_WIDTH_M])
        .y_bounds([middle.y - half_height_m, middle.y + half_height_m])
        .paint(|context| {
            let Some(Model { pose, sides, hip }) = &known else {
                return;
            };
            if let Some(scene) = now.scene() {
                let gap_m = 2.0 * HALF_WIDTH_M * DOTS_GAP / f64::from(area.width.max(1));
                dots(context, &corners(&scene.object, sides), gap_m);
                mark(context, scene.tool, "+", GHOST);
            }
            context.layer();
            outline(context, &corners(pose, sides));
            if let Some(hip) = hip {
                mark(context, *hip, "o", HIP);
            }
        });
    frame.render_widget(canvas, area);
}

/// Which is which.
fn title(now: &Snapshot) -> Line<'static> {
    let ghost = match now.scene_age_s() {
        Some(age_s) => format!("┄ remote {:.0} ms ago", age_s * 1e3),
        None => "┄ remote -".to_owned(),
    };
    Line::from(vec![
        Span::styled("─ model", Style::new().fg(MODEL)),
        Span::raw("  "),
        Span::styled(ghost, Style::new().fg(GHOST)),
    ])
}

/// The corners of a body, in order.
fn corners(pose: &Pose, sides: &BoxFootprint) -> [Vec2; 4] {
    let BoxFootprint {
        east,
        north,
        west,
        south,
    } = *sides;
    let corners = [
        (east, north),
        (-west, north),
        (-west, -south),
        (east, -south),
    ];
    corners.map(|(x, y)| pose.position + rotate(pose.angle, Vec2::new(x, y)))
}

fn edges(corners: &[Vec2; 4]) -> impl Iterator<Item = (&Vec2, &Vec2)> {
    corners.iter().zip(corners.iter().cycle().skip(1))
}

fn outline(context: &mut Context<'_>, corners: &[Vec2; 4]) {
    for (from, to) in edges(corners) {
        context.draw(&Stroke::new(from.x, from.y, to.x, to.y, MODEL));
    }
}

/// The outline in dots this far apart, m: without colours too it is not the model's.
fn dots(context: &mut Context<'_>, corners: &[Vec2; 4], gap_m: f64) {
    for (from, to) in edges(corners) {
        let count = ((to - from).norm() / gap_m).ceil().max(1.0);
        let at = |n: u32| from + (to - from) * (f64::from(n) / count);
        let places: Vec<(f64, f64)> = (0..count as u32).map(at).map(|at| (at.x, at.y)).collect();
        context.draw(&Points {
            coords: &places,
            color: GHOST,
        });
    }
}

fn mark(context: &mut Context<'_>, at: Vec2, sign: &'static str, colour: Color) {
    let sign = Span::styled(sign, Style::new().fg(colour));
    context.print(at.x, at.y, Line::from(sign));
}
