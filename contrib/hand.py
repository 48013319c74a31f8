#!/usr/bin/env python3
"""A scripted hand at mmt's device link (docs/plugs.md): it grips, pushes along the world's x, and lets go.

    mmt master - --device link                   # asks for the pairing string; prints: device: udp://127.0.0.1:PORT?token=…
    python3 hand.py --way 0.35                   # asks for that address

Nothing but the standard library. The class Device is what a driver of a real device needs; the rest is a simulated one: a mass in
a hand that is a spring and a damper, which the force of mmt moves.
"""

import argparse
import json
import math
import socket
import struct
import sys
import time
import urllib.parse

HEAD = struct.Struct("<4sBBHIIQ16s")
READING = struct.Struct("<6f")
FORCE = struct.Struct("<6f")
SESSION, ENGAGED, IN_CONTACT, STOPPED, LINK_LATE, REFUSED = (1 << bit for bit in range(6))
# numbers go round: this many ahead, or more, is behind
HALF, ALL = 1 << 31, 1 << 32
# without a packet for so long a device has to take its force away by itself
SILENCE_S = 0.020


def endpoint(address):
    """Host, port and token of an address as mmt prints it; a ValueError for what is none. The token is not shown."""
    try:
        parts = urllib.parse.urlsplit(address)
        token = bytes.fromhex(urllib.parse.parse_qs(parts.query)["token"][0])
        if parts.scheme == "udp" and parts.hostname and parts.port and len(token) == 16:
            return parts.hostname, parts.port, token
    except (KeyError, ValueError):
        pass
    raise ValueError("this is no address of a plug: give udp://HOST:PORT?token=… with 32 hexadecimal digits, as mmt printed it")


class Device:
    """One end of the link: send what the device measured, get the force."""

    def __init__(self, address):
        host, port, self.token = endpoint(address)
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_DGRAM)
        self.socket.connect((host, port))
        self.socket.setblocking(False)
        self.sequence = self.newest = self.received = self.lost_down = 0
        self.state, self.force, self.hip, self.lost_up = 0, (0.0, 0.0, 0.0), (0.0, 0.0), 0
        self.last_answer = -math.inf

    def send(self, position, velocity, buttons, stamp_ns=None):
        """A reading: m and m/s along the device's axes, a bit for each button; when it was taken, if that is not now."""
        # it goes round, and 0 is none
        self.sequence = self.sequence % (ALL - 1) + 1
        stamp_ns = time.monotonic_ns() if stamp_ns is None else stamp_ns
        head = HEAD.pack(b"MMTL", 1, 1, buttons, self.sequence, self.newest, stamp_ns, self.token)
        try:
            self.socket.send(head + READING.pack(*position, *velocity))
        except OSError:
            pass  # nobody is there (yet): the silence shows it

    def receive(self):
        """Takes what has come; without anything for SILENCE_S the force is none."""
        while True:
            try:
                packet = self.socket.recv(256)
            except OSError:
                break
            if len(packet) != 64:
                continue
            magic, version, kind, state, sequence, _, _, token = HEAD.unpack_from(packet)
            ahead = (sequence - self.newest) % ALL if self.newest else 1
            if (magic, version, kind, token) != (b"MMTL", 1, 2, self.token) or not 0 < ahead < HALF:
                continue
            self.lost_down += ahead - 1
            self.received += 1
            x, y, z, hip_x, hip_y, lost = FORCE.unpack_from(packet, HEAD.size)
            self.newest, self.state, self.last_answer = sequence, state, time.monotonic()
            self.force, self.hip, self.lost_up = (x, y, z), (hip_x, hip_y), int(lost)
        if time.monotonic() - self.last_answer > SILENCE_S:
            self.state, self.force = 0, (0.0, 0.0, 0.0)


class Clutch:
    """Grips as soon as mmt lets it, and again when it was let go: the button must be seen up before it counts."""

    def __init__(self):
        self.packets = 0

    def button(self, state):
        """Whether the button is down in the next packet."""
        if state & ENGAGED:
            self.packets = 0
            return True
        if not state & SESSION or state & STOPPED:
            self.packets = 0
            return False
        # up for five packets, then down for as many as the answer may need
        self.packets = (self.packets + 1) % 100
        return self.packets > 5


def asked(address, name):
    """The address, from a line of standard input where it is `-`: it holds a token, which other users would see on a command line.
    Ends the program where it is none."""
    if address == "-":
        if sys.stdin.isatty():
            print(f"the address behind “{name}: ”, as mmt printed it:", file=sys.stderr)
        address = sys.stdin.readline().strip()
    try:
        host, port, _ = endpoint(address)
        socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
        return address
    except (OSError, UnicodeError):
        print("nobody knows the host of this address: give it as mmt printed it", file=sys.stderr)
    except ValueError as error:
        print(error, file=sys.stderr)
    sys.exit(2)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("address", nargs="?", default="-", help="as mmt printed it after “device: ”; `-`, the default, asks for it or reads it from standard input")
    arguments.add_argument("--way", type=float, default=0.35, help="how far the hand goes along x, m of the device")
    arguments.add_argument("--speed", type=float, default=0.1, help="how fast, m/s")
    arguments.add_argument("--duration", type=float, default=30.0, help="how long at the most, s")
    options = arguments.parse_args()
    device, clutch = Device(asked(options.address, "device")), Clutch()
    mass, stiffness, damping, period = 0.5, 400.0, 25.0, 0.001
    position, velocity = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    wanted, engaged_s, peak_n, contact_s, reach, first, last = 0.0, 0.0, 0.0, 0.0, None, None, None
    begin = due = time.monotonic()
    while due - begin < options.duration and wanted < options.way:
        device.receive()
        engaged = bool(device.state & ENGAGED)
        if engaged:
            first = first or device.hip
            last = device.hip
            engaged_s += period
            contact_s += period * bool(device.state & IN_CONTACT)
            wanted += options.speed * period
        peak_n = max(peak_n, math.hypot(*device.force))
        # the hand's spring towards what it wants, and the force of mmt; velocity first
        for axis, goal in enumerate((wanted, 0.0, 0.0)):
            drive = options.speed if engaged and axis == 0 else 0.0
            pull = stiffness * (goal - position[axis]) + damping * (drive - velocity[axis])
            velocity[axis] += period * (pull + device.force[axis]) / mass
            position[axis] += period * velocity[axis]
        device.send(position, velocity, int(clutch.button(device.state)))
        due += period
        wait = due - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        elif wait < -0.01:
            due -= wait  # the host stood still: skip, never catch up
    device.send(position, velocity, 0)
    print(json.dumps({
        "sent": device.sequence,
        "received": device.received,
        "lost_up": device.lost_up,
        "lost_down": device.lost_down,
        "engaged_s": round(engaged_s, 3),
        "contact_s": round(contact_s, 3),
        "force_peak_n": round(peak_n, 3),
        "hip_from_m": first,
        "hip_to_m": last,
    }))


if __name__ == "__main__":
    main()
