//! The promises of `slave`.

use mmt_shared::model::sample::HipCounts;
use mmt_shared::model::settings::Mode;
use mmt_shared::time::TICK;

use super::*;

/// The updates of 2 s in which the object, at the edge of the workspace, flies away at 0.5 m/s.
fn updates_of_an_object_that_leaves() -> (Vec<Update>, u64) {
    let mut config = SlaveConfig::of_mode(Mode::Recommended);
    config.trigger.scheme = Scheme::EverySample;
    config.environment.pose = Pose::new(4.9, 0.0, 0.0);
    let coupling = Coupling::for_stiffness(1000.0);
    let mut slave = Slave::try_new(&config, coupling).unwrap();
    let (mut now, mut updates) = (Time::ZERO, Vec::new());
    for _ in 0..2000 {
        now += TICK;
        let flight = Twist::new(0.5, 0.0, 0.0);
        slave.environment_mut().set_twist(flight);
        let sample = HipSample {
            stamp: now,
            hip: HipCounts::nearest(Vec2::new(4.0, 0.0)),
            ..HipSample::default()
        };
        slave.handle_sample(now, &sample, 0);
        updates.extend(slave.tick(now).and_then(|tick| tick.update));
    }
    (updates, slave.clamped_states())
}

#[test]
fn an_object_beyond_the_workspace_is_at_its_edge_and_counted_and_updates_go_on() {
    let (updates, clamped) = updates_of_an_object_that_leaves();
    let x = |update: &Update| update.state.pose().position.x;
    let most = updates.iter().map(x).fold(0.0, f64::max);
    assert_eq!(most, 5.0, "it has left, and no master refuses it");
    let at_the_edge = updates.iter().filter(|update| x(update) == 5.0).count();
    assert!(at_the_edge > 500, "{at_the_edge}");
    assert!(clamped >= at_the_edge as u64, "{clamped}");
    let numbers = updates.iter().map(|update| update.sequence);
    assert!(numbers.eq(1..=updates.len() as u32), "none is left out");
}
