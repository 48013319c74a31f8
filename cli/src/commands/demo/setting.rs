//! What a session of a demo is made of: the arguments, and what viewers have changed since.

use mmt_client::io::console::SessionWish;
use mmt_lab::layers::Program;
use mmt_lab::world::WorldConfig;
use mmt_netem::LinkConfig;
use mmt_server::plant::PlantConfig;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::settings::Mode;
use mmt_shared::pairing::Pairing;
use mmt_shared::range::in_range;
use serde_json::{Value, json};

use crate::args::DemoArguments;
use crate::commands::device;
use crate::failure::Failure;
use crate::view::Caption;

/// Masses that a viewer may choose, kg: what a force of 8 N moves well.
const MASS_KG: (f64, f64) = (0.1, 3.0);
/// Friction coefficients that a viewer may choose.
const FRICTION: (f64, f64) = (0.02, 1.0);

/// The setting of a session.
#[derive(Clone, Debug)]
pub(super) struct Setting {
    /// As they were given, and as viewers have changed them.
    pub(super) arguments: DemoArguments,
    /// The object's mass, kg, if a viewer chose it.
    mass_kg: Option<f64>,
    /// The friction coefficient, if a viewer chose it.
    friction: Option<f64>,
}

impl Setting {
    /// The arguments' own.
    pub(super) fn new(arguments: &DemoArguments) -> Self {
        Self {
            arguments: arguments.clone(),
            mass_kg: None,
            friction: None,
        }
    }

    /// The configuration of both sides.
    ///
    /// # Errors
    /// The files of configuration and scene.
    pub(super) fn config(&self) -> Result<WorldConfig, Failure> {
        let arguments = &self.arguments;
        let path = arguments.config.as_deref();
        let flags = arguments.flags()?;
        let mut config = device::configuration(Program::Demo, path, &flags, &arguments.device)?;
        // nothing can be plugged in here
        config.slave.plant = PlantConfig::default();
        let environment = &mut config.slave.environment;
        environment.mass_kg = self.mass_kg.unwrap_or(environment.mass_kg);
        environment.friction_coefficient =
            self.friction.unwrap_or(environment.friction_coefficient);
        Ok(config)
    }

    /// Both networks, to be changed.
    ///
    /// # Errors
    /// As [`Self::config`].
    pub(super) fn networks(&mut self) -> Result<[&mut LinkConfig; 2], Failure> {
        let WorldConfig { up, down, .. } = self.config()?;
        let DemoArguments {
            netem_up,
            netem_down,
            ..
        } = &mut self.arguments;
        Ok([netem_up.insert(up), netem_down.insert(down)])
    }

    /// What the page shows of it and may change.
    pub(super) fn shown(&self) -> [(&'static str, Value); 2] {
        let config = self.config().ok();
        let network = config.as_ref().map(
            |WorldConfig { up, down, .. }| json!({"up": up.to_string(), "down": down.to_string()}),
        );
        let session = config.map(|config| {
            let (slave, environment) = (&config.slave, &config.slave.environment);
            // of several bodies none is the object
            let one = slave.scene.bodies.is_empty();
            json!({
                "mode": slave.mode,
                "architecture": config.architecture.name(),
                "scheme": slave.trigger.scheme.to_string(),
                "mass_kg": one.then_some(environment.mass_kg),
                "friction": one.then_some(environment.friction_coefficient),
            })
        });
        [("network", json!(network)), ("settings", json!(session))]
    }

    /// The setting that a viewer wishes.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(super) fn wished(&self, wish: &SessionWish) -> Result<Self, String> {
        let mut next = self.clone();
        let arguments = &mut next.arguments;
        match wish.mode.as_deref() {
            None => {}
            Some("paper") => arguments.mode = Some(Mode::Paper),
            Some("recommended") => arguments.mode = Some(Mode::Recommended),
            Some(other) => return Err(format!("no mode {other:?}")),
        }
        if let Some(name) = &wish.architecture {
            let found = Architecture::ALL.into_iter().find(|of| of.name() == name);
            arguments.architecture =
                Some(found.ok_or_else(|| format!("no architecture {name:?}"))?);
        }
        match wish.scheme.as_deref() {
            None => {}
            Some("") => arguments.scheme = None,
            Some(words) => {
                let scheme = words.parse();
                arguments.scheme = Some(
                    scheme.map_err(|error: mmt_server::trigger::SchemeError| error.to_string())?,
                );
            }
        }
        for (name, unit, value, range, own) in [
            ("mass", "kg", wish.mass_kg, MASS_KG, &mut next.mass_kg),
            (
                "friction coefficient",
                "",
                wish.friction,
                FRICTION,
                &mut next.friction,
            ),
        ] {
            if let Some(value) = value {
                in_range(name, unit, value, range).map_err(|error| error.to_string())?;
                *own = Some(value);
            }
        }
        Ok(next)
    }
}

