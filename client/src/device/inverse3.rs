//! Haply Inverse3: messages of the vendor's Inverse Service, JSON over a WebSocket.
//!
//! By the vendor's pages of service 3.5 (docs.haply.co, `inverseSDK/service/realtime/websocket-protocol` and
//! `…/control-commands`, `…/api/http`). The service begins with an inventory of the devices, and then answers each message with
//! one frame; commands act once and are forgotten. Metres, metres a second and newtons along right-handed axes, z up.
//!
//! ```text
//! service: {"inverse3": [{"device_id": "049D", "config": {…}, "state": {"cursor_position": {"x": …, "y": …, "z": …},
//!           "cursor_velocity": {…}, …}, "status": {…}}], "wireless_verse_grip": [{"state": {"buttons": {"a": false, …}, …}}]}
//! we:      {"inverse3": [{"device_id": "049D", "commands": {"set_cursor_force": {"vector": {"x": …, "y": …, "z": …}}}}]}
//! ```
//!
//! Before 3.5 `vector` was called `values`; clients of 3.1 still send that (Isaac Lab's among them). The device is the first
//! that is listed. Buttons are those of any grip that is: a, b, c, d, e, f of a wireless or custom Verse Grip are bits 0 to 5,
//! the one of a wired grip is bit 0.
//!
//! Not known from those pages: how a frame differs in which a device has no news. One without a position of our device counts
//! as no reading, and silence does the rest. Pure.

#[cfg(test)]
mod tests;

use mmt_shared::plug::PlugCounts;
use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

use super::hand::Hand;
use super::link::{DeviceLinkConfig, DeviceLinkError, Dialect, HandOutput, Reading};
use crate::operator::pointer::HandEvent;

/// What the service shows its user of us.
const PROFILE: &str = "mmt";
/// The first version that takes `vector`.
const VECTOR_SINCE: (u32, u32) = (3, 5);

/// An Inverse3 at the haptic loop.
#[derive(Clone, Debug)]
pub struct Inverse3 {
    /// As it was asked for.
    wanted: Dialect,
    /// As it is written.
    dialect: Dialect,
    hand: Hand,
    counts: PlugCounts,
    /// Its number at the service; none before it was seen, and once it is gone.
    device: Option<String>,
    /// Whether the service has received who we are.
    greeted: bool,
}

#[derive(Deserialize)]
struct Frame {
    #[serde(default)]
    inverse3: Vec<Cursor>,
    #[serde(default)]
    verse_grip: Vec<Grip>,
    #[serde(default)]
    wireless_verse_grip: Vec<Grip>,
    #[serde(default)]
    custom_verse_grip: Vec<Grip>,
}

#[derive(Deserialize)]
struct Cursor {
    device_id: String,
    #[serde(default)]
    state: CursorState,
}

#[derive(Default, Deserialize)]
struct CursorState {
    cursor_position: Option<Vector>,
    cursor_velocity: Option<Vector>,
}

#[derive(Deserialize)]
struct Grip {
    #[serde(default)]
    state: GripState,
}

#[derive(Default, Deserialize)]
struct GripState {
    #[serde(default)]
    button: bool,
    #[serde(default)]
    buttons: Buttons,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Buttons {
    a: bool,
    b: bool,
    c: bool,
    d: bool,
    e: bool,
    f: bool,
}

#[derive(Clone, Copy, Deserialize, Serialize)]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize)]
struct Request<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    session: Option<Session>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    inverse3: Vec<Command<'a>>,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Session {
    Configure { profile: Profile },
    ForceRenderFullState {},
}

#[derive(Serialize)]
struct Profile {
    name: &'static str,
}

#[derive(Serialize)]
struct Command<'a> {
    device_id: &'a str,
    commands: Commands,
}

#[derive(Clone, Copy, Serialize)]
struct Commands {
    set_cursor_force: Force,
}

#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
enum Force {
    Vector(Vector),
    Values(Vector),
}

impl Inverse3 {
    /// One that the service has not shown yet.
    ///
    /// # Errors
    /// Names the first number that is not accepted.
    pub fn try_new(config: DeviceLinkConfig) -> Result<Self, DeviceLinkError> {
        Ok(Self {
            wanted: config.dialect,
            dialect: config.dialect,
            hand: Hand::try_new(config)?,
            counts: PlugCounts::default(),
            device: None,
            greeted: false,
        })
    }

    /// What became of the service's messages.
    pub fn counts(&self) -> &PlugCounts {
        &self.counts
    }

    /// The newest reading as it came, once.
    pub fn seen(&mut self) -> Option<Reading> {
        self.hand.seen()
    }

