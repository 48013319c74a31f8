//! `mmt netem`: a UDP relay that emulates a network between two hosts.

use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use mmt_netem::io::relay::{Extras, Relay, RelayHandle};
use mmt_netem::record::Heading;
use mmt_netem::{Direction, LinkConfig};
use mmt_shared::io::connect::in_order;
use mmt_shared::pairing::Address;

use super::conclusion::conclude;
use crate::args::{NetemArguments, NetemCommand};
use crate::failure::Failure;
use crate::log::Messages;
use crate::output::{note, print, print_json};
use crate::stop::Stop;

pub(super) mod control;
mod document;
mod files;
mod gauge;
mod places;
mod report;
mod shell;
mod start;
mod table;
mod trace;
pub(super) mod wrap;

use control::Command;
pub(crate) use document::NetemReport;
use files::{Files, record_file};
use gauge::{Caption, Gauge};
use places::Places;
use start::{CHECK_EVERY, announce, start_error};

/// Runs `mmt netem`.
///
/// # Errors
/// The slave's name is unknown, the address cannot be had, the record cannot be written, the relay
/// breaks; of a report, its file is none.
pub(crate) fn run(arguments: &NetemArguments, messages: &Messages) -> Result<(), Failure> {
    match &arguments.command {
        Some(NetemCommand::Report(arguments)) => report::run(arguments),
        Some(NetemCommand::Trace(arguments)) => trace::run(arguments),
        Some(NetemCommand::Shell(arguments)) => shell::run(arguments, messages),
        None => relay(arguments, messages),
    }
}

/// Relays until asked to stop.
fn relay(arguments: &NetemArguments, messages: &Messages) -> Result<(), Failure> {
    let (Some(listen), Some(to)) = (arguments.listen, &arguments.to) else {
        return Err(Failure::usage("a relay needs --listen and --to").remedy("give both"));
    };
    let to = resolve(to)?;
    let stop = Stop::on_signals()?;
    let (up, down) = (arguments.up.clone(), arguments.down.clone());
    let files = Files::begin(&arguments.files, &heading(arguments))?;
    let extras = Extras {
        rebind_every: arguments.rebind,
        clients: Some(arguments.clients),
        ..files.extras()
    };
    let relay = Relay::bind(listen, to, up, down, arguments.seed, extras);
    let relay = relay.map_err(start_error)?;
    let local = relay.local_addr();
    print(local)?;
    let began = Instant::now();
    // the keys are the commands' where there are commands
    let live = !arguments.json && !arguments.control;
    let gauge = live.then(|| Gauge::take(caption(arguments, local, to), messages));
    let (rate, bytes) = (arguments.rate, arguments.bytes);
    let names = [format!("up   (to {to})"), "down (to masters)".to_owned()];
    let effects = announce(
        [&arguments.up, &arguments.down],
        rate,
        bytes,
        names,
        messages,
    );
    let commands = arguments.control.then(lines_of_stdin);
    wait(
        &relay,
        &stop,
        arguments,
        commands.as_ref(),
        Show {
            gauge: gauge.flatten(),
            messages,
        },
    );
    let duration_s = began.elapsed().as_secs_f64();
    let ending = stop.ending().name();
    let counters = relay.stop().map_err(Failure::failed)?;
    let effects = effects.join();
    let effects =
        effects.map_err(|_| Failure::failed("the effect of the networks is not known"))?;
    let report = NetemReport::of(
        arguments,
        [local, to],
        duration_s,
        ending,
        counters,
        effects.map_err(Failure::usage)?,
    );
    let printed = if arguments.json {
        print_json(&report)
    } else {
        print(format_args!("\n{report}"))
    };
    conclude([printed, files.finish()])
}

fn heading(arguments: &NetemArguments) -> Heading {
    Heading {
        seed: arguments.seed,
        up: arguments.up.to_string(),
        down: arguments.down.to_string(),
    }
}

/// The lines of stdin as they come, until it ends.
fn lines_of_stdin() -> Receiver<String> {
    let (sender, lines) = channel();
    control::from_stdin(move |line| sender.send(line.to_owned()).is_ok());
    lines
}

