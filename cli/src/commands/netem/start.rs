//! What the relay and the shell share: how their networks are announced, checked and refused.

use std::thread::JoinHandle;
use std::time::Duration;

use mmt_netem::config::ConfigError;
use mmt_netem::io::relay::RelayError;
use mmt_netem::{Effect, LinkConfig};

use crate::failure::{Exit, Failure};
use crate::log::Messages;

/// How often the state of the relay is checked.
pub(super) const CHECK_EVERY: Duration = Duration::from_millis(50);

/// The last line of a run that the host was too slow for.
pub(super) const DEGRADED: &str =
    "degraded: this host was too slow for the emulation, do not trust its delays";

/// What the networks up and down will do, worked out and printed while they are at work already.
pub(super) fn announce(
    links: [&LinkConfig; 2],
    rate: f64,
    bytes: usize,
    names: [String; 2],
    messages: &Messages,
) -> JoinHandle<Result<(Effect, Effect), ConfigError>> {
    let ([up, down], [of_up, of_down]) = (links.map(LinkConfig::clone), names);
    let messages = messages.clone();
    std::thread::spawn(move || {
        let effect_up = up.expected(rate, bytes)?;
        messages.show(&format!("{of_up}: {effect_up}"));
        let effect_down = down.expected(rate, bytes)?;
        messages.show(&format!("{of_down}: {effect_down}"));
        Ok((effect_up, effect_down))
    })
}

pub(super) fn start_error(error: RelayError) -> Failure {
    match &error {
        RelayError::Listen { .. } => Failure::new(Exit::Address, &error)
            .remedy("give another --listen address, or port 0 for any free port"),
        RelayError::Target { .. } | RelayError::Loop { .. } => {
            Failure::usage(&error).remedy("give --to the address that the slave listens on")
        }
        RelayError::Config(_) => Failure::usage(&error).remedy("change --up or --down"),
        RelayError::Thread(_) | RelayError::Broken(_) => Failure::failed(&error),
    }
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use super::*;

    #[test]
    fn a_relay_to_itself_is_wrong_input_and_an_address_in_use_has_its_own_code() {
        let to = SocketAddr::from(([127, 0, 0, 1], 1));
        assert_eq!(start_error(RelayError::Loop { to }).exit(), Exit::Usage);
        let source = std::io::ErrorKind::AddrInUse.into();
        let listen = RelayError::Listen { listen: to, source };
        assert_eq!(start_error(listen).exit(), Exit::Address);
    }
}
