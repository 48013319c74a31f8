//! `mmt master`: the host with the hand.

mod path_file;

use std::io::IsTerminal as _;
use std::path::Path;

use mmt_client::commands::CommandConfig;
use mmt_client::io::console::Order;
use mmt_client::io::{
    MasterHostError, MasterLive, MasterOptions, MasterReport, OperatorChoice, ResumeFile,
    SessionEnd, SharedPath,
};
use mmt_client::operator::pointer::Driver;
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_client::operator::trace::Trace;
use mmt_lab::layers::Program;
use mmt_netem::io::socket::SocketExtras;
use mmt_netem::{Direction, LinkConfig};
use mmt_shared::clean::clean;
use mmt_shared::io::connect::ConnectError;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::identity_file::default_directory;
use mmt_shared::io::wish::Wish;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::Pairing;
use mmt_shared::report::RunReport;
use serde_json::json;
use tokio::sync::watch;

use super::conclusion::conclude;
use super::console::{self, SessionConsole};
use super::device::{self, Device};
use super::host::{Host, spawn};
use super::netem::wrap::{Emulation, effect};
use super::record::Record;
use super::viewer::Viewer;
use crate::args::{DeviceWords, MasterArguments, OperatorWords, PairingWords};
use crate::failure::{Exit, Failure};
use crate::input::{read_line, read_text};
use crate::log::Messages;
use crate::output::{note, print_report};
use crate::stop::Stop;
use crate::view::Caption;
use path_file::PathFile;

/// Where a recorded path is carried to start, m: 5 cm before the west face of the model at its start, which
/// is 20 cm from the origin.
const TRACE_START_M: (f64, f64) = (-0.25, 0.0);

/// Runs `mmt master`.
///
/// # Errors
/// Wrong input, no session, or a session that broke.
pub(crate) fn run(arguments: MasterArguments, messages: &Messages) -> Result<(), Failure> {
    let (mut options, stiffness) = options(&arguments)?;
    let device = Device::start(&arguments.device, stiffness)?;
    device.give(&mut options);
    let record = Record::start(arguments.record.as_deref())?;
    options.record = record.recorder();
    let path_file = PathFile::claim(arguments.record_path.as_deref())?;
    // not before the pairing has been read from stdin: the orders come after it
    let mut link = options.netem.clone();
    let seed = options.netem_seed;
    let wanted = matches!(arguments.operator, OperatorWords::Pointer);
    let stop = Stop::on_signals()?;
    options.emergency = stop.emergency().clone();
    let mut console = SessionConsole::start(&arguments.console, wanted, stop.emergency())?;
    let controlled = console.is_some();
    let emulation = Emulation::start(&arguments.emulation, controlled, seed, Some(&link), None)?;
    options.netem_extras = emulation.extras(Direction::Up);
    let dashboard = !arguments.json && !emulation.takes_orders();
    options.scene_hz = Viewer::scene_hz(dashboard);
    if let Some(console) = &console {
        options.scene_hz = console::SCENE_HZ;
        options.events = std::sync::Mutex::new(Some(console.events()));
    }
    if !link.is_transparent() {
        note(effect(Direction::Up, &link)?);
    }
    let mut caption = caption(&options);
    arguments.transport.warning().into_iter().for_each(note);
    let path = options.path.clone();
    let (host, live) = start(options, stop.receiver())?;
    if let Some(console) = &mut console {
        let shown = live.clone();
        console.show(&caption, move || *shown.borrow(), || None);
        show_network(console, &link);
        caption.setting = format!("{}  {}", console.address(), caption.setting);
    }
    let mut viewer = Viewer::new(caption, dashboard, messages, &stop);
    while host.is_running() {
        let master = Some(*live.borrow());
        viewer.look(None, master);
        if let Some(console) = &mut console {
            attend(console, &stop, &emulation, &mut link);
        }
    }
    drop(viewer);
    let report = RunReport::from(host.join()?);
    let kept = path_file.zip(path.as_ref());
    let end = live.borrow().ended;
    conclude([
        print_report(&report, arguments.json, arguments.full),
        kept.map_or(Ok(()), |(file, path)| file.keep(path)),
        emulation.finish(),
        record.finish(),
        judge(end),
    ])
}

