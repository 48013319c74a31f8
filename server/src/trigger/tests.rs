//! What the trigger promises.

mod elsewhere;
mod felt;

use mmt_shared::model::geometry::Vec2;

use super::*;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::settings::Mode;
use mmt_shared::rng::Substream;

fn params(m: f64, c: f64) -> ModelParams {
    let coupling = Coupling::for_stiffness(1000.0);
    ModelParams::of_square(m, 3.0, c, 0.36, &coupling).unwrap()
}

fn input(f_s: f64, f_m: f64) -> TriggerInput {
    TriggerInput {
        f_s: Vec2::new(f_s, 0.0),
        f_m: Vec2::new(f_m, 0.0),
        noise_n: 0.0,
        slave_in_contact: true,
        shadow_in_contact: true,
        hip_stands: false,
        sticking: false,
        speed: 0.15,
        acceleration: 0.1,
        force_deviation: 0.0,
        params: params(0.7, 2.06),
        only_friction_holds: false,
        shift: Vec2::zeros(),
        shift_deviation: 0.0,
        turn: 0.0,
        turn_deviation: 0.0,
    }
}

fn trigger(scheme: &str, mode: Mode) -> Trigger {
    Trigger::new(TriggerConfig {
        scheme: scheme.parse().unwrap(),
        ..TriggerConfig::of_mode(mode)
    })
}

/// Causes by tick of a random but seeded run with contact and without.
fn run(scheme: &str) -> Vec<(u64, Cause)> {
    let mut trigger = trigger(scheme, Mode::Paper);
    let mut random = Substream::new(1, "trigger-test", 0);
    let mut sent = Vec::new();
    for n in 0..5000 {
        let contact = n % 1000 > 300;
        let sample = TriggerInput {
            slave_in_contact: contact,
            shadow_in_contact: contact,
            ..input(2.0, 2.0 + 0.1 * random.normal())
        };
        sent.extend(
            trigger
                .step(Time::from_millis(n), &sample)
                .map(|cause| (n, cause)),
        );
    }
    sent
}

#[test]
fn a_violation_exactly_at_delta_does_not_fire_and_the_next_number_does() {
    // 0.25 and 2 are exact in binary
    let mut trigger = trigger("deadband 25%", Mode::Paper);
    assert_eq!(trigger.step(Time::ZERO, &input(2.0, 2.5)), None);
    let above = f64::from_bits(2.5f64.to_bits() + 1);
    assert_eq!(
        trigger.step(Time::ZERO, &input(2.0, above)),
        Some(Cause::Deadband)
    );
}

#[test]
fn small_forces_are_divided_by_the_floor() {
    // |f_s − f_m| = 0.008 of a floor of 0.04 is 20 %; of |f_s| = 0.01 it would be 80 %
    assert_eq!(
        trigger("deadband 25%", Mode::Paper).step(Time::ZERO, &input(0.01, 0.018)),
        None
    );
    let mut narrow = trigger("deadband 15%", Mode::Paper);
    assert_eq!(
        narrow.step(Time::ZERO, &input(0.01, 0.018)),
        Some(Cause::Deadband)
    );
}

#[test]
fn an_endless_t_update_makes_hybrid_the_deadband_scheme() {
    assert_eq!(run("hybrid 10% 60s"), run("deadband 10%"));
    assert!(run("deadband 10%").len() > 20);
}

#[test]
fn an_endless_delta_makes_hybrid_the_timer() {
    assert_eq!(run("hybrid 100% 50ms"), run("timer 50ms"));
}

#[test]
fn the_timer_sends_exactly_every_t_update() {
    let sent: Vec<u64> = run("timer 50ms")
        .into_iter()
        .filter(|(_, cause)| *cause == Cause::Timer)
        .map(|(n, _)| n)
        .collect();
    assert_eq!(&sent[..4], &[50, 100, 150, 200]);
}

#[test]
fn every_update_resets_the_timer() {
    let mut trigger = trigger("hybrid 10% 50ms", Mode::Paper);
    let at = |n| Time::from_millis(n);
    assert_eq!(trigger.step(at(0), &input(2.0, 2.0)), None);
    assert_eq!(
        trigger.step(at(30), &input(2.0, 3.0)),
        Some(Cause::Deadband)
    );
    assert_eq!(trigger.step(at(79), &input(2.0, 2.0)), None);
    assert_eq!(trigger.step(at(80), &input(2.0, 2.0)), Some(Cause::Timer));
}

