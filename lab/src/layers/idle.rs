//! Keys that cannot change a run, whatever happens in it, and what to do instead.
//!
//! A key that only did not happen to matter is not named here: whether a long pause comes, or a force that reaches a limit,
//! nobody knows before the run. The test of this file tries every key that a sweep has.

#[cfg(test)]
mod tests;

use mmt_server::environment::Shape;
use mmt_server::trigger::{MismatchMetric, Scheme};
use mmt_shared::model::settings::Mode;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys::{at, within};
use super::program::Program;
use crate::text_error::TextError;
use crate::world::WorldConfig;

/// k_p of the device.
pub(crate) const DEVICE_STIFFNESS: &str = "stiffness_n_per_m";
/// k_p of the local model, where it is not the device's: in virtual time only.
pub(crate) const MODEL_STIFFNESS: &str = "settings.coupling.stiffness_n_per_m";

/// Keys of the body in `[environment]`, which the bodies of a scene have as well.
const OF_BODY: [&str; 9] = [
    "side_m",
    "shape",
    "centre_of_mass_m",
    "mass_kg",
    "friction_coefficient",
    "static_ratio",
    "damping_ns_per_m",
    "rotational_damping_nms",
    "pose",
];

/// Why a key cannot change a run of this configuration, and what to do; none if it may.
pub(crate) fn idle(config: &WorldConfig, key: &str) -> Option<&'static str> {
    never(key)
        .or_else(|| of_operator(config, key))
        .or_else(|| of_environment(config, key))
        .or_else(|| of_bodies(config, key))
        .or_else(|| of_vision(config, key))
        .or_else(|| of_trigger(config, key))
        .or_else(|| of_tool_energy(config, key))
        .or_else(|| of_architecture(config, key))
}

/// Why a key cannot change a run in virtual time, and what to do; none if it may.
pub(crate) fn idle_in_sweep(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let of_plant = "nothing can be plugged into virtual time; leave it out";
    within(key, "slave.plant")
        .then_some(of_plant)
        .or_else(|| idle(config, key))
        .or((!Program::Sweep.uses(key)).then_some("leave it out"))
}

/// Refuses a k_p of the device beside another one of the model, where both count.
pub(super) fn agree(text: &str, given: &DeTable) -> Result<(), TextError> {
    let [device, model] = [DEVICE_STIFFNESS, MODEL_STIFFNESS].map(|key| at(given, key));
    match (device, model) {
        (Some(device), Some(model)) if number(device) != number(model) => {
            let what = format!(
                "`{DEVICE_STIFFNESS}` has no effect: `{MODEL_STIFFNESS}` gives the model another k_p; leave one of them out"
            );
            Err(TextError::at(text, Some(device.span()), what))
        }
        _ => Ok(()),
    }
}

fn number(value: &Spanned<DeValue>) -> Option<f64> {
    let value = value.get_ref();
    let written = value.as_float().map(|float| float.as_str());
    let written = written.or_else(|| value.as_integer().map(|integer| integer.as_str()));
    written?.parse().ok()
}

/// What no run reads.
fn never(key: &str) -> Option<&'static str> {
    if within(key, "slave.environment.coupling") {
        return Some(
            "a session has the coupling of its device; give `stiffness_n_per_m`, or for the real contact `slave.environment.contact`",
        );
    }
    let of_start = "the estimator starts from `slave.start`; give it there";
    key.ends_with(".prior").then_some(of_start)
}

fn of_operator(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let operator = &config.operator;
    let (still, why) = match key {
        "operator.nudge_m" => (
            operator.dwell_s,
            "without `operator.dwell_s` the operator does not nudge; give that as well",
        ),
        "operator.slow_hz" => (operator.slow_share, "`operator.slow_share` is 0"),
        "operator.fast_hz" => (operator.fast_share, "`operator.fast_share` is 0"),
        "operator.hand.tremor_hz" => (operator.hand.tremor_m, "`operator.hand.tremor_m` is 0"),
        _ => return None,
    };
    (still == 0.0).then_some(why)
}