    /// A connection begins, to a service of this version such as 3.5.0.0; none where it reports none.
    pub fn begin(&mut self, version: Option<&str>, give: impl FnMut(HandEvent)) {
        let mut numbers = version.unwrap_or_default().split('.').map(str::parse);
        self.dialect = match (self.wanted, numbers.next(), numbers.next()) {
            (Dialect::Auto, Some(Ok(major)), Some(Ok(minor))) if (major, minor) < VECTOR_SINCE => {
                Dialect::Values
            }
            (Dialect::Auto, ..) => Dialect::Vector,
            (wanted, ..) => wanted,
        };
        self.greeted = false;
        self.lose(give);
    }

    /// Takes in a message, and gives what the hand does by it.
    pub fn handle(&mut self, now: Time, message: &str, mut give: impl FnMut(HandEvent)) {
        let Ok(frame) = serde_json::from_str::<Frame>(message) else {
            self.counts.malformed += 1;
            self.lose(give);
            return;
        };
        self.counts.taken += 1;
        let known = |cursor: &&Cursor| {
            self.device
                .as_ref()
                .is_none_or(|id| *id == cursor.device_id)
        };
        let Some(cursor) = frame.inverse3.iter().find(known) else {
            self.lose(give);
            return;
        };
        if self.device.is_none() {
            self.device = Some(cursor.device_id.clone());
        }
        let Some(place) = cursor.state.cursor_position else {
            self.counts.late += 1;
            self.miss(now, give);
            return;
        };
        self.hand.note_packet(now, &mut give);
        let still = Vector {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        };
        let reading = Reading {
            stamp_ns: now.as_nanos(),
            place: place.along(),
            velocity: cursor.state.cursor_velocity.unwrap_or(still).along(),
            buttons: frame.buttons(),
        };
        let could_be = self.hand.take(&reading, give);
        self.counts.nonsense += u64::from(!could_be);
    }

    /// Something came that is no text.
    pub fn handle_other(&mut self, give: impl FnMut(HandEvent)) {
        self.counts.malformed += 1;
        self.lose(give);
    }

    /// Nothing has come: after a while the hand is let go. Whether that is now.
    pub fn miss(&mut self, now: Time, give: impl FnMut(HandEvent)) -> bool {
        let silent = self.hand.is_silent(now);
        if silent {
            self.hand.anew(give);
        }
        silent
    }

    /// The connection or the device is gone.
    pub fn lose(&mut self, give: impl FnMut(HandEvent)) {
        self.hand.anew(give);
        self.device = None;
    }

    /// The message that asks for the next frame, with the force that the newest tick asks for; without a device it asks for
    /// the inventory.
    pub fn answer(&mut self, now: Time, output: &HandOutput) -> String {
        let [x, y, z] = self.hand.act(now, output).force;
        let silent = self.hand.is_silent(now);
        let force = if silent { [0.0; 3] } else { [x, y, z] };
        self.request(force)
    }

    /// The message with no force: the last of a connection.
    pub fn no_force(&mut self) -> String {
        self.request([0.0; 3])
    }

    fn request(&mut self, [x, y, z]: [f64; 3]) -> String {
        let vector = Vector { x, y, z };
        let force = match self.dialect {
            Dialect::Values => Force::Values(vector),
            Dialect::Auto | Dialect::Vector => Force::Vector(vector),
        };
        let commands = Commands {
            set_cursor_force: force,
        };
        let known = self.device.iter();
        let inverse3 = known.map(|device_id| Command {
            device_id,
            commands,
        });
        let inverse3: Vec<_> = inverse3.collect();
        // older services have no profiles
        let greets = !self.greeted && self.dialect == Dialect::Vector;
        let session = match (inverse3.is_empty(), greets) {
            (true, _) => Some(Session::ForceRenderFullState {}),
            (false, true) => Some(Session::Configure {
                profile: Profile { name: PROFILE },
            }),
            (false, false) => None,
        };
        self.greeted |= !inverse3.is_empty();
        let request = Request { session, inverse3 };
        // an empty object asks for a frame, and commands nothing
        serde_json::to_string(&request).unwrap_or_else(|_| "{}".to_owned())
    }
}

impl Frame {
    /// The buttons of all grips together.
    fn buttons(&self) -> u16 {
        let grips = self.verse_grip.iter().chain(&self.wireless_verse_grip);
        let grips = grips.chain(&self.custom_verse_grip);
        grips.fold(0, |bits, grip| bits | grip.state.bits())
    }
}

impl GripState {
    fn bits(&self) -> u16 {
        let Buttons { a, b, c, d, e, f } = self.buttons;
        let all = [a || self.button, b, c, d, e, f];
        let bits = all.into_iter().rev();
        bits.fold(0, |bits, down| bits << 1 | u16::from(down))
    }
}

impl Vector {
    fn along(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }
}
