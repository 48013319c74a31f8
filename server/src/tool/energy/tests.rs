//! Laws of the bound on the tool's energy: what is counted, what it allows, and whom it never holds.

use super::*;

/// A bound of 15 N and 0.5 m/s at 1000 N/m.
fn bound(config: EnergyConfig) -> ToolEnergy {
    ToolEnergy::try_new(config, 15.0, Coupling::for_stiffness(1000.0), 0.5).unwrap()
}

fn x(metres: f64) -> Vec2 {
    Vec2::new(metres, 0.0)
}

/// The hand goes `way` metres along x against this force in so many ticks.
fn hand_goes(energy: &mut ToolEnergy, way: f64, force: f64, ticks: u32) {
    let from = energy.hand.map_or(0.0, |hand| hand.hip.x);
    for n in 0..=ticks {
        let hip = x(from + way * f64::from(n) / f64::from(ticks));
        energy.follow_hand(Some(HandSample {
            hip,
            force: x(force),
        }));
    }
}

/// The tool goes `way` metres along x with this force on the object, as far as the bound lets it; how far it got.
fn tool_goes(energy: &mut ToolEnergy, way: f64, force: f64, ticks: u32) -> f64 {
    let from = energy.trail.map_or(0.0, |trail| trail.place.x);
    let mut at = from;
    energy.measured(x(at), x(force));
    for _ in 0..ticks {
        at += energy.way_left_m(x(force)).min(way / f64::from(ticks));
        energy.measured(x(at), x(force));
    }
    at - from
}

#[test]
fn the_tool_gives_what_the_hand_gave_a_quarter_more_and_its_limit_over_the_hands_way_in_a_round_trip()
 {
    let mut energy = bound(EnergyConfig::default());
    // 2 N over 0.2 m in a second; in 50 ms the hand goes 10 mm
    hand_goes(&mut energy, 0.2, 2.0, 1000);
    assert!((energy.hand_j() - 0.4).abs() < 1e-9);
    assert!((energy.budget_j() - (0.1 + 15.0 * 0.01 + START_J)).abs() < 1e-9);
    // 10 N: what the contact stores, 50 mJ, comes back and does not count
    let far = tool_goes(&mut energy, 0.3, 10.0, 1000);
    let most = 0.4 + 0.25 + START_J + 0.05;
    assert!((energy.tool_j() - most).abs() < 1e-3, "{}", energy.tool_j());
    // less the play at the beginning
    assert!((far - most / 10.0 - PLAY_M).abs() < 1e-5, "{far}");
    // the hand goes on, and so does the tool
    hand_goes(&mut energy, 0.1, 2.0, 500);
    let more = tool_goes(&mut energy, 0.3, 10.0, 1000);
    assert!(
        (more - 0.025).abs() < 1e-3,
        "1.25 times 0.2 J at 10 N: {more}"
    );
}

#[test]
fn a_longer_path_allows_for_a_longer_way_and_a_hand_that_jumps_for_that_of_a_tool() {
    let mut energy = bound(EnergyConfig::default());
    energy.set_round_trip(Duration::from_millis(450));
    hand_goes(&mut energy, 0.2, 0.0, 1000);
    // 0.2 m/s for half a second
    assert!((energy.budget_j() - 15.0 * 0.1 - START_J).abs() < 1e-6);
    hand_goes(&mut energy, 3.0, 0.0, 1);
    // a tool of 0.5 m/s
    assert!(energy.budget_j() < 15.0 * 0.1 + START_J + 15.0 * 0.5e-3 + 1e-6);
}

#[test]
fn a_hand_is_credited_with_what_its_device_can_have_shown_and_pays_back_what_it_takes() {
    let mut energy = bound(EnergyConfig::default());
    hand_goes(&mut energy, 0.1, 20.0, 500);
    assert!((energy.hand_j() - 0.8).abs() < 1e-9, "8 N over 0.1 m");
    hand_goes(&mut energy, -0.1, 20.0, 500);
    assert!(energy.hand_j().abs() < 1e-9, "{}", energy.hand_j());
    // no samples, no credit; nor for a reading that jumps
    energy.follow_hand(None);
    hand_goes(&mut energy, 0.1, 8.0, 500);
    let before = energy.hand_j();
    energy.follow_hand(None);
    let far = HandSample {
        hip: x(5.0),
        force: x(8.0),
    };
    energy.follow_hand(Some(far));
    hand_goes(&mut energy, 1.0, 8.0, 1);
    assert_eq!(energy.hand_j(), before);
}

/// The model holds a spring's 32 mJ at the most, so what the samples show beyond is a box that is carried back with the HIP.
#[test]
fn the_hand_gets_no_more_back_than_the_model_holds() {
    let mut energy = bound(EnergyConfig::default());
    for _ in 0..10 {
        let before = energy.hand_j();
        // the box slides at 1 N, and is carried back while the hand presses with 8 N
        hand_goes(&mut energy, 0.1, 1.0, 500);
        energy.set_returnable(0.032);
        hand_goes(&mut energy, -0.1, 8.0, 500);
        let gave = energy.hand_j() - before;
        assert!((gave - (0.1 - 0.032)).abs() < 1e-9, "{gave} J");
    }
}

#[test]
fn a_tremor_that_a_sensor_shows_late_is_no_work() {
    let mut energy = bound(EnergyConfig::default());
    let swing = |s: f64| 3e-4 * libm::sin(std::f64::consts::TAU * 9.3 * s);
    for n in 0..20_000 {
        let s = f64::from(n) * TICK_S;
        // 5 ms late, of a contact of 10 kN/m that is pressed with 5 N
        energy.measured(x(swing(s)), x(5.0 + 1e4 * swing(s - 5e-3)));
    }
    // tick by tick it would be 75 mJ a second
    assert!(energy.tool_j().abs() < 0.1, "{} J in 20 s", energy.tool_j());
}

#[test]
fn a_tool_that_touches_nothing_or_has_no_bound_goes_as_far_as_it_likes() {
    let mut energy = bound(EnergyConfig::default());
    let force = x(10.0);
    energy.begin_at(x(0.0), force);
    assert!((energy.way_left_m(force) - START_J / 10.0).abs() < 1e-12);
    assert_eq!(energy.way_left_m(Vec2::zeros()), f64::INFINITY);
    let mut free = bound(EnergyConfig {
        bounded: false,
        ..EnergyConfig::default()
    });
    free.begin_at(x(0.0), force);
    assert_eq!(free.way_left_m(force), f64::INFINITY);
}

#[test]
fn the_other_side_is_shown_for_100_ms_that_the_tool_was_held() {
    let mut energy = bound(EnergyConfig::default());
    energy.note(true);
    for _ in 0..100 {
        assert!(energy.holds());
        energy.note(false);
    }
    assert!(!energy.holds());
    assert_eq!(energy.held_ticks(), 1);
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    for (hand_force_max_n, share, name) in [
        (0.0, 0.25, "hand force"),
        (f64::NAN, 0.25, "hand force"),
        (8.0, -0.1, "share"),
        (8.0, f64::INFINITY, "share"),
    ] {
        let config = EnergyConfig {
            bounded: true,
            hand_force_max_n,
            share,
        };
        let made = ToolEnergy::try_new(config, 15.0, Coupling::for_stiffness(1000.0), 0.5);
        let error = made.unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
}
