//! The hand's plug: a haptic device of somebody else's becomes the hand of a session.
//!
//! Pure: packets in, what the hand does ([`HandEvent`]) out, and a packet with the force for each that was taken
//! (`docs/plugs.md`). Its readings go through the same clock map, resampling, clutch and release as those of a pointer.

pub(super) mod config;
mod file;
#[cfg(test)]
mod tests;

use std::net::SocketAddr;

use mmt_shared::plug::{
    Admitted, DEVICE_BYTES, PlugCounts, PlugHead, PlugKind, PlugPeer, PlugToken, decode, encode,
    singles,
};
use mmt_shared::time::Time;

use super::hand::Hand;
pub use super::hand::{HandOutput, Reading};
use crate::operator::pointer::HandEvent;
pub use config::{Axis, DeviceKind, DeviceLinkConfig, DeviceLinkError, Dialect, Hold, Version};
pub use file::DeviceFile;

/// Bits of the state that is sent to the device.
mod state {
    pub(super) const SESSION: u16 = 1;
    pub(super) const ENGAGED: u16 = 2;
    pub(super) const IN_CONTACT: u16 = 4;
    pub(super) const STOPPED: u16 = 8;
    pub(super) const LINK_LATE: u16 = 16;
    pub(super) const REFUSED: u16 = 32;
}

/// The device's end of the haptic loop.
#[derive(Clone, Debug)]
pub struct DeviceLink {
    token: PlugToken,
    peer: PlugPeer,
    hand: Hand,
    sent: u32,
}

impl DeviceLink {
    /// A link that nobody is plugged into.
    ///
    /// # Errors
    /// Names the first number that is not accepted.
    pub fn try_new(config: DeviceLinkConfig, token: PlugToken) -> Result<Self, DeviceLinkError> {
        let hand = Hand::try_new(config)?;
        Ok(Self {
            token,
            peer: PlugPeer::new(config.tuning().silence),
            hand,
            sent: 0,
        })
    }

    /// What became of the device's packets.
    pub fn counts(&self) -> &PlugCounts {
        &self.peer.counts
    }

    /// The newest reading as it came, once.
    pub fn seen(&mut self) -> Option<Reading> {
        self.hand.seen()
    }

    /// Takes in a packet that came from there at `now`, and gives what the hand does by it. Whether an answer is due.
    pub fn handle(
        &mut self,
        now: Time,
        from: SocketAddr,
        packet: &[u8],
        mut give: impl FnMut(HandEvent),
    ) -> bool {
        let read = decode(PlugKind::Reading, DEVICE_BYTES, &self.token, packet);
        let (head, numbers) = match read {
            Ok(read) => read,
            Err(why) => {
                self.peer.refuse(why);
                return false;
            }
        };
        match self.peer.admit(now, from, head.sequence) {
            None => return false,
            Some(Admitted::First) => self.hand.anew(&mut give),
            Some(Admitted::Next) => {}
        }
        let [x, y, z, velocity @ ..] = singles::<6>(numbers);
        let reading = Reading {
            stamp_ns: head.stamp_ns,
            place: [x, y, z],
            velocity,
            buttons: head.flags,
        };
        let could_be = self.hand.take(&reading, give);
        self.peer.counts.nonsense += u64::from(!could_be);
        true
    }

    /// The packet that answers the newest reading, with what the newest tick gave.
    pub fn answer(&mut self, now: Time, output: &HandOutput) -> [u8; DEVICE_BYTES] {
        let action = self.hand.act(now, output);
        let (runs, acts) = (action.runs, action.acts);
        let bits = [
            (runs, state::SESSION),
            (acts && output.engaged, state::ENGAGED),
            (runs && output.in_contact, state::IN_CONTACT),
            (runs && output.stopped, state::STOPPED),
            (runs && output.link_late, state::LINK_LATE),
            (action.refused, state::REFUSED),
        ];
        self.sent = self.sent.wrapping_add(1);
        let head = PlugHead {
            flags: bits.iter().filter(|bit| bit.0).map(|bit| bit.1).sum(),
            sequence: self.sent,
            answers: self.peer.newest(),
            stamp_ns: now.as_nanos(),
        };
        let [x, y, z] = action.force;
        let lost = self.peer.counts.lost as f64;
        let numbers = [x, y, z, output.hip.x, output.hip.y, lost];
        let numbers = numbers.map(|number| (number as f32).to_le_bytes());
        encode(PlugKind::Force, &self.token, &head, numbers)
    }
}
