//! `mmt netem trace`: two captures of one real path become a record, which the emulator plays and `report` sums up.

use std::path::Path;

use mmt_netem::capture::{self, Match, MatchError};
use mmt_netem::record::{Heading, csv};

use crate::args::NetemTraceArguments;
use crate::failure::Failure;
use crate::input::read_bytes;
use crate::output::{note, print};

/// Runs `mmt netem trace`.
///
/// # Errors
/// A file cannot be read or written or is no capture, or the captures are not of one path.
pub(super) fn run(arguments: &NetemTraceArguments) -> Result<(), Failure> {
    let (from, to) = (&arguments.from, &arguments.to);
    let bytes = [from, to].map(|path| read_bytes(path, "the capture"));
    let [from_bytes, to_bytes] = bytes;
    let (from_bytes, to_bytes) = (from_bytes?, to_bytes?);
    let frames = |path: &Path, bytes| {
        capture::read(bytes).map_err(|error| {
            let what = format!(
                "{}: packet {}: {}",
                path.display(),
                error.line,
                error.reason
            );
            Failure::usage(what).remedy("give two captures in pcap or pcapng")
        })
    };
    let (sent, arrived) = (frames(from, &from_bytes)?, frames(to, &to_bytes)?);
    let how = Match {
        same_clock: arguments.same_clock,
    };
    let matched = how.paths(&sent, &arrived).map_err(|error| {
        let remedy = match error {
            MatchError::Nothing => {
                "capture both ends of one path at the same time, without offloading (ethtool -K)"
            }
            MatchError::Ambiguous { .. } => {
                "capture on one interface at each end, not on all, and packets that differ, such as those of a session of mmt"
            }
            MatchError::Clocks { .. } => {
                "capture packets of both directions and leave out --same-clock"
            }
        };
        Failure::usage(error).remedy(remedy)
    })?;
    let words =
        |from: &Path, to: &Path| format!("captured: {} to {}", from.display(), to.display());
    let mut text = csv::heading(&Heading {
        seed: 0,
        up: words(from, to),
        down: words(to, from),
    });
    matched
        .entries
        .iter()
        .for_each(|entry| csv::push(&mut text, entry));
    note(format_args!(
        "{} packets matched by their contents; {} left out, whose contents were sent more than once; the second clock taken to be {:.6} ms ahead",
        matched.entries.len(),
        matched.ambiguous,
        matched.clock_ahead_ns as f64 / 1e6,
    ));
    match &arguments.out {
        None => print(text.trim_end()),
        Some(path) => std::fs::write(path, text).map_err(|error| {
            Failure::usage(format!("cannot write {}: {error}", path.display()))
                .remedy("give a path that can be written")
        }),
    }
}
