//! `mmt.Device` and `mmt.Plant`: a device and a plant in Python, plugged into a master and a slave (docs/plugs.md).

mod device;
mod plant;

pub(crate) use device::Device;
pub(crate) use plant::{Command, Plant};

use std::io::ErrorKind;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::time::{Duration, Instant};

use mmt_shared::plug::{PLANT_BYTES, PlugHead, PlugKind, PlugToken, decode, encode};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

/// Room for a packet and a byte, by which a longer one shows.
const ROOM: usize = PLANT_BYTES + 1;

/// x and y.
type Pair = (f64, f64);
/// x, y and z.
type Triple = (f64, f64, f64);

/// One end of a plug: its socket, and the numbers of the packets of both ways.
struct End {
    socket: UdpSocket,
    token: PlugToken,
    sequence: u32,
    newest: u32,
    /// Flags and numbers of that.
    kept: (u16, [u8; ROOM]),
    received: u64,
    lost: u64,
}

impl End {
    /// Plugs in at an address as mmt printed it.
    fn connect(address: &str) -> PyResult<Self> {
        // not shown: a token may stand in it all the same
        let refused =
            || PyValueError::new_err("address is none; mmt prints one: udp://HOST:PORT?token=…");
        let (place, token) = address
            .strip_prefix("udp://")
            .and_then(|rest| rest.split_once("?token="))
            .ok_or_else(refused)?;
        let token: PlugToken = token
            .parse()
            .map_err(|error| PyValueError::new_err(format!("address: {error}")))?;
        let unreached = |error: std::io::Error| PyOSError::new_err(format!("{place}: {error}"));
        let mut found = place.to_socket_addrs().map_err(unreached)?;
        let there = found.next().ok_or_else(refused)?;
        let here: SocketAddr = match there {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let socket = UdpSocket::bind(here).map_err(unreached)?;
        socket.connect(there).map_err(unreached)?;
        Ok(Self {
            socket,
            token,
            sequence: 0,
            newest: 0,
            kept: (0, [0; ROOM]),
            received: 0,
            lost: 0,
        })
    }

    /// Sends a packet; where nobody is (yet), the silence shows it.
    fn send<const BYTES: usize, const N: usize>(
        &mut self,
        kind: PlugKind,
        flags: u16,
        stamp_ns: u64,
        numbers: impl IntoIterator<Item = [u8; N]>,
    ) {
        // it goes round, and 0 is none
        self.sequence = self.sequence.checked_add(1).unwrap_or(1);
        let head = PlugHead {
            flags,
            sequence: self.sequence,
            answers: self.newest,
            stamp_ns,
        };
        let packet: [u8; BYTES] = encode(kind, &self.token, &head, numbers);
        let _ = self.socket.send(&packet);
    }

    /// The next packet of mmt that waits or comes within `wait`: by how many it is ahead of the newest, its flags, and its
    /// numbers; of one that came late or twice 0, and those of the newest.
    fn receive(
        &mut self,
        kind: PlugKind,
        length: usize,
        wait: Duration,
    ) -> Option<(u32, u16, [u8; ROOM])> {
        let until = Instant::now() + wait;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            self.socket.set_nonblocking(left.is_zero()).ok()?;
            if !left.is_zero() {
                self.socket.set_read_timeout(Some(left)).ok()?;
            }
            let mut packet = [0; ROOM];
            let bytes = match self.socket.recv(&mut packet) {
                Ok(bytes) => bytes,
                // nobody is there (any more): whoever comes is waited for
                Err(error) if error.kind() == ErrorKind::ConnectionRefused => continue,
                // nothing came, or a signal for Python
                Err(_) => return None,
            };
            let bytes = packet.get(..bytes).unwrap_or_default();
            let Ok((head, numbers)) = decode(kind, length, &self.token, bytes) else {
                continue;
            };
            let ahead = self.ahead(head.sequence);
            if ahead > 0 {
                let (flags, room) = &mut self.kept;
                *flags = head.flags;
                for (to, from) in room.iter_mut().zip(numbers) {
                    *to = *from;
                }
            }
            let (flags, room) = self.kept;
            return Some((ahead, flags, room));
        }
    }

    /// Counts a packet: 0 if it is no newer than the newest.
    fn ahead(&mut self, sequence: u32) -> u32 {
        let ahead = match self.newest {
            0 => 1,
            newest => sequence.wrapping_sub(newest),
        };
        self.received += 1;
        if ahead == 0 || ahead > u32::MAX / 2 {
            return 0;
        }
        self.lost += u64::from(ahead - 1);
        self.newest = sequence;
        ahead
    }
}

/// The clock of `time.monotonic_ns()`.
fn monotonic_ns(py: Python<'_>) -> PyResult<u64> {
    py.import("time")?.call_method0("monotonic_ns")?.extract()
}

/// Numbers of a packet: all must be finite.
fn finite<const N: usize>(numbers: [f64; N], what: &str) -> PyResult<[f64; N]> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(numbers);
    }
    let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
    let what = format!("{what} is ({}): it must be finite", numbers.join(", "));
    Err(PyValueError::new_err(what))
}
