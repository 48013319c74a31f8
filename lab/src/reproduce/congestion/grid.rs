//! What is run: the network with its bottleneck, and who answers congestion.
//!
//! It never says what came of a run.

use mmt_netem::config::LinkConfig;
use mmt_netem::words::ParseError;
use mmt_shared::channel::rate_control::StretchMax;

use crate::reproduce::ReproduceError;
use crate::world::WorldConfig;

/// When the bottleneck comes and goes, s.
pub(super) const FROM_S: f64 = 10.0;
pub(super) const UNTIL_S: f64 = 25.0;
/// Beginning of the part after congestion: what had queued is gone, and the stretch.
pub(super) const AFTER_S: f64 = 35.0;
/// Each direction; the 58 bytes are the headers of IPv4, UDP and QUIC.
const NETWORK: &str = "delay 50ms; at 10s delay 50ms rate 64kbit 58 queue 1s; at 25s delay 50ms";
/// Who answers congestion: nobody, the master with its samples alone, both; greatest stretches of master and slave.
pub(super) const VARIANTS: [(&str, StretchMax, StretchMax); 3] = [
    ("nobody", StretchMax::OFF, StretchMax::OFF),
    ("master", StretchMax::RECOMMENDED, StretchMax::OFF),
    ("both", StretchMax::RECOMMENDED, StretchMax::RECOMMENDED),
];

/// The live defaults over that network, with these greatest stretches of master and slave.
///
/// # Errors
/// When the network's words are not accepted.
pub(super) fn world(master: StretchMax, slave: StretchMax) -> Result<WorldConfig, ReproduceError> {
    let link: Result<LinkConfig, _> = NETWORK.parse();
    let link = link.map_err(|error: ParseError| ReproduceError::Network {
        name: "bottleneck".to_owned(),
        why: error.to_string(),
    })?;
    let mut world = WorldConfig {
        up: link.clone(),
        down: link,
        stretch_max: master,
        ..WorldConfig::default()
    };
    world.slave.stretch_max = slave;
    Ok(world)
}
