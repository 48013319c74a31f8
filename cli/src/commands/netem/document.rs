//! The document of a relay.

use std::net::SocketAddr;

use mmt_netem::Effect;
use mmt_netem::io::relay::RelaySnapshot;
use serde::Serialize;

use crate::args::NetemArguments;

/// The document of a relay.
#[derive(Debug, Serialize)]
pub(crate) struct NetemReport {
    pub(super) version: &'static str,
    pub(super) command: &'static str,
    pub(super) seed: u64,
    pub(super) duration_s: f64,
    pub(super) ending: &'static str,
    /// Whether this host was too slow for the run to be about these networks.
    pub(super) degraded: bool,
    /// Whether a master was turned away because there were as many as --clients allows.
    pub(super) refused_clients: bool,
    /// Whether a master that did not talk with the slave made room for a newer one.
    pub(super) displaced_clients: bool,
    pub(super) counters: RelaySnapshot,
    configuration: NetemConfiguration,
}

impl NetemReport {
    /// Of a relay between these addresses, which ran for so long (s) and ended so.
    pub(super) fn of(
        arguments: &NetemArguments,
        [local, to]: [SocketAddr; 2],
        duration_s: f64,
        ending: &'static str,
        counters: RelaySnapshot,
        (effect_up, effect_down): (Effect, Effect),
    ) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            command: "netem",
            seed: arguments.seed,
            duration_s,
            ending,
            degraded: counters.lateness.degraded(),
            refused_clients: counters.refused.packets > 0,
            displaced_clients: counters.clients_displaced > 0,
            counters,
            configuration: NetemConfiguration {
                listen: local.to_string(),
                to: to.to_string(),
                up: arguments.up.to_string(),
                down: arguments.down.to_string(),
                effect_up,
                effect_down,
            },
        }
    }
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
