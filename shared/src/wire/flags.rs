//! The flags of a datagram's header: what the sender's side does besides what the message is about.

use serde::Serialize;

/// The sender's emergency stop is set.
const STOPPED: u16 = 1;
/// Bits of the tool's state, and by how much they are shifted.
const TOOL: (u16, u32) = (0b11, 1);
/// The limit of the tool's energy holds it.
const ENERGY: u16 = 1 << 3;

/// Whether the slave's tool follows the master's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ToolState {
    /// It follows.
    #[default]
    Nominal,
    /// No sample has come for 100 ms: it stands, and follows again with the next.
    Hold,
    /// No sample has come for 2 s: it stands for good.
    Disengaged,
}

impl ToolState {
    /// All of them, in the order of their numbers on the wire.
    pub const ALL: [Self; 3] = [Self::Nominal, Self::Hold, Self::Disengaged];

    /// Name in views and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::Hold => "hold",
            Self::Disengaged => "disengaged",
        }
    }
}

/// What a datagram's header shows of its sender.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// Whether the sender's emergency stop is set.
    pub stopped: bool,
    /// The slave's tool; of a master always nominal.
    pub tool: ToolState,
    /// Whether the limit of the tool's energy holds it; of a master never.
    pub energy_holds: bool,
}

impl Flags {
    /// The header's number.
    pub(super) const fn to_bits(self) -> u16 {
        let (_, shift) = TOOL;
        let stopped = if self.stopped { STOPPED } else { 0 };
        let energy = if self.energy_holds { ENERGY } else { 0 };
        stopped | (self.tool as u16) << shift | energy
    }

    /// The flags of a header's number; none if it has bits that no version 3 sets.
    pub(super) fn from_bits(bits: u16) -> Option<Self> {
        let (mask, shift) = TOOL;
        let tool = ToolState::ALL.get(usize::from(bits >> shift & mask))?;
        let flags = Self {
            stopped: bits & STOPPED != 0,
            tool: *tool,
            energy_holds: bits & ENERGY != 0,
        };
        (flags.to_bits() == bits).then_some(flags)
    }

    /// Whether a master may send them.
    pub(super) fn are_a_masters(self) -> bool {
        let own = Self {
            stopped: self.stopped,
            ..Self::default()
        };
        self == own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_is_one_set_of_flags_or_none() {
        let known: Vec<u16> = (0..=u16::MAX)
            .filter(|bits| Flags::from_bits(*bits).is_some_and(|flags| flags.to_bits() == *bits))
            .collect();
        assert_eq!(known, [0, 1, 2, 3, 4, 5, 8, 9, 10, 11, 12, 13]);
        assert_eq!(Flags::from_bits(4).unwrap().tool, ToolState::Disengaged);
        let masters = known
            .iter()
            .filter(|bits| Flags::from_bits(**bits).unwrap().are_a_masters());
        assert_eq!(masters.copied().collect::<Vec<_>>(), [0, 1]);
    }
}
