//! What a trial promises.

use super::*;
use crate::setting::{Curve, paper_world};
use crate::world::Given;
use mmt_shared::model::settings::Mode;

fn trial(seconds: u64) -> Trial {
    let config = paper_world(Mode::Recommended, Curve::Hybrid(150).at(0.10)).seeded(3);
    Trial::new(config, Duration::from_secs(seconds))
}

#[test]
fn a_trial_is_a_function_of_itself_and_its_trace_holds_every_sample() {
    let traced = Trial {
        traced: true,
        ..trial(8)
    };
    let (once, again) = (traced.run().unwrap(), traced.run().unwrap());
    assert_eq!(once, again);
    assert_eq!(once.trace.len(), 8000);
    let sent = once.trace.iter().filter(|row| row.update.is_some()).count();
    assert_eq!(sent as u64, once.updates.total());
    assert!(
        once.trace.iter().all(|row| row.f_m.is_some()),
        "without a network no sample is lost"
    );
    let plain = trial(8).run().unwrap();
    assert_eq!((plain.digest, plain.trace.len()), (once.digest, 0));
}

#[test]
fn a_change_of_friction_in_mid_push_is_followed() {
    let changed = Trial {
        change: Some(Change {
            after_pushes: 1,
            contact_s: 1.0,
            to: Alteration::FrictionCoefficient(0.45),
        }),
        ..trial(20)
    };
    let measured = changed.run().unwrap();
    let recovery = measured.recovery.unwrap();
    assert!(
        recovery.worst_error > 0.10,
        "the change was felt: {recovery:?}"
    );
    assert!(recovery.contact_s.unwrap() > 0.0, "{recovery:?}");
    assert_eq!(trial(20).run().unwrap().recovery, None);
}

#[test]
fn a_change_waits_until_the_tool_has_let_go_after_the_push_before() {
    let changed = Trial {
        change: Some(Change {
            after_pushes: 1,
            contact_s: 0.0,
            to: Alteration::FrictionCoefficient(0.45),
        }),
        ..trial(20)
    };
    let mut running = Running::try_new(&changed).unwrap();
    let friction_n = |running: &Running| running.world().slave().environment().truth().c();
    let (first, mut has_let_go) = (friction_n(&running), false);
    while friction_n(&running) == first && !running.is_over() {
        let tick = running.step(Given::default()).unwrap();
        let pushes = running.world().operator().pushes_completed();
        let is_free = tick.slave.is_some_and(|slave| !slave.in_contact);
        has_let_go |= pushes == Some(1) && is_free;
    }
    assert!(!running.is_over() && has_let_go);
}

#[test]
fn a_change_to_an_impossible_object_is_an_error() {
    let impossible = Trial {
        change: Some(Change {
            after_pushes: 0,
            contact_s: 0.1,
            to: Alteration::MassKg(-1.0),
        }),
        ..trial(10)
    };
    let error = impossible.run().unwrap_err().to_string();
    assert!(error.starts_with("change: environment: "), "{error}");
}

#[test]
fn a_trial_that_is_stepped_from_outside_comes_to_the_same_and_its_packets_change_nothing() {
    let link = "delay 20ms 5ms loss 5%".parse().unwrap();
    let trial = Trial::new(WorldConfig::over(link).seeded(2), Duration::from_secs(6));
    let mut running = Running::try_new(&trial).unwrap().with_packets();
    while !running.is_over() {
        running.step(Given::default()).unwrap();
    }
    assert_eq!(running.measured(), trial.run().unwrap());
    let kept = running.world().packets();
    assert!(!kept.is_empty());
    assert_eq!(running.take_packets().read(), kept);
    assert!(running.world().packets().is_empty());
}
