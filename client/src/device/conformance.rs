//! What every device is promised that is plugged in, whatever its protocol, and what is promised of it.
//!
//! One suite. Each device stands behind a [`Rig`] that speaks its protocol, byte for byte; the operator and the limiter of a
//! session are real, time is virtual. `tests/tests/devices.rs` holds the programs to the same against emulators.

mod plugged;
mod rigs;

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;

use super::link::{DeviceKind, HandOutput, Hold};
use plugged::{GENTLE, Interruption, Plugged};
use rigs::{Rig, rigs};

/// What the model presses with where a test asks for more than any device may give, N, world.
const WILD: Vec2 = Vec2::new(60.0, -80.0);

fn each(test: impl Fn(Box<dyn Rig>)) {
    let mut kinds: Vec<_> = rigs().iter().map(|rig| rig.config().kind.name()).collect();
    kinds.dedup();
    assert_eq!(kinds, DeviceKind::ALL.map(DeviceKind::name), "all kinds");
    rigs().into_iter().for_each(test);
}

#[test]
fn every_device_moves_the_hip_along_its_axes_metre_by_metre() {
    each(|rig| {
        let mut plugged = Plugged::new(rig);
        plugged.grip(plugged.place(0.0, 0.0));
        let from = plugged.hip;
        for step in 1..=100 {
            let way = f64::from(step) * 1e-4;
            plugged.at(plugged.place(2.0 * way, -way), true);
        }
        (0..5).for_each(|_| plugged.at(plugged.place(0.02, -0.01), true));
        let way = plugged.hip - from;
        let expected = Vec2::new(0.02, -0.01) * plugged.config.scale;
        let name = plugged.rig.name();
        assert!((way - expected).norm() < 1e-6, "{name}: {way}");
    });
}

#[test]
fn every_device_gets_the_force_in_newtons_at_its_tool_along_its_axes() {
    each(|rig| {
        let plugged = Plugged::pushing(rig);
        let (force, name) = (plugged.in_world(), plugged.rig.name());
        assert!((force - GENTLE).norm() < 1e-5, "{name}: {force}");
        let size = plugged.acts.iter().map(|n| n * n).sum::<f64>().sqrt();
        assert!(
            (size - 1.0).abs() < 1e-5,
            "{name}: nothing along the third axis"
        );
    });
}

#[test]
fn no_device_gets_more_than_its_greatest_force_and_all_of_it_only_after_200_ms() {
    each(|rig| {
        let mut plugged = Plugged::new(rig);
        plugged.wanted = WILD;
        let place = plugged.place(0.0, 0.0);
        plugged.grip(place);
        let (most, name) = (plugged.config.force_max_n, plugged.rig.name());
        let mut last = 0.0;
        for ms in 1..=300 {
            let force = plugged.in_world().norm();
            let ramp = most * f64::from(ms.min(200)) / 200.0;
            assert!(force <= ramp * 1.000_001, "{name}: {force} after {ms} ms");
            assert!(force >= last - 1e-6, "{name}: it falls");
            last = force;
            plugged.at(place, true);
        }
        assert!(last > 0.7 * most, "{name}: {last} of {most}");
    });
}

#[test]
fn silence_of_any_device_lets_the_hand_go_and_leaves_no_force() {
    each(|rig| {
        let mut plugged = Plugged::pushing(rig);
        let (hip, name) = (plugged.hip, plugged.rig.name());
        plugged.nothing(39);
        assert!(plugged.held(), "{name}: a few lost ones are nothing");
        plugged.nothing(2);
        assert!(!plugged.held(), "{name}");
        // a device at the link gets no packet then; one that is asked gets zero
        let direct = plugged.config.kind != DeviceKind::Link;
        assert!(!(direct && plugged.pushed()), "{name}: at once");
        plugged.nothing(250);
        assert!(!plugged.pushed(), "{name}");
        assert!(plugged.hip_is(hip), "{name}: the HIP stays");
    });
}

#[test]
fn nonsense_from_any_device_takes_the_force_away_at_once_until_it_is_gripped_anew() {
    each(|rig| {
        let kinds = rig.nonsense().len();
        assert!(kinds >= 3, "{}", rig.name());
        for kind in 0..kinds {
            let fresh = rigs().into_iter().find(|other| other.name() == rig.name());
            let mut plugged = Plugged::pushing(fresh.unwrap());
            let (hip, name) = (plugged.hip, plugged.rig.name());
            plugged.step(|rig, now, give| rig.nonsensical(kind, now, give));
            let what = plugged.rig.nonsense()[kind];
            assert!(!plugged.held(), "{name}: {what}");
            assert!(!plugged.pushed(), "{name}: {what}");
            // what was down through it does not count
            let place = plugged.place(0.0, 0.0);
            (0..500).for_each(|_| plugged.at(place, true));
            assert!(!plugged.held() && !plugged.pushed(), "{name}: {what}");
            plugged.at(place, false);
            plugged.grip(place);
            assert!(plugged.hip_is(hip), "{name}: {what}: the HIP stays");
        }
    });
}

#[test]
fn places_where_no_device_may_be_let_the_hand_go() {
    each(|rig| {
        let mut plugged = Plugged::pushing(rig);
        let rim = plugged.config.workspace_m / 2.0;
        let name = plugged.rig.name();
        // out at half a metre a second
        let mut out = 0.0;
        while out < rim - 1e-4 {
            plugged.at(plugged.place(0.0, out), true);
            assert!(plugged.held(), "{name}: inside, {out}");
            out += 5e-4;
        }
        plugged.at(plugged.place(0.0, rim + 3e-4), true);
        assert!(!plugged.held() && !plugged.pushed(), "{name}");
    });
}

