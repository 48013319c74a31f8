//! The document of a relay.

use mmt_netem::Effect;
use mmt_netem::io::relay::RelaySnapshot;
use serde::Serialize;

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
    pub(super) configuration: NetemConfiguration,
}

#[derive(Debug, Serialize)]
pub(super) struct NetemConfiguration {
    pub(super) listen: String,
    pub(super) to: String,
    pub(super) up: String,
    pub(super) down: String,
    pub(super) effect_up: Effect,
    pub(super) effect_down: Effect,
}
