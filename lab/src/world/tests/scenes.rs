//! The scenes that the documents show, pushed about by the scripted operator.

use super::*;
use mmt_server::environment::SceneConfig;
use mmt_shared::model::settings::Mode;

#[test]
fn the_documented_scenes_run_and_nothing_leaves_its_bounds() {
    let scenes = [
        include_str!("../../../../docs/scenes/row.toml"),
        include_str!("../../../../docs/scenes/corner.toml"),
    ];
    for (text, mode) in scenes.iter().zip([Mode::Paper, Mode::Recommended]) {
        let scene: SceneConfig = toml::from_str(text).unwrap();
        let bodies = scene.bodies.len();
        let mut config = over("none", 1);
        config.slave = SlaveConfig {
            scene,
            ..SlaveConfig::of_mode(mode)
        };
        let mut world = World::try_new(&config).unwrap();
        let start: Vec<_> = (0..bodies)
            .map(|k| world.slave().environment().pose_of(k))
            .collect();
        for _ in 0..15_000 {
            let tick = world.step();
            let force = tick.slave.map_or(0.0, |slave| slave.true_force.norm());
            assert!(force < 40.0, "{force} N");
        }
        let moved = (0..bodies)
            .filter(|k| world.slave().environment().pose_of(*k) != start[*k])
            .count();
        assert!(moved >= 2, "only {moved} bodies moved");
        // the paper's way of setting the pose is not passive
        assert!(mode == Mode::Paper || world.outcome().energy_injected_j < 1e-6);
    }
}