/// What a view has above the numbers of a session with this setting.
pub(super) fn caption(
    arguments: &DemoArguments,
    config: &WorldConfig,
    pairing: &Pairing,
) -> Caption {
    let (slave, environment) = (&config.slave, &config.slave.environment);
    let m = environment.mass_kg;
    let c = environment.friction_coefficient * m * environment.gravity_m_per_s2;
    let mode = match slave.mode {
        Mode::Paper => "paper",
        Mode::Recommended => "recommended",
    };
    let (scheme, seed) = (slave.trigger.scheme, config.seed);
    let network = match (&config.up, &config.down) {
        (up, down) if up == down => format!("network each way: {up}"),
        (up, down) => format!("network up: {up}, down: {down}"),
    };
    let mode = match config.architecture {
        Architecture::Mmt => mode.to_owned(),
        other => format!("{mode}, {}", other.name()),
    };
    Caption {
        command: "demo",
        duration_s: Some(arguments.duration.as_secs_f64()),
        setting: format!("{mode}, {scheme}; {network}; seed {seed}"),
        slave: pairing.address.to_string(),
        // of several bodies the one that is touched counts
        truth: (slave.scene.bodies.is_empty()).then_some([m, environment.damping_ns_per_m, c]),
    }
}

#[cfg(test)]
mod tests {
    use mmt_client::commands::CommandConfig;
    use mmt_server::slave::SlaveConfig;

    use super::*;
    use crate::args::{Arguments, Command};
    use clap::Parser;

    fn setting() -> Setting {
        of(&["--scheme", "timer 100ms"])
    }

    fn of(words: &[&str]) -> Setting {
        match Arguments::parse_from(["mmt", "demo"].iter().chain(words)).command {
            Command::Demo(arguments) => Setting::new(&arguments),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_play_out_waits_for_packing_and_the_whole_jitter() {
        let delay_ms = |words: &[&str]| of(words).config().unwrap().slave.playout.delay_ms;
        let own = SlaveConfig::default().playout.delay_ms;
        assert_eq!(delay_ms(&[]), 21.0);
        assert_eq!(delay_ms(&["--netem", "delay 50ms"]), 11.0);
        let normal = "delay 50ms 4ms distribution normal";
        assert_eq!(delay_ms(&["--netem-up", normal]), 31.0);
        assert_eq!(delay_ms(&["--architecture", "tdpa"]), own);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mmt.toml");
        std::fs::write(&path, "[slave.playout]\ndelay_ms = 33\n").unwrap();
        assert_eq!(delay_ms(&["--config", path.to_str().unwrap()]), 33.0);
    }

    #[test]
    fn without_a_file_it_is_the_default_over_the_documented_network() {
        let config = of(&["--seed", "7"]).config().unwrap();
        let network = LinkConfig::default();
        assert_ne!((&config.up, &config.down), (&network, &network));
        let slave = SlaveConfig {
            seed: 7,
            playout: config.slave.playout,
            ..SlaveConfig::default()
        };
        assert_eq!((config.seed, config.operator.seed), (7, 7));
        assert_eq!(config.slave, slave);
        assert_eq!(
            config.samples_per_command,
            CommandConfig::default().samples_per_command
        );
        let paper = of(&["--mode", "paper"]).config().unwrap();
        assert_eq!(
            paper.stretch_max, paper.slave.stretch_max,
            "both sides stretch as far"
        );
    }

    #[test]
    fn what_is_wished_is_what_the_next_slave_gets_and_the_rest_stays() {
        let wish = SessionWish {
            mode: Some("paper".to_owned()),
            scheme: Some(String::new()),
            mass_kg: Some(1.5),
            ..SessionWish::default()
        };
        let before = setting();
        let config = before.wished(&wish).unwrap().config().unwrap().slave;
        let own = SlaveConfig::of_mode(Mode::Paper);
        assert_eq!(config.mode, Mode::Paper);
        assert_eq!(config.trigger.scheme, own.trigger.scheme, "the mode's own");
        assert_eq!(config.environment.mass_kg, 1.5);
        assert_eq!(config.environment.friction_coefficient, 0.3);
        let same = before.wished(&SessionWish::default()).unwrap();
        assert_eq!(same.config().unwrap(), before.config().unwrap());
    }

    #[test]
    fn a_wish_that_cannot_be_is_refused_in_words() {
        let refused = |wish: SessionWish| setting().wished(&wish).unwrap_err();
        let none = SessionWish::default();
        let mass_kg = Some(f64::NAN);
        assert!(
            refused(SessionWish {
                mass_kg,
                ..none.clone()
            })
            .contains("mass")
        );
        let scheme = Some("sometimes".to_owned());
        assert!(
            refused(SessionWish {
                scheme,
                ..none.clone()
            })
            .contains("sometimes")
        );
        let mode = Some("magic".to_owned());
        assert!(refused(SessionWish { mode, ..none }).contains("magic"));
    }

    #[test]
    fn a_network_that_is_changed_in_one_direction_stays_in_the_other() {
        let mut setting = setting();
        let before = setting.config().unwrap();
        let [up, _] = setting.networks().unwrap();
        *up = "delay 1ms".parse().unwrap();
        let after = setting.config().unwrap();
        assert_eq!(after.down, before.down);
        assert_ne!(after.up, before.up);
    }
}
