//! The clients of a relay: bounded in number, each with its socket toward the target, forgotten when
//! idle, or when a newer one takes its place.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use mmt_shared::time::Time;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use super::port::{Port, Received};
use super::sockets::Sockets;
use super::standing::{Standing, makes_room};
use crate::capture::Sides;

/// A client without a datagram in either direction for this long is forgotten: four times QUIC's own
/// idle timeout in this project.
pub const CLIENT_IDLE: Duration = Duration::from_secs(60);
/// Descriptors besides one for each client: the program's own.
const OTHER_DESCRIPTORS: u64 = 64;

/// Who sends to the relay.
#[derive(Debug)]
pub(super) struct Client {
    pub(super) addr: SocketAddr,
    /// The relay's address that the client uses.
    pub(super) local_ip: Option<IpAddr>,
    /// The socket toward the target, and its address.
    pub(super) port: Port,
    pub(super) port_addr: SocketAddr,
    pub(super) standing: Standing,
}

impl Client {
    /// Where a datagram of this class from this client was sent, and where it goes.
    pub(super) fn sides(&self, listen: SocketAddr, target: SocketAddr, class: u8) -> Sides {
        let ip = self.local_ip.unwrap_or(listen.ip());
        Sides {
            came: [self.addr, SocketAddr::new(ip, listen.port())],
            leaves: [self.port_addr, target],
            class,
        }
    }
}

/// The clients, by a number that is never used twice.
#[derive(Debug)]
pub(super) struct Clients {
    to: SocketAddr,
    by_number: BTreeMap<u64, Client>,
    by_addr: BTreeMap<SocketAddr, u64>,
    met: u64,
    displaced: u64,
    /// How many there can be at one time.
    most: usize,
    /// All their sockets and those of the relay, so that a wait is one for all of them.
    pub(super) sockets: Sockets,
}

impl Clients {
    /// Room for `most` clients of the target `to`.
    ///
    /// # Errors
    /// The process is out of descriptors.
    pub(super) fn try_new(to: SocketAddr, most: usize) -> io::Result<Self> {
        make_room(most as u64 + OTHER_DESCRIPTORS);
        Ok(Self {
            to,
            by_number: BTreeMap::new(),
            by_addr: BTreeMap::new(),
            met: 0,
            displaced: 0,
            most,
            sockets: Sockets::try_new()?,
        })
    }

    /// A socket toward the target whose datagrams are for client `number`.
    fn port_for(&self, number: u64) -> io::Result<(Port, SocketAddr)> {
        let (port, addr) = port_toward(self.to)?;
        self.sockets.add(&port, number)?;
        Ok((port, addr))
    }

    /// Where all clients' packets go.
    pub(super) fn target(&self) -> SocketAddr {
        self.to
    }

    pub(super) fn get(&self, number: u64) -> Option<&Client> {
        self.by_number.get(&number)
    }

    pub(super) fn get_mut(&mut self, number: u64) -> Option<&mut Client> {
        self.by_number.get_mut(&number)
    }

    pub(super) fn len(&self) -> usize {
        self.by_number.len()
    }

    /// Clients met since the start; also the next client's number.
    pub(super) fn met(&self) -> u64 {
        self.met
    }

    /// Clients that had to make room for newer ones.
    pub(super) fn displaced(&self) -> u64 {
        self.displaced
    }

    /// The number of the client that sent `datagram`, met now if need be. `None` if all places, or all sockets that are to be
    /// had, are those of clients that talk with the target.
    pub(super) fn meet(&mut self, datagram: &Received<'_>) -> Option<u64> {
        let now = datagram.arrived;
        if let Some(number) = self.by_addr.get(&datagram.from) {
            let client = self.by_number.get_mut(number)?;
            client.local_ip = datagram.local_ip;
            client.standing.sends(now);
            return Some(*number);
        }
        if self.by_number.len() >= self.most {
            self.make_room(datagram.from.ip(), now)?;
        }
        let number = self.met;
        let (port, port_addr) = match self.port_for(number) {
            Ok(port) => port,
            Err(_) => {
                self.make_room(datagram.from.ip(), now)?;
                self.port_for(number).ok()?
            }
        };
        let client = Client {
            addr: datagram.from,
            local_ip: datagram.local_ip,
            port,
            port_addr,
            standing: Standing::new(datagram.from.ip(), now),
        };
        self.met = number.saturating_add(1);
        self.by_addr.insert(client.addr, number);
        self.by_number.insert(number, client);
        Some(number)
    }

