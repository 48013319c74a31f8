//! The hand's plug: a haptic device of somebody else's becomes the hand of a session.
//!
//! Pure: packets in, what the hand does ([`HandEvent`]) out, and a packet with the force for each that was taken
//! (`docs/plugs.md`). Its readings go through the same clock map, resampling, clutch and release as those of a pointer.
//! The hand is held from a press of the button to its release; where the HIP was then it goes on. A reading that cannot be,
//! or of a place where the device may not be, lets the hand go, and no force is sent until the button has been up.

mod config;
#[cfg(test)]
mod tests;

use std::net::SocketAddr;
use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::{
    Admitted, DEVICE_BYTES, PlugCounts, PlugHead, PlugKind, PlugPeer, PlugToken, decode, encode,
    singles,
};
use mmt_shared::time::Time;

use crate::operator::pointer::{HandEvent, PointerSample};
pub use config::{Axis, DeviceLinkConfig, DeviceLinkError};

/// A loop of which no tick has been seen for so long is taken for gone: no force.
const LOOP_SILENCE: Duration = Duration::from_millis(50);
/// For so long after the button is up the force of the ramp goes out: its 200 ms and some periods.
const RAMP_OUT: Duration = Duration::from_millis(210);
/// How far a reading may be from the one before besides what the greatest speed allows, m: quantization and noise.
const STEP_SLACK_M: f64 = 1e-3;

/// Bits of the state that is sent to the device.
mod state {
    pub(super) const SESSION: u16 = 1;
    pub(super) const ENGAGED: u16 = 2;
    pub(super) const IN_CONTACT: u16 = 4;
    pub(super) const STOPPED: u16 = 8;
    pub(super) const LINK_LATE: u16 = 16;
    pub(super) const REFUSED: u16 = 32;
}

/// What a tick of the haptic loop gives the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandOutput {
    /// Number of the tick, from 1; 0: no loop runs.
    pub tick: u64,
    /// Force on the hand as it left the limiter, N, world.
    pub force: Vec2,
    /// The HIP, m, world.
    pub hip: Vec2,
    /// Whether force may act on the hand.
    pub engaged: bool,
    /// Whether the HIP touches the model.
    pub in_contact: bool,
    /// Whether an emergency stop is set.
    pub stopped: bool,
    /// Whether nothing has come from the slave for 120 ms or more.
    pub link_late: bool,
}

/// The device's end of the haptic loop.
#[derive(Clone, Debug)]
pub struct DeviceLink {
    config: DeviceLinkConfig,
    token: PlugToken,
    peer: PlugPeer,
    /// Stamp and place of the newest reading that could be, ns and m.
    newest: Option<(u64, [f64; 3])>,
    /// Stamp that the times of readings count from, ns.
    first_ns: u64,
    hold: Hold,
    /// When the button was held last; none if it never was, or the hand was taken away.
    held: Option<Time>,
    sent: u32,
    /// The newest tick that was seen, and when it was new.
    ticked: (u64, Time),
}

/// What the button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    /// It must be seen up first.
    Barred,
    /// It is up.
    Up,
    /// It holds the hand.
    Held,
}

impl DeviceLink {
    /// A link that nobody is plugged into.
    ///
    /// # Errors
    /// Names the first number that is not accepted.
    pub fn try_new(config: DeviceLinkConfig, token: PlugToken) -> Result<Self, DeviceLinkError> {
        config.check()?;
        let silence = config.tuning().silence;
        Ok(Self {
            config,
            token,
            peer: PlugPeer::new(silence),
            newest: None,
            first_ns: 0,
            hold: Hold::Barred,
            held: None,
            sent: 0,
            ticked: (0, Time::ZERO),
        })
    }

