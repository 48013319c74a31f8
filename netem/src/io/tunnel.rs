//! The *tunnel* driver: an emulated link in each direction between two network interfaces of IP packets (TUN devices).
//!
//! Up is from the near one to the far one. A packet is an IPv4 packet with its headers; others end here. Everything happens on one thread.

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use mmt_shared::io::alarm::wait;
use mmt_shared::io::realtime;
use mmt_shared::time::Time;
use quinn::udp::EcnCodepoint;
use rustix::event::{PollFd, PollFlags};

use super::capture_file::CaptureWriter;
use super::driver::{Datagram, Driver, Outcome};
use super::lateness::Lateness;
use super::record_file::RecordWriter;
use super::relay::{Extras, RelayError, RelayHandle, RelaySnapshot, Shared, drivers};
use super::{lock, now};
use crate::config::LinkConfig;

/// Packets taken from one interface before the times are looked at again.
const BATCH: usize = 64;
/// The longest IP packet.
const PACKET_MAX: usize = 65_535;

/// The tunnel as such: [`Tunnel::start`] starts one.
#[derive(Debug)]
pub struct Tunnel;

impl Tunnel {
    /// Starts a tunnel between two interfaces on a thread of its own; both links draw from `seed`. Of the extras it
    /// takes record and capture. Its handle has no address.
    ///
    /// # Errors
    /// Settings out of range, no thread to be had.
    pub fn start(
        near: OwnedFd,
        far: OwnedFd,
        up: LinkConfig,
        down: LinkConfig,
        seed: u64,
        extras: Extras,
    ) -> Result<RelayHandle, RelayError> {
        let shared = Shared::try_new()?;
        for end in [&near, &far] {
            rustix::io::ioctl_fionbio(end, true)
                .map_err(|errno| RelayError::Thread(errno.into()))?;
        }
        let links = drivers([up, down], seed, now(), &shared, &extras, |()| None)?;
        let worker = Worker {
            ends: [near, far],
            links,
            offered: [Time::ZERO; 2],
            buffer: vec![0; PACKET_MAX],
            receive_errors: 0,
            record: extras.record,
            capture: extras.capture,
            shared: shared.clone(),
        };
        RelayHandle::start("netem-tunnel", None, shared, move || worker.run())
    }
}

/// Everything the thread owns; the near end and the link up come first.
struct Worker {
    ends: [OwnedFd; 2],
    links: [Driver<()>; 2],
    /// The latest arrival that was offered to each: times of offers never go back.
    offered: [Time; 2],
    buffer: Vec<u8>,
    receive_errors: u64,
    record: Option<RecordWriter>,
    capture: Option<CaptureWriter>,
    shared: Arc<Shared>,
}

impl Worker {
    fn run(mut self) -> io::Result<()> {
        // what the host does not grant, the lateness shows
        let _ = realtime::request();
        while !self.shared.stopping.load(Ordering::Acquire) {
            self.release_due();
            self.apply_commands();
            self.publish();
            let ready = self.wait()?;
            self.receive(ready);
        }
        self.publish();
        Ok(())
    }

    fn apply_commands(&mut self) {
        let commands = std::mem::take(&mut *lock(&self.shared.commands));
        if let (Some((up, down)), [link_up, link_down]) = (commands.links, &mut self.links) {
            // the handle has checked them
            let _ = link_up.reconfigure(now(), up);
            let _ = link_down.reconfigure(now(), down);
        }
    }

    /// Waits; which ends have something to read.
    fn wait(&self) -> io::Result<[bool; 2]> {
        let until = self.links.iter().filter_map(Driver::poll_timeout).min();
        let [near, far] = &self.ends;
        let mut fds = [
            self.shared.alarm.as_poll_fd(),
            PollFd::from_borrowed_fd(near.as_fd(), PollFlags::IN),
            PollFd::from_borrowed_fd(far.as_fd(), PollFlags::IN),
        ];
        wait(&mut fds, until)?;
        let [alarm, near, far] = fds.map(|fd| fd.revents() != PollFlags::empty());
        if alarm {
            self.shared.alarm.silence();
        }
        Ok([near, far])
    }

