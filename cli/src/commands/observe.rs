//! `mmt master --observe`: looks on at a slave, whoever operates it.

use mmt_client::io::{MasterHostError, ObserverOptions, ObserverReport, SessionEnd};
use mmt_client::observer::ObserverLive;
use mmt_lab::layers::Program;
use mmt_netem::Direction;
use mmt_shared::io::wish::Wish;
use mmt_shared::report::RunReport;
use tokio::sync::watch;

use super::conclusion::conclude;
use super::console::{self, SessionConsole};
use super::host::{Host, spawn};
use super::master::{host_failure, judge, pairing};
use super::netem::wrap::{Emulation, effect};
use super::viewer::Viewer;
use crate::args::MasterArguments;
use crate::config::configuration;
use crate::failure::Failure;
use crate::log::Messages;
use crate::output::{note, print_report};
use crate::stop::Stop;
use crate::view::Caption;

/// Scenes a second where nobody watches a picture: enough for a force in each line.
const SCENE_HZ: u8 = 5;

/// Runs `mmt master --observe`.
///
/// # Errors
/// Wrong input, a slave that lets nobody look on, a session that broke.
pub(crate) fn run(arguments: &MasterArguments, messages: &Messages) -> Result<(), Failure> {
    let mut options = options(arguments)?;
    let link = options.netem.clone();
    let stop = Stop::on_signals()?;
    let seed = options.netem_seed;
    let emulation = Emulation::start(&arguments.emulation, false, seed, Some(&link), None)?;
    options.netem_extras = emulation.extras(Direction::Up);
    if !link.is_transparent() {
        note(effect(Direction::Up, &link)?);
    }
    arguments.transport.warning().into_iter().for_each(note);
    let dashboard = !arguments.json && !emulation.takes_orders();
    let mut console = SessionConsole::start(&arguments.console, false, stop.emergency())?;
    options.scene_hz = match &console {
        Some(_) => console::SCENE_HZ,
        None => Viewer::scene_hz(dashboard).max(SCENE_HZ),
    };
    let mut caption = Caption {
        command: "observer",
        duration_s: options.duration.map(|time| time.as_secs_f64()),
        setting: format!("looks on at {}, {link}", options.pairing.address),
        slave: options.pairing.address.to_string(),
        truth: None,
    };
    let (host, live) = start(options, stop.receiver())?;
    if let Some(console) = &mut console {
        let shown = live.clone();
        console.show_observer(&caption, move || *shown.borrow());
        caption.setting = format!("{}  {}", console.address(), caption.setting);
    }
    let mut viewer = Viewer::new(caption, dashboard, messages, &stop);
    while host.is_running() {
        let seen = *live.borrow();
        viewer.look_on(seen);
    }
    drop(viewer);
    let (report, end) = host.join()?;
    conclude([
        print_report(&RunReport::from(report), arguments.json, arguments.full),
        emulation.finish(),
        judge(Some(end)),
    ])
}

fn options(arguments: &MasterArguments) -> Result<ObserverOptions, Failure> {
    let path = arguments.config.as_deref();
    let config = configuration(Program::Master, path, &arguments.flags())?;
    Ok(ObserverOptions {
        pairing: pairing(&arguments.pairing)?,
        transport: arguments.transport.choose()?,
        duration: arguments.duration,
        scene_hz: 0,
        netem: config.up,
        netem_seed: config.seed,
        netem_extras: mmt_netem::io::socket::SocketExtras::default(),
    })
}

/// An observer's host at work and what it sees.
type Started = (
    Host<(ObserverReport, SessionEnd)>,
    watch::Receiver<ObserverLive>,
);

fn start(options: ObserverOptions, stop: watch::Receiver<Wish>) -> Result<Started, Failure> {
    let (live, looks) = watch::channel(ObserverLive::default());
    let work = async move { mmt_client::io::observe(options, stop, live).await };
    let failed = |error: MasterHostError| host_failure(&error);
    let host = spawn("observer", move |runtime| {
        runtime.block_on(work).map_err(failed)
    })?;
    Ok((host, looks))
}
