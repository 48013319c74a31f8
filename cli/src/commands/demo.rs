//! `mmt demo`: real slave, real master, real QUIC sockets on loopback, an emulated network between them.

use std::net::{Ipv4Addr, SocketAddr};
use std::time::{Duration, Instant};

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::io::{MasterOptions, OperatorChoice};
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_netem::{Direction, LinkConfig};
use mmt_server::io::SlaveOptions;
use mmt_server::playout::PlayoutConfig;
use mmt_server::slave::SlaveConfig;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::transport::Transport;
use mmt_shared::io::truth::{self, TruthReceiver, TruthSender};
use mmt_shared::model::settings::Mode;
use mmt_shared::pairing::Pairing;
use mmt_shared::report::RunReport;
use mmt_shared::wire::Architecture;

use super::netem::wrap::{Emulation, effect};
use super::record::Record;
use super::viewer::Viewer;
use super::{master, slave};
use crate::args::DemoArguments;
use crate::config::scene;
use crate::failure::Failure;
use crate::log::Messages;
use crate::output::{note, print, print_json};
use crate::stop::Stop;
use crate::view::{Caption, Snapshot};

/// Samples in a command.
const SAMPLES_PER_COMMAND: u8 = 10;
/// How long the slave may take to notice that the master has ended before it is asked to end as well.
const FAREWELL: Duration = Duration::from_secs(3);

/// Runs `mmt demo`.
///
/// # Errors
/// A host could not start, or the session broke.
pub(crate) fn run(arguments: &DemoArguments, messages: &Messages) -> Result<(), Failure> {
    let config = slave_config(arguments)?;
    let caption = caption(arguments, &config);
    let (up, down) = (up(arguments), down(arguments));
    note(effect(Direction::Up, up)?);
    note(effect(Direction::Down, down)?);
    arguments.transport.warning().into_iter().for_each(note);
    let transport = arguments.transport.choose()?;
    let record = Record::start(arguments.record.as_deref())?;
    let (stop, stop_slave) = (Stop::on_signals()?, Stop::new());
    // both sides stretch as far
    let stretch_max = config.stretch_max;
    let seed = arguments.seed;
    let emulation = Emulation::start(&arguments.emulation, seed, Some(up), Some(down))?;
    let (truth_from, truth_to) = truth::pair();
    let mut options = slave_options(arguments, transport, &emulation, config, truth_from)?;
    options.record = record.recorder();
    let (slave, started) = slave::start(options, None, stop_slave.receiver())?;
    let Ok(started) = started.recv() else {
        return slave.join().map(|_| ());
    };
    let mut options = master_options(arguments, transport, &emulation, started.pairing, truth_to);
    options.commands.stretch_max = stretch_max;
    options.record = record.recorder();
    let dashboard = !arguments.json && !emulation.takes_orders();
    options.scene_hz = Viewer::scene_hz(dashboard);
    let (master, master_live) = master::start(options, stop.receiver())?;

    let mut viewer = Viewer::new(caption, dashboard, messages, &stop);
    let mut master_ended = None;
    while master.is_running() || slave.is_running() {
        // copied first: a borrow that lives through the viewer's wait would stop the hosts' tasks
        let (slave_now, master_now) = (*started.live.borrow(), *master_live.borrow());
        viewer.look(Snapshot {
            slave: Some(slave_now).filter(|slave| slave.connected),
            master: Some(master_now),
        });
        if !master.is_running() {
            let since = *master_ended.get_or_insert_with(Instant::now);
            if since.elapsed() > FAREWELL {
                stop_slave.end();
            }
        }
    }
    drop(viewer);
    let (master, slave) = (master.join(), slave.join());
    emulation.finish()?;
    let report = RunReport::of_both(master?, slave?);
    if arguments.json {
        print_json(&report)?
    } else {
        print(&report)?
    }
    record.finish()?;
    master::judge(master_live.borrow().ended)
}

fn up(arguments: &DemoArguments) -> &LinkConfig {
    arguments.netem_up.as_ref().unwrap_or(&arguments.netem)
}

fn down(arguments: &DemoArguments) -> &LinkConfig {
    arguments.netem_down.as_ref().unwrap_or(&arguments.netem)
}