fn caption(options: &MasterOptions) -> Caption {
    Caption {
        command: "master",
        duration_s: options.duration.map(|time| time.as_secs_f64()),
        setting: format!("slave at {}, {}", options.pairing.address, options.netem),
        slave: options.pairing.address.to_string(),
        truth: None,
    }
}

fn show_network(console: &mut SessionConsole, link: &LinkConfig) {
    console.show_about([("network", json!({"up": link.to_string()}))]);
}

/// Does what viewers ask for.
fn attend(console: &mut SessionConsole, stop: &Stop, emulation: &Emulation, link: &mut LinkConfig) {
    while let Some(order) = console.next_order() {
        match order {
            Order::End => stop.end(),
            Order::Network(wish) => {
                console.change_networks(&wish, emulation, [Some(link), None]);
                show_network(console, link);
            }
            // the object is another host's
            Order::Restart(_) | Order::Study(_) => {}
        }
    }
}

/// A master host at work and its snapshots.
type Started = (Host<MasterReport>, watch::Receiver<MasterLive>);

/// Starts a master host.
///
/// # Errors
/// No thread; joining the host returns why it failed.
pub(super) fn start(
    options: MasterOptions,
    stop: watch::Receiver<Wish>,
) -> Result<Started, Failure> {
    let (live, looks) = watch::channel(MasterLive::default());
    let work = async move { mmt_client::io::run(options, stop, live).await };
    let host = spawn("master", |runtime| {
        runtime.block_on(work).map_err(|error| host_failure(&error))
    })?;
    Ok((host, looks))
}

/// Whether the session ended as it should.
///
/// # Errors
/// It did not.
pub(super) fn judge(end: Option<SessionEnd>) -> Result<(), Failure> {
    use mmt_shared::wire::Ending;
    match end.map(|end| (end, end.ending())) {
        Some((end, Ending::Failed)) => {
            Err(Failure::failed(format!("the session ended early: {end}")))
        }
        _ => Ok(()),
    }
}

/// What the session needs, and the stiffness that the device is to be used with, N/m, if one is given.
fn options(arguments: &MasterArguments) -> Result<(MasterOptions, Option<f64>), Failure> {
    let pairing = pairing(&arguments.pairing)?;
    let path = arguments.config.as_deref();
    let flags = arguments.flags();
    let config = device::configuration(Program::Master, path, &flags, &arguments.device)?;
    let stiffness = config.stiffness_n_per_m;
    let options = MasterOptions {
        transport: arguments.transport.choose()?,
        device: device::profile(&arguments.device, stiffness)?,
        operator: operator(arguments, config.operator)?,
        events: std::sync::Mutex::default(),
        device_port: std::sync::Mutex::default(),
        duration: arguments.duration,
        architecture: config.architecture,
        scene_hz: 0,
        commands: CommandConfig {
            samples_per_command: config.samples_per_command,
            repeat_samples: config.repeat_samples,
            stretch_max: config.stretch_max,
        },
        netem: config.up,
        netem_seed: config.seed,
        netem_extras: SocketExtras::default(),
        record: None,
        path: arguments.record_path.is_some().then(SharedPath::default),
        truth: None,
        take_over: arguments.take_over,
        resume: resume_file(&pairing),
        emergency: EmergencyStop::default(),
        pairing,
    };
    Ok((options, stiffness))
}

/// The file for this slave's session, for a master that is killed; without one it waits until the slave has missed it.
fn resume_file(pairing: &Pairing) -> Option<ResumeFile> {
    let pin = pairing.pin.to_string();
    let name = format!("resume-{}", pin.get(..16)?);
    let opened = default_directory().map(|directory| ResumeFile::open(&directory.join(name)));
    match opened {
        Ok(Ok(file)) => file,
        Ok(Err(error)) => {
            tracing::warn!("a master that is killed will not resume at once: {error}");
            None
        }
        Err(_) => {
            tracing::warn!("a master that is killed will not resume at once: there is no HOME");
            None
        }
    }
}