#[test]
fn noise_in_free_space_never_fires() {
    let mut trigger = trigger("deadband 2.5%", Mode::Paper);
    let mut random = Substream::new(2, "trigger-test", 0);
    for n in 0..5000 {
        let free = TriggerInput {
            slave_in_contact: false,
            shadow_in_contact: false,
            ..input(0.01 * random.normal(), 0.0)
        };
        assert_eq!(trigger.step(Time::from_millis(n), &free), None);
    }
}

#[test]
fn a_contact_of_one_side_counts_after_the_debounce_and_is_sent_again_at_intervals() {
    for (slave, cause) in [
        (false, Cause::MasterOnlyContact),
        (true, Cause::SlaveOnlyContact),
    ] {
        let mut trigger = trigger("deadband 10%", Mode::Recommended);
        let one = TriggerInput {
            slave_in_contact: slave,
            shadow_in_contact: !slave,
            ..input(2.0, 0.0)
        };
        let told: Vec<u64> = (0..115)
            .filter(|n| trigger.step(Time::from_millis(*n), &one) == Some(cause))
            .collect();
        assert_eq!(told, [10, 60, 110]);
    }
}

#[test]
fn a_contact_of_one_side_that_lasts_while_the_hip_stands_is_sent_ever_more_rarely_until_the_hip_moves()
 {
    let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
    let stands = TriggerInput {
        shadow_in_contact: false,
        hip_stands: true,
        ..input(0.4, 0.0)
    };
    let mut told = |from: u64, to: u64, one: &TriggerInput| -> Vec<u64> {
        (from..to)
            .filter(|n| trigger.step(Time::from_millis(*n), one).is_some())
            .collect()
    };
    assert_eq!(
        told(0, 4000, &stands),
        [10, 60, 160, 360, 760, 1560, 2560, 3560]
    );
    let moves = TriggerInput {
        hip_stands: false,
        ..stands
    };
    assert_eq!(told(4000, 4120, &moves), [4000, 4050, 4100]);
}

#[test]
fn the_end_of_a_contact_is_sent_once_and_only_if_that_is_asked_for() {
    let free = TriggerInput {
        slave_in_contact: false,
        shadow_in_contact: false,
        ..input(0.0, 0.0)
    };
    for mode in [Mode::Paper, Mode::Recommended] {
        for contact_lost in [TriggerConfig::of_mode(mode).contact_lost, true] {
            let mut trigger = Trigger::new(TriggerConfig {
                scheme: Scheme::Deadband { delta: 0.10 },
                contact_lost,
                ..TriggerConfig::of_mode(mode)
            });
            assert_eq!(trigger.step(Time::ZERO, &input(2.0, 2.0)), None);
            let sent = contact_lost.then_some(Cause::ContactLost);
            assert_eq!(trigger.step(Time::from_millis(1), &free), sent, "{mode:?}");
            assert_eq!(trigger.step(Time::from_millis(2), &free), None, "{mode:?}");
        }
        // III-A names three mismatches, and this is none of them
        assert!(!TriggerConfig::of_mode(mode).contact_lost, "{mode:?}");
    }
}

#[test]
fn a_sticking_box_is_no_mismatch_in_recommended_mode() {
    let sticking = TriggerInput {
        sticking: true,
        ..input(1.0, 2.0)
    };
    let decide = |mode| trigger("deadband 10%", mode).step(Time::ZERO, &sticking);
    assert_eq!(decide(Mode::Paper), Some(Cause::Deadband));
    assert_eq!(decide(Mode::Recommended), None);
}

#[test]
fn every_sample_means_every_sample() {
    assert_eq!(run("every-sample").len(), 5000);
}

#[test]
fn dis_fires_beyond_an_absolute_error_or_at_its_heartbeat() {
    let mut trigger = trigger("dis 0.25N 1s", Mode::Paper);
    assert_eq!(trigger.step(Time::ZERO, &input(2.0, 2.25)), None);
    assert_eq!(
        trigger.step(Time::ZERO, &input(2.0, 2.26)),
        Some(Cause::Deadband)
    );
    assert_eq!(
        trigger.step(Time::from_millis(1000), &input(2.0, 2.0)),
        Some(Cause::Timer)
    );
}

