//! Every key that a sweep has changes a run, or is refused.

use mmt_shared::model::settings::Mode;

use super::*;
use crate::layers::{Flag, Known, Layers};
use crate::sweep::Plan;

/// What matters in some setting only: the key, the setting, a value that shows it there, and why not without.
#[rustfmt::skip]
const SOMETIMES: &[[&str; 4]] = &[
    ["repeat_samples", "up = \"delay 20ms loss 20%\"\n", "4", "nothing is lost"],
    ["slave.repeats_ms", "down = \"delay 20ms loss 30%\"\n", "[50.0, 100.0]", "nothing is lost"],
    ["slave.playout.extrapolation_ms", "up = \"delay 20ms loss burst 20% 60ms\"\n", "0.0", "samples never run out"],
    ["slave.playout.delay_max_ms", "up = \"delay 60ms 50ms\"\n", "16.0", "nothing jitters"],
    ["stretch_max", NARROW, "1.0", "nothing is congested"],
    ["slave.stretch_max", NARROW, "1.0", "nothing is congested"],
    ["operator.home_radius_m", "operator.push_m = 1.0\noperator.push_speed_m_per_s = [0.3, 0.3]\n", "0.5", "the box does not get far"],
    ["operator.nudge_m", "operator.dwell_s = 0.5\n", "0.02", "there are no nudges"],
    ["slave.tool_force_max_n", "slave.environment.friction_coefficient = 1.0\n", "3.0", "the box is light"],
    ["slave.tool_energy.bounded", "slave.tool_energy.hand_force_max_n = 0.1\n", "false", "the budget is kept"],
    ["slave.tool_energy.share", "slave.tool_energy.hand_force_max_n = 0.1\n", "10.0", "the budget is kept"],
    ["slave.tool_energy.hand_force_max_n", "slave.tool_energy.share = 0.0\n", "0.1", "the budget is kept"],
    ["slave.sensing.vision.latency_ms", "slave.sensing.vision.rate_hz = 30.0\n", "100.0", "paper mode has no images"],
    ["slave.sensing.vision.position_noise_m", "slave.sensing.vision.rate_hz = 0.0\nslave.trigger.free_space_error_m = 0.0\n", "0.01", "paper mode has no images"],
    ["slave.conditioning.follow_noise", "slave.sensing.force_noise_n = 0.1\n", "false", "the sensor is sound"],
    ["slave.conditioning.tare", "slave.sensing.force_bias_n = 0.2\n", "false", "the sensor is sound"],
    ["slave.environment.shape", "", "{ disc = { diameter_m = 0.3 } }", "a shape has measures"],
    ["slave.estimator.recommended.recursive.change.after_s", CHANGES, "0.0", "friction does not change"],
    ["slave.estimator.recommended.recursive.change.trust", CHANGES, "1.0", "friction does not change"],
    ["slave.estimator.recommended.recursive.change.error_share", RIPPLES, "0.01", "friction does not change"],
    ["slave.scene.contact_friction", "slave.environment.wall = { distance_m = 0.3, angle_rad = 0.0 }\n", "1.0", "there is nothing to meet"],
    ["slave.trigger.free_space_error_m", SLIPS, "0.0", "an untouched box is where it is thought to be"],
    ["slave.trigger.timer_in_free_space", "slave.trigger.scheme = \"hybrid 10% 150ms\"\n", "false", "the timer of `useful` runs in contact only"],
    ["slave.trigger.mismatch_debounce.secs", "", "1", "its range begins at what it is"],
    ["slave.trigger.mismatch_repeat.secs", "", "1", "its range begins at what it is"],
];
const NARROW: &str =
    "up = \"delay 20ms rate 64kbit limit 20\"\ndown = \"delay 20ms rate 32kbit limit 20\"\n";
const RIPPLES: &str = "slave.environment.ripple = { share = 0.8, period_m = 0.1 }\n";
const CHANGES: &str = "slave.environment.ripple = { share = 0.8, period_m = 0.1 }\nslave.estimator.recommended.recursive.change.error_share = 0.01\n";
const SLIPS: &str = "slave.environment.friction_coefficient = 0.01\nslave.environment.damping_ns_per_m = 0.0\nslave.trigger.scheme = \"deadband 100%\"\n";

/// Keys that no run in virtual time reads: a plan with one of them is refused.
const NEVER: [&str; 3] = ["slave.plant", "slave.environment.coupling", "prior"];

const DELAY: &str = "up = \"delay 20ms\"\ndown = \"delay 20ms\"\n";

/// Digest of a run of some seconds, or why the plan is refused.
fn digest(base: &str, seconds: u64) -> Result<String, String> {
    let text = format!("duration_s = {seconds}\nseeds = {{ count = 1 }}\n[base]\n{base}\n");
    let plan = Plan::parse(&text).map_err(|error| error.to_string())?;
    let run = plan.row(1).unwrap().trial.run();
    run.map(|run| run.digest).map_err(|error| error.to_string())
}

