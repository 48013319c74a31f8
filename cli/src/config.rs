//! The files of a configuration, a scene and a device: TOML, unknown keys are errors with line and caret.
//!
//! One configuration serves every program (`mmt_lab::layers`); what a file leaves out is the mode's, and the command line
//! comes before the file.

use std::path::{Path, PathBuf};

use mmt_client::device::link::{DeviceFile, DeviceKind, DeviceLinkConfig};
use mmt_lab::layers::{Flag, Layers, Program};
use mmt_lab::text_error::TextError;
use mmt_lab::world::WorldConfig;
use mmt_netem::LinkConfig;
use mmt_server::environment::SceneConfig;
use serde::Serialize;

use crate::failure::Failure;
use crate::input::read_text;

/// The option with the file of a scene.
const SCENE: &str = "--scene";

/// What the command line sets of a configuration.
#[derive(Debug, Default)]
pub(crate) struct Flags {
    keys: Vec<Flag>,
    seed: Option<u64>,
    /// The file of the scene.
    scene: Option<PathBuf>,
}

impl Flags {
    /// The seed of everything.
    pub(crate) fn seed(mut self, seed: Option<u64>) -> Self {
        self.seed = seed;
        self
    }

    /// Where the flag is given it sets these keys.
    pub(crate) fn set(
        mut self,
        name: &'static str,
        keys: &[&'static str],
        value: Option<impl Serialize>,
    ) -> Self {
        if let Some(value) = value {
            let flags = keys.iter().filter_map(|key| Flag::new(name, key, &value));
            self.keys.extend(flags);
        }
        self
    }

    /// The same for the networks at these keys, `up` and `down`.
    pub(crate) fn network(
        mut self,
        name: &'static str,
        keys: &[&'static str],
        network: Option<&LinkConfig>,
    ) -> Self {
        if let Some(network) = network {
            let flags = keys.iter().map(|key| Flag::network(name, key, network));
            self.keys.extend(flags);
        }
        self
    }

    /// The same for bodies and walls in a file of their own.
    ///
    /// # Errors
    /// The file cannot be read, is no TOML, or is no scene.
    pub(crate) fn scene(mut self, path: Option<&Path>) -> Result<Self, Failure> {
        if let Some(path) = path {
            let (scene, text) = scene(path)?;
            let flag = Flag::new(SCENE, "slave.scene", &scene);
            self.keys.extend(flag.map(|flag| flag.read_from(text)));
            self.scene = Some(path.to_owned());
        }
        Ok(self)
    }
}

/// The file of a configuration, read.
pub(crate) struct ConfigFile<'a> {
    path: Option<&'a Path>,
    pub(crate) text: String,
}

impl<'a> ConfigFile<'a> {
    /// Reads it, if there is one.
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn read(path: Option<&'a Path>) -> Result<Self, Failure> {
        let text = path.map(|path| read_text(path, "the configuration"));
        Ok(Self {
            path,
            text: text.transpose()?.unwrap_or_default(),
        })
    }

    /// What is made of it and the command line.
    ///
    /// # Errors
    /// What is wrong with the file, or with a flag.
    pub(crate) fn with<T>(
        &self,
        program: Program,
        flags: &Flags,
        read: impl FnOnce(Layers) -> Result<T, TextError>,
    ) -> Result<T, Failure> {
        let layers = Layers {
            program,
            file: &self.text,
            flags: &flags.keys,
            seed: flags.seed,
        };
        read(layers).map_err(|error| match (error.option(), &flags.scene, self.path) {
            (Some(SCENE), Some(path), _) => refused_scene(path, &error),
            (Some(_), ..) | (None, _, None) => Failure::usage(error).remedy("change that option"),
            (None, _, Some(path)) => {
                refused(path, "the configuration", "docs/configuration.md", &error)
            }
        })
    }
}

/// The configuration of a program: the file's, if there is one, and over it what the command line sets.
///
/// # Errors
/// The file cannot be read, is no TOML, or is no configuration; a number is out of range.
pub(crate) fn configuration(
    program: Program,
    path: Option<&Path>,
    flags: &Flags,
) -> Result<WorldConfig, Failure> {
    ConfigFile::read(path)?.with(program, flags, |layers| layers.config())
}

/// The device of this kind that is to be plugged in, with the keys of a file, if there is one.
///
/// # Errors
/// The file cannot be read, is no TOML, or is no device of this kind.
pub(crate) fn device_config(
    kind: DeviceKind,
    path: Option<&Path>,
) -> Result<DeviceLinkConfig, Failure> {
    let file = path.map_or(Ok(DeviceFile::default()), |path| {
        let text = read_text(path, "the device")?;
        let read = toml::from_str(&text).map_err(|error| TextError::of(&text, &error));
        read.map_err(|error| refused(path, "the device", "docs/plugs.md", &error))
    });
    file?.device(kind).map_err(|error| {
        Failure::usage(error).remedy("change that key in --device-config, or the device")
    })
}

/// The scene of a file, and its text.
///
/// # Errors
/// The file cannot be read, is no TOML, or is no scene.
fn scene(path: &Path) -> Result<(SceneConfig, String), Failure> {
    let text = read_text(path, "the scene")?;
    let read = toml::from_str(&text).map_err(|error| TextError::of(&text, &error));
    let scene = read.map_err(|error| refused_scene(path, &error))?;
    Ok((scene, text))
}

fn refused_scene(path: &Path, error: &TextError) -> Failure {
    refused(path, "the scene", "docs/scenes.md", error)
}

fn refused(path: &Path, what: &str, page: &str, error: &TextError) -> Failure {
    Failure::usage(format!("{what} {}: {error}", path.display()))
        .remedy(format!("correct that place; {page} describes every key"))
}

#[cfg(test)]
mod tests {
    use mmt_server::slave::SlaveConfig;
    use mmt_server::trigger::{Scheme, TriggerConfig};
    use mmt_shared::model::settings::Mode;

