//! What a session of a demo is made of: the arguments, and what viewers have changed since.

use mmt_client::io::console::SessionWish;
use mmt_netem::LinkConfig;
use mmt_server::playout::PlayoutConfig;
use mmt_server::slave::SlaveConfig;
use mmt_shared::model::settings::Mode;
use mmt_shared::range::in_range;
use mmt_shared::wire::Architecture;
use serde_json::{Value, json};

use super::SAMPLES_PER_COMMAND;
use crate::args::DemoArguments;
use crate::config::scene;
use crate::failure::Failure;

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

pub(super) fn up(arguments: &DemoArguments) -> &LinkConfig {
    arguments.netem_up.as_ref().unwrap_or(&arguments.netem)
}

pub(super) fn down(arguments: &DemoArguments) -> &LinkConfig {
    arguments.netem_down.as_ref().unwrap_or(&arguments.netem)
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

    /// The slave.
    ///
    /// # Errors
    /// The scene's file.
    pub(super) fn slave_config(&self) -> Result<SlaveConfig, Failure> {
        let arguments = &self.arguments;
        let mut config = SlaveConfig::of_mode(arguments.mode);
        config.seed = arguments.seed;
        if let Some(path) = &arguments.scene {
            config.scene = scene(path)?;
        }
        // where the tool may be felt the play-out finds out by itself how long it has to wait
        if !arguments.architecture.feels_tool() {
            let jitter = up(arguments).jitter_span();
            config.playout = PlayoutConfig::for_packing_and_jitter(SAMPLES_PER_COMMAND, jitter);
        }
        if let Some(scheme) = arguments.scheme {
            config.trigger.scheme = scheme;
        }
        config.repeats_ms = arguments.repeats.unwrap_or(config.repeats_ms);
        config.stretch_max = arguments.stretch_max.unwrap_or(config.stretch_max);
        let environment = &mut config.environment;
        environment.mass_kg = self.mass_kg.unwrap_or(environment.mass_kg);
        environment.friction_coefficient =
            self.friction.unwrap_or(environment.friction_coefficient);
        Ok(config)
    }

    /// Both networks, to be changed.
    pub(super) fn networks(&mut self) -> [&mut LinkConfig; 2] {
        let DemoArguments {
            netem,
            netem_up,
            netem_down,
            ..
        } = &mut self.arguments;
        [netem_up, netem_down].map(|way| way.get_or_insert_with(|| netem.clone()))
    }

    /// What the page shows of it and may change.
    pub(super) fn shown(&self) -> [(&'static str, Value); 2] {
        let arguments = &self.arguments;
        let (up, down) = (up(arguments).to_string(), down(arguments).to_string());
        let session = self.slave_config().ok().map(|config| {
            let environment = &config.environment;
            // of several bodies none is the object
            let one = config.scene.bodies.is_empty();
            json!({
                "mode": arguments.mode,
                "architecture": arguments.architecture.name(),
                "scheme": config.trigger.scheme.to_string(),
                "mass_kg": one.then_some(environment.mass_kg),
                "friction": one.then_some(environment.friction_coefficient),
            })
        });
        [
            ("network", json!({"up": up, "down": down})),
            ("settings", json!(session)),
        ]
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
            Some("paper") => arguments.mode = Mode::Paper,
            Some("recommended") => arguments.mode = Mode::Recommended,
            Some(other) => return Err(format!("no mode {other:?}")),
        }
        if let Some(name) = &wish.architecture {
            let found = Architecture::ALL.into_iter().find(|of| of.name() == name);
            arguments.architecture = found.ok_or_else(|| format!("no architecture {name:?}"))?;
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::args::{Arguments, Command};
    use clap::Parser;

    fn setting() -> Setting {
        match Arguments::parse_from(["mmt", "demo", "--scheme", "timer 100ms"]).command {
            Command::Demo(arguments) => Setting::new(&arguments),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_play_out_waits_for_packing_and_the_whole_jitter() {
        let peak_to_peak = |text: &str| {
            let link: LinkConfig = text.parse().unwrap();
            link.jitter_span()
        };
        assert_eq!(peak_to_peak("delay 50ms"), Duration::ZERO);
        assert_eq!(peak_to_peak("delay 50ms 5ms"), Duration::from_millis(10));
        let normal = peak_to_peak("delay 50ms 4ms distribution normal");
        assert_eq!(normal, Duration::from_millis(20));
        let playout = PlayoutConfig::for_packing_and_jitter(10, peak_to_peak("delay 50ms 5ms"));
        assert_eq!(playout.delay_ms, 21.0);
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
        let config = before.wished(&wish).unwrap().slave_config().unwrap();
        let own = SlaveConfig::of_mode(Mode::Paper);
        assert_eq!(config.mode, Mode::Paper);
        assert_eq!(config.trigger.scheme, own.trigger.scheme, "the mode's own");
        assert_eq!(config.environment.mass_kg, 1.5);
        assert_eq!(config.environment.friction_coefficient, 0.3);
        let same = before.wished(&SessionWish::default()).unwrap();
        let (same, before) = (same.slave_config().unwrap(), before.slave_config().unwrap());
        assert_eq!(same.trigger.scheme, before.trigger.scheme);
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
        let down = down(&setting.arguments).clone();
        let [up, _] = setting.networks();
        *up = "delay 1ms".parse().unwrap();
        assert_eq!(super::down(&setting.arguments), &down);
        assert_ne!(super::up(&setting.arguments), &down);
    }
}