    /// What became of the device's packets.
    pub fn counts(&self) -> &PlugCounts {
        &self.peer.counts
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
            Some(Admitted::First) => {
                self.let_go(&mut give);
                self.begin_anew(&mut give);
            }
            Some(Admitted::Next) => {}
        }
        let [x, y, z, velocity @ ..] = singles::<6>(numbers);
        let place = [x, y, z];
        let finite = place.iter().chain(&velocity).all(|n| n.is_finite());
        if !finite || !self.follows(head.stamp_ns, place) {
            self.peer.counts.nonsense += 1;
            self.let_go(&mut give);
            self.begin_anew(&mut give);
        } else if let Some(at) = self.config.world(place) {
            self.take(&head, place, at, give);
        } else {
            self.peer.counts.nonsense += 1;
            self.newest = Some((head.stamp_ns, place));
            self.let_go(&mut give);
        }
        true
    }

    /// The packet that answers the newest reading, with what the newest tick gave.
    pub fn answer(&mut self, now: Time, output: &HandOutput) -> [u8; DEVICE_BYTES] {
        if output.tick != self.ticked.0 {
            self.ticked = (output.tick, now);
        }
        let runs = output.tick > 0 && now.saturating_since(self.ticked.1) < LOOP_SILENCE;
        let refused = self.hold == Hold::Barred;
        if self.hold == Hold::Held {
            self.held = Some(now);
        }
        // whoever else moves the hand moves no device that nobody holds
        let ramps = |held| now.saturating_since(held) < RAMP_OUT;
        let acts = runs && self.held.is_some_and(ramps);
        let force = if acts { output.force } else { Vec2::zeros() };
        let bits = [
            (runs, state::SESSION),
            (acts && output.engaged, state::ENGAGED),
            (runs && output.in_contact, state::IN_CONTACT),
            (runs && output.stopped, state::STOPPED),
            (runs && output.link_late, state::LINK_LATE),
            (refused, state::REFUSED),
        ];
        self.sent = self.sent.wrapping_add(1);
        let head = PlugHead {
            flags: bits.iter().filter(|bit| bit.0).map(|bit| bit.1).sum(),
            sequence: self.sent,
            answers: self.peer.newest(),
            stamp_ns: now.as_nanos(),
        };
        let [x, y, z] = self.config.device(force);
        let lost = self.peer.counts.lost as f64;
        let numbers = [x, y, z, output.hip.x, output.hip.y, lost];
        let numbers = numbers.map(|number| (number as f32).to_le_bytes());
        encode(PlugKind::Force, &self.token, &head, numbers)
    }

    /// Whether a reading can follow the newest: later, and no further than the greatest speed allows.
    fn follows(&self, stamp_ns: u64, place: [f64; 3]) -> bool {
        let Some((then_ns, then)) = self.newest else {
            return true;
        };
        let silence_s = self.config.tuning().silence.as_secs_f64();
        let passed_s = (stamp_ns.saturating_sub(then_ns) as f64 * 1e-9).min(silence_s);
        let way = place.iter().zip(then).map(|(now, then)| now - then);
        let way = way.fold(0.0, |sum, part| sum + part * part).sqrt();
        stamp_ns > then_ns && way <= self.config.speed_max_m_per_s * passed_s + STEP_SLACK_M
    }

    /// A reading that can be, at `at` (m, world).
    fn take(
        &mut self,
        head: &PlugHead,
        place: [f64; 3],
        at: Vec2,
        mut give: impl FnMut(HandEvent),
    ) {
        if self.newest.is_none() {
            self.first_ns = head.stamp_ns;
        }
        self.newest = Some((head.stamp_ns, place));
        let page_s = head.stamp_ns.saturating_sub(self.first_ns) as f64 * 1e-9;
        let sample = PointerSample { page_s, at };
        let pressed = head.flags >> self.config.button & 1 == 1;
        self.hold = match (self.hold, pressed) {
            (Hold::Barred | Hold::Up, false) => {
                give(HandEvent::Clock(page_s));
                Hold::Up
            }
            (Hold::Up, true) => {
                give(HandEvent::Press(sample));
                Hold::Held
            }
            (Hold::Held, true) => {
                give(HandEvent::Move(sample));
                Hold::Held
            }
            (Hold::Held, false) => {
                give(HandEvent::Release);
                Hold::Up
            }
            (Hold::Barred, true) => Hold::Barred,
        };
    }

    fn let_go(&mut self, give: &mut impl FnMut(HandEvent)) {
        if self.hold == Hold::Held {
            give(HandEvent::Release);
        }
        (self.hold, self.held) = (Hold::Barred, None);
    }

    /// The next reading is the first of its clock.
    fn begin_anew(&mut self, give: &mut impl FnMut(HandEvent)) {
        give(HandEvent::NewPage);
        self.newest = None;
    }
}
