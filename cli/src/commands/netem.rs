//! `mmt netem`: a UDP relay that emulates a network between two hosts.

use std::net::{SocketAddr, ToSocketAddrs};
use std::time::{Duration, Instant};

use mmt_netem::io::relay::{Relay, RelayError, RelayHandle, RelaySnapshot};
use mmt_netem::{Effect, effect};
use mmt_shared::pairing::Address;
use serde::Serialize;

use crate::args::NetemArguments;
use crate::failure::{Exit, Failure};
use crate::output::{note, print, print_json};
use crate::stop::Stop;

mod table;

/// The rate at which the effect of the settings is told, packets per second: that of commands of ten
/// samples.
const RATE_HZ: f64 = 100.0;
/// How often the relay is looked at.
const LOOK: Duration = Duration::from_millis(50);

/// The document of a relay.
#[derive(Debug, Serialize)]
pub(crate) struct NetemReport {
    version: &'static str,
    command: &'static str,
    seed: u64,
    duration_s: f64,
    ending: &'static str,
    counters: RelaySnapshot,
    configuration: NetemConfiguration,
}

#[derive(Debug, Serialize)]
struct NetemConfiguration {
    listen: String,
    to: String,
    up: String,
    down: String,
    effect_up: Effect,
    effect_down: Effect,
}

/// Runs `mmt netem`.
///
/// # Errors
/// The slave's name is unknown, the address cannot be had, the relay breaks.
pub(crate) fn run(arguments: &NetemArguments) -> Result<(), Failure> {
    let effect_of = |link| effect(link, RATE_HZ).map_err(Failure::usage);
    let (effect_up, effect_down) = (effect_of(&arguments.up)?, effect_of(&arguments.down)?);
    let to = resolve(&arguments.to)?;
    let stop = Stop::on_signals()?;
    let (up, down) = (arguments.up.clone(), arguments.down.clone());
    let relay = Relay::bind(arguments.listen, to, up, down, arguments.seed).map_err(start_error)?;
    let local = relay.local_addr();
    note(format_args!("up   (to {to}): {effect_up}"));
    note(format_args!("down (to masters): {effect_down}"));
    print(local)?;
    let began = Instant::now();
    wait(&relay, &stop, arguments.duration);
    let duration_s = began.elapsed().as_secs_f64();
    let ending = if stop.asked() {
        "interrupted"
    } else {
        "finished"
    };
    let report = NetemReport {
        version: env!("CARGO_PKG_VERSION"),
        command: "netem",
        seed: arguments.seed,
        duration_s,
        ending,
        counters: relay.stop().map_err(Failure::failed)?,
        configuration: NetemConfiguration {
            listen: local.to_string(),
            to: to.to_string(),
            up: arguments.up.to_string(),
            down: arguments.down.to_string(),
            effect_up,
            effect_down,
        },
    };
    match arguments.json {
        true => print_json(&report),
        false => print(format_args!("\n{report}")),
    }
}

/// Until the time is over, somebody asks for the end, or the relay breaks.
fn wait(relay: &RelayHandle, stop: &Stop, duration: Option<Duration>) {
    let began = Instant::now();
    let over = || duration.is_some_and(|duration| began.elapsed() >= duration);
    while !stop.asked() && !over() && relay.is_running() {
        let left = duration.map(|duration| duration.saturating_sub(began.elapsed()));
        std::thread::sleep(left.map_or(LOOK, |left| left.min(LOOK)));
    }
}

fn resolve(address: &Address) -> Result<SocketAddr, Failure> {
    let unknown = |why: String| {
        let what = format!("--to {address}: {why}");
        Failure::usage(what).remedy("check the name, or give the slave's IP address")
    };
    let found = address.to_string().to_socket_addrs();
    let mut found = found.map_err(|error| unknown(error.to_string()))?;
    found
        .next()
        .ok_or_else(|| unknown("the name has no address".to_owned()))
}

fn start_error(error: RelayError) -> Failure {
    match &error {
        RelayError::Listen { .. } => Failure::new(Exit::Address, &error)
            .remedy("give another --listen address, or port 0 for any free port"),
        RelayError::Target { .. } | RelayError::Loop { .. } => {
            Failure::usage(&error).remedy("give --to the address that the slave listens on")
        }
        RelayError::Config(_) => Failure::usage(&error).remedy("change --up or --down"),
        RelayError::Histogram(_) | RelayError::Thread(_) | RelayError::Broken(_) => {
            Failure::failed(&error)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn a_relay_to_itself_is_wrong_input_and_an_address_in_use_has_its_own_code() {
        let to = SocketAddr::from(([127, 0, 0, 1], 1));
        assert_eq!(start_error(RelayError::Loop { to }).exit(), Exit::Usage);
        let source = std::io::ErrorKind::AddrInUse.into();
        let listen = RelayError::Listen { listen: to, source };
        assert_eq!(start_error(listen).exit(), Exit::Address);
    }
}
