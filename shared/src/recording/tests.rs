//! A recording written by hand, and every way in which it can be wrong.

use super::*;
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// One push: the block's corner at (100, 200) mm moves 10 mm along x; the finger's yaw is 90°.
const ONE: &str = "1
100 200 8 1 0 0 0
110 200 8 1 0 0 0
3
1000.00 0.5 0.25
1000.01 0.5 0.25
1000.02 1.5 1.25
2
1000.00 95 230 8 0.70710678118654752 0 0 0.70710678118654752
1000.03 96 230 8 0.70710678118654752 0 0 0.70710678118654752
";

#[test]
fn a_push_written_by_hand_is_read_in_the_stated_frames() {
    let recording = Recording::parse(ONE).unwrap();
    let [push] = recording.pushes.as_slice() else {
        panic!("one push")
    };
    // the reference point is the corner shifted by (50, 50) mm
    assert!((push.before.position - Vec2::new(0.15, 0.25)).norm() < 1e-12);
    assert!((push.after.position - Vec2::new(0.16, 0.25)).norm() < 1e-12);
    // reading (1, 1) above bias: −R (1, 1) = (−√2, 0); turned by 90°: (0, −√2)
    assert_eq!(push.force[0].force, Vec2::zeros());
    assert_eq!(push.force[1].force, Vec2::zeros());
    let expected = Vec2::new(0.0, -std::f64::consts::SQRT_2);
    assert!((push.force[2].force - expected).norm() < 1e-12);
    assert!((push.force[2].t_s - 0.02).abs() < 1e-6);
    assert!((push.finger[1].pose.position - Vec2::new(0.096, 0.23)).norm() < 1e-12);
    assert!((push.finger[1].pose.angle - FRAC_PI_2).abs() < 1e-12);
    assert!((push.duration_s() - 0.02).abs() < 1e-6);
}

#[test]
fn the_reference_point_turns_with_the_block() {
    let turned = ONE.replace("110 200 8 1 0 0 0", "100 200 8 0.70710678 0 0 0.70710678");
    let recording = Recording::parse(&turned).unwrap();
    let after = recording.pushes[0].after;
    assert!((after.position - Vec2::new(0.05, 0.25)).norm() < 1e-6);
    assert!((after.angle - FRAC_PI_2).abs() < 1e-6);
}

#[test]
fn force_along_the_motion_has_positive_work_and_against_it_negative() {
    let along = ONE
        .replace("0.7071067811865475", "0.0000000")
        .replace("0.00000002", "1");
    let along = along.replace(" 1 0 0 1\n", " 0 0 0 1\n");
    // yaw 180°: (−√2, 0) becomes (√2, 0), along +x
    let push = &Recording::parse(&along).unwrap().pushes[0];
    assert!(push.force_times_displacement() > 0.0);
    let against = along.replace("110 200", "90 200");
    assert!(Recording::parse(&against).unwrap().pushes[0].force_times_displacement() < 0.0);
}

#[test]
fn every_cut_of_a_recording_is_refused_with_its_place() {
    let body = ONE.trim_end();
    for cut in 0..body.len() - 1 {
        // cut inside the last number, the text is still a recording only if the quaternion is one
        let Err(error) = Recording::parse(&body[..cut]) else {
            assert!(cut > body.len() - 18, "accepted {cut} bytes");
            continue;
        };
        assert!(error.line >= 1 && error.column >= 1);
    }
}

#[test]
fn a_wrong_word_is_named_with_line_column_and_what_is_expected() {
    let refused = |from: &str, to: &str| {
        let text = ONE.replacen(from, to, 1);
        assert_ne!(text, ONE);
        Recording::parse(&text).unwrap_err().to_string()
    };
    assert_eq!(
        refused("1.5", "x"),
        "line 7, column 9: a force sample's fx should be a number from -10000 to 10000 N, found \"x\""
    );
    assert!(refused("1.5", "NaN").contains("\"NaN\""));
    assert!(refused("1.5", "inf").contains("\"inf\""));
    assert!(refused("110", "1e300").starts_with("line 3, column 1:"));
    assert!(refused("\n3\n", "\n99999999999\n").contains("a whole number from 2 to 1000000"));
    assert!(refused("\n3\n", "\n-1\n").contains("number of force samples"));
    assert!(refused("1000.02", "1000.01").contains("later than the sample before"));
    assert!(refused("8 1 0 0 0", "8 0 0 0 0").contains("norm"));
    assert!(refused("1\n", "2\n").contains("the end of the text"));
    assert!(Recording::parse("").is_err());
    assert!(Recording::parse("0").is_err());
    let longer = format!("{ONE} 7");
    let error = Recording::parse(&longer).unwrap_err().to_string();
    assert!(error.contains("what follows the last push"), "{error}");
}

proptest! {
    #[test]
    fn no_text_makes_the_parser_panic(text in "\\PC*") {
        let _ = Recording::parse(&text);
    }

    #[test]
    fn no_change_of_one_word_makes_the_parser_panic_or_give_a_number_that_is_not_finite(
        index in 0usize..60,
        word in "-?[0-9]{0,20}(\\.[0-9]{0,5})?(e-?[0-9]{1,3})?|nan|inf|-|é",
    ) {
        let mut words: Vec<&str> = ONE.split_whitespace().collect();
        let index = index % words.len();
        words[index] = &word;
        if let Ok(recording) = Recording::parse(&words.join(" ")) {
            for push in &recording.pushes {
                prop_assert!(push.before.is_finite() && push.after.is_finite());
                prop_assert!(push.force.iter().all(|s| s.force.norm().is_finite()));
                prop_assert!(push.finger.iter().all(|s| s.pose.is_finite()));
            }
        }
    }
}