#[test]
fn a_jump_of_any_device_is_no_motion_of_the_hand() {
    each(|rig| {
        let mut plugged = Plugged::pushing(rig);
        let (hip, name) = (plugged.hip, plugged.rig.name());
        plugged.at(plugged.place(0.02, 0.02), true);
        assert!(!plugged.held() && !plugged.pushed(), "{name}");
        plugged.nothing(5);
        assert!(plugged.hip_is(hip), "{name}");
    });
}

#[test]
fn the_end_of_the_loop_leaves_no_force_on_any_device() {
    each(|rig| {
        let mut plugged = Plugged::pushing(rig);
        let (name, place) = (plugged.rig.name(), plugged.place(0.0, 0.0));
        // the session is over: its port gives this
        plugged.now += Duration::from_millis(1);
        let now = plugged.now;
        plugged.rig.reading(now, place, true, &mut |_| ());
        let acts = plugged.rig.acts(now, &HandOutput::default());
        assert_eq!(acts, [0.0; 3], "{name}");
        // and a loop that stands: the same tick again and again
        let mut plugged = Plugged::pushing(rigs_named(name));
        let output = HandOutput {
            tick: plugged.ticks,
            force: GENTLE,
            engaged: true,
            ..HandOutput::default()
        };
        let mut counts = [0, 0];
        for ms in 1..=60 {
            let now = plugged.now + Duration::from_millis(ms);
            plugged.rig.reading(now, place, true, &mut |_| ());
            let acts = plugged
                .rig
                .acts(now, &output)
                .iter()
                .any(|n| n.abs() > 1e-9);
            counts[usize::from(acts)] += 1;
        }
        assert_eq!(counts, [11, 49], "{name}: 50 ms after the last tick");
    });
}

fn rigs_named(name: &str) -> Box<dyn Rig> {
    rigs().into_iter().find(|rig| rig.name() == name).unwrap()
}

#[test]
fn any_device_that_comes_back_elsewhere_does_not_move_the_hip() {
    each(|rig| {
        let mut plugged = Plugged::pushing(rig);
        let (hip, name) = (plugged.hip, plugged.rig.name());
        plugged.nothing(300);
        let elsewhere = plugged.place(0.02, -0.03);
        plugged.at(elsewhere, true);
        plugged.at(elsewhere, true);
        assert!(!plugged.held(), "{name}: its button was down all the time");
        assert!(plugged.hip_is(hip), "{name}");
        plugged.at(elsewhere, false);
        plugged.grip(elsewhere);
        (0..5).for_each(|_| plugged.at(elsewhere, true));
        assert!(plugged.hip_is(hip), "{name}: it goes on from where it was");
    });
}

#[test]
fn a_stop_a_pause_and_a_new_session_let_any_device_go_and_it_can_be_held_again() {
    each(|rig| {
        for by in [
            Interruption::Stop,
            Interruption::Pause,
            Interruption::NewSession,
        ] {
            let mut plugged = Plugged::pushing(rigs_named(rig.name()));
            let (name, place) = (plugged.rig.name(), plugged.place(0.0, 0.0));
            let step = plugged.interrupted(by, place, 300);
            assert!(step < 0.02, "{name}, {by:?}: a step of {step} N");
            assert!(!plugged.held() && !plugged.pushed(), "{name}, {by:?}");
            plugged.grip(place);
            (0..250).for_each(|_| plugged.at(place, true));
            assert!(plugged.pushed(), "{name}, {by:?}");
        }
    });
}

#[test]
fn the_clutch_of_any_device_moves_it_without_the_hip() {
    each(|rig| {
        let mut plugged = Plugged::pushing(rig);
        let (hip, name) = (plugged.hip, plugged.rig.name());
        match plugged.config.hold {
            Hold::Button => plugged.at(plugged.place(0.0, 0.0), false),
            // it has none: whoever wants to move without the hip lets it out of its workspace
            Hold::Rest => {
                let rim = plugged.config.workspace_m / 2.0;
                for step in 0..=60 {
                    let x = f64::from(step) / 60.0 * (rim + 1e-3);
                    plugged.at(plugged.place(x, 0.0), false);
                }
            }
        }
        assert!(!plugged.held(), "{name}");
        let let_go = plugged.hip;
        for step in 0..=60 {
            let x = plugged.config.workspace_m / 2.0 - f64::from(step) * 5e-4;
            if plugged.config.hold == Hold::Rest {
                plugged.at(plugged.place(x, 0.0), false);
            }
        }
        let back = match plugged.config.hold {
            Hold::Button => plugged.place(0.005, 0.0),
            Hold::Rest => plugged.place(plugged.config.workspace_m / 2.0 - 0.03, 0.0),
        };
        plugged.at(back, false);
        assert!(plugged.hip_is(let_go), "{name}");
        plugged.grip(back);
        (0..5).for_each(|_| plugged.at(back, true));
        assert!(plugged.hip_is(let_go), "{name}");
        if plugged.config.hold == Hold::Button {
            assert_eq!(let_go, hip, "{name}");
        }
    });
}