/// Values that might be legal: the ends of what is accepted, and others.
fn candidates(known: &Known) -> Vec<String> {
    use toml::Value as V;
    let value = known.value.as_deref().unwrap_or_default();
    let given: toml::Table = toml::from_str(&format!("x = {value}")).unwrap();
    let numbers = |x: f64| -> Vec<f64> {
        let ends = known
            .accepted
            .split(' ')
            .filter_map(|word| word.trim_end_matches(';').parse().ok());
        ends.take(2)
            .chain([x * 1.5, x * 0.5, x + 0.1])
            .filter(|other| *other != x)
            .collect()
    };
    match &given["x"] {
        V::Boolean(is) => vec![(!is).to_string()],
        V::Integer(x) => numbers(*x as f64)
            .iter()
            .map(|x| format!("{x:.0}"))
            .collect(),
        V::Float(x) => numbers(*x).iter().map(|x| format!("{x:?}")).collect(),
        V::Array(list) if !list.is_empty() => {
            let scaled = |by: f64, more: f64| {
                let each = list.iter().map(|x| {
                    let x = x.as_float().or(x.as_integer().map(|x| x as f64)).unwrap();
                    format!("{:?}", x * by + more)
                });
                format!("[{}]", each.collect::<Vec<_>>().join(", "))
            };
            vec![scaled(0.5, 0.0), scaled(1.2, 0.0), scaled(1.0, 0.05)]
        }
        V::String(_) => {
            let words = known
                .accepted
                .split([',', ' '])
                .map(|word| word.trim_matches('\''));
            words
                .filter(|word| word.len() > 2)
                .map(|word| format!("{word:?}"))
                .collect()
        }
        _ => Vec::new(),
    }
}

/// What is wrong with a key: nothing shows that it is read.
fn wrong(known: &Known, mode: &str, usual: &str) -> Option<String> {
    let key = known.key.as_str();
    let alone = |value: &str| digest(&format!("{DELAY}{mode}{key} = {value}"), 5);
    if NEVER
        .iter()
        .any(|never| within(key, never) || key.ends_with(never))
    {
        let value = known.value.as_deref()?;
        let refused = alone(value).err().unwrap_or_default();
        return (!refused.contains("no effect")).then(|| format!("{key} is taken: {refused}"));
    }
    if let Some([_, setting, value, why]) = SOMETIMES.iter().find(|row| row[0] == key) {
        let over = ["up", "down"].map(|way| {
            let own = setting.contains(&format!("{way} = "));
            if own {
                String::new()
            } else {
                format!("{way} = \"delay 20ms\"\n")
            }
        });
        let setting = format!("{}{setting}", over.concat());
        let without = digest(&setting, 10);
        let with = digest(&format!("{setting}{key} = {value}"), 10);
        let same = without.is_err() || with.is_err() || without == with;
        return same.then(|| format!("{key} = {value}, not without that {why}: {with:?}"));
    }
    let changes = |value: &String| alone(value).is_ok_and(|digest| digest != usual);
    (!candidates(known).iter().any(changes))
        .then(|| format!("{key} changes nothing: {:?}", candidates(known)))
}

/// Checks every key of a mode that is chosen.
fn check(mode: Mode, chosen: fn(&str) -> bool) {
    let flags = vec![Flag::new("--mode", "slave.mode", &mode).unwrap()];
    let layers = Layers {
        program: Program::Sweep,
        file: "",
        flags: &flags,
        seed: None,
    };
    let mode = match mode {
        Mode::Recommended => "",
        Mode::Paper => "slave.mode = \"paper\"\n",
    };
    let usual = digest(&format!("{DELAY}{mode}"), 5).unwrap();
    let known = layers.known().unwrap();
    // networks are words, seeds are the plan's, the mode is given, and what is left out or empty has no value to change
    let wanted = known.iter().filter(|known| {
        let key = known.key.as_str();
        let other = ["up", "down", "seed", "slave.mode"].contains(&key) || key.ends_with(".seed");
        let has_value = known.value.as_deref().is_some_and(|value| value != "[]");
        chosen(key) && !other && has_value
    });
    let wrong: Vec<String> = wanted
        .filter_map(|known| wrong(known, mode, &usual))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_key_of_the_hand_and_the_session_changes_a_run_or_is_refused() {
    check(Mode::Recommended, |key| !within(key, "slave"));
}

#[test]
fn every_key_of_the_slave_changes_a_run_or_is_refused() {
    check(Mode::Recommended, |key| {
        within(key, "slave") && !within(key, "slave.estimator")
    });
}

#[test]
fn every_key_of_an_estimator_changes_a_run_or_is_refused() {
    for mode in [Mode::Recommended, Mode::Paper] {
        check(mode, |key| within(key, "slave.estimator"));
    }
}

#[test]
fn every_key_of_the_slave_in_paper_mode_changes_a_run_or_is_refused() {
    check(Mode::Paper, |key| {
        within(key, "slave") && !within(key, "slave.estimator")
    });
}
