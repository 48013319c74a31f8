//! Whether records are of one run: each session of an end once, and what arrived at an end is what left the other.
//!
//! Pure: whoever reads the files hands over message by message.

use std::collections::BTreeSet;

use mmt_shared::record::messages::{Message, Packet, Session};

/// Why they are not.
#[derive(Debug, thiserror::Error)]
pub enum NotOneRun {
    /// A session is there a second time.
    #[error("session {session} of the {side} was given before")]
    Twice {
        /// Which end.
        side: String,
        /// Its number.
        session: u32,
    },
    /// The ends of two runs.
    #[error("none of what left the {from} arrived at the other end: these are records of two runs")]
    Strangers {
        /// Who sent it.
        from: &'static str,
    },
}

/// Of this many datagrams one is kept, by its number: the same at both ends. An hour fits in some megabytes.
const KEPT: u32 = 16;

/// A datagram: its number, and when it left by its sender's clock, ns.
type Key = (u32, u64);

/// One direction.
#[derive(Clone, Debug, Default)]
struct Way {
    left: BTreeSet<Key>,
    arrived: BTreeSet<Key>,
}

/// The records of a run, as far as they were handed over.
#[derive(Clone, Debug, Default)]
pub struct OneRun {
    sessions: BTreeSet<(String, u32)>,
    up: Way,
    down: Way,
}

impl OneRun {
    /// Takes the next message of a record. One that is broken shows nothing.
    ///
    /// # Errors
    /// It begins a session that was there before.
    pub fn take(&mut self, topic: &str, message: &[u8]) -> Result<(), NotOneRun> {
        let Some((side, what)) = topic.trim_start_matches('/').split_once('/') else {
            return Ok(());
        };
        match what {
            "session" => {
                let Ok(Session { session, .. }) = Session::read(message) else {
                    return Ok(());
                };
                let side = side.to_owned();
                if !self.sessions.insert((side.clone(), session)) {
                    return Err(NotOneRun::Twice { side, session });
                }
            }
            "packets" => {
                if let Ok(packet) = Packet::read(message) {
                    self.packet(&packet);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn packet(&mut self, packet: &Packet) {
        let way = if packet.direction == "up" {
            &mut self.up
        } else {
            &mut self.down
        };
        let leaves = matches!(packet.fate.as_str(), "sent" | "repeated");
        let ends = if leaves {
            &mut way.left
        } else {
            &mut way.arrived
        };
        if packet.number.is_multiple_of(KEPT) {
            ends.insert((packet.number, packet.sent_ns));
        }
    }

    /// Whether no session has begun.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sessions.is_empty()
    }

    /// Judges what was taken.
    ///
    /// # Errors
    /// Both ends are there, and nothing that left one arrived at the other.
    pub fn judge(&self) -> Result<(), NotOneRun> {
        for (from, way) in [("master", &self.up), ("slave", &self.down)] {
            let both = !way.left.is_empty() && !way.arrived.is_empty();
            if both && way.left.is_disjoint(&way.arrived) {
                return Err(NotOneRun::Strangers { from });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::record::cdr::CdrWriter;
    use mmt_shared::record::messages::Stamp;

    fn bytes(message: &impl Message) -> Vec<u8> {
        let mut out = CdrWriter::default();
        message.write(out.begin());
        out.message().to_vec()
    }

    fn session(number: u32) -> Vec<u8> {
        bytes(&Session {
            stamp: Stamp(1),
            session: number,
            program: String::new(),
            began_ns: 0,
            opening: Vec::new(),
            setting: String::new(),
            configuration: String::new(),
        })
    }

    fn packet(direction: &str, sent_ns: u64, fate: &str) -> Vec<u8> {
        bytes(&Packet {
            stamp: Stamp(1),
            session: 1,
            direction: direction.to_owned(),
            number: KEPT,
            sent_ns,
            bytes: 50,
            kind: "command".to_owned(),
            update: 0,
            cause: String::new(),
            fate: fate.to_owned(),
        })
    }

    #[test]
    fn a_session_counts_once_for_each_end() {
        let mut run = OneRun::default();
        assert!(run.is_empty());
        run.take("/master/session", &session(1)).unwrap();
        run.take("/slave/session", &session(1)).unwrap();
        run.take("/slave/session", &session(2)).unwrap();
        assert!(!run.is_empty());
        let twice = run.take("/master/session", &session(1)).unwrap_err();
        assert_eq!(
            twice.to_string(),
            "session 1 of the master was given before"
        );
    }

    #[test]
    fn what_arrived_at_one_end_is_what_left_the_other() {
        let mut run = OneRun::default();
        run.take("/master/packets", &packet("up", 7, "sent"))
            .unwrap();
        run.judge().unwrap();
        run.take("/slave/packets", &packet("up", 8, "newest"))
            .unwrap();
        let strangers = run.judge().unwrap_err();
        assert!(strangers.to_string().contains("left the master"));
        run.take("/slave/packets", &packet("up", 7, "newest"))
            .unwrap();
        run.judge().unwrap();
    }
}
