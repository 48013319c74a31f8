//! What the reference motions promise, for the study's body and for odd ones.

use super::reference::{FinePatch, Line, STEPS};
use super::*;

fn body(mass_kg: f64, side_m: f64, friction_coefficient: f64, damping_ns_per_m: f64) -> Body {
    Body {
        mass_kg,
        side_m,
        friction_coefficient,
        damping_ns_per_m,
    }
}

fn shown(body: &Body) -> Vec<PhysicsCase> {
    let rows = cases(body).unwrap();
    println!("{body:?}");
    for row in &rows {
        println!(
            "  {:13} {:>11.6} {:>11.6} {:3} {:8.4} %  {:?}: {}",
            row.case,
            row.reference,
            row.measured,
            row.unit,
            100.0 * row.relative_error,
            row.source,
            row.motion
        );
    }
    rows
}

#[test]
fn the_study_body_moves_as_the_references_say() {
    // what the model study states for 0.7 kg, 0.36 m, mu 0.3
    let study = [
        ("push", 0.34641),
        ("push-45", 0.34641),
        ("stop", 0.04247),
        ("spin-down", 0.2664),
        ("coast-x", 0.03074),
        ("coast-theta", 0.29449),
        ("wrench-x", 0.12747),
        ("wrench-theta", -0.46979),
        ("hold-0.5c", 0.0),
        ("hold-0.9c", 0.0),
    ];
    let rows = shown(&Body::DEFAULT);
    assert_eq!(rows.len(), study.len());
    for (row, (case, value)) in rows.iter().zip(study) {
        assert_eq!(row.case, case);
        assert!(
            (row.reference - value).abs() <= 2e-4 * value.abs(),
            "{row:?}"
        );
        assert!(row.relative_error <= 0.012, "{row:?}");
        if case.starts_with("hold") {
            assert!(row.measured < 1e-6, "{row:?}");
        }
    }
    assert_eq!(rows[0].motion, "4.0000 N at 0 degrees for 0.500 s");
    assert_eq!(
        rows[6].motion,
        "3.0000 N along x with -0.18000 N m for 0.400 s"
    );
}

#[test]
fn odd_bodies_move_as_the_references_say() {
    for body in [
        body(0.7, 0.36, 0.3, 3.0),
        body(0.053, 0.05, 0.05, 0.0),
        body(20.0, 1.0, 0.05, 0.0),
        body(0.7, 0.36, 0.01, 0.0),
        body(10.0, 1.0, 1.5, 30.0),
        body(1.3, 0.2, 0.8, 1.0),
        body(0.06, 1.0, 0.3, 0.1),
    ] {
        shown(&body);
        for motion in ReferenceMotion::all(&body.checked().unwrap()) {
            let run = MeasuredMotion::of(&motion).unwrap();
            for kind in motion.kinds() {
                let row = case(&motion, &run, *kind);
                // a period of 1 ms is that much of a motion that is over soon
                let soon = 1.1e-3 / run.reference_seconds;
                assert!(row.relative_error <= 0.012 + soon, "{row:?} of {body:?}");
                if row.reference == 0.0 {
                    assert!(row.measured.abs() < 1e-6, "{row:?}");
                }
            }
        }
    }
}

#[test]
fn the_smallest_and_the_heaviest_body_have_every_row() {
    for body in [
        body(0.0501, 0.05, 1.5, 0.0),
        body(0.07, 0.05, 0.05, 30.0),
        body(13.5, 1.0, 1.5, 30.0),
        body(20.0, 0.05, 0.05, 30.0),
        body(50.0, 2.0, 0.3, 200.0),
        body(0.06, 0.02, 5.0, 0.0),
    ] {
        let rows = shown(&body);
        assert_eq!(rows.len(), 10);
        for row in rows {
            let numbers = [row.reference, row.measured, row.relative_error];
            assert!(numbers.iter().all(|number| number.is_finite()), "{row:?}");
            assert!(row.relative_error < 0.5, "{row:?} of {body:?}");
        }
    }
}

#[test]
fn an_environment_that_is_wrong_by_a_tenth_shows() {
    let mut dynamics = Body::DEFAULT.checked().unwrap();
    dynamics.config.friction_coefficient *= 1.1;
    for motion in ReferenceMotion::all(&dynamics) {
        let run = MeasuredMotion::of(&motion).unwrap();
        for kind in motion.kinds() {
            let row = case(&motion, &run, *kind);
            let held = row.case.starts_with("hold");
            assert!(held || row.relative_error > 0.05, "{row:?}");
        }
    }
}

