//! Configurations, plans, scenes, device files and rows of a sweep: what is accepted can run, and is what it is when it is
//! written and read again.

use mmt_client::device::DeviceProfile;
use mmt_client::device::inverse3::Inverse3;
use mmt_client::device::link::{DeviceFile, DeviceKind, DeviceLink};
use mmt_client::device::two_diy::TwoDiy;
use mmt_lab::layers::{Layers, Program};
use mmt_lab::sweep::{Plan, Results};
use mmt_lab::world::{World, WorldConfig};
use mmt_server::environment::{Environment, EnvironmentConfig, SceneConfig};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK;

use super::inputs;
use super::outcome::Outcome;
use super::plug::TOKEN;

/// The first byte asks for a program.
pub(super) fn layers(input: &[u8]) -> Outcome {
    let (program, text) = input.split_first().unwrap_or((&0, &[]));
    let program = Program::ALL[usize::from(*program) % Program::ALL.len()];
    let Ok(text) = std::str::from_utf8(text) else {
        return Outcome::refused(&"no text");
    };
    let layers = Layers {
        program,
        file: text,
        flags: &[],
        seed: Some(1),
    };
    let read = layers.config();
    match &read {
        Ok(config) => runs(config, program),
        Err(why) => {
            // what is wrong is named in a few lines
            assert!(why.to_string().len() <= 4 * text.len() + 20_000, "{why}");
        }
    }
    Outcome::of(read)
}

/// What is accepted runs for a moment and stays of numbers; what is written of it reads as the same.
fn runs(config: &WorldConfig, program: Program) {
    let written = serde_json::to_string(config).unwrap();
    let again: WorldConfig = serde_json::from_str(&written).unwrap();
    assert_eq!(again, *config, "{written}");
    let mut config = config.clone();
    // a live program asks its device
    if program != Program::Sweep {
        config.stiffness_n_per_m = None;
    }
    let mut world = World::try_new(&config).unwrap();
    world.run(TICK * 30, |tick| {
        let force = tick.master.hand_force;
        assert!(force.x.is_finite() && force.y.is_finite());
        assert!(force.norm() <= 8.001, "{force:?}");
    });
}

pub(super) fn plan(input: &[u8]) -> Outcome {
    let Ok(text) = std::str::from_utf8(input) else {
        return Outcome::refused(&"no text");
    };
    let read = Plan::parse(text);
    match &read {
        Ok(plan) => {
            assert!((1..=1_000_000).contains(&plan.rows()));
            let (first, last) = (plan.row(1).unwrap(), plan.row(plan.rows()).unwrap());
            assert_eq!((first.number, last.number), (1, plan.rows()));
            assert!(plan.row(0).is_none() && plan.row(plan.rows() + 1).is_none());
            assert_eq!(first.values.len(), plan.keys().count());
            World::try_new(&last.trial.config).unwrap();
        }
        Err(why) => assert!(why.to_string().len() <= 4 * text.len() + 20_000, "{why}"),
    }
    Outcome::of(read)
}

pub(super) fn scene(input: &[u8]) -> Outcome {
    let Ok(text) = std::str::from_utf8(input) else {
        return Outcome::refused(&"no text");
    };
    let scene: SceneConfig = match toml::from_str(text) {
        Ok(scene) => scene,
        Err(why) => return Outcome::refused(&why.message()),
    };
    let written = toml::to_string(&scene).unwrap();
    let again: SceneConfig = toml::from_str(&written).unwrap();
    // as text: it may hold what is no number, and is refused for it below
    assert_eq!(format!("{again:?}"), format!("{scene:?}"));
    match Environment::of_scene(EnvironmentConfig::default(), &scene) {
        Ok(mut environment) => {
            for tick in 0..5 {
                let met = environment.step(
                    Vec2::new(-0.19 + 0.001 * f64::from(tick), 0.0),
                    Vec2::new(1.0, 0.0),
                );
                assert!(
                    met.force.x.is_finite() && met.force.y.is_finite(),
                    "{met:?}"
                );
                assert!(met.pose.is_finite());
            }
            Outcome::taken(environment.poses().len().min(8) as u64)
        }
        Err(why) => Outcome::refused(&why),
    }
}

pub(super) fn device(input: &[u8]) -> Outcome {
    let (kind, text) = input.split_first().unwrap_or((&0, &[]));
    let kind = DeviceKind::ALL[usize::from(kind % 3)];
    let Ok(text) = std::str::from_utf8(text) else {
        return Outcome::refused(&"no text");
    };
    let file: DeviceFile = match toml::from_str(text) {
        Ok(file) => file,
        Err(why) => return Outcome::refused(&why.message()),
    };
    let config = match file.device(kind) {
        Ok(config) => config,
        Err(why) => return Outcome::refused(&why),
    };
    let made = match kind {
        DeviceKind::Link => DeviceLink::try_new(config, TOKEN).map(drop),
        DeviceKind::Inverse3 => Inverse3::try_new(config).map(drop),
        DeviceKind::TwoDiy => TwoDiy::try_new(config).map(drop),
    };
    if let Err(why) = made {
        return Outcome::refused(&why);
    }
    match DeviceProfile::plugged_in(&config) {
        Ok(profile) => {
            let tuning = config.tuning();
            assert!(
                tuning.playout_s.is_finite()
                    && tuning.playout_s >= 0.0
                    && !tuning.silence.is_zero()
            );
            assert!((50.0..=10_000.0 * 100.0).contains(&profile.coupling().stiffness_n_per_m));
            Outcome::taken(kind as u64)
        }
        Err(why) => Outcome::refused(&why),
    }
}

pub(super) fn sweep_part(input: &[u8]) -> Outcome {
    let plan = inputs::small_plan();
    let mut results = Results::default();
    let added = results.add_part(&plan, "part", input);
    assert!(results.done() <= plan.rows());
    assert_eq!(
        results.missing(&plan).count() as u64 + results.done(),
        plan.rows()
    );
    let (header, records) = results.table(&plan);
    assert!(records.iter().all(|record| record.len() == header.len()));
    if added.is_ok() {
        assert!(results.add_part(&plan, "again", input).is_ok());
        assert_eq!(
            results.to_csv(&plan).is_some(),
            results.done() == plan.rows()
        );
    }
    Outcome::of(added)
}
