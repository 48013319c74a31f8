//! `mmt config`: every key of a configuration, with its unit, what is accepted, and where its value comes from.

use std::fmt::Write;

use mmt_lab::layers::{Known, Layers, Origin, template};

use crate::args::{ConfigArguments, ConfigCommand, ShowArguments};
use crate::config::ConfigFile;
use crate::failure::Failure;
use crate::output::{print, print_json};

/// Runs `mmt config`.
///
/// # Errors
/// What is wrong with the file or with a flag.
pub(crate) fn run(arguments: &ConfigArguments) -> Result<(), Failure> {
    match &arguments.command {
        ConfigCommand::Default { mode } => {
            let text = template(*mode).map_err(Failure::failed)?;
            print(text.trim_end())
        }
        ConfigCommand::Show(arguments) => show(arguments),
    }
}

fn show(arguments: &ShowArguments) -> Result<(), Failure> {
    let (program, flags) = (arguments.program, arguments.flags()?);
    let file = ConfigFile::read(arguments.config.as_deref())?;
    let known = file.with(program, &flags, |layers: Layers| layers.known())?;
    if arguments.json {
        return print_json(&known);
    }
    let path = arguments.config.as_deref();
    let path = path
        .map(|path| path.display().to_string())
        .unwrap_or_default();
    let row = |key: &Known| {
        let origin = match key.origin {
            Origin::Default => "default".to_owned(),
            Origin::File(line) => format!("{path}:{line}"),
            Origin::Flag(name) => name.to_owned(),
        };
        let name = program.name();
        let origin = if key.in_force {
            origin
        } else {
            format!("{origin}; without effect in mmt {name}")
        };
        [
            key.key.clone(),
            key.value.clone().unwrap_or_else(|| "(left out)".to_owned()),
            key.unit.to_owned(),
            origin,
            key.accepted.replace('\n', " "),
        ]
    };
    print(table(&known.iter().map(row).collect::<Vec<_>>()))
}

/// Columns below their names, the last one as long as it is.
fn table(rows: &[[String; 5]]) -> String {
    let names = ["key", "value", "unit", "from", "accepted"].map(str::to_owned);
    let rows = || std::iter::once(&names).chain(rows);
    let mut widths = [0; 5];
    for row in rows() {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.chars().count().max(*width);
        }
    }
    let mut text = String::new();
    for row in rows() {
        let mut line = String::new();
        for (width, cell) in widths.iter().zip(row) {
            let _ = write!(line, "{cell:width$}  ");
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text.trim_end().to_owned()
}
