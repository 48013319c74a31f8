//! The four files of recorded real pushes: frames, counts and the achieved errors.
//!
//! The data lie beside the repository. Where they are missing these tests say so loudly, and fail in CI.
#![allow(
    clippy::disallowed_methods,
    clippy::print_stderr,
    clippy::unwrap_used,
    reason = "a test reads the recorded files and the environment variable CI, and fails by panicking"
)]

use mmt_client::operator::trace::Trace;
use mmt_lab::replay::{Law, ReplayConfig, ReplayReport, replay};
use mmt_shared::recording::Recording;
use std::path::Path;

/// A file, and the least upper bounds, with a margin, of what held-out prediction achieves on it:
/// median |F| error of the limit surface at a point, of three points, of the surface from the twist.
const FILES: [(&str, [f64; 3]); 4] = [
    ("black-patch", [0.035, 0.050, 0.055]),
    ("wood-patch", [0.065, 0.095, 0.080]),
    ("black-3pt-10-130", [0.08, 0.08, 0.14]),
    ("black-3pt-30-90", [0.11, 0.11, 0.23]),
];

fn text(name: &str) -> Option<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/cmu-push");
    let path = folder.join(format!("{name}.txt"));
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(text),
        Err(error) => {
            let note = format!("recorded pushes are missing: {}: {error}", path.display());
            assert!(std::env::var("CI").is_err(), "{note}");
            eprintln!("\n*** NOT RUN *** {note}\n");
            None
        }
    }
}

fn each(check: impl Fn(&str, &[f64; 3], &str)) {
    for (name, bounds) in &FILES {
        if let Some(text) = text(name) {
            check(name, bounds, &text);
        }
    }
}

fn replayed(text: &str) -> ReplayReport {
    let recording = Recording::parse(text).unwrap();
    replay(&recording, &ReplayConfig::default(), &mut |_, _| {})
}

#[test]
fn every_file_holds_fifty_pushes_in_each_of_which_force_and_motion_agree() {
    each(|name, _, text| {
        let recording = Recording::parse(text).unwrap();
        assert_eq!(recording.pushes.len(), 50, "{name}");
        for (index, push) in recording.pushes.iter().enumerate() {
            assert!(push.force_times_displacement() > 0.0, "{name} {index}");
            assert!(push.force.len() > 600 && push.finger.len() > 200);
        }
    });
}

#[test]
fn the_finger_ends_on_the_edge_of_the_block() {
    each(|name, _, text| {
        let recording = Recording::parse(text).unwrap();
        for (index, push) in recording.pushes.iter().enumerate() {
            let tip = push.finger.last().unwrap().pose.position;
            let at = push.after.point_to_object(tip) * 1e3;
            // legs at −50 mm, hypotenuse x + y = 50 mm, from the centroid
            let outside = (-50.0 - at.x)
                .max(-50.0 - at.y)
                .max((at.x + at.y - 50.0) * std::f64::consts::FRAC_1_SQRT_2);
            assert!(outside.abs() < 4.0, "{name} {index}: {outside} mm");
        }
    });
}

#[test]
fn held_out_forces_are_predicted_within_the_stated_errors_and_the_surface_beats_the_decoupled_law()
{
    each(|name, bounds, text| {
        let report = replayed(text);
        println!("{name}\n{report}");
        let error = |law| report.held_out(law).unwrap().median_error.unwrap();
        let laws = [Law::LimitSurface, Law::ThreePoint, Law::LimitSurfaceTwist];
        for (law, bound) in laws.into_iter().zip(bounds) {
            assert!(error(law) < *bound, "{name} {law:?}: {}", error(law));
            assert!(error(law) < error(Law::Decoupled), "{name} {law:?}");
        }
    });
}

#[test]
fn replayed_push_by_push_the_surface_errs_less_and_sends_less_than_the_decoupled_law() {
    each(|name, _, text| {
        let report = replayed(text);
        let of = |law| report.law(law).unwrap();
        let (surface, decoupled) = (of(Law::LimitSurface), of(Law::Decoupled));
        assert!(
            surface.force_error.median < decoupled.force_error.median,
            "{name}"
        );
        assert!(
            surface.vector_error.median < decoupled.vector_error.median,
            "{name}"
        );
        assert!(surface.updates.sent < decoupled.updates.sent, "{name}");
    });
}

#[test]
fn every_file_is_also_a_tool_path() {
    each(|name, _, text| {
        let trace = Trace::from_cmu(text, None).unwrap();
        assert!(trace.duration().as_secs() > 300, "{name}");
        let one = Trace::from_cmu(text, Some(49)).unwrap();
        assert!((6..8).contains(&one.duration().as_secs()), "{name}");
    });
}
