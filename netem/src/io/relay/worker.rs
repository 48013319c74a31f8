//! The thread of a relay: receives, offers to the links, and sends what they deliver.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use mmt_shared::io::alarm::wait;
use mmt_shared::io::realtime;
use mmt_shared::time::Time;

use super::clients::Clients;
use super::origin::{Origin, datagram};
use super::pace::{Pace, after};
use super::port::{Port, Received, Receiver, Sending};
use super::shared::{RelaySnapshot, Shared};
use super::sockets::{ALARM, LISTEN, Ready};
use crate::counters::Tally;
use crate::direction::Direction;
use crate::io::capture_file::CaptureWriter;
use crate::io::driver::{Datagram, Driver, Outcome};
use crate::io::lateness::Lateness;
use crate::io::record_file::RecordWriter;
use crate::io::{lock, now};
use crate::packet::Departure;

/// How often the counts are copied for others at most while wake-ups are close to each other. Else they are at each one: a
/// timer for it costs more than they do.
const PUBLISH_EVERY: Duration = Duration::from_millis(5);

/// Everything the thread owns.
pub(super) struct Worker {
    listen: Port,
    /// The address that it listens on.
    local: SocketAddr,
    clients: Clients,
    receiver: Receiver,
    /// What the target sent to several clients, to be put in order.
    answers: Vec<(Time, Datagram<Origin>)>,
    pace: Pace,
    /// The links, whose datagrams carry their client.
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
    /// When the counts were copied last, and when that is to be done next.
    published: Time,
    unpublished: Option<Time>,
    shared: Arc<Shared>,
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
            pace: Pace::new(listen.room()),
            published: Time::ZERO,
            unpublished: None,
            listen,
            local,
            clients,
            receiver: Receiver::new(),
            answers: Vec::new(),
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
        self.clients.sockets.add(&self.shared.alarm, ALARM)?;
        self.clients.sockets.add(&self.listen, LISTEN)?;
        let mut ready = Ready::default();
        while !self.shared.stopping.load(Ordering::Acquire) {
            let moment = self.release_due();
            if ready.alarm || self.rebind.is_some() {
                self.apply_commands();
            }
            self.expire(moment);
            self.publish(moment);
            self.wait(moment, &mut ready)?;
            if ready.listen {
                self.receive_up();
            }
            self.receive_down(&ready.clients);
        }
        self.publish(Time::MAX);
        Ok(())
    }

    fn wait(&mut self, moment: Time, ready: &mut Ready) -> io::Result<()> {
        let due = [self.up.poll_timeout(), self.down.poll_timeout()];
        let due = due.into_iter().flatten().min();
        let [up, down] = [&self.up, &self.down].map(|link| link.earliest_of_later(moment));
        let rest = self.pace.rest(moment, due, up.min(down));
        if rest.is_some() {
            wait(&mut [self.shared.alarm.as_poll_fd()], rest)?;
        }
        let (due, at_once) = after(rest, due);
        let others = [
            self.expiry,
            self.rebind.map(|(_, next)| next),
            self.unpublished,
            at_once,
        ];
        let about = others.into_iter().flatten().min();
        self.clients.sockets.wait(due, about, ready)?;
        self.pace.wakes(now());
        if ready.alarm {
            self.shared.alarm.silence();
        }
        Ok(())
    }

    /// Forgets who was idle for too long, once somebody may have been.
    fn expire(&mut self, now: Time) {
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
        let mut take = |received: Received<'_>| match clients.meet(&received) {
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
        let taken = receiver.receive(listen, &mut take);
        let overflows = self.listen.new_overflows();
        self.overflows_up = self.overflows_up.saturating_add(overflows);
        self.note_error(taken);
    }

    /// Takes what the target sent to clients and puts it on the link down, as it came.
    fn receive_down(&mut self, numbers: &[u64]) {
        for number in numbers {
            self.take_answers(*number);
        }
        if numbers.len() > 1 {
            self.answers.sort_by_key(|(arrived, _)| *arrived);
        }
        for (arrived, datagram) in self.answers.drain(..) {
            self.offered_down = arrived.max(self.offered_down);
            self.down.offer(self.offered_down, datagram);
        }
    }

    fn take_answers(&mut self, number: u64) {
        let Some(client) = self.clients.get_mut(number) else {
            return;
        };
        let (local, captures) = (self.local, self.capture.is_some());
        let (receiver, answers) = (&mut self.receiver, &mut self.answers);
        let mut last = None;
        let taken = receiver.receive(&client.port, |received| {
            let mut datagram = datagram(number, &received);
            let turned = || client.sides(local, received.from, received.class).turned();
            datagram.address.sides = captures.then(|| Box::new(turned()));
            answers.push((received.arrived, datagram));
            last = Some(received.arrived);
        });
        last.into_iter()
            .for_each(|arrived| client.standing.is_answered(arrived));
        let overflows = client.port.new_overflows();
        self.overflows_down = self.overflows_down.saturating_add(overflows);
        self.note_error(taken);
    }

    fn note_error(&mut self, taken: io::Result<()>) {
        let Err(error) = taken else {
            return;
        };
        let counter = match error.kind() {
            io::ErrorKind::ConnectionRefused => &mut self.unreachable,
            _ => &mut self.receive_errors,
        };
        *counter = counter.saturating_add(1);
    }

    /// Sends what is due, and returns the time.
    fn release_due(&mut self) -> Time {
        let mut moment = now();
        while let Some(mut packet) = self.up.poll(moment) {
            let outcome = self.send(Direction::Up, &mut packet);
            self.up.finish(&packet, outcome, moment);
            moment = now();
        }
        while let Some(mut packet) = self.down.poll(moment) {
            let outcome = self.send(Direction::Down, &mut packet);
            self.down.finish(&packet, outcome, moment);
            moment = now();
        }
        moment
    }

    /// Sends to the target from the client's own port, or to the client from the address that it has.
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

    fn publish(&mut self, now: Time) {
        let next = self.published + PUBLISH_EVERY;
        if now < next && self.pace.is_busy() {
            self.unpublished = Some(next);
            return;
        }
        (self.published, self.unpublished) = (now, None);
        *lock(&self.shared.board) = RelaySnapshot {
            up: self.up.counters(),
            down: self.down.counters(),
            clients: self.clients.len() as u64,
            clients_met: self.clients.met(),
            clients_displaced: self.clients.displaced(),
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