    /// Forgets one client for a newcomer from `address`; `None` if none has to go.
    fn make_room(&mut self, address: IpAddr, now: Time) -> Option<()> {
        let clients = self.by_number.iter();
        let standings = clients.map(|(number, client)| (*number, &client.standing));
        let number = makes_room(standings, address, self.by_number.len(), now)?;
        let client = self.by_number.remove(&number)?;
        self.by_addr.remove(&client.addr);
        self.displaced = self.displaced.saturating_add(1);
        Some(())
    }

    /// Gives every client a new port toward the target; one that can get none keeps the old one. Returns
    /// how many got one.
    pub(super) fn rebind(&mut self) -> u64 {
        let mut rebound = 0;
        let numbers: Vec<u64> = self.by_number.keys().copied().collect();
        for number in numbers {
            if let Ok(port) = self.port_for(number)
                && let Some(client) = self.by_number.get_mut(&number)
            {
                (client.port, client.port_addr) = port;
                rebound += 1;
            }
        }
        rebound
    }

    /// Forgets the clients that were idle for too long.
    pub(super) fn expire(&mut self, now: Time) {
        self.by_number
            .retain(|_, client| client.standing.seen() + CLIENT_IDLE > now);
        let known = &self.by_number;
        self.by_addr.retain(|_, number| known.contains_key(number));
    }

    /// When the next client could have been idle for too long.
    pub(super) fn next_expiry(&self) -> Option<Time> {
        let seen = self.by_number.values().map(|client| client.standing.seen());
        let oldest = seen.min();
        oldest.map(|oldest| oldest + CLIENT_IDLE)
    }
}

/// Raises this process's limit of descriptors to `wanted` where it is lower, as far as the system allows: a client that
/// gets no socket is turned away and counted.
fn make_room(wanted: u64) {
    let now = getrlimit(Resource::Nofile);
    if now.current.is_some_and(|current| current < wanted) {
        let current = now.maximum.map_or(wanted, |most| most.min(wanted));
        let raised = Rlimit {
            current: Some(current),
            ..now
        };
        let _ = setrlimit(Resource::Nofile, raised);
    }
}

/// A socket connected to `to`: the kernel keeps strangers' datagrams out of it.
fn port_toward(to: SocketAddr) -> io::Result<(Port, SocketAddr)> {
    let any: IpAddr = match to {
        SocketAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
        SocketAddr::V6(_) => Ipv6Addr::UNSPECIFIED.into(),
    };
    let socket = UdpSocket::bind((any, 0))?;
    socket.connect(to)?;
    let addr = socket.local_addr()?;
    Ok((Port::try_new(socket)?, addr))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn clients() -> Clients {
        Clients::try_new((Ipv4Addr::LOCALHOST, 9).into(), 64).unwrap()
    }

    fn from(port: u16, arrived: Time) -> Received<'static> {
        Received {
            from: (Ipv4Addr::LOCALHOST, port).into(),
            local_ip: None,
            class: 0,
            arrived,
            contents: &[],
        }
    }

    #[test]
    fn a_client_keeps_its_number_while_it_is_heard_and_gets_another_after_a_silence() {
        let mut clients = clients();
        let soon = Time::ZERO + CLIENT_IDLE - Duration::from_nanos(1);
        assert_eq!(clients.meet(&from(1, Time::ZERO)), Some(0));
        assert_eq!(clients.meet(&from(2, Time::ZERO)), Some(1));
        assert_eq!(clients.meet(&from(1, soon)), Some(0));
        clients.expire(soon);
        assert_eq!(clients.len(), 2);
        assert_eq!(clients.next_expiry(), Some(Time::ZERO + CLIENT_IDLE));
        clients.expire(Time::ZERO + CLIENT_IDLE);
        assert_eq!(clients.len(), 1);
        assert_eq!(clients.meet(&from(2, soon)), Some(2));
    }

    #[test]
    fn a_newcomer_takes_the_place_of_who_was_never_answered_and_none_of_who_talks() {
        let mut clients = clients();
        let now = Time::ZERO;
        for port in 1..=64 {
            assert!(clients.meet(&from(port, now)).is_some());
        }
        // all but the second one
        let talk = |client: &mut Client| client.standing.is_answered(now);
        (0..64).filter(|number| *number != 1).for_each(|number| {
            clients.get_mut(number).into_iter().for_each(talk);
        });
        assert_eq!(clients.meet(&from(100, now)), Some(64));
        assert_eq!((clients.len(), clients.displaced()), (64, 1));
        // an old one is one of those that are there, and who has left is a newcomer again
        assert_eq!(clients.meet(&from(1, now)), Some(0));
        assert_eq!(clients.meet(&from(2, now)), Some(65));
        clients.get_mut(65).into_iter().for_each(talk);
        assert_eq!(clients.meet(&from(100, now)), None, "no place is free");
        assert_eq!((clients.met(), clients.displaced()), (66, 2));
    }
}
