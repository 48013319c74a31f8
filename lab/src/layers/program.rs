//! Who reads a configuration, and which keys have an effect in it.

use super::keys::within;

/// What the seeds of a plan set.
pub(crate) const SEED_KEYS: [&str; 3] = ["seed", "slave.seed", "operator.seed"];

/// Who reads the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// Both sides on one machine.
    Demo,
    /// The host with the object.
    Slave,
    /// The host with the hand.
    Master,
    /// Experiments in virtual time.
    Sweep,
}

impl Program {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Demo, Self::Slave, Self::Master, Self::Sweep];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Demo => "demo",
            Self::Slave => "slave",
            Self::Master => "master",
            Self::Sweep => "sweep",
        }
    }

    /// Whether a key has an effect in it; the keys of the other side have none.
    #[must_use]
    pub fn uses(self, key: &str) -> bool {
        let any = |tables: &[&str]| tables.iter().any(|table| within(key, table));
        // a session has the coupling of its device, and its estimator starts from `slave.start`
        let used = !any(&["slave.environment.coupling"]) && !key.ends_with(".prior");
        used && match self {
            Self::Demo => !any(&["settings", "slave.plant"]),
            Self::Slave => any(&["seed", "slave", "down"]),
            Self::Master => !any(&["settings", "slave", "down"]),
            Self::Sweep => !any(&SEED_KEYS) && !any(&["slave.plant"]),
        }
    }
}
