//! What the trigger is given of hand and model.

use super::*;
use crate::trigger::TriggerInput;
use mmt_shared::model::update::Cause;

#[test]
fn the_trigger_knows_whether_the_hip_stands() {
    let mut driven = Driven::new(Mode::Recommended, vec![cube(0.0, 0.7, false)]);
    let mut stands = |hip: Vec2| {
        driven.now += TICK;
        let sample = HipSample {
            stamp: driven.now,
            hip: HipCounts::nearest(hip),
            ..HipSample::default()
        };
        driven.slave.handle_sample(driven.now, &sample, 0);
        let mut seen = None;
        let mut look = |_: Time, input: &TriggerInput| {
            seen = Some(input.hip_stands);
            None
        };
        let scheme = Substitutes {
            scheme: Some(&mut look),
            ..Substitutes::default()
        };
        driven.slave.tick_with(driven.now, scheme);
        seen
    };
    let mut along = |steps: i32, step_m: f64, from_m: f64| -> Vec<bool> {
        let hips = (0..steps).map(|n| Vec2::new(from_m + f64::from(n) * step_m, 0.0));
        hips.filter_map(&mut stands).skip(100).collect()
    };
    let moves = along(300, -1e-4, -0.3);
    assert!(moves.len() > 100 && moves.iter().all(|stands| !stands));
    let rests = along(300, 0.0, -0.33);
    assert!(rests.len() > 100 && rests.iter().all(|stands| *stands));
}

#[test]
fn what_the_model_is_still_turning_to_is_not_sent_again() {
    let mut driven = Driven::new(Mode::Recommended, vec![cube(0.0, 0.7, false)]);
    driven.go((-0.3, 0.1));
    // the first update about a turn, and by how much another one would turn the shadow after that, rad
    let (mut sent, mut turns) = (None, Vec::new());
    while turns.len() < 50 {
        driven.take(driven.hip + Vec2::new(0.15e-3, 0.0));
        let before = driven.slave.shadow.ahead().state().pose.angle;
        let mut scheme = |_, input: &TriggerInput| {
            let due = sent.is_none() && input.turn.abs() > 0.03;
            if sent.is_some() {
                turns.push(input.turn.abs());
            }
            due.then_some(Cause::Timer)
        };
        let others = Substitutes {
            scheme: Some(&mut scheme),
            ..Substitutes::default()
        };
        let tick = driven.slave.tick_with(driven.now, others).unwrap();
        driven.updates.extend(tick.update);
        let timed = tick.update.filter(|update| update.cause == Cause::Timer);
        sent = sent.or(timed.map(|update| update.state.pose().angle - before));
    }
    let turn = sent.unwrap().abs();
    assert!(turn > 0.025, "the model was off by {turn} rad");
    let most = turns.iter().copied().fold(0.0, f64::max);
    assert!(most < 0.010, "{most} rad of {turn} rad are sent again");
}
