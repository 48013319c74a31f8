//! `mmt demo`: real slave, real master, real QUIC sockets on loopback, an emulated network between them.

use mmt_lab::world::WorldConfig;
use mmt_netem::Direction;

use super::conclusion::conclude;
use super::console::SessionConsole;
use super::device::Device;
use super::master;
use super::netem::wrap::{Emulation, effect};
use super::record::Record;
use super::viewer::Viewer;
use crate::args::DemoArguments;
use crate::failure::Failure;
use crate::log::Messages;
use crate::output::{note, print_report};
use crate::stop::Stop;
use crate::view::{Caption, Screen};

mod blind;
mod round;
mod setting;
mod study;
use round::Round;
use setting::Setting;

/// Runs `mmt demo`.
///
/// # Errors
/// A host could not start, or the session broke.
pub(crate) fn run(arguments: &DemoArguments, messages: &Messages) -> Result<(), Failure> {
    if let Some([a, b]) = arguments.blind.as_deref() {
        return blind::run(arguments, [a, b], messages);
    }
    let mut setting = Setting::new(arguments);
    let config = setting.config()?;
    let WorldConfig { up, down, seed, .. } = &config;
    note(effect(Direction::Up, up)?);
    note(effect(Direction::Down, down)?);
    arguments.transport.warning().into_iter().for_each(note);
    let device = Device::start(&arguments.device, config.stiffness_n_per_m)?;
    let record = Record::start(arguments.record.as_deref())?;
    let stop = Stop::on_signals()?;
    let dashboard = !arguments.json && !arguments.emulation.netem_control;
    let mut console = SessionConsole::start(
        &arguments.console,
        dashboard && Screen::is_there(),
        stop.emergency(),
    )?;
    let emulation = &arguments.emulation;
    let emulation = Emulation::start(emulation, console.is_some(), *seed, Some(up), Some(down))?;
    let mut viewer = Viewer::new(Caption::default(), dashboard, messages, &stop);
    let ended = loop {
        let mut round = Round {
            setting: &mut setting,
            emulation: &emulation,
            record: &record,
            device: &device,
            stop: &stop,
            dashboard,
            viewer: &mut viewer,
            console: console.as_mut(),
            blind: false,
            again: None,
        };
        let ended = round.session();
        if ended.is_ok() {
            round.wait();
        }
        match round.again.take() {
            Some(again) if ended.is_ok() => setting = again,
            _ => break ended,
        }
    };
    drop(viewer);
    let Some((report, end)) = ended? else {
        return Ok(());
    };
    conclude([
        print_report(&report, arguments.json, arguments.full),
        emulation.finish(),
        record.finish(),
        master::judge(end),
    ])
}
