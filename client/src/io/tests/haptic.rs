//! What the haptic loop promises, ticked by hand.

use mmt_shared::io::schedule::Tick;
use mmt_shared::io::truth::{self, TruthReceiver};
use mmt_shared::io::wake::{self, Wakeup};
use mmt_shared::metrics::PoseError;
use mmt_shared::model::geometry::Pose;
use mmt_shared::model::update::Update;
use mmt_shared::time::Time;

use super::fake::{state, welcome_for};
use super::*;
use crate::io::haptic::{HapticLoop, HapticParts, HapticPort, RING_SAMPLES};
use crate::limiter::{ForceLimiter, RAMP_TICKS};
use crate::master::Master;

const COUPLING: Coupling = Coupling {
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 10.0,
};

/// A loop whose hand stays 2 mm inside of the box, so that there is a force.
fn pressing(duration: Option<Duration>) -> (HapticLoop, HapticPort, Wakeup) {
    along("0,-0.21,0\n0.1,-0.198,0\n1000,-0.198,0\n", duration, None)
}

/// A loop whose hand follows a path, with the truth at hand or without.
fn along(
    path: &str,
    duration: Option<Duration>,
    truth: Option<TruthReceiver>,
) -> (HapticLoop, HapticPort, Wakeup) {
    let limiter = ForceLimiter::try_new(DeviceProfile::default().limits()).unwrap();
    let path = Trace::from_csv(&format!("t_s,x_m,y_m\n{path}")).unwrap();
    let parts = HapticParts {
        master: Master::new(&welcome_for(COUPLING), limiter),
        operator: Operator::Trace(path),
        duration,
        samples_per_wake: 10,
        truth,
    };
    let (waker, wakeup) = wake::pair().unwrap();
    let (haptic, port) = HapticLoop::new(parts, Time::ZERO, waker);
    (haptic, port, wakeup)
}

fn tick(index: u64) -> Tick {
    Tick {
        index,
        deadline: Time::from_millis(index + 1),
        skipped: 0,
        lateness: Duration::ZERO,
    }
}

fn update(sequence: u32) -> Update {
    Update {
        sequence,
        cause: Cause::Timer,
        answers: Time::from_millis(1),
        slave_in_contact: true,
        state: state(&COUPLING),
    }
}

#[tokio::test]
async fn the_model_of_a_stamp_is_held_against_the_truth_of_that_stamp_and_without_truth_nothing_is()
{
    let (mut blind, _port, _wakeup) = pressing(None);
    assert!(blind.tick(tick(0)).is_continue());
    assert_eq!(blind.outcome().pose, PoseError::default());
    let (mut truth, receiver) = truth::pair();
    let (mut haptic, _port, _wakeup) =
        along("0,-0.21,0\n1,-0.10,0\n9,-0.10,0\n", None, Some(receiver));
    for index in 0..600 {
        assert!(haptic.tick(tick(index)).is_continue());
    }
    let model = haptic.master().model();
    let then = model
        .history()
        .at(Time::from_millis(400))
        .unwrap()
        .motion
        .pose;
    let now = model.state().pose;
    assert!(
        (now.position - then.position).norm() > 1e-3,
        "it was pushed"
    );
    let off = Pose::new(then.position.x + 0.003, then.position.y, then.angle);
    truth.send(Time::from_millis(400), off);
    assert!(haptic.tick(tick(600)).is_continue());
    let outcome = haptic.outcome();
    assert!((outcome.pose.position_rms_m().unwrap() - 0.003).abs() < 1e-12);
    assert!(outcome.observer_min_j <= 0.0 && outcome.energy_injected_j == 0.0);
}

/// Ticks until the loop breaks; the slave is heard all the time. Returns the number of ticks.
fn run_out(haptic: &mut HapticLoop, port: &mut HapticPort) -> u64 {
    let broke = |&index: &u64| {
        port.heard(Time::from_millis(index + 1));
        while port.pop().is_some() {}
        haptic.tick(tick(index)).is_break()
    };
    (0..100_000).find(broke).unwrap() + 1
}

