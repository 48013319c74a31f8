//! The flat messages of a record: each is one table, and one place names its fields.
//!
//! Quantities carry their unit at the end of the field's name. A number that is not known is NaN.

use std::fmt::Write as _;

use serde::Serialize;

use super::PROGRAM;
use super::cdr::{CdrError, CdrReader, CdrWriter};
use super::field::Field;
use crate::time::Time;
use crate::wire::{STREAM_MESSAGE_MAX, StreamMessage};

pub use super::field::{Stamp, Value};

#[cfg(test)]
mod tests;

/// What stands between the definition of a message and those that it uses.
const SEPARATOR: &str =
    "================================================================================\n";
/// The one message that ours use.
const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

/// A flat message.
pub trait Message: Sized {
    /// Name of its type.
    const NAME: &'static str;
    /// Name and type of each field, in their order.
    const FIELDS: &'static [(&'static str, &'static str)];
    /// Writes its fields.
    fn write(&self, out: &mut CdrWriter);
    /// Reads a whole message.
    ///
    /// # Errors
    /// The bytes are no such message.
    fn read(message: &[u8]) -> Result<Self, CdrError>;
    /// Its row in a table of comma-separated values.
    fn cells(&self) -> Vec<String>;
    /// The values of its fields, in their order.
    fn values(self) -> Vec<Value>;
}

/// The schema of a flat message, as `ros2msg`.
pub fn schema<M: Message>() -> String {
    let mut text = String::new();
    for (name, of) in M::FIELDS {
        // writing to a text cannot fail
        let _ = writeln!(text, "{of} {name}");
    }
    text + SEPARATOR + TIME
}

macro_rules! messages {
    ($($(#[$doc:meta])* $name:ident { $($(#[$about:meta])* $field:ident: $of:ty,)* })*) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $($(#[$about])* pub $field: $of,)*
        }

        impl Message for $name {
            const NAME: &'static str = concat!("mmt_msgs/msg/", stringify!($name));
            const FIELDS: &'static [(&'static str, &'static str)] =
                &[$((stringify!($field), <$of as Field>::ROS)),*];

            fn write(&self, out: &mut CdrWriter) {
                $(Field::write(&self.$field, out);)*
            }

            fn read(message: &[u8]) -> Result<Self, CdrError> {
                let mut input = CdrReader::new(message)?;
                Ok(Self { $($field: Field::read(&mut input)?,)* })
            }

            fn cells(&self) -> Vec<String> {
                vec![$(self.$field.cell()),*]
            }

            fn values(self) -> Vec<Value> {
                vec![$(Field::value(self.$field)),*]
            }
        }
    )* };
}