pub(super) fn pairing(words: &PairingWords) -> Result<Pairing, Failure> {
    let line;
    let text = match words.reveal() {
        "-" => {
            let mut stdin = std::io::stdin().lock();
            if stdin.is_terminal() {
                note("PAIRING, as mmt slave printed it:");
            }
            let read = read_line(&mut stdin);
            let read =
                read.map_err(|error| Failure::usage(format!("cannot read stdin: {error}")))?;
            line = read.unwrap_or_default();
            line.as_str()
        }
        text => text,
    };
    // The error holds nothing of the secret.
    text.parse()
        .map_err(|error| Failure::usage(format!("PAIRING: {error}")))
}

fn operator(
    arguments: &MasterArguments,
    scripted: ScriptedConfig,
) -> Result<OperatorChoice, Failure> {
    let person = |driver| OperatorChoice::Person {
        scripted,
        driver,
        device: None,
    };
    match &arguments.operator {
        OperatorWords::Trace(_) | OperatorWords::Pointer
            if matches!(arguments.device.device, DeviceWords::PluggedIn(_)) =>
        {
            let what =
                "a device that is plugged in is the hand itself: no other operator goes with it";
            Err(Failure::usage(what).remedy("leave --operator out"))
        }
        OperatorWords::Trace(path) => Ok(OperatorChoice::Trace {
            trace: trace(path, arguments.push)?,
            name: format!("trace:{}", path.display()),
        }),
        _ if arguments.push.is_some() => {
            Err(Failure::usage("--push goes with recorded pushes only")
                .remedy("add --operator trace:FILE, or leave --push out"))
        }
        OperatorWords::Pointer if arguments.console.options(true)?.is_none() => {
            let what = "--operator pointer with --no-console: nobody could take the hand";
            Err(Failure::usage(what).remedy("leave one of the two out"))
        }
        OperatorWords::Pointer => Ok(person(Driver::Pointer)),
        OperatorWords::Scripted if arguments.console.options(false)?.is_some() => {
            Ok(person(Driver::Scripted))
        }
        OperatorWords::Scripted => Ok(OperatorChoice::Scripted(scripted)),
    }
}

fn trace(path: &Path, push: Option<usize>) -> Result<Trace, Failure> {
    let text = read_text(path, "the trace")?;
    let is_csv = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("csv"));
    if is_csv && push.is_some() {
        return Err(
            Failure::usage("--push: a .csv trace has no pushes to choose from")
                .remedy("leave --push out"),
        );
    }
    let trace = if is_csv {
        Trace::from_csv(&text)
    } else {
        Trace::from_cmu(&text, push)
    };
    let (x, y) = TRACE_START_M;
    trace
        .map(|trace| trace.starting_at(Vec2::new(x, y)))
        .map_err(|error| {
            let what = format!("the trace {}: {error}", path.display());
            Failure::usage(what).remedy(
                "give a .csv file with the header t_s,x_m,y_m, or a file of recorded pushes",
            )
        })
}

/// The host's own words, and the exit code that belongs to them.
pub(super) fn host_failure(error: &MasterHostError) -> Failure {
    use MasterHostError as E;
    let exit = match error {
        E::Insecure(_) | E::OutOfRange(_) | E::Lookup { .. } | E::NoAddress { .. } => Exit::Usage,
        E::Connect(ConnectError::NoAnswer { .. }) | E::LookupSlow { .. } | E::NoWelcome { .. } => {
            Exit::NoAnswer
        }
        E::Connect(
            ConnectError::WrongKey { .. }
            | ConnectError::OtherProtocol { .. }
            | ConnectError::OtherTransport { .. }
            | ConnectError::Crowded { .. },
        )
        | E::Busy { .. }
        | E::WrongToken { .. }
        | E::WrongRole { .. }
        | E::Full { .. }
        | E::NoObservers { .. }
        | E::BadHello { .. }
        | E::Ending { .. }
        | E::Unexpected { .. }
        | E::Welcome { .. } => Exit::Refused,
        E::Hung => Exit::Hung,
        _ => Exit::Failed,
    };
    // what the slave wrote may stand in it
    Failure::new(exit, clean(&error.to_string()))
}

#[cfg(test)]
mod tests;