/// Until the time is over, somebody asks for the end, or the relay breaks; applies commands meanwhile.
fn wait(
    relay: &RelayHandle,
    stop: &Stop,
    arguments: &NetemArguments,
    commands: Option<&Receiver<String>>,
    mut show: Show<'_>,
) {
    let (began, duration) = (Instant::now(), arguments.duration);
    let mut links = (arguments.up.clone(), arguments.down.clone());
    let mut places = Places::new(arguments.clients);
    let over = || duration.is_some_and(|duration| began.elapsed() >= duration);
    while !stop.asked() && !over() && relay.is_running() {
        for line in commands.into_iter().flat_map(Receiver::try_iter) {
            if let Err(what) = apply(&line, relay, &mut links) {
                note(what);
            }
        }
        show.warn(places.warnings(&relay.snapshot(), Instant::now()));
        let left = duration.map(|duration| duration.saturating_sub(began.elapsed()));
        let patience = left.map_or(CHECK_EVERY, |left| left.min(CHECK_EVERY));
        if show.look(relay, patience) {
            stop.ask();
        }
    }
    // one that came since the last look counts as well
    show.warn(places.warnings(&relay.snapshot(), Instant::now()));
}

/// Where a run shows what it does: the gauge, if there is a terminal for it, and messages.
struct Show<'a> {
    gauge: Option<Gauge>,
    messages: &'a Messages,
}

impl Show<'_> {
    fn warn(&self, warnings: Vec<String>) {
        for warning in warnings {
            self.messages.show(&warning);
        }
    }

    /// Shows what the relay does for as long as `patience`; whether somebody wants the end.
    fn look(&mut self, relay: &RelayHandle, patience: Duration) -> bool {
        let Some(gauge) = &mut self.gauge else {
            std::thread::sleep(patience);
            return false;
        };
        gauge.look(relay, patience).unwrap_or_else(|error| {
            self.gauge = None;
            tracing::warn!("the live view ends: {error}");
            false
        })
    }
}

fn caption(arguments: &NetemArguments, local: SocketAddr, to: SocketAddr) -> Caption {
    let (up, down) = (&arguments.up, &arguments.down);
    Caption {
        path: format!("{local} to {to}, up: {up}, down: {down}"),
        duration: arguments.duration,
    }
}

fn apply(
    line: &str,
    relay: &RelayHandle,
    links: &mut (LinkConfig, LinkConfig),
) -> Result<(), String> {
    match Command::parse(line)? {
        None => return Ok(()),
        Some(Command::Link(Direction::Up, link)) => links.0 = *link,
        Some(Command::Link(Direction::Down, link)) => links.1 = *link,
        Some(Command::Rebind) => {
            relay.rebind();
            return Ok(());
        }
    }
    let (up, down) = links.clone();
    relay
        .reconfigure(up, down)
        .map_err(|error| error.to_string())
}

fn resolve(address: &Address) -> Result<SocketAddr, Failure> {
    let unknown = |why: String| {
        let what = format!("--to {address}: {why}");
        Failure::usage(what).remedy("check the name, or give the slave's IP address")
    };
    let found = address.to_string().to_socket_addrs();
    let found = in_order(found.map_err(|error| unknown(error.to_string()))?);
    let first = found.first().copied();
    let first = first.ok_or_else(|| unknown("the name has no address".to_owned()))?;
    if found.len() > 1 {
        note(format_args!(
            "{address} has several addresses: the relay sends to {first}"
        ));
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::failure::Exit;

    #[test]
    fn an_unknown_host_is_named_with_the_remedy() {
        let address: Address = "no-such-host.invalid:1".parse().unwrap();
        let failure = resolve(&address).unwrap_err();
        assert_eq!(failure.exit(), Exit::Usage);
        let text = failure.to_string();
        assert!(
            text.contains("no-such-host.invalid:1") && text.contains("what to do"),
            "{text}"
        );
    }
}
