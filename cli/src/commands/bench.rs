//! `mmt bench`: what things cost on this machine, and how well an object is felt.

use mmt_lab::io::transport_bench::{self, BenchConfig, BenchReport};
use serde::Serialize;

use crate::args::{BenchArguments, BenchSubject, TransportBenchArguments};
use crate::failure::Failure;
use crate::output::{note, print, print_json};
use crate::stop::Stop;

mod plant;

/// Runs `mmt bench`.
///
/// # Errors
/// The machine has no sockets or threads to give.
pub(crate) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    match &arguments.subject {
        BenchSubject::Transport(arguments) => transport(arguments),
        BenchSubject::Plant(arguments) => plant::run(arguments),
    }
}

/// The document of `mmt bench transport`.
#[derive(Serialize)]
struct Document<'a> {
    version: &'static str,
    command: &'static str,
    duration_s: f64,
    #[serde(flatten)]
    report: &'a BenchReport,
}

fn transport(arguments: &TransportBenchArguments) -> Result<(), Failure> {
    let config = BenchConfig {
        rate_hz: arguments.rate,
        duration: arguments.duration,
        bytes: usize::from(arguments.size),
        cores: arguments.cores,
    };
    let stop = Stop::on_signals()?;
    note(format_args!(
        "measuring for {:?}, in turns; Ctrl-C ends it with what there is",
        arguments.duration
    ));
    let report = transport_bench::run(&config, || stop.asked());
    let report =
        report.map_err(|error| Failure::failed(format!("mmt bench transport: {error}")))?;
    if !arguments.json {
        return print(&report);
    }
    print_json(&Document {
        version: env!("CARGO_PKG_VERSION"),
        command: "bench transport",
        duration_s: arguments.duration.as_secs_f64(),
        report: &report,
    })
}