#[test]
fn each_metric_sees_its_own_mismatch_and_no_other() {
    let quiet = input(2.0, 2.0);
    let cases = [
        (MismatchMetric::Force, input(2.0, 2.5)),
        (
            MismatchMetric::Parameters,
            TriggerInput {
                params: params(0.7, 2.6),
                ..quiet
            },
        ),
        (
            MismatchMetric::Pose,
            TriggerInput {
                turn: 0.03,
                ..quiet
            },
        ),
    ];
    for (metric, _) in &cases {
        for (other, mismatched) in &cases {
            let mut trigger = Trigger::new(TriggerConfig {
                scheme: "deadband 10%".parse().unwrap(),
                metric: *metric,
                ..TriggerConfig::of_mode(Mode::Paper)
            });
            // what the master starts from has not been sent, so parameters fire once
            let _ = trigger.step(Time::ZERO, &quiet);
            assert_eq!(trigger.step(Time::from_millis(1), &quiet), None);
            let fired = trigger.step(Time::from_millis(2), mismatched);
            let expected = (metric == other).then_some(Cause::Deadband);
            assert_eq!(fired, expected, "{metric:?} on a mismatch of {other:?}");
        }
    }
}

#[test]
fn a_timer_that_rests_in_free_space_counts_on_and_fires_at_the_touch() {
    let mut trigger = Trigger::new(TriggerConfig {
        scheme: "hybrid 10% 150ms".parse().unwrap(),
        timer_in_free_space: false,
        ..TriggerConfig::of_mode(Mode::Paper)
    });
    let free = TriggerInput {
        slave_in_contact: false,
        shadow_in_contact: false,
        ..input(0.0, 0.0)
    };
    for n in 0..1000 {
        assert_eq!(trigger.step(Time::from_millis(n), &free), None);
    }
    assert_eq!(
        trigger.step(Time::from_millis(1000), &input(2.0, 2.0)),
        Some(Cause::Timer)
    );
}

#[test]
fn what_was_lost_is_said_again_once_at_once_and_under_every_scheme() {
    let free = TriggerInput {
        slave_in_contact: false,
        shadow_in_contact: false,
        ..input(0.0, 0.0)
    };
    for scheme in [
        "deadband 10%",
        "useful 10% 10s",
        "adaptive 10% 10s",
        "timer 10s",
    ] {
        let mut trigger = trigger(scheme, Mode::Recommended);
        assert_eq!(trigger.step(Time::from_millis(1), &free), None);
        trigger.repeat(Cause::ContactLost);
        let said = trigger.step(Time::from_millis(2), &free);
        assert_eq!(said, Some(Cause::ContactLost), "{scheme}");
        assert_eq!(trigger.step(Time::from_millis(3), &free), None, "{scheme}");
    }
}

#[test]
fn a_scheme_of_somebody_else_decides_alone_but_for_contact_and_loss() {
    let mut trigger = Trigger::new(TriggerConfig {
        scheme: Scheme::EverySample,
        contact_lost: true,
        ..TriggerConfig::of_mode(Mode::Paper)
    });
    let mut at = (0..).map(Time::from_millis);
    let mut now = || at.next().unwrap();
    let (alike, asked) = (input(2.0, 2.0), Some(Cause::Deadband));
    assert_eq!(trigger.step(now(), &alike), Some(Cause::EverySample));
    assert_eq!(trigger.step_by(now(), &input(2.0, 9.0), None), None);
    assert_eq!(trigger.step_by(now(), &alike, asked), asked);
    trigger.repeat(Cause::Timer);
    assert_eq!(
        trigger.step_by(now(), &alike, None),
        Some(Cause::Timer),
        "lost"
    );
    let apart = TriggerInput {
        slave_in_contact: false,
        shadow_in_contact: false,
        ..alike
    };
    let lost = trigger.step_by(now(), &apart, asked);
    assert_eq!(lost, Some(Cause::ContactLost));
    assert_eq!(trigger.step_by(now(), &apart, asked), asked);
}
