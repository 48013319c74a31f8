//! stdout is data, stderr is messages. A reader that has gone away is no error and no panic.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::time::Duration;

use mmt_shared::report::{Brief, RunReport};
use serde::Serialize;

use crate::failure::Failure;
pub(crate) use crate::stderr::note;
use crate::stderr::settle;

/// How long data waits for the messages before it, so that they come in their order on a terminal.
const IN_ORDER: Duration = Duration::from_millis(100);

/// Writes data and a line end to stdout at once.
///
/// # Errors
/// stdout cannot be written to, for another reason than that its reader has gone.
pub(crate) fn print(data: impl Display) -> Result<(), Failure> {
    settle(IN_ORDER);
    print_to(&mut io::stdout().lock(), data)
}

/// Writes a document as JSON to stdout.
///
/// # Errors
/// As [`print`].
pub(crate) fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(document);
    print(text.map_err(|error| Failure::failed(format!("the report is no JSON: {error}")))?)
}

/// Writes a report to stdout: as JSON, whole, or in a sentence and ten lines.
///
/// # Errors
/// As [`print`].
pub(crate) fn print_report<C: Serialize>(
    report: &RunReport<C>,
    json: bool,
    full: bool,
) -> Result<(), Failure> {
    if json {
        print_json(report)
    } else if full {
        print(report)
    } else {
        print(Brief(report))
    }
}

/// How often each was there, as `name 3, name 5`.
pub(crate) fn counts<N: Display>(of: &BTreeMap<N, u64>) -> String {
    let of = of.iter().map(|(name, count)| format!("{name} {count}"));
    of.collect::<Vec<_>>().join(", ")
}

/// Makes the folder that a command writes to, if it is not there.
///
/// # Errors
/// It cannot be made.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|error| {
        let what = format!("cannot make the folder {}: {error}", folder.display());
        Failure::usage(what).remedy("give another one with --out")
    })
}

/// Takes away a file that an earlier run of a command left, if it is there.
///
/// # Errors
/// It is there and stays.
pub(crate) fn take_away(path: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            let what = format!(
                "cannot remove {} of an earlier run: {error}",
                path.display()
            );
            Err(Failure::failed(what).remedy("give another folder with --out"))
        }
        _ => Ok(()),
    }
}

/// The failure of a command that could not write a file to its folder; `what` names the file and the reason.
pub(crate) fn unwritten(folder: &Path, what: impl Display) -> Failure {
    Failure::failed(what).remedy(format!(
        "check the folder {}: is the disk full, may you write there?",
        folder.display()
    ))
}

fn print_to(out: &mut impl Write, data: impl Display) -> Result<(), Failure> {
    match writeln!(out, "{data}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::failed(format!("cannot write to stdout: {error}"))
                .remedy("check where stdout goes: is the disk full?"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Full(ErrorKind);

    impl Write for Full {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_reader_that_went_away_is_no_failure_and_a_full_disk_is_one() {
        assert_eq!(print_to(&mut Full(ErrorKind::BrokenPipe), "x"), Ok(()));
        let full = print_to(&mut Full(ErrorKind::StorageFull), "x").unwrap_err();
        assert!(full.to_string().contains("what to do"), "{full}");
    }
}
