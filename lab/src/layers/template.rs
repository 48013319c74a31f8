//! The default configuration as a file, to be changed: every key with its unit and what is accepted.
//!
//! Given back to any program it changes nothing. What each program chooses for itself is a comment.

use std::fmt::Write;

use mmt_shared::model::settings::Mode;

use super::program::Program;
use super::{Flag, Known, Layers};
use crate::text_error::TextError;

/// What the file begins with.
const HEAD: &str = "# The configuration of mmt demo, slave and master (--config FILE) and of mmt sweep (--config FILE, below the plan):
# every key with its default. A line that begins with # is left out: what it shows is what each program then takes by
# itself. A key in this file comes before the mode, and the command line before this file.
";

/// The file of a mode.
///
/// # Errors
/// Never, unless a default is refused.
pub fn template(mode: Mode) -> Result<String, TextError> {
    let flags: Vec<Flag> = Flag::new("--mode", "slave.mode", &mode)
        .into_iter()
        .collect();
    let layers = |program| Layers {
        program,
        file: "",
        flags: &flags,
        seed: None,
    };
    let sweep = layers(Program::Sweep);
    let demo = layers(Program::Demo).known()?;
    let given = toml::Value::try_from(sweep.config()?).ok();
    let mut text = HEAD.to_owned();
    let mut table = "";
    let known = sweep.known()?;
    for (key, others) in known.iter().zip(&demo) {
        let (path, _) = key.key.rsplit_once('.').unwrap_or_default();
        let is_given = |at: &str| {
            let steps = at.split('.').filter(|step| !step.is_empty());
            let mut value = given.as_ref();
            for step in steps {
                value = value.and_then(|value| value.get(step));
            }
            value.is_some()
        };
        if path != table {
            let mark = if is_given(path) { "" } else { "# " };
            let _ = write!(text, "\n{mark}[{path}]\n");
            table = path;
        }
        let stays = is_given(&key.key) && key.value == others.value;
        line(&mut text, key, others, stays);
    }
    Ok(text)
}

/// A key in a line of its own, with its unit and what is accepted.
fn line(text: &mut String, key: &Known, demo: &Known, stays: bool) {
    let name = key.key.rsplit('.').next().unwrap_or_default();
    let mark = if stays { "" } else { "# " };
    let value = key.value.as_deref().unwrap_or("(left out)");
    let is_range = key
        .accepted
        .starts_with(|first: char| first == '-' || first.is_ascii_digit());
    let unit = if is_range || key.accepted.is_empty() {
        key.unit
    } else {
        ""
    };
    let in_unit = format!("{} {unit}", key.accepted);
    let mut words = vec![in_unit.trim().to_owned()];
    if let Some(demo) = demo
        .value
        .as_ref()
        .filter(|demo| Some(*demo) != key.value.as_ref())
    {
        words.push(format!("in a demo {demo}"));
    }
    words.retain(|word| !word.is_empty());
    let comment = if words.is_empty() {
        String::new()
    } else {
        format!("  # {}", words.join("; ").replace('\n', " "))
    };
    let _ = writeln!(text, "{mark}{name} = {value}{comment}");
}