fn of_environment(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let (environment, scene) = (&config.slave.environment, &config.slave.scene);
    if key == "slave.scene.contact_friction" {
        let alone = scene.bodies.len() <= 1 && scene.walls.is_empty() && environment.wall.is_none();
        return alone.then_some("one body without a wall meets nothing; give another or a wall");
    }
    let key = key.strip_prefix("slave.environment.")?;
    if !scene.bodies.is_empty() && OF_BODY.iter().any(|of_body| within(key, of_body)) {
        return Some(
            "`slave.scene.bodies` stand in the place of the body of `slave.environment`; give it to one of them",
        );
    }
    if key == "side_m" && environment.shape != Shape::Square {
        return Some("only a square has a side; the shape has its own measures");
    }
    let flat = environment.ripple.is_some_and(|ripple| ripple.share == 0.0);
    (key == "ripple.period_m" && flat).then_some("the share of the ripple is 0")
}

/// Of the bodies of a scene, which are numbered from 0: `slave.scene.bodies.0.side_m`.
fn of_bodies(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let key = key.strip_prefix("slave.scene.bodies.")?;
    let (number, key) = key.split_once('.')?;
    let body = config
        .slave
        .scene
        .bodies
        .get(number.parse::<usize>().ok()?)?;
    let of_square = key == "side_m" && body.shape != Shape::Square;
    of_square.then_some("only a square has a side; the shape has its own measures")
}

fn of_vision(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let vision = &config.slave.sensing.vision;
    let blind = vision.rate_hz == 0.0;
    match key {
        // the noise of place and angle is that of the pose at the start as well, which decides what touch teaches of the faces
        // and whether an untouched object is sent
        "slave.sensing.vision.position_noise_m"
            if blind
                && config.slave.mode == Mode::Paper
                && config.slave.trigger.free_space_error_m == 0.0 =>
        {
            Some(
                "paper mode learns no faces, and `slave.sensing.vision.rate_hz` and `slave.trigger.free_space_error_m` are 0: nothing asks how sure the place is",
            )
        }
        "slave.sensing.vision.latency_ms" | "slave.sensing.vision.size_noise_m" if blind => {
            Some("`slave.sensing.vision.rate_hz` is 0: there are no images")
        }
        "slave.start.side_m" if !blind && vision.size_noise_m.is_some() => Some(
            "with `slave.sensing.vision.size_noise_m` the model starts from the size that images show; leave one of them out",
        ),
        _ => None,
    }
}

fn of_trigger(config: &WorldConfig, key: &str) -> Option<&'static str> {
    use Scheme as S;
    let key = key.strip_prefix("slave.trigger.")?;
    // a time may be given by its `secs` and `nanos`
    let key = key.split('.').next()?;
    let trigger = &config.slave.trigger;
    let by_force = trigger.metric == MismatchMetric::Force;
    let (used, why) = match (key, trigger.scheme) {
        ("timer_in_free_space", scheme) => (
            matches!(scheme, S::Hybrid { .. }),
            "only the scheme `hybrid` asks whether its timer runs in free space",
        ),
        ("timer_carries_pose", scheme) => (
            !matches!(scheme, S::Deadband { .. } | S::EverySample),
            "this scheme has no timer",
        ),
        ("free_space_error_m", S::EverySample) => (false, "every sample is sent anyway"),
        (
            "metric" | "force_floor_n" | "judged_over",
            S::Timer { .. } | S::EverySample | S::Dis { .. },
        ) => (false, "this scheme has no deadband"),
        ("judge_sticking", S::Timer { .. } | S::EverySample) => {
            (false, "this scheme does not judge the force")
        }
        ("judge_sticking", S::Dis { .. }) => return None,
        ("judge_sticking", _) => (by_force, "`slave.trigger.metric` is not the force"),
        ("force_floor_n" | "judged_over", S::Deadband { .. } | S::Hybrid { .. }) => {
            (by_force, "`slave.trigger.metric` is not the force")
        }
        _ => return None,
    };
    (!used).then_some(why)
}

fn of_tool_energy(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let key = key.strip_prefix("slave.tool_energy.")?;
    if config.architecture.feels_tool() && matches!(key, "bounded" | "share") {
        return Some("with this architecture each port has a bound of its own");
    }
    let is_free = key == "share" && !config.slave.tool_energy.bounded;
    is_free.then_some("`slave.tool_energy.bounded` is false, as in paper mode; give that as well")
}

fn of_architecture(config: &WorldConfig, key: &str) -> Option<&'static str> {
    let packed = matches!(key, "samples_per_command" | "repeat_samples");
    (packed && config.architecture.feels_tool())
        .then_some("with this architecture each sample goes up alone, once")
}