    /// Takes what came in at the ends and puts it on the links.
    fn receive(&mut self, ready: [bool; 2]) {
        let ways = self.ends.iter().zip(&mut self.links).zip(&mut self.offered);
        for (((end, link), offered), _) in ways.zip(ready).filter(|(_, ready)| *ready) {
            for _ in 0..BATCH {
                match rustix::io::read(end, &mut self.buffer) {
                    Ok(bytes) => {
                        let contents = self.buffer.get(..bytes).unwrap_or_default().to_owned();
                        if !is_ipv4(&contents) {
                            continue;
                        }
                        *offered = now().max(*offered);
                        let ecn = ecn(&contents);
                        link.offer(
                            *offered,
                            Datagram {
                                address: (),
                                ecn,
                                contents,
                            },
                        );
                    }
                    Err(rustix::io::Errno::AGAIN) => break,
                    Err(_) => {
                        self.receive_errors = self.receive_errors.saturating_add(1);
                        break;
                    }
                }
            }
        }
    }

    fn release_due(&mut self) {
        let [near, far] = &self.ends;
        for (link, to) in self.links.iter_mut().zip([far, near]) {
            while let Some(mut packet) = link.poll(now()) {
                let moment = now();
                if packet.payload.ecn == Some(EcnCodepoint::Ce) {
                    mark(&mut packet.payload.contents);
                }
                let outcome = match rustix::io::write(to, &packet.payload.contents) {
                    Ok(_) => Outcome::Sent,
                    Err(rustix::io::Errno::AGAIN | rustix::io::Errno::NOBUFS) => Outcome::Blocked,
                    Err(_) => Outcome::Failed,
                };
                link.finish(&packet, outcome, moment);
            }
        }
    }

    fn publish(&self) {
        let [up, down] = &self.links;
        *lock(&self.shared.board) = RelaySnapshot {
            up: up.counters(),
            down: down.counters(),
            receive_errors: self.receive_errors,
            unrecorded: self.record.as_ref().map_or(0, RecordWriter::missed),
            uncaptured: self.capture.as_ref().map_or(0, CaptureWriter::missed),
            // the handle reads the histogram itself
            lateness: Lateness::default(),
            ..RelaySnapshot::default()
        };
    }
}

fn is_ipv4(packet: &[u8]) -> bool {
    packet.first().is_some_and(|first| first >> 4 == 4)
}

/// The ECN field of an IPv4 packet.
fn ecn(packet: &[u8]) -> Option<EcnCodepoint> {
    EcnCodepoint::from_bits(packet.get(1)? & 3)
}

/// Marks an IPv4 packet as having met congestion (RFC 3168), with the right checksum.
fn mark(packet: &mut [u8]) {
    let Some([_, class, _, _, _, _, _, _, _, _, high, low]) = packet.first_chunk_mut() else {
        return;
    };
    let added = u32::from(3 - (*class & 3));
    *class |= 3;
    // RFC 1624: the sum of the header grows by as much, its complement falls
    let sum = u32::from(!u16::from_be_bytes([*high, *low])) + added;
    let sum = (sum & 0xffff) + (sum >> 16);
    [*high, *low] = (!(sum as u16)).to_be_bytes();
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixDatagram;

    use super::*;

    #[test]
    fn what_is_no_ipv4_goes_no_way() {
        let (near, inside) = UnixDatagram::pair().unwrap();
        let (far, outside) = UnixDatagram::pair().unwrap();
        let [up, down] = [(); 2].map(|()| LinkConfig::default());
        let ends = (near.into(), far.into());
        let tunnel = Tunnel::start(ends.0, ends.1, up, down, 1, Extras::default()).unwrap();
        inside.send(&[0x60, 0, 1]).unwrap();
        inside.send(&[0x45, 0, 2]).unwrap();
        let mut packet = [0; 3];
        outside.recv(&mut packet).unwrap();
        assert_eq!(packet, [0x45, 0, 2]);
        assert_eq!(tunnel.stop().unwrap().up.link.offered.packets, 1);
    }

    #[test]
    fn a_mark_leaves_the_checksum_of_the_header_right() {
        for class in [1_u8, 2] {
            let header = etherparse::Ipv4Header {
                ecn: class.try_into().unwrap(),
                ..etherparse::Ipv4Header::new(
                    0,
                    64,
                    etherparse::IpNumber::UDP,
                    [10, 1, 2, 3],
                    [9, 8, 7, 6],
                )
                .unwrap()
            };
            let mut packet = Vec::new();
            header.write(&mut packet).unwrap();
            assert_eq!(ecn(&packet), EcnCodepoint::from_bits(class));
            mark(&mut packet);
            assert_eq!(ecn(&packet), Some(EcnCodepoint::Ce));
            let (read, _) = etherparse::Ipv4Header::from_slice(&packet).unwrap();
            assert_eq!(read.header_checksum, read.calc_header_checksum());
        }
        mark(&mut []);
    }
}
