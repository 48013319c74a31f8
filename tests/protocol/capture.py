"""Keeps the UDP datagrams of one socket as a capture file (pcap), and counts them.

Beside the socket, not in the system: it needs no privilege. Must never change what it sees.
"""

import ipaddress
import struct
import time

RAW_IP = 101  # LINKTYPE_RAW: packets begin with the IP header


class Capture:
    """Takes datagrams; writes them to `file` if there is one. IPv4 only."""

    def __init__(self, file=None):
        self.file = file
        self.datagrams = {"sent": 0, "received": 0}
        self.bytes = {"sent": 0, "received": 0}
        if file:
            file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, RAW_IP))

    def take(self, direction, payload, source, destination):
        self.datagrams[direction] += 1
        self.bytes[direction] += len(payload)
        if self.file:
            packet = ipv4(payload, source, destination)
            seconds, ns = divmod(time.time_ns(), 10**9)
            size = len(packet)
            self.file.write(struct.pack("<IIII", seconds, ns // 1000, size, size) + packet)


def ipv4(payload, source, destination):
    """The datagram with its headers; checksums of 0, which say that there are none to check."""
    udp = struct.pack("!HHHH", source[1], destination[1], 8 + len(payload), 0) + payload
    addresses = [ipaddress.IPv4Address(host).packed for host in (source[0], destination[0])]
    return struct.pack("!BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, *addresses) + udp