messages! {
    /// The beginning of a session at one end: all that its end was made of.
    Session {
        /// When.
        stamp: Stamp,
        /// Number of the session in the record, from 1.
        session: u32,
        /// Name and version of the program.
        program: String,
        /// When the end began, by its own clock, ns.
        began_ns: u64,
        /// What opened the session: at the slave the hello, at the master the welcome, as on the wire, their secrets zero.
        opening: Vec<u8>,
        /// What else the end was made of, JSON.
        setting: String,
        /// The whole configuration for people, JSON.
        configuration: String,
    }
    /// A datagram that arrived: an input.
    Arrival {
        /// When.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// Number of the input in its session, from 0.
        index: u64,
        /// When, by the end's own clock, ns.
        at_ns: u64,
        /// The datagram.
        datagram: Vec<u8>,
    }
    /// A tick of the master: what it was given and what it gave.
    MasterTick {
        /// Its deadline.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// Number of the input in its session, from 0.
        index: u64,
        /// Its deadline by the master's clock, ns.
        deadline_ns: u64,
        /// From the deadline to the wake, ns.
        lateness_ns: u64,
        /// Ticks that were skipped before it.
        skipped: u64,
        /// The device's reading: the HIP in the world, m.
        reading_x_m: f64,
        /// The same.
        reading_y_m: f64,
        /// Whether a hand holds the device.
        engaged: bool,
        /// Whether the hand is to be released from here on.
        releases: bool,
        /// Whether the master's emergency stop is set.
        stops: bool,
        /// When what it sends leaves, by the master's clock, ns.
        sent_ns: u64,
        /// The HIP as it is used and sent, m.
        hip_x_m: f64,
        /// The same.
        hip_y_m: f64,
        /// f_m, the force on the object that is felt, before the limiter, N.
        f_m_x_n: f64,
        /// The same.
        f_m_y_n: f64,
        /// The force on the hand, limited, N.
        hand_x_n: f64,
        /// The same.
        hand_y_n: f64,
        /// Whether the HIP touches the model.
        in_contact: bool,
        /// The link: fresh, late, stale or released.
        link: String,
        /// Digest of all that the session gave before this tick's datagrams.
        digest: u64,
    }
    /// A reading of a person's hand as it came, before anything is made of it.
    Reading {
        /// When the master took it.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// When it was taken, by the clock of the page or the device, s; NaN when the hand lets go.
        own_s: f64,
        /// Where the pointer or the device was, m, world; NaN when the hand lets go.
        x_m: f64,
        /// The same.
        y_m: f64,
        /// Whether the hand holds.
        held: bool,
    }
    /// A tick of the slave: what it was given and what it gave.
    SlaveTick {
        /// Its deadline.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// Number of the input in its session, from 0.
        index: u64,
        /// Its deadline by the slave's clock, ns.
        deadline_ns: u64,
        /// From the deadline to the wake, ns.
        lateness_ns: u64,
        /// Ticks that were skipped before it.
        skipped: u64,
        /// Whether the slave's emergency stop is set, or the plant that is plugged in is silent.
        stops: bool,
        /// The newest packet of the plant that is plugged in, its token and its head's numbers zero; empty if none has come since.
        plant: Vec<u8>,
        /// Whether that is the first after a silence.
        plant_anew: bool,
        /// When what it sends leaves, by the slave's clock, ns.
        sent_ns: u64,
        /// Whether a HIP sample was due; without one the rest is NaN.
        plays: bool,
        /// Stamp of the HIP sample by the master's clock, ns.
        sample_ns: u64,
        /// The tool, m.
        tool_x_m: f64,
        /// The same.
        tool_y_m: f64,
        /// f_s, the measured contact force on the object, N.
        f_s_x_n: f64,
        /// The same.
        f_s_y_n: f64,
        /// The contact force as it is, N.
        true_x_n: f64,
        /// The same.
        true_y_n: f64,
        /// The shadow's force, N: f_m as the trigger sees it.
        f_shadow_x_n: f64,
        /// The same.
        f_shadow_y_n: f64,
        /// f_m as the master rendered it for this sample, N; NaN if that is not known.
        f_m_x_n: f64,
        /// The same.
        f_m_y_n: f64,
        /// Whether the tool touches the object.
        in_contact: bool,
        /// The object's true pose, m and rad.
        object_x_m: f64,
        /// The same.
        object_y_m: f64,
        /// The same.
        object_angle_rad: f64,
        /// Why an update was decided on; empty if none was.
        update: String,
        /// Digest of all that the session gave before this tick's datagrams.
        digest: u64,
    }
    /// A datagram as one end saw it.
    Packet {
        /// When it left or arrived.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// up: master to slave; down: slave to master.
        direction: String,
        /// Its number in its direction; 0 if it cannot be read.
        number: u32,
        /// When it left, by the sender's clock, ns.
        sent_ns: u64,
        /// Length of the message, bytes.
        bytes: u32,
        /// command, update, scene, tool or heartbeat.
        kind: String,
        /// Of an update its number, else 0.
        update: u32,
        /// Of an update why it was sent, else empty.
        cause: String,
        /// sent or repeated; newest, reordered, duplicate, too_old, implausible or malformed where it arrived.
        fate: String,
    }
    /// Parameters of the model.
    Parameters {
        /// When.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// Mass m, kg.
        m_kg: f64,
        /// Viscous damping b, N s/m.
        b_ns_per_m: f64,
        /// Coulomb friction c, N.
        c_n: f64,
        /// Covariance of (m, b, c), row by row; NaN at the master, to which it is not sent.
        covariance: [f64; 9],
    }
    /// The link as one end sees it.
    Link {
        /// When.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// Median round trip, ms; NaN before the first.
        rtt_ms: f64,
        /// Datagrams of the master that were numbered, as far as is known.
        up_expected: u32,
        /// How many of them arrived.
        up_received: u32,
        /// Datagrams of the slave that were numbered, as far as is known.
        down_expected: u32,
        /// How many of them arrived.
        down_received: u32,
    }
    /// A 1 kHz loop in the second before, and what the record misses so far.
    Loop {
        /// When.
        stamp: Stamp,
        /// Number of the session in the record.
        session: u32,
        /// Ticks served.
        ticks: u64,
        /// Ticks skipped.
        skipped: u64,
        /// Mean time from deadline to wake, us.
        lateness_mean_us: f64,
        /// Longest, us.
        lateness_max_us: f64,
        /// Inputs and events that found no room on their way to the record, so far.
        missed: u64,
    }
}

impl Session {
    /// The beginning of a session whose end began at `began` and is made of these; stamp and number come with the record.
    pub fn of_end(
        began: Time,
        opening: &StreamMessage,
        setting: &impl Serialize,
        configuration: &impl Serialize,
    ) -> Self {
        let mut bytes = [0; STREAM_MESSAGE_MAX];
        // what was accepted can be written; without it the record cannot run again, which is seen then
        let length = opening.encode(&mut bytes).unwrap_or(0);
        let json = |value: serde_json::Result<String>| value.unwrap_or_default();
        Self {
            stamp: Stamp::default(),
            session: 0,
            program: PROGRAM.to_owned(),
            began_ns: began.as_nanos(),
            opening: bytes.get(..length).unwrap_or_default().to_vec(),
            setting: json(serde_json::to_string(setting)),
            configuration: json(serde_json::to_string(configuration)),
        }
    }
}
