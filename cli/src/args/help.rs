//! The prose and the examples of `--help`, each in a text file of its own.

/// One line on the whole.
pub(super) const ABOUT: &str = "Model-mediated teleoperation: feel a box that stands far away without the network in your hand";

/// Below the list of commands.
pub(super) const AFTER: &str = include_str!("help/commands.txt").trim_ascii_end();

/// Examples of `mmt demo`.
pub(super) const DEMO: &str = include_str!("help/demo.txt").trim_ascii_end();

/// Examples of `mmt slave`.
pub(super) const SLAVE: &str = include_str!("help/slave.txt").trim_ascii_end();

/// Examples of `mmt master`.
pub(super) const MASTER: &str = include_str!("help/master.txt").trim_ascii_end();

/// Examples of `mmt netem`.
pub(super) const NETEM: &str = include_str!("help/netem.txt").trim_ascii_end();

/// Examples of `mmt replay`.
pub(super) const REPLAY: &str = include_str!("help/replay.txt").trim_ascii_end();

/// Examples of `mmt check`.
pub(super) const CHECK: &str = include_str!("help/check.txt").trim_ascii_end();

/// Examples of `mmt report`.
pub(super) const REPORT: &str = include_str!("help/report.txt").trim_ascii_end();

/// Examples of `mmt export`.
pub(super) const EXPORT: &str = include_str!("help/export.txt").trim_ascii_end();

/// Examples of `mmt live`.
#[cfg(feature = "live")]
pub(super) const LIVE: &str = include_str!("help/live.txt").trim_ascii_end();

/// Examples of `mmt reproduce`.
pub(super) const REPRODUCE: &str = include_str!("help/reproduce.txt").trim_ascii_end();

/// Examples of `mmt swarm`.
pub(super) const SWARM: &str = include_str!("help/swarm.txt").trim_ascii_end();

/// Examples of `mmt soak`.
pub(super) const SOAK: &str = include_str!("help/soak.txt").trim_ascii_end();

/// Examples of `mmt sweep`.
pub(super) const SWEEP: &str = include_str!("help/sweep.txt").trim_ascii_end();

/// Examples of `mmt config`.
pub(super) const CONFIG: &str = include_str!("help/config.txt").trim_ascii_end();

/// Examples of `mmt device`.
pub(super) const DEVICE: &str = include_str!("help/device.txt").trim_ascii_end();

/// Examples of `mmt device list`.
pub(super) const DEVICE_LIST: &str = include_str!("help/device-list.txt").trim_ascii_end();

/// Examples of `mmt device test`.
pub(super) const DEVICE_TEST: &str = include_str!("help/device-test.txt").trim_ascii_end();

/// Examples of `mmt identity`.
pub(super) const IDENTITY: &str = include_str!("help/identity.txt").trim_ascii_end();

/// Examples of `mmt identity list`.
pub(super) const IDENTITY_LIST: &str = include_str!("help/identity-list.txt").trim_ascii_end();

/// Examples of `mmt identity rotate`.
pub(super) const IDENTITY_ROTATE: &str = include_str!("help/identity-rotate.txt").trim_ascii_end();

/// Examples of `mmt identity revoke`.
pub(super) const IDENTITY_REVOKE: &str = include_str!("help/identity-revoke.txt").trim_ascii_end();

/// Examples of `mmt completions`.
pub(super) const COMPLETIONS: &str = include_str!("help/completions.txt").trim_ascii_end();

/// Examples of `mmt man`.
pub(super) const MAN: &str = include_str!("help/man.txt").trim_ascii_end();

/// Examples of `mmt doctor`.
pub(super) const DOCTOR: &str = include_str!("help/doctor.txt").trim_ascii_end();

/// Examples of `mmt bench`.
pub(super) const BENCH: &str = include_str!("help/bench.txt").trim_ascii_end();
