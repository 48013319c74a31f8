//! `mmt slave`: the host with the object.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc;
use std::time::Duration;

use mmt_lab::layers::Program;
use mmt_netem::Direction;
use mmt_netem::io::socket::SocketExtras;
use mmt_server::io::plant_link::{PlantHost, PlantHostError};
use mmt_server::io::{
    SlaveConfiguration, SlaveHost, SlaveHostError, SlaveLive, SlaveOptions, SlaveReport,
};
use mmt_shared::clean::clean;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::identity_file::{advertise, load_or_create};
use mmt_shared::io::plug_socket::PlugSocketError;
use mmt_shared::io::wish::Wish;
use mmt_shared::pairing::{Host as HostName, Pairing};
use mmt_shared::report::RunReport;
use mmt_shared::wire::Ending;
use tokio::runtime::Runtime;
use tokio::sync::watch;

use super::conclusion::conclude;
use super::host::{Host, spawn};
use super::identity;
use super::netem::wrap::{Emulation, effect};
use super::record::Record;
use super::viewer::Viewer;
use crate::args::SlaveArguments;
use crate::config::configuration;
use crate::failure::{Exit, Failure};
use crate::log::Messages;
use crate::output::{note, print, print_report};
use crate::stop::Stop;
use crate::view::Caption;

/// Between two looks at whether somebody ends the command while it waits for a plant.
const PLANT_WAIT: Duration = Duration::from_millis(100);

/// Runs `mmt slave`.
///
/// # Errors
/// Wrong input, an address that cannot be had, a host that failed.
pub(crate) fn run(arguments: SlaveArguments, messages: &Messages) -> Result<(), Failure> {
    let directory = identity::directory(arguments.identity.as_deref())?;
    let mut options = options(&arguments, &directory)?;
    let record = Record::start(arguments.record.as_deref())?;
    options.record = record.recorder();
    let (netem, seed) = (Some(&options.netem), options.netem_seed);
    let emulation = Emulation::start(&arguments.emulation, false, seed, None, netem)?;
    options.netem_extras = emulation.extras(Direction::Down);
    if !options.netem.is_transparent() {
        note(effect(Direction::Down, &options.netem)?);
    }
    let mut unserved = unserved(&options);
    arguments.transport.warning().into_iter().for_each(note);
    let stop = Stop::on_signals()?;
    options.emergency = stop.emergency().clone();
    if options.config.plant.link {
        let plant = plugged_in(arguments.plant.listen()?, &stop)?;
        if plant.is_none() {
            return Ok(());
        }
        options.plant = plant;
    }
    let everywhere = arguments.listen.ip().is_unspecified();
    let (host, started) = start(options, arguments.advertise, stop.receiver())?;
    // If it could not start the reason is in the host.
    if let Ok(started) = started.recv() {
        keep_address(&directory, &started.pairing);
        print(&started.pairing)?;
        note(waiting(&started.pairing, everywhere));
        let mut viewer = Viewer::new(Caption::default(), false, messages, &stop);
        // else stdin has commands to the network
        if !emulation.takes_orders() {
            viewer = viewer.with_keys();
        }
        watch_sessions(&host, &started.live, viewer);
    }
    let report = host.join()?.map(RunReport::from);
    let judged = judge(arguments.once, report.as_ref());
    if stop.ending() == Ending::Failed {
        unserved.ending = Some(Ending::Failed.name());
    }
    // without a session there is nothing to read
    let shown = report.or(arguments.json.then_some(unserved));
    conclude([
        shown.map_or(Ok(()), |report| {
            print_report(&report, arguments.json, arguments.full)
        }),
        emulation.finish(),
        record.finish(),
        judged,
    ])
}

/// Whether the one session that this slave was started for ended as it should. A slave that goes on serving is not judged by its
/// last one.
///
/// # Errors
/// It did not.
fn judge<C>(once: bool, report: Option<&RunReport<C>>) -> Result<(), Failure> {
    let failed = |report: &&RunReport<C>| report.ending == Some(Ending::Failed.name());
    match report.filter(failed) {
        Some(_) if once => Err(Failure::failed("the session ended early")
            .remedy("the message before the report has the reason")),
        _ => Ok(()),
    }
}

/// A plug for a plant, once one is plugged in; none if somebody ends the command before.
fn plugged_in(listen: SocketAddr, stop: &Stop) -> Result<Option<PlantHost>, Failure> {
    let plant = PlantHost::start(listen).map_err(plant_failure)?;
    note(format_args!("plant: {}", plant.address()));
    note(
        "waiting for a plant: until it comes, the slave does not listen and prints no pairing string",
    );
    while !plant.wait(PLANT_WAIT) {
        if stop.asked() {
            return Ok(None);
        }
    }
    Ok(Some(plant))
}

/// Why no plant can be plugged in.
pub(super) fn plant_failure(error: PlantHostError) -> Failure {
    match error {
        PlantHostError::Socket(PlugSocketError::Listen { .. }) => {
            Failure::new(Exit::Address, error)
                .remedy("give another --plant-listen address, or port 0 for any free port")
        }
        PlantHostError::Socket(_) | PlantHostError::Setup(_) | PlantHostError::Thread(_) => {
            Failure::failed(error)
        }
    }
}