#[test]
fn a_body_that_is_not_accepted_is_named() {
    let error = |body: Body| cases(&body).unwrap_err().to_string();
    assert!(error(body(f64::NAN, 0.36, 0.3, 0.0)).contains("mass is not a finite number"));
    assert!(error(body(0.7, 0.0, 0.3, 0.0)).contains("side 0"));
    assert!(error(body(0.7, 0.36, f64::INFINITY, 0.0)).contains("friction coefficient inf"));
    assert!(error(body(0.7, 0.36, 0.3, -1.0)).contains("damping"));
    assert!(error(body(0.7, 0.36, 0.0, 0.0)).contains("friction coefficient 0 is too small"));
    assert!(traces(&body(0.7, 0.36, 0.3, f64::NAN)).is_err());
}

#[test]
fn traces_run_from_the_start_to_what_the_table_shows() {
    let body = body(0.7, 0.36, 0.3, 1.0);
    let (rows, traces) = (cases(&body).unwrap(), traces(&body).unwrap());
    assert_eq!(rows.len(), traces.len());
    for (row, trace) in rows.iter().zip(&traces) {
        assert_eq!(row.case, trace.case);
        assert!(
            (2..=401).contains(&trace.points.len()),
            "{}",
            trace.points.len()
        );
        assert!(trace.points.is_sorted_by(|a, b| a.t_s < b.t_s));
        let (first, last) = (trace.points[0], trace.points[trace.points.len() - 1]);
        assert_eq!(
            (first.t_s, first.measured, first.reference),
            (0.0, 0.0, 0.0)
        );
        if row.unit == "s" {
            assert!((last.t_s - row.measured).abs() <= 1e-3);
        } else {
            assert_eq!(last.measured, row.measured);
            let near = 2e-3 * row.reference.abs();
            assert!(
                (last.reference - row.reference).abs() <= near,
                "{row:?} {last:?}"
            );
        }
    }
}

#[test]
fn the_closed_form_solves_its_equation_with_and_without_damping() {
    for b in [0.0, 1e-7, 1e-3, 0.1, 3.0, 30.0] {
        for (f, v) in [(1.94, 0.0), (-2.06, 0.5)] {
            let line = Line { m: 0.7, b, f, v };
            let end = if f < 0.0 { line.rest_s() } else { 0.5 };
            // the midpoint rule, independent of any closed form
            let (n, mut x, mut speed) = (20_000, 0.0, v);
            let dt = end / f64::from(n);
            for _ in 0..n {
                let middle = speed + 0.5 * dt * (f - b * speed) / 0.7;
                speed += dt * (f - b * middle) / 0.7;
                x += dt * middle;
            }
            assert!(
                (line.at(end) / x - 1.0).abs() < 1e-7,
                "b {b}: {} {x}",
                line.at(end)
            );
            assert!(f > 0.0 || speed.abs() < 1e-7, "b {b}: {speed} at rest");
        }
    }
}

#[test]
fn the_fine_patch_agrees_with_closed_forms_and_with_itself_at_half_the_steps() {
    for damping in [0.0, 3.0] {
        let dynamics = body(0.7, 0.36, 0.3, damping).checked().unwrap();
        let coast = FinePatch::new(&dynamics, 0.0, 0.0);
        let end = |start, steps| *coast.run(start, 0.4, steps).last().unwrap();
        let slide = Line {
            m: dynamics.m,
            b: dynamics.b,
            f: -dynamics.c,
            v: 0.5,
        };
        let (t, state) = end([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], STEPS);
        assert!((t - slide.rest_s()).abs() < 2e-4, "{t} {}", slide.rest_s());
        assert!((state[0] / slide.at(slide.rest_s()) - 1.0).abs() < 1e-5);
        let turn = Line {
            m: dynamics.inertia,
            b: dynamics.b_r,
            f: -dynamics.e,
            v: 5.0,
        };
        let (_, state) = end([0.0, 0.0, 0.0, 0.0, 0.0, 5.0], STEPS);
        assert!((state[2] / turn.at(turn.rest_s()) - 1.0).abs() < 5e-4);
        let both = [0.0, 0.0, 0.0, 0.3, 0.0, 3.0];
        let (fine, coarse) = (end(both, STEPS).1, end(both, STEPS / 2).1);
        let wrench = FinePatch::new(&dynamics, 3.0, -0.18);
        let pushed = |steps| wrench.run([0.0; 6], 0.4, steps).last().unwrap().1;
        let (pushed, coarsely) = (pushed(STEPS), pushed(STEPS / 2));
        for (a, b) in [
            (fine[0], coarse[0]),
            (fine[2], coarse[2]),
            (pushed[0], coarsely[0]),
            (pushed[2], coarsely[2]),
        ] {
            println!("{a} {b} {:.1e}", a / b - 1.0);
            assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        }
    }
}
