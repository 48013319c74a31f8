//! Laws of the trigger.

use mmt_shared::contact::Coupling;
use mmt_shared::rng::Substream;

use super::*;

fn params(m: f64, b: f64, c: f64) -> ModelParams {
    ModelParams::of_square(m, b, c, 0.4, &Coupling::for_stiffness(1000.0)).unwrap()
}

/// Both in contact, forces 1 N and `1 − error` N along x, nothing to change.
fn pushing(error: f64) -> TriggerInput {
    TriggerInput {
        f_s: Vec2::new(1.0, 0.0),
        f_m: Vec2::new(1.0 - error, 0.0),
        slave_in_contact: true,
        shadow_in_contact: true,
        sticking: false,
        speed: 0.1,
        acceleration: 0.0,
        candidate: params(0.7, 3.0, 2.0),
        sent: params(0.7, 3.0, 2.0),
        object: Pose::default(),
        model: Pose::default(),
    }
}

fn free() -> TriggerInput {
    TriggerInput {
        slave_in_contact: false,
        shadow_in_contact: false,
        f_s: Vec2::zeros(),
        f_m: Vec2::zeros(),
        ..pushing(0.0)
    }
}

fn trigger(mode: Mode, scheme: &str) -> Trigger {
    Trigger::new(TriggerConfig::of_mode(mode, scheme.parse().unwrap()))
}

/// Ticks (ms) and causes of the updates over a sequence of inputs.
fn sent(mut trigger: Trigger, inputs: impl IntoIterator<Item = TriggerInput>) -> Vec<(u64, Cause)> {
    (0..)
        .zip(inputs)
        .filter_map(|(ms, input)| Some((ms, trigger.decide(Time::from_millis(ms), &input)?)))
        .collect()
}

fn always(input: TriggerInput, ticks: usize) -> impl Iterator<Item = TriggerInput> {
    std::iter::repeat_n(input, ticks)
}

/// Contacts that come and go, errors that wander, objects that stick: all that a scheme can meet.
fn anything(seed: u64) -> Vec<TriggerInput> {
    let mut random = Substream::new(seed, "trigger", 0);
    let (mut slave, mut shadow, mut error) = (false, false, 0.0);
    (0..20_000)
        .map(|_| {
            slave ^= random.chance(0.003);
            shadow ^= random.chance(if slave == shadow { 0.002 } else { 0.05 });
            error = 0.98 * error + 0.03 * random.normal();
            TriggerInput {
                slave_in_contact: slave,
                shadow_in_contact: shadow,
                sticking: random.chance(0.1),
                ..pushing(error)
            }
        })
        .collect()
}

fn without_cause(list: Vec<(u64, Cause)>) -> Vec<u64> {
    list.into_iter().map(|(ms, _)| ms).collect()
}

#[test]
fn hybrid_without_timer_is_the_deadband_scheme() {
    for seed in 0..5 {
        let deadband = sent(trigger(Mode::Paper, "deadband 10%"), anything(seed));
        assert!(deadband.len() > 50);
        assert_eq!(
            sent(trigger(Mode::Paper, "hybrid 10% inf"), anything(seed)),
            deadband
        );
        assert_ne!(
            sent(trigger(Mode::Paper, "hybrid 10% 50ms"), anything(seed)),
            deadband
        );
    }
}

#[test]
fn hybrid_without_deadband_is_the_timer_scheme() {
    for seed in 0..5 {
        let timer = sent(trigger(Mode::Paper, "timer 50ms"), anything(seed));
        assert!(timer.len() > 300);
        assert_eq!(
            sent(trigger(Mode::Paper, "hybrid inf 50ms"), anything(seed)),
            timer
        );
        assert_ne!(
            sent(trigger(Mode::Paper, "hybrid 10% 50ms"), anything(seed)),
            timer
        );
    }
}

#[test]
fn violation_12_is_strict_to_the_bit() {
    let input = pushing(0.125);
    let fires = |delta: f64| {
        let scheme = Scheme::Deadband { delta };
        let mut trigger = Trigger::new(TriggerConfig::of_mode(Mode::Paper, scheme));
        trigger.decide(Time::ZERO, &input)
    };
    assert_eq!(fires(0.125), None);
    assert_eq!(fires(0.125_f64.next_up()), None);
    assert_eq!(fires(0.125_f64.next_down()), Some(Cause::Deadband));
}

