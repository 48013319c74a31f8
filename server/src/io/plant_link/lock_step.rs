//! A plant in lock-step: virtual time stands until the plant has answered, so that it runs as fast as the plant computes.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use mmt_shared::io::plug_socket::{PACKET_MAX, PlugSocket};
use mmt_shared::plug::PlugHead;

use crate::plant::{PlantAnswer, PlantCommand};

use super::PlantHostError;

/// A plant that has not answered for so long is gone.
const GONE: Duration = Duration::from_secs(5);
/// After so long without the answer the command is sent again.
const AGAIN: Duration = Duration::from_millis(200);

/// The plant in lock-step is gone, or what it measured cannot be.
#[derive(Debug, thiserror::Error)]
pub enum LockStepError {
    /// It did not answer.
    #[error("the plant did not answer command {sequence} within {} s: see its own messages", GONE.as_secs())]
    Gone {
        /// Number of the command.
        sequence: u32,
    },
    /// What it measured cannot be.
    #[error("the plant's answer to command {sequence} has numbers that cannot be")]
    Nonsense {
        /// Number of the command.
        sequence: u32,
    },
}

/// A plug for one plant that answers every command before the next is sent.
#[derive(Debug)]
pub struct LockStep {
    socket: PlugSocket,
    plant: Option<SocketAddr>,
    sent: u32,
    newest: u32,
}

impl LockStep {
    /// Starts to listen.
    ///
    /// # Errors
    /// The address cannot be had, or there is no token.
    pub fn start(listen: SocketAddr) -> Result<Self, PlantHostError> {
        let socket = PlugSocket::bind(listen)?;
        let patience = socket.socket().set_read_timeout(Some(AGAIN));
        patience.map_err(PlantHostError::Setup)?;
        Ok(Self {
            socket,
            plant: None,
            sent: 0,
            newest: 0,
        })
    }

    /// The address for the plant. It holds the token.
    #[must_use]
    pub fn address(&self) -> String {
        self.socket.address()
    }

    /// Whether a plant has plugged in; waits a moment for one.
    pub fn wait(&mut self) -> bool {
        self.take();
        self.plant.is_some()
    }

    /// The plant's answer to a command.
    ///
    /// # Errors
    /// It is gone, or its numbers cannot be.
    pub fn exchange(&mut self, command: &PlantCommand) -> Result<PlantAnswer, LockStepError> {
        self.sent = self.sent.wrapping_add(1);
        let sequence = self.sent;
        let began = Instant::now();
        while began.elapsed() < GONE {
            let head = PlugHead {
                flags: 0,
                sequence,
                answers: self.newest,
                stamp_ns: u64::from(sequence) * 1_000_000,
            };
            let packet = command.packet(self.socket.token(), &head);
            if let Some(plant) = self.plant {
                // what is lost is sent again
                self.socket.send(&packet, plant);
            }
            while let Some((head, answer)) = self.take() {
                if head.answers == sequence {
                    return answer.ok_or(LockStepError::Nonsense { sequence });
                }
            }
        }
        Err(LockStepError::Gone { sequence })
    }

    /// The next packet of the plant, which is whoever showed the token first; none after a while without.
    fn take(&mut self) -> Option<(PlugHead, Option<PlantAnswer>)> {
        let mut packet = [0; PACKET_MAX];
        loop {
            let (length, from) = self.socket.socket().recv_from(&mut packet).ok()?;
            let packet = packet.get(..length).unwrap_or_default();
            let Ok(read) = PlantAnswer::read(self.socket.token(), packet) else {
                continue;
            };
            if *self.plant.get_or_insert(from) == from {
                self.newest = read.0.sequence;
                return Some(read);
            }
        }
    }
}
