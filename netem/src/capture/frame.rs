//! Headers of packets: put before a datagram, and taken off a captured frame.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::net::{IpAddr, SocketAddr};

use etherparse::{
    EtherType, IpHeaders, IpNumber, Ipv4Header, Ipv6FlowLabel, Ipv6Header, NetSlice, PacketBuilder,
    SlicedPacket, TransportSlice,
};

const HOPS: u8 = 64;
/// Link types (tcpdump.org).
const NULL: u16 = 0;
const ETHERNET: u16 = 1;
const LOOP: u16 = 108;
const LINUX_SLL: u16 = 113;
const LINUX_SLL2: u16 = 276;
const RAW: [u16; 5] = [12, 14, 101, 228, 229];

/// A datagram behind its IP and UDP headers; without headers if there are none for it.
pub(super) fn udp([from, to]: [SocketAddr; 2], class: u8, contents: &[u8]) -> Vec<u8> {
    // IPv4 in an IPv6 socket is IPv4 on the wire
    let ip = match (from.ip().to_canonical(), to.ip().to_canonical()) {
        (IpAddr::V4(from), IpAddr::V4(to)) => {
            let header = Ipv4Header::new(0, HOPS, IpNumber::UDP, from.octets(), to.octets());
            header.ok().map(|mut header| {
                header.dscp = (class >> 2).try_into().unwrap_or_default();
                header.ecn = (class & 3).try_into().unwrap_or_default();
                IpHeaders::Ipv4(header, Default::default())
            })
        }
        (from, to) => {
            let octets = |ip| match ip {
                IpAddr::V4(ip) => ip.to_ipv6_mapped().octets(),
                IpAddr::V6(ip) => ip.octets(),
            };
            let header = Ipv6Header {
                traffic_class: class,
                flow_label: Ipv6FlowLabel::ZERO,
                payload_length: 0,
                next_header: IpNumber::UDP,
                hop_limit: HOPS,
                source: octets(from),
                destination: octets(to),
            };
            Some(IpHeaders::Ipv6(header, Default::default()))
        }
    };
    let mut frame = Vec::with_capacity(contents.len() + 48);
    let written = ip.map(|ip| {
        let builder = PacketBuilder::ip(ip).udp(from.port(), to.port());
        builder.write(&mut frame, contents)
    });
    if !matches!(written, Some(Ok(()))) {
        contents.clone_into(&mut frame);
    }
    frame
}

/// A packet as it is known again on the other side of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    /// Sender and receiver by its IP header.
    pub(super) between: [IpAddr; 2],
    /// What no router changes.
    pub(super) identity: u64,
    /// UDP payload, or what IP carries, bytes.
    pub(super) bytes: u32,
}

impl Seen {
    /// None: no whole IP packet.
    pub(super) fn of(link_type: u16, frame: &[u8]) -> Option<Self> {
        let packet = match link_type {
            ETHERNET => SlicedPacket::from_ethernet(frame),
            LINUX_SLL => SlicedPacket::from_ether_type(ether_type(frame, 14)?, frame.get(16..)?),
            LINUX_SLL2 => SlicedPacket::from_ether_type(ether_type(frame, 0)?, frame.get(20..)?),
            NULL | LOOP => SlicedPacket::from_ip(frame.get(4..)?),
            raw if RAW.contains(&raw) => SlicedPacket::from_ip(frame),
            _ => return None,
        };
        let packet = packet.ok()?;
        if packet.is_ip_payload_fragmented() {
            return None;
        }
        let between: [IpAddr; 2] = match packet.net.as_ref()? {
            NetSlice::Ipv4(ip) => {
                let header = ip.header();
                [
                    header.source_addr().into(),
                    header.destination_addr().into(),
                ]
            }
            NetSlice::Ipv6(ip) => {
                let header = ip.header();
                [
                    header.source_addr().into(),
                    header.destination_addr().into(),
                ]
            }
            NetSlice::Arp(_) => return None,
        };
        let carried = packet.net.as_ref()?.ip_payload_ref()?;
        // ports and checksums are what a NAT changes
        let parts = match &packet.transport {
            Some(TransportSlice::Udp(udp)) => [udp.payload(), &[]],
            Some(TransportSlice::Tcp(tcp)) => [tcp.slice().get(4..16)?, tcp.slice().get(18..)?],
            _ => [carried.payload, &[]],
        };
        let mut hasher = DefaultHasher::new();
        (carried.ip_number.0, parts).hash(&mut hasher);
        let bytes = if matches!(packet.transport, Some(TransportSlice::Udp(_))) {
            parts.map(<[u8]>::len).iter().sum()
        } else {
            carried.payload.len()
        };
        Some(Self {
            between,
            identity: hasher.finish(),
            bytes: u32::try_from(bytes).unwrap_or(u32::MAX),
        })
    }
}

/// What a cooked frame carries, from the two bytes at `place` of its header. A reader of the whole header would refuse the hardware
/// types that it does not know.
fn ether_type(frame: &[u8], place: usize) -> Option<EtherType> {
    let kind = frame.get(place..)?.first_chunk()?;
    Some(EtherType(u16::from_be_bytes(*kind)))
}
