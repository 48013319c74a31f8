//! The thread of a relay: receives, offers to the links, and sends what they deliver.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use quinn::udp::EcnCodepoint;
use rustix::event::PollFlags;

use mmt_shared::io::alarm::wait;
use mmt_shared::io::realtime;
use mmt_shared::time::Time;

use super::clients::Clients;
use super::port::{Port, Received, Receiver, Sending};
use super::{RelaySnapshot, Shared};
use crate::capture::Sides;
use crate::counters::Tally;
use crate::direction::Direction;
use crate::io::capture_file::CaptureWriter;
use crate::io::driver::{Datagram, Driver, Outcome};
use crate::io::lateness::Lateness;
use crate::io::record_file::RecordWriter;
use crate::io::{lock, now};
use crate::packet::Departure;

/// Batches taken from one socket before the times are looked at again.
const BATCHES: usize = 16;

/// Everything the thread owns.
pub(super) struct Worker {
    listen: Port,
    /// The address that it listens on.
    local: SocketAddr,
    clients: Clients,
    receiver: Receiver,
    /// The links, whose datagrams know their client.
    up: Driver<Origin>,
    down: Driver<Origin>,
    /// The latest arrival that was offered to either: times of offers never go back.
    offered_up: Time,
    offered_down: Time,
    overflows_up: u64,
    overflows_down: u64,
    record: Option<RecordWriter>,
    capture: Option<CaptureWriter>,
    refused: Tally,
    unreachable: u64,
    receive_errors: u64,
    rebinds: u64,
    /// No client is idle for too long before this; none: there was no client.
    expiry: Option<Time>,
    /// How often to rebind, and when next.
    rebind: Option<(Duration, Time)>,
    shared: Arc<Shared>,
}

/// Whose datagram it is, and its DSCP in the place that it has in the traffic class.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    number: u64,
    dscp: u8,
    /// Where it was sent and goes; kept for a capture only.
    sides: Option<Box<Sides>>,
}

impl Origin {
    pub(super) fn sides(&self) -> Option<Sides> {
        self.sides.as_deref().copied()
    }
}

/// The sockets with something to read.
struct Ready {
    listen: bool,
    clients: Vec<u64>,
}

impl Worker {
    pub(super) fn new(
        (listen, local): (Port, SocketAddr),
        clients: Clients,
        up: Driver<Origin>,
        down: Driver<Origin>,
        shared: Arc<Shared>,
    ) -> Self {
        Self {
            listen,
            local,
            clients,
            receiver: Receiver::new(),
            up,
            down,
            record: None,
            capture: None,
            offered_up: Time::ZERO,
            offered_down: Time::ZERO,
            overflows_up: 0,
            overflows_down: 0,
            rebinds: 0,
            expiry: None,
            rebind: None,
            refused: Tally::default(),
            unreachable: 0,
            receive_errors: 0,
            shared,
        }
    }

    /// Where what becomes of packets is written.
    pub(super) fn writes_to(
        &mut self,
        record: Option<RecordWriter>,
        capture: Option<CaptureWriter>,
    ) {
        (self.record, self.capture) = (record, capture);
    }

    /// Gives every client a new port toward the target as often as this.
    pub(super) fn rebind_every(&mut self, every: Option<Duration>, now: Time) {
        let every = every.filter(|every| !every.is_zero());
        self.rebind = every.map(|every| (every, now + every));
    }

    /// Does what the handle asks for and what is due.
    fn apply_commands(&mut self) {
        let commands = std::mem::take(&mut *lock(&self.shared.commands));
        if let Some((up, down)) = commands.links {
            // the handle has checked them
            let _ = self.up.reconfigure(now(), up);
            let _ = self.down.reconfigure(now(), down);
        }
        let mut rebind = commands.rebind;
        if let Some((every, next)) = &mut self.rebind
            && *next <= now()
        {
            *next += *every;
            rebind = true;
        }
        if rebind {
            let rebound = self.clients.rebind();
            self.rebinds = self.rebinds.saturating_add(rebound);
        }
    }

    pub(super) fn run(mut self) -> io::Result<()> {
        // what the host does not grant, the lateness shows
        let _ = realtime::request();
        while !self.shared.stopping.load(Ordering::Acquire) {
            self.release_due();
            self.apply_commands();
            self.expire();
            self.publish();
            let ready = self.wait()?;
            if ready.listen {
                self.receive_up();
            }
            for number in ready.clients {
                self.receive_down(number);
            }
        }
        self.publish();
        Ok(())
    }

    fn wait(&self) -> io::Result<Ready> {
        let until = [
            self.up.poll_timeout(),
            self.down.poll_timeout(),
            self.expiry,
            self.rebind.map(|(_, next)| next),
        ];
        let mut fds = [
            self.shared.alarm.as_poll_fd(),
            self.listen.as_poll_fd(),
            self.clients.as_poll_fd(),
        ];
        wait(&mut fds, until.into_iter().flatten().min())?;
        // an error is a reason to read, too: reading returns and clears it
        let [alarm, listen, clients] = fds.map(|fd| fd.revents() != PollFlags::empty());
        if alarm {
            self.shared.alarm.silence();
        }
        let clients = if clients {
            self.clients.ready()?
        } else {
            Vec::new()
        };
        Ok(Ready { listen, clients })
    }