fn architecture(arguments: &DemoArguments) -> Architecture {
    arguments.architecture
}

fn slave_config(arguments: &DemoArguments) -> Result<SlaveConfig, Failure> {
    let mut config = SlaveConfig::of_mode(arguments.mode);
    config.seed = arguments.seed;
    if let Some(path) = &arguments.scene {
        config.scene = scene(path)?;
    }
    // where the tool may be felt the play-out finds out by itself how long it has to wait
    if !architecture(arguments).feels_tool() {
        let jitter = up(arguments).jitter_span();
        config.playout = PlayoutConfig::for_packing_and_jitter(SAMPLES_PER_COMMAND, jitter);
    }
    if let Some(scheme) = arguments.scheme {
        config.trigger.scheme = scheme;
    }
    config.repeats_ms = arguments.repeats.unwrap_or(config.repeats_ms);
    config.stretch_max = arguments.stretch_max.unwrap_or(config.stretch_max);
    Ok(config)
}

fn caption(arguments: &DemoArguments, config: &SlaveConfig) -> Caption {
    let environment = &config.environment;
    let m = environment.mass_kg;
    let c = environment.friction_coefficient * m * environment.gravity_m_per_s2;
    let mode = match config.mode {
        Mode::Paper => "paper",
        Mode::Recommended => "recommended",
    };
    let (scheme, seed) = (config.trigger.scheme, arguments.seed);
    let network = match (up(arguments), down(arguments)) {
        (up, down) if up == down => format!("network each way: {up}"),
        (up, down) => format!("network up: {up}, down: {down}"),
    };
    let mode = match architecture(arguments) {
        Architecture::Mmt => mode.to_owned(),
        other => format!("{mode}, {}", other.name()),
    };
    Caption {
        command: "demo",
        duration_s: Some(arguments.duration.as_secs_f64()),
        setting: format!("{mode}, {scheme}; {network}; seed {seed}"),
        // of several bodies the one that is touched counts
        truth: (config.scene.bodies.is_empty()).then_some([m, environment.damping_ns_per_m, c]),
    }
}

fn slave_options(
    arguments: &DemoArguments,
    transport: Transport,
    emulation: &Emulation,
    config: SlaveConfig,
    truth: TruthSender,
) -> Result<SlaveOptions, Failure> {
    Ok(SlaveOptions {
        transport,
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        identity: Identity::ephemeral().map_err(Failure::failed)?,
        config,
        netem: down(arguments).clone(),
        netem_seed: arguments.seed,
        netem_extras: emulation.extras(Direction::Down),
        once: true,
        truth: Some(truth),
        record: None,
    })
}

fn master_options(
    arguments: &DemoArguments,
    transport: Transport,
    emulation: &Emulation,
    pairing: Pairing,
    truth: TruthReceiver,
) -> MasterOptions {
    MasterOptions {
        transport,
        pairing,
        device: DeviceProfile::default(),
        operator: OperatorChoice::Scripted(ScriptedConfig {
            seed: arguments.seed,
            ..ScriptedConfig::default()
        }),
        duration: Some(arguments.duration),
        architecture: architecture(arguments),
        scene_hz: 0,
        commands: CommandConfig {
            samples_per_command: SAMPLES_PER_COMMAND,
            repeat_samples: arguments.repeat_samples,
            ..CommandConfig::default()
        },
        netem: up(arguments).clone(),
        netem_seed: arguments.seed,
        netem_extras: emulation.extras(Direction::Up),
        path: None,
        truth: Some(truth),
        record: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_play_out_waits_for_packing_and_the_whole_jitter() {
        let peak_to_peak = |text: &str| {
            let link: mmt_netem::LinkConfig = text.parse().unwrap();
            link.jitter_span()
        };
        assert_eq!(peak_to_peak("delay 50ms"), Duration::ZERO);
        assert_eq!(peak_to_peak("delay 50ms 5ms"), Duration::from_millis(10));
        let normal = peak_to_peak("delay 50ms 4ms distribution normal");
        assert_eq!(normal, Duration::from_millis(20));
        let playout = PlayoutConfig::for_packing_and_jitter(10, peak_to_peak("delay 50ms 5ms"));
        assert_eq!(playout.delay_ms, 21.0);
    }
}
