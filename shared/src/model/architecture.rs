//! What the hand feels.

use serde::{Deserialize, Serialize};

/// Which architecture the master's hand feels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Model-mediated teleoperation: the local model's force.
    #[default]
    Mmt,
    /// The tool's force, with time-domain passivity control, as soon as it comes.
    Tdpa,
}

impl Architecture {
    /// All of them, in the order of their numbers on the wire.
    pub const ALL: [Self; 2] = [Self::Mmt, Self::Tdpa];

    /// Name in options and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mmt => "mmt",
            Self::Tdpa => "tdpa",
        }
    }

    /// Whether the hand feels the tool's force, so that the two ports exchange their energies.
    pub const fn feels_tool(self) -> bool {
        matches!(self, Self::Tdpa)
    }
}
