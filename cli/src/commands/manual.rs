//! `mmt completions` and `mmt man`: what shells and `man` need of the command line.

use std::io::Write;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::args::{Arguments, ManArguments};
use crate::failure::Failure;
use crate::output::{make_folder, note, print, unwritten};

/// Runs `mmt completions`.
///
/// # Errors
/// stdout cannot be written to.
pub(crate) fn completions(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "mmt", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())
}

/// Runs `mmt man`.
///
/// # Errors
/// The folder cannot be made or a page cannot be written.
pub(crate) fn pages(arguments: &ManArguments) -> Result<(), Failure> {
    let folder = &arguments.out;
    let failed = |error| unwritten(folder, format!("cannot write a page: {error}"));
    make_folder(folder)?;
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let mut written = 0;
    let mut waiting = vec![command];
    while let Some(command) = waiting.pop() {
        waiting.extend(command.get_subcommands().cloned());
        let name = command
            .get_display_name()
            .unwrap_or("mmt")
            .replace(' ', "-");
        let mut page = Vec::new();
        let of_command = clap_mangen::Man::new(command);
        of_command.render(&mut page).map_err(failed)?;
        let path = folder.join(format!("{name}.1"));
        let file = std::fs::File::create(path);
        file.and_then(|mut file| file.write_all(&page))
            .map_err(failed)?;
        written += 1;
    }
    note(format_args!(
        "{written} pages in {}; read one with `man {}/mmt.1`",
        folder.display(),
        folder.display()
    ));
    Ok(())
}