#[tokio::test]
async fn after_its_duration_the_loop_goes_on_until_no_force_is_left() {
    let (mut haptic, mut port, _wakeup) = pressing(Some(TICK * 500));
    let ticks = run_out(&mut haptic, &mut port);
    assert_eq!(ticks, 500 + u64::from(RAMP_TICKS));
    let outcome = haptic.outcome();
    assert_eq!(outcome.end, Some(SessionEnd::DurationOver));
    assert!(outcome.on_hand.largest_n().unwrap() > 0.5, "it was pressed");
    let last = port.look();
    assert_eq!(last.hand_force, Vec2::zeros());
    assert!(last.f_m.norm() > 0.5, "and still would be: {:?}", last.f_m);
}

#[tokio::test]
async fn a_loop_that_was_asked_to_end_has_no_reason_of_its_own() {
    let (mut haptic, mut port, _wakeup) = pressing(None);
    assert!(haptic.tick(tick(0)).is_continue());
    port.release();
    run_out(&mut haptic, &mut port);
    assert_eq!(haptic.outcome().end, None);
}

#[tokio::test]
async fn silence_of_one_second_releases_and_one_tick_less_does_not() {
    let (mut haptic, mut port, _wakeup) = pressing(None);
    for index in 0..999 {
        assert!(haptic.tick(tick(index)).is_continue());
        while port.pop().is_some() {}
    }
    assert_eq!(haptic.outcome().end, None);
    assert!(haptic.tick(tick(999)).is_continue());
    assert_eq!(haptic.outcome().end, Some(SessionEnd::LinkSilent));
    // being heard again does not bring the force back
    let ticks = (1000..2000).find(|&index| {
        port.heard(Time::from_millis(index + 1));
        haptic.tick(tick(index)).is_break()
    });
    assert!(ticks.unwrap() <= 1000 + u64::from(RAMP_TICKS));
}

#[tokio::test]
async fn only_the_newest_update_is_applied_and_the_overtaken_are_counted() {
    let (mut haptic, mut port, _wakeup) = pressing(None);
    assert!(haptic.tick(tick(0)).is_continue());
    for sequence in 1..=3 {
        port.offer(&update(sequence));
    }
    assert!(port.untaken());
    assert!(haptic.tick(tick(1)).is_continue());
    assert!(haptic.tick(tick(2)).is_continue());
    assert_eq!(haptic.outcome().applied, 1);
    assert_eq!(port.superseded(), 2);
    assert!(!port.untaken());
    assert!(haptic.outcome().age.mean().is_some());
}

#[tokio::test]
async fn a_full_ring_drops_the_new_sample_and_counts_it() {
    let (mut haptic, mut port, _wakeup) = pressing(None);
    for index in 0..RING_SAMPLES as u64 + 7 {
        port.heard(Time::from_millis(index + 1));
        assert!(haptic.tick(tick(index)).is_continue());
    }
    assert_eq!(haptic.outcome().samples_dropped, 7);
    let first = port.pop().unwrap();
    assert_eq!(first.sample.stamp, Time::from_millis(1));
    assert_eq!((0..).map_while(|_| port.pop()).count(), RING_SAMPLES - 1);
}

#[tokio::test]
async fn the_network_is_woken_once_for_a_commands_samples() {
    let (mut haptic, mut port, mut wakeup) = pressing(None);
    let soon = Duration::from_millis(20);
    (0..9).for_each(|index| assert!(haptic.tick(tick(index)).is_continue()));
    assert!(timeout(soon, wakeup.wait()).await.is_err());
    assert!(haptic.tick(tick(9)).is_continue());
    timeout(FOR_EVER, wakeup.wait()).await.unwrap().unwrap();
    assert_eq!((0..).map_while(|_| port.pop()).count(), 10);
}

#[tokio::test]
async fn a_panic_in_the_loop_is_noticed_and_hangs_nobody() {
    let (haptic, port, mut wakeup) = pressing(None);
    let gone = haptic.gone();
    assert!(!port.ended());
    let thread = std::thread::spawn(move || {
        let _gone = gone;
        panic!("meant to happen in this test");
    });
    while !port.ended() {
        timeout(FOR_EVER, wakeup.wait()).await.unwrap().unwrap();
    }
    assert!(thread.join().is_err());
}