    use super::*;

    fn parse(text: &str, mode: Option<Mode>) -> Result<SlaveConfig, TextError> {
        let flags = Flags::default().set("--mode", &["slave.mode"], mode);
        let layers = Layers {
            program: Program::Slave,
            file: text,
            flags: &flags.keys,
            seed: None,
        };
        layers.config().map(|config| config.slave)
    }

    #[test]
    fn an_empty_file_is_the_default_and_a_mode_alone_is_that_mode() {
        assert_eq!(parse("", None), Ok(SlaveConfig::default()));
        let paper = SlaveConfig::of_mode(Mode::Paper);
        assert_eq!(parse("mode = \"paper\"", None), Ok(paper.clone()));
        assert_eq!(
            parse("mode = \"recommended\"", Some(Mode::Paper)),
            Ok(paper)
        );
    }

    #[test]
    fn what_a_table_leaves_out_is_the_modes() {
        let text =
            "mode = \"paper\"\n[trigger]\nforce_floor_n = 0.1\n[environment]\nmass_kg = 1.5\n";
        let config = parse(text, None).unwrap();
        assert_eq!(config.environment.mass_kg, 1.5);
        let paper = TriggerConfig::of_mode(Mode::Paper);
        let expected = TriggerConfig {
            force_floor_n: 0.1,
            ..paper
        };
        assert_eq!(config.trigger, expected);
    }

    #[test]
    fn a_body_its_ground_and_its_wall_are_written_as_the_documents_show() {
        let text = include_str!("../../docs/physics.md");
        let examples: Vec<_> = text
            .split("```toml\n")
            .skip(1)
            .filter_map(|rest| rest.split("```").next())
            .collect();
        assert!(examples.len() >= 2);
        for example in examples {
            let config = parse(example, None).unwrap();
            assert_ne!(config.environment, SlaveConfig::default().environment);
            mmt_server::environment::Environment::try_new(config.environment).unwrap();
        }
        let error = parse("[environment.shape.disc]\nradius_m = 0.1\n", None).unwrap_err();
        assert!(error.to_string().contains("radius_m"), "{error}");
    }

    #[test]
    fn a_scene_that_is_wrong_is_named_with_line_and_caret() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, "[[bodies]]\nmas_kg = 1.0\n").unwrap();
        let text = scene(&path).unwrap_err().to_string();
        for part in ["the scene", "scene.toml", "line 2", "^^^^^^", "scenes.md"] {
            assert!(text.contains(part), "{text}");
        }
        let config = parse("[scene]\n[[scene.bodies]]\nmass_kg = 2.0\n", None).unwrap();
        assert_eq!(config.scene.bodies[0].mass_kg, 2.0);
    }

    #[test]
    fn a_scheme_is_written_in_words() {
        let text = "[trigger]\nscheme = \"deadband 5%\"\n";
        assert_eq!(
            parse(text, None).unwrap().trigger.scheme,
            Scheme::Deadband { delta: 0.05 }
        );
    }

    #[test]
    fn an_unknown_key_is_an_error_with_line_and_caret() {
        let error = parse("seed = 1\n[environment]\nmas_kg = 1.0\n", None).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("line 3") && text.contains("^^^^^^"), "{text}");
        assert!(
            text.contains("mas_kg") && text.contains("mass_kg"),
            "{text}"
        );
    }

    #[test]
    fn what_a_table_leaves_out_of_the_trigger_and_the_paper_estimator_is_the_default() {
        let config = parse(
            "trigger_reference = \"echo\"\n[trigger]\nmetric = \"parameters\"\n\
             [estimator.paper]\nwindow_s = 0.25\nrows = \"stacked\"\n",
            None,
        )
        .unwrap();
        let text = serde_json::to_string(&config).unwrap();
        for part in [
            r#""trigger_reference":"echo""#,
            r#""metric":"parameters""#,
            r#""window_s":0.25"#,
            r#""rows":"stacked""#,
            r#""jerk_density":0.3"#,
        ] {
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn a_file_that_is_wrong_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("slave.toml");
        std::fs::write(&path, "seed = \"one\"").unwrap();
        let text = configuration(Program::Slave, Some(&path), &Flags::default())
            .unwrap_err()
            .to_string();
        for part in ["slave.toml", "line 1", "^", "what to do"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