#[test]
fn violation_12_compares_vectors_and_has_a_floor() {
    let fires = |mode, f_s: (f64, f64), f_m: (f64, f64)| {
        let input = TriggerInput {
            f_s: Vec2::new(f_s.0, f_s.1),
            f_m: Vec2::new(f_m.0, f_m.1),
            ..pushing(0.0)
        };
        trigger(mode, "deadband 10%")
            .decide(Time::ZERO, &input)
            .is_some()
    };
    // equal sizes, turned by 0.2 rad
    assert!(fires(Mode::Paper, (1.0, 0.0), (0.98, 0.199)));
    // 0.02 N of noise on 0.1 N: the paper's floor of 0.04 N fires, that of 0.3 N does not
    assert!(fires(Mode::Paper, (0.1, 0.0), (0.08, 0.0)));
    assert!(!fires(Mode::Recommended, (0.1, 0.0), (0.08, 0.0)));
    assert!(!fires(Mode::Paper, (0.0, 0.0), (0.004, 0.0)));
    assert!(fires(Mode::Paper, (0.0, 0.0), (0.0041, 0.0)));
}

#[test]
fn the_timers_interval_is_t_update_to_the_tick() {
    for (scheme, period, in_a_second) in [
        ("timer 50ms", 50, 20),
        ("hybrid 10% 50ms", 50, 20),
        ("hybrid 10% 150ms", 150, 6),
        ("dis 0.3N 1s", 1000, 1),
    ] {
        let ticks = without_cause(sent(trigger(Mode::Paper, scheme), always(free(), 1001)));
        let expected: Vec<u64> = (1..=in_a_second).map(|k| k * period).collect();
        assert_eq!(ticks, expected, "{scheme}");
    }
}

#[test]
fn every_update_resets_the_timer() {
    let inputs = |at: u64| (0..200).map(move |ms| pushing(if ms == at { 0.5 } else { 0.0 }));
    assert_eq!(
        sent(trigger(Mode::Paper, "hybrid 10% 50ms"), inputs(30)),
        [
            (30, Cause::Deadband),
            (80, Cause::Timer),
            (130, Cause::Timer),
            (180, Cause::Timer)
        ]
    );
    // losing contact at 30 resets it as well
    let lose = (0..100).map(|ms| if ms < 30 { pushing(0.0) } else { free() });
    assert_eq!(
        sent(trigger(Mode::Paper, "hybrid 10% 50ms"), lose),
        [(30, Cause::ContactLost), (80, Cause::Timer)]
    );
    // and so does geometry: the slave alone from 30 to 45, then both
    let apart = (0..100).map(|ms| TriggerInput {
        shadow_in_contact: !(30..45).contains(&ms),
        ..pushing(0.0)
    });
    assert_eq!(
        sent(trigger(Mode::Paper, "hybrid 10% 50ms"), apart),
        [(40, Cause::SlaveOnlyContact), (90, Cause::Timer)]
    );
}

#[test]
fn noise_in_free_space_fires_nothing() {
    let mut noise = Substream::new(3, "free", 0);
    let mut contact = ContactDetector::new(ContactThresholds::default());
    let inputs: Vec<TriggerInput> = (0..30_000)
        .map(|ms| {
            let (x, y) = noise.normal_pair();
            let f_s = Vec2::new(x, y) * 0.010;
            let slave_in_contact = contact.step(Time::from_millis(ms), f_s.norm());
            TriggerInput {
                f_s,
                slave_in_contact,
                ..free()
            }
        })
        .collect();
    // the effect: compared without regard to contact, a perfect model would fire nearly always
    let blind = inputs.iter().map(|input| TriggerInput {
        slave_in_contact: true,
        shadow_in_contact: true,
        ..*input
    });
    assert!(sent(trigger(Mode::Paper, "deadband 10%"), blind).len() > 20_000);
    for scheme in ["deadband 2.5%", "useful 2.5% 50ms", "dis 0.001N inf"] {
        assert_eq!(sent(trigger(Mode::Paper, scheme), inputs.clone()), []);
    }
}

#[test]
fn a_contact_mismatch_is_sent_after_the_debounce_and_then_every_50_ms() {
    for (slave, cause) in [
        (true, Cause::SlaveOnlyContact),
        (false, Cause::MasterOnlyContact),
    ] {
        let apart = TriggerInput {
            slave_in_contact: slave,
            shadow_in_contact: !slave,
            ..pushing(0.0)
        };
        let found = sent(
            trigger(Mode::Recommended, "useful 10% 150ms"),
            always(apart, 130),
        );
        assert_eq!(found, [(10, cause), (60, cause), (110, cause)]);
        let brief = always(apart, 10).chain(always(free(), 1));
        let brief = sent(trigger(Mode::Recommended, "useful 10% 150ms"), brief);
        assert!(
            brief.iter().all(|(_, cause)| *cause == Cause::ContactLost),
            "{brief:?}"
        );
    }
}

#[test]
fn losing_contact_is_sent_once_and_at_once() {
    let inputs = always(pushing(0.0), 20).chain(always(free(), 500));
    assert_eq!(
        sent(trigger(Mode::Recommended, "useful 10% 150ms"), inputs),
        [(20, Cause::ContactLost)]
    );
}