    /// Forgets who was idle for too long, once somebody may have been.
    fn expire(&mut self) {
        let now = now();
        if self.expiry.is_none_or(|at| at <= now) {
            self.clients.expire(now);
            self.expiry = self.clients.next_expiry();
        }
    }

    /// Takes what clients sent and puts it on the link up.
    fn receive_up(&mut self) {
        let Self {
            listen,
            local,
            clients,
            receiver,
            up,
            offered_up,
            refused,
            capture,
            ..
        } = self;
        let mut take = |received: Received<'_>| match clients.meet(&received, now()) {
            Some(number) => {
                *offered_up = received.arrived.max(*offered_up);
                let mut datagram = datagram(number, &received);
                if let Some(client) = capture.as_ref().and_then(|_| clients.get(number)) {
                    let sides = client.sides(*local, clients.target(), received.class);
                    datagram.address.sides = Some(Box::new(sides));
                }
                up.offer(*offered_up, datagram);
            }
            None => refused.count(received.contents.len()),
        };
        let mut batches = (0..BATCHES).map(|_| receiver.receive(listen, &mut take));
        let error = batches.find_map(Result::err);
        let overflows = self.listen.new_overflows();
        self.overflows_up = self.overflows_up.saturating_add(overflows);
        if let Some(error) = error {
            self.receive_error(&error);
        }
    }

    /// Takes what the target sent to a client and puts it on the link down.
    fn receive_down(&mut self, number: u64) {
        let Some(client) = self.clients.get_mut(number) else {
            return;
        };
        let (local, captures) = (self.local, self.capture.is_some());
        for _ in 0..BATCHES {
            let (down, offered) = (&mut self.down, &mut self.offered_down);
            let received = self.receiver.receive(&client.port, |received| {
                *offered = received.arrived.max(*offered);
                let mut datagram = datagram(number, &received);
                let turned = || client.sides(local, received.from, received.class).turned();
                datagram.address.sides = captures.then(|| Box::new(turned()));
                down.offer(*offered, datagram);
            });
            let overflows = client.port.new_overflows();
            self.overflows_down = self.overflows_down.saturating_add(overflows);
            match received {
                Ok(()) => client.seen(now()),
                Err(error) => return self.receive_error(&error),
            }
        }
    }

    fn receive_error(&mut self, error: &io::Error) {
        let counter = match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => return,
            io::ErrorKind::ConnectionRefused => &mut self.unreachable,
            _ => &mut self.receive_errors,
        };
        *counter = counter.saturating_add(1);
    }

    fn release_due(&mut self) {
        while let Some(mut packet) = self.up.poll(now()) {
            let moment = now();
            let outcome = self.send(Direction::Up, &mut packet);
            self.up.finish(&packet, outcome, moment);
        }
        while let Some(mut packet) = self.down.poll(now()) {
            let moment = now();
            let outcome = self.send(Direction::Down, &mut packet);
            self.down.finish(&packet, outcome, moment);
        }
    }

    /// Sends to the target from the client's own port, or to the client from the address that it knows.
    fn send(&mut self, direction: Direction, packet: &mut Departure<Datagram<Origin>>) -> Outcome {
        let Some(client) = self.clients.get(packet.payload.address.number) else {
            return Outcome::Abandoned;
        };
        let (port, to, from) = match direction {
            Direction::Up => (&client.port, self.clients.target(), None),
            Direction::Down => (&self.listen, client.addr, client.local_ip),
        };
        if let (Direction::Up, Some(sides)) = (direction, &mut packet.payload.address.sides) {
            // it may have another port than when the packet came
            sides.leaves = [client.port_addr, to];
        }
        let ecn = packet.payload.ecn.map_or(0, |ecn| ecn as u8);
        let sending = Sending {
            to,
            from,
            class: packet.payload.address.dscp | ecn,
        };
        port.send(sending, &packet.payload.contents, &mut self.unreachable)
    }

    fn publish(&self) {
        *lock(&self.shared.board) = RelaySnapshot {
            up: self.up.counters(),
            down: self.down.counters(),
            clients: self.clients.len() as u64,
            clients_met: self.clients.met(),
            refused: self.refused,
            overflows_up: self.overflows_up,
            overflows_down: self.overflows_down,
            unreachable: self.unreachable,
            receive_errors: self.receive_errors,
            rebinds: self.rebinds,
            unrecorded: self.record.as_ref().map_or(0, RecordWriter::missed),
            uncaptured: self.capture.as_ref().map_or(0, CaptureWriter::missed),
            // the handle reads the histogram itself
            lateness: Lateness::default(),
        };
    }
}

fn datagram(number: u64, received: &Received<'_>) -> Datagram<Origin> {
    Datagram {
        address: Origin {
            number,
            dscp: received.class & !3,
            sides: None,
        },
        ecn: EcnCodepoint::from_bits(received.class & 3),
        contents: received.contents.to_owned(),
    }
}
