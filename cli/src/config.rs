//! The files of a slave, configuration and scene: TOML, unknown keys are errors with line and caret.
//!
//! What the file leaves out is the mode's, and the mode is the command line's before the file's.

use std::path::Path;

use mmt_client::device::link::DeviceLinkConfig;
use mmt_lab::overlay::laid_over;
use mmt_server::environment::SceneConfig;
use mmt_server::slave::SlaveConfig;
use mmt_shared::model::settings::Mode;

use crate::failure::Failure;
use crate::input::read_text;

/// The slave of a file, if there is one, in a mode, if one is given.
///
/// # Errors
/// The file cannot be read, is no TOML, or is no configuration.
pub(crate) fn slave_config(
    path: Option<&Path>,
    mode: Option<Mode>,
) -> Result<SlaveConfig, Failure> {
    let Some(path) = path else {
        return Ok(SlaveConfig::of_mode(mode.unwrap_or(Mode::Recommended)));
    };
    read(path, "the configuration", "docs/commands.md", |text| {
        parse(text, mode)
    })
}

/// The device of a file that is to be plugged in, if there is one.
///
/// # Errors
/// The file cannot be read, is no TOML, or is no device.
pub(crate) fn device_config(path: Option<&Path>) -> Result<DeviceLinkConfig, Failure> {
    path.map_or(Ok(DeviceLinkConfig::default()), |path| {
        read(path, "the device", "docs/plugs.md", |text| {
            toml::from_str(text)
        })
    })
}

/// The scene of a file.
///
/// # Errors
/// The file cannot be read, is no TOML, or is no scene.
pub(crate) fn scene(path: &Path) -> Result<SceneConfig, Failure> {
    read(path, "the scene", "docs/scenes.md", |text| {
        toml::from_str(text)
    })
}

/// Reads a file that `page` describes.
fn read<T>(
    path: &Path,
    what: &str,
    page: &str,
    parse: impl Fn(&str) -> Result<T, toml::de::Error>,
) -> Result<T, Failure> {
    let text = read_text(path, what)?;
    parse(&text).map_err(|error| {
        let (path, error) = (path.display(), error.to_string());
        let what = format!("{what} {path}: {}", error.trim_end());
        Failure::usage(what).remedy(format!("correct that line; {page} lists every key"))
    })
}

fn parse(text: &str, mode: Option<Mode>) -> Result<SlaveConfig, toml::de::Error> {
    // First as it stands, for errors with their place.
    let alone: SlaveConfig = toml::from_str(text)?;
    let mode = mode.unwrap_or(alone.mode);
    let merged = laid_over(&SlaveConfig::of_mode(mode), text)?;
    Ok(SlaveConfig { mode, ..merged })
}

#[cfg(test)]
mod tests {
    use mmt_server::trigger::{Scheme, TriggerConfig};

    use super::*;

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
        let text = slave_config(Some(&path), None).unwrap_err().to_string();
        for part in ["slave.toml", "line 1", "^", "what to do"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
