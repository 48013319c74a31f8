//! The promises of `trace`.

use super::*;
use crate::operator::Operator;
use crate::operator::scripted::View;
use mmt_shared::model::geometry::{BoxFootprint, Pose};
use proptest::prelude::*;

const CSV: &str = "t_s,x_m,y_m\n1.0,0.0,0.0\n2.0,0.2,-0.4\r\n4.0,0.4,0.0\n\n";

const PUSHES: &str = "2
0 0 0 1 0 0 0  5 0 0 1 0 0 0
2  100 0 0  101 1 1
3  100.00 -10 0 0 1 0 0 0  100.03 -9 0 0 1 0 0 0  100.06 -8 0 0 1 0 0 0
5 0 0 1 0 0 0  5 5 0 1 0 0 0
2  50 0 0  51 1 1
2  50.00 -8 50 0 1 0 0 0  50.03 -8 51 0 1 0 0 0
";

fn close(a: Vec2, b: Vec2) -> bool {
    (a - b).norm() < 1e-9
}

#[test]
fn a_path_is_linear_between_samples_and_holds_at_its_ends() {
    let trace = Trace::from_csv(CSV).unwrap();
    let at = |millis| trace.at(Duration::from_millis(millis));
    assert_eq!(trace.duration(), Duration::from_secs(3));
    assert!(close(at(0), Vec2::zeros()));
    assert!(close(at(500), Vec2::new(0.1, -0.2)));
    assert!(close(at(1000), Vec2::new(0.2, -0.4)));
    assert!(close(at(2000), Vec2::new(0.3, -0.2)));
    assert!(close(at(3000), Vec2::new(0.4, 0.0)));
    assert!(close(trace.at(Duration::MAX), Vec2::new(0.4, 0.0)));
}

#[test]
fn a_carried_path_starts_where_it_is_set_and_keeps_its_shape() {
    let trace = Trace::from_csv(CSV).unwrap();
    let start = Vec2::new(-0.3, 0.1);
    let carried = trace.clone().starting_at(start);
    for millis in (0..3500).step_by(70) {
        let elapsed = Duration::from_millis(millis);
        assert!(close(carried.at(elapsed) - start, trace.at(elapsed)));
    }
}

#[test]
fn recorded_pushes_all_lead_towards_the_box_one_after_the_other() {
    let trace = Trace::from_cmu(PUSHES, None).unwrap();
    // 1 s of approach, then 2 mm along x in 0.06 s, then 1 mm that was recorded along y in 0.03 s
    let at = |millis| trace.at(Duration::from_millis(millis));
    assert!(close(at(0), Vec2::zeros()));
    assert!(close(at(1000), Vec2::new(0.060, 0.0)));
    assert!(close(at(1060), Vec2::new(0.061, 0.0)));
    assert!((trace.duration().as_secs_f64() - 1.15).abs() < 1e-6);
    assert!(close(trace.at(Duration::MAX), Vec2::new(0.063, 0.0)));
    let rising = trace.samples().windows(2).all(|pair| pair[0].0 < pair[1].0);
    assert!(rising);
}

#[test]
fn one_push_can_be_taken_by_number_and_a_number_that_is_not_there_is_refused() {
    let trace = Trace::from_cmu(PUSHES, Some(1)).unwrap();
    assert!(close(trace.at(Duration::MAX), Vec2::new(0.061, 0.0)));
    assert!((trace.duration().as_secs_f64() - 1.06).abs() < 1e-6);
    let error = Trace::from_cmu(PUSHES, Some(2)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "there is no push 2: the recording holds pushes 0 to 1"
    );
    assert!(Trace::from_cmu(PUSHES, Some(usize::MAX)).is_err());
}

#[test]
fn every_wrong_line_is_refused_with_its_number_and_reason() {
    let message = |text: &str| Trace::from_csv(text).unwrap_err().to_string();
    assert!(message("t,x,y\n0,0,0").starts_with("line 1: the header should be exactly"));
    assert!(message("").starts_with("line 1"));
    assert!(message("t_s,x_m,y_m\n").starts_with("line 2: there is no sample"));
    assert!(message("t_s,x_m,y_m\n0,0\n").starts_with("line 2: expected 3 fields"));
    assert!(message("t_s,x_m,y_m\n0,0,0,0\n").contains("found 4"));
    assert!(message("t_s,x_m,y_m\n0,0,0\n\n1,0,0").starts_with("line 3: expected 3 fields"));
    for bad in ["x", "nan", "inf", "1e9", ""] {
        let text = message(&format!("t_s,x_m,y_m\n0,0,0\n1,{bad},0\n"));
        assert!(text.starts_with("line 3: x_m should be a number"), "{text}");
    }
    let text = message("t_s,x_m,y_m\n0,0,0\n1,0,0\n1,0,0\n");
    assert_eq!(text, "line 4: t_s 1 is not later than 1 on the line before");
    assert!(Trace::from_cmu("nonsense", None).is_err());
}

proptest! {
    #[test]
    fn no_text_makes_the_importers_panic(text in "\\PC*", lines in "([-0-9.e,]{0,12}\n){0,6}") {
        let _ = Trace::from_csv(&text);
        let _ = Trace::from_cmu(&text, None);
        if let Ok(trace) = Trace::from_csv(&format!("{CSV_HEADER}\n{lines}")) {
            let middle = trace.at(trace.duration() / 2);
            prop_assert!(middle.x.is_finite() && middle.y.is_finite());
        }
    }
}

#[test]
fn a_path_is_led_to_from_the_tool_round_the_box_and_keeps_its_shape() {
    let view = View {
        pose: Pose::new(0.1, 0.0, 0.3),
        footprint: BoxFootprint::square(0.4),
        in_contact: false,
    };
    let trace = Trace::from_csv(CSV)
        .unwrap()
        .starting_at(Vec2::new(-0.3, 0.0));
    let own = |elapsed| Operator::Trace(trace.clone()).led_from(trace.at(elapsed), &view);
    let Operator::Trace(unled) = own(Duration::ZERO) else {
        panic!("another operator")
    };
    assert_eq!(unled, trace, "the tool is there already");

    let tool = Vec2::new(0.5, 0.1);
    let Operator::Trace(led) = Operator::Trace(trace.clone()).led_from(tool, &view) else {
        panic!("another operator")
    };
    assert!(close(led.at(Duration::ZERO), tool));
    let lead = led.duration() - trace.duration();
    for ms in 0..lead.as_millis() as u64 {
        let at = |ms| led.at(Duration::from_millis(ms));
        let distance = view.footprint.nearest(view.pose.point_to_object(at(ms))).1;
        assert!(distance > 0.03, "{distance} m from the box");
        assert!((at(ms + 1) - at(ms)).norm() < 2.1e-4, "0.2 m/s");
    }
    for ms in (0..3000).step_by(100) {
        let elapsed = Duration::from_millis(ms);
        assert!(close(led.at(lead + elapsed), trace.at(elapsed)));
    }
}