#[test]
fn a_sticking_object_is_no_mismatch_in_recommended_mode_and_is_one_in_paper_mode() {
    let stuck = TriggerInput {
        sticking: true,
        ..pushing(0.5)
    };
    for scheme in ["deadband 10%", "dis 0.1N 10s"] {
        assert_eq!(
            sent(trigger(Mode::Recommended, scheme), always(stuck, 100)),
            []
        );
        assert_eq!(
            sent(trigger(Mode::Paper, scheme), always(stuck, 100)).len(),
            100
        );
    }
}

#[test]
fn every_sample_sends_every_sample() {
    let found = sent(trigger(Mode::Paper, "every-sample"), anything(1));
    assert_eq!(found.len(), 20_000);
    assert!(found.iter().all(|(_, cause)| *cause == Cause::EverySample));
}

#[test]
fn dis_bounds_the_force_in_newtons() {
    let large = |f_m| TriggerInput {
        f_s: Vec2::new(8.0, 0.0),
        f_m: Vec2::new(f_m, 0.0),
        ..pushing(0.0)
    };
    let fires = |f_m| !sent(trigger(Mode::Paper, "dis 0.25N 10s"), [large(f_m)]).is_empty();
    assert!(!fires(7.75));
    assert!(fires(7.75_f64.next_down()));
}

#[test]
fn useful_sends_only_what_changes_the_force_or_the_orientation() {
    let scheme = "useful 10% 150ms";
    let count = |input| sent(trigger(Mode::Recommended, scheme), always(input, 1001)).len();
    let wrong = pushing(0.5);
    assert_eq!(count(wrong), 0, "the update would change nothing");
    // 1 % of 1 N: c by 0.009 and by 0.011 N, with b making up for it, and m in no acceleration
    let candidate = |m, b, c| TriggerInput {
        candidate: params(m, b, c),
        ..wrong
    };
    assert_eq!(count(candidate(0.7, 3.0, 2.009)), 0);
    assert_eq!(count(candidate(0.7, 3.0, 2.011)), 100, "once in 10 ms");
    assert_eq!(
        count(candidate(0.7, 2.0, 2.1)),
        0,
        "b 1 N s/m at 0.1 m/s is c 0.1 N"
    );
    assert_eq!(count(candidate(1.4, 3.0, 2.0)), 0);
    let accelerating = TriggerInput {
        acceleration: -0.1,
        ..candidate(1.4, 3.0, 2.0)
    };
    assert_eq!(count(accelerating), 100);
    let turned = |angle| TriggerInput {
        object: Pose::new(0.0, 0.0, angle),
        ..wrong
    };
    assert_eq!(count(turned(0.0099)), 0);
    assert_eq!(count(turned(-0.0101)), 100);
    assert_eq!(
        count(turned(std::f64::consts::TAU)),
        0,
        "a whole turn is no turn"
    );
}

#[test]
fn the_timer_of_useful_runs_in_contact_only() {
    let changed = |input| TriggerInput {
        candidate: params(0.7, 3.0, 2.5),
        ..input
    };
    let scheme = "useful 10% 150ms";
    let in_free_space = sent(
        trigger(Mode::Recommended, scheme),
        always(changed(free()), 2000),
    );
    assert_eq!(in_free_space, []);
    // contact from 1000 on: the first timer update one T_update later
    let inputs = always(changed(free()), 1000).chain(always(changed(pushing(0.0)), 400));
    assert_eq!(
        sent(trigger(Mode::Recommended, scheme), inputs),
        [(1150, Cause::Timer), (1300, Cause::Timer)]
    );
}

#[test]
fn the_metrics_see_what_they_are_named_after() {
    let fires = |metric, input: TriggerInput| {
        let mut config = TriggerConfig::of_mode(Mode::Recommended, "deadband 10%".parse().unwrap());
        config.metric = metric;
        Trigger::new(config).decide(Time::ZERO, &input).is_some()
    };
    let force = pushing(0.2);
    let parameters = TriggerInput {
        candidate: params(0.7, 3.0, 2.4),
        ..pushing(0.0)
    };
    let moved = TriggerInput {
        object: Pose::new(0.0011, 0.0, 0.0),
        ..pushing(0.0)
    };
    let turned = TriggerInput {
        object: Pose::new(0.0, 0.0, 0.011),
        ..pushing(0.0)
    };
    for (metric, own) in [
        (Metric::Force, [true, false, false, false]),
        (Metric::Parameters, [false, true, false, false]),
        (Metric::Pose, [false, false, true, true]),
    ] {
        let seen = [force, parameters, moved, turned].map(|input| fires(metric, input));
        assert_eq!(seen, own, "{metric:?}");
    }
}

#[test]
fn numbers_that_are_not_finite_fire_no_deadband() {
    for odd in [f64::NAN, f64::INFINITY] {
        let input = TriggerInput {
            f_s: Vec2::new(odd, 0.0),
            ..pushing(0.0)
        };
        assert_eq!(
            sent(trigger(Mode::Paper, "deadband 10%"), always(input, 10)),
            []
        );
    }
}