/// What to do on the other host; the secret stands on stdout only. `everywhere`: the slave listens at every address of this
/// host.
fn waiting(pairing: &Pairing, everywhere: bool) -> String {
    let address = &pairing.address;
    let lost = matches!(&address.host, HostName::V4(v4) if v4.is_loopback());
    let remedy = if everywhere && lost {
        "\nthis host has no interface for others, so the string names 127.0.0.1: give --advertise ADDRESS, one that the master's host reaches"
    } else {
        ""
    };
    format!(
        "waiting for a master at {address}; on its host run\n  mmt master -\nand give it the pairing string, which stands on stdout{remedy}"
    )
}

/// Plain lines while a master is connected.
fn watch_sessions(
    host: &Host<Option<SlaveReport>>,
    live: &watch::Sender<SlaveLive>,
    mut viewer: Viewer,
) {
    while host.is_running() {
        let slave = Some(*live.borrow()).filter(|slave| slave.connected);
        viewer.look(slave, None);
    }
}

/// A slave that listens.
pub(super) struct Listening {
    /// What a master needs.
    pub(super) pairing: Pairing,
    /// Looks at it.
    pub(super) live: Arc<watch::Sender<SlaveLive>>,
}

/// A slave host and, once it listens, its pairing.
type Started = (Host<Option<SlaveReport>>, mpsc::Receiver<Listening>);

/// Starts a slave host. If it cannot listen, the receiver gives nothing and joining the host gives the reason.
///
/// # Errors
/// No thread.
pub(super) fn start(
    options: SlaveOptions,
    advertise: Option<HostName>,
    stop: watch::Receiver<Wish>,
) -> Result<Started, Failure> {
    let (sender, receiver) = mpsc::channel();
    let work = move |runtime: &Runtime| {
        let _inside = runtime.enter();
        let host = SlaveHost::bind(options).map_err(|error| host_failure(&error))?;
        let live = Arc::new(watch::Sender::default());
        let listening = Listening {
            pairing: host.pairing(advertise),
            live: Arc::clone(&live),
        };
        // Whoever started it waits for this.
        let _ = sender.send(listening);
        let served = runtime.block_on(host.run(stop, live));
        served.map_err(|error| host_failure(&error))
    };
    Ok((spawn("slave", work)?, receiver))
}

/// Keeps where the slave is reached for `mmt identity rotate`, whose user has to give it where this fails.
fn keep_address(directory: &Path, pairing: &Pairing) {
    if let Err(error) = advertise(directory, &pairing.address) {
        tracing::debug!("mmt identity rotate will need --address: {error}");
    }
}

fn options(arguments: &SlaveArguments, directory: &Path) -> Result<SlaveOptions, Failure> {
    let path = arguments.config.as_deref();
    let world = configuration(Program::Slave, path, &arguments.flags()?)?;
    let mut config = world.slave;
    config.plant.link = arguments.plant.is_linked(config.plant.link)?;
    let transport = arguments.transport.choose()?;
    let permitted = transport.permit(arguments.listen);
    permitted.map_err(Failure::usage)?;
    Ok(SlaveOptions {
        transport,
        listen: arguments.listen,
        identity: load_or_create(directory).map_err(Failure::usage)?,
        netem_seed: world.seed,
        config,
        netem: world.down,
        netem_extras: SocketExtras::default(),
        once: arguments.once,
        observers: arguments.observers,
        truth: None,
        record: None,
        emergency: EmergencyStop::default(),
        plant: None,
    })
}

/// The report of a slave that no master came to.
fn unserved(options: &SlaveOptions) -> RunReport<SlaveConfiguration> {
    let configuration = SlaveConfiguration {
        listen: options.listen.to_string(),
        transport: options.transport.name(),
        slave: options.config.clone(),
        netem: options.netem.to_string(),
    };
    let mut report = RunReport::new("slave", configuration);
    report.seed = Some(options.config.seed);
    report.ending = Some(Ending::Interrupted.name());
    report
}

fn host_failure(error: &SlaveHostError) -> Failure {
    match error {
        SlaveHostError::Bind(_) | SlaveHostError::Socket { .. } => {
            Failure::new(Exit::Address, error)
                .remedy("give another --listen address, or port 0 for any free port")
        }
        SlaveHostError::Slave(_) => {
            Failure::usage(error).remedy("change that number in the configuration")
        }
        SlaveHostError::NoOperator => Failure::usage(error)
            .remedy("`mmt identity rotate` makes one; give it the same --identity"),
        SlaveHostError::Insecure(_) => Failure::usage(error),
        SlaveHostError::Netem(_) => Failure::usage(error).remedy("change --netem"),
        SlaveHostError::Hung => Failure::new(Exit::Hung, error),
        // what a master wrote may stand in it
        _ => Failure::failed(clean(&error.to_string())),
    }
}

#[cfg(test)]
mod tests;
