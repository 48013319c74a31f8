//! What a figure promises.

use super::*;

fn figure(dots: Vec<Dot>) -> Figure {
    Figure {
        panels: vec![Panel {
            title: "Title".to_owned(),
            x: Axis::log("x, 1/s"),
            y: Axis::linear("y"),
            series: vec![
                Series::line("a curve", Colour::BLUE, dots.clone()).marked(Mark::Circle),
                Series::line("dashed", Colour::GREEN, dots.clone()).stroked(Stroke::Dashed, 1),
                Series::line("", Colour::SKY, dots).stroked(Stroke::Events, 1),
            ],
            legend: Some(Legend::UpperRight),
        }],
        columns: 2,
        panel_size: (400, 300),
    }
}

#[test]
fn the_same_data_give_the_same_bytes_and_every_text_is_there() {
    let mut dots = vec![Dot::at(1.0, 2.0), Dot::at(10.0, 1.0), Dot::at(100.0, 0.5)];
    dots[1].y_interval = Some((0.8, 1.2));
    dots[1].note = Some("10 %".to_owned());
    let svg = figure(dots.clone()).draw().unwrap();
    assert_eq!(svg, figure(dots).draw().unwrap());
    for text in ["Title", "x, 1/s", "a curve", "dashed", "10 %", "100"] {
        assert!(svg.contains(text), "{text}");
    }
    assert!(svg.trim_end().ends_with("</svg>"));
}

#[test]
fn things_without_an_order_stand_under_their_names() {
    let names: Vec<String> = (0..11).map(|n| format!("thing {n}")).collect();
    let named = Axis::named(names.clone());
    for axis in [named.clone(), named.over(-0.6..13.2)] {
        let panel = Panel::new("Title", Axis::log("x"), axis, []);
        let figure = Figure::of_alike([panel], Legend::UpperRight, 1, (400, 300));
        let svg = figure.draw().unwrap();
        for name in &names {
            assert_eq!(svg.matches(&format!("\n{name}\n")).count(), 1, "{name}");
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_left_out_and_breaks_nothing() {
    for dots in [
        vec![],
        vec![Dot::at(0.0, 1.0)],
        vec![
            Dot::at(-1.0, f64::NAN),
            Dot::at(5.0, 1.0),
            Dot::at(6.0, f64::INFINITY),
        ],
        vec![Dot::at(5.0, 5.0)],
    ] {
        assert!(figure(dots).draw().unwrap().contains("</svg>"));
    }
    let empty = Figure {
        panels: Vec::new(),
        columns: 1,
        panel_size: (100, 100),
    };
    assert!(empty.draw().unwrap().contains("</svg>"));
}

#[test]
fn panels_that_look_alike_share_the_legend_of_the_first() {
    let panel = || Panel::new("Title", Axis::linear("x"), Axis::linear("y"), []);
    let figure = Figure::of_alike([panel(), panel()], Legend::LowerLeft, 2, (100, 100));
    let legends = figure.panels.into_iter().map(|panel| panel.legend);
    assert!(legends.eq([Some(Legend::LowerLeft), None]));
    let none = Figure::of_alike([], Legend::LowerLeft, 2, (100, 100));
    assert!(none.panels.is_empty());
}

/// Width of the legend's background, pixels.
fn legend_width(label: &str) -> f64 {
    let dots = vec![Dot::at(1.0, 2.0), Dot::at(10.0, 1.0)];
    let mut figure = figure(Vec::new());
    figure.panels[0].series = vec![Series::line(label, Colour::BLUE, dots)];
    let svg = figure.draw().unwrap();
    let box_of_legend = svg.lines().find(|line| line.contains("opacity=\"0.85\""));
    let (_, width) = box_of_legend.unwrap().split_once("width=\"").unwrap();
    width.split_once('"').unwrap().0.parse().unwrap()
}

#[test]
fn the_legend_has_room_for_letters_half_as_wide_as_the_font_is_high() {
    let letters = legend_width(&"n".repeat(30)) - legend_width(&"n".repeat(10));
    // of 13 pixels
    assert!(letters >= 20.0 * 6.5, "{letters}");
}
