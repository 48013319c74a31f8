#!/usr/bin/env python3
"""A plant at mmt's plant link (docs/plugs.md): a block on a table with friction, pushed by a tool on a spring.

    mmt slave --listen 127.0.0.1:0 --plant link         # prints: plant: udp://127.0.0.1:PORT?token=…
    python3 plant.py                                    # asks for that address

Nothing but the standard library. The class Plant is what a robot or a simulator needs; the class Block is the simplest object that
shows how it is used. With `mmt bench plant --plant link` the same program runs in lock-step, as fast as it computes.
"""

import argparse
import collections
import math
import socket
import struct
import sys
import time
import urllib.parse

HEAD = struct.Struct("<4sBBHIIQ16s")
NUMBERS = struct.Struct("<10d")
SESSION, BEGINS, HELD = 1, 2, 4
OBJECT_SEEN = 1
PERIOD_S = 0.001
# numbers go round: this many ahead, or more, is behind
HALF, ALL = 1 << 31, 1 << 32
# without a command for so long the tool has to stand by itself
SILENCE_S = 0.020

Command = collections.namedtuple("Command", "tool velocity stiffness damping force_max begins held periods")


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


class Plant:
    """One end of the link: take commands, send what was measured."""

    def __init__(self, address):
        host, port, self.token = endpoint(address)
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_DGRAM)
        self.socket.connect((host, port))
        self.sequence = self.newest = self.received = self.lost = 0
        self.last = None

    def answer(self, tool, velocity, force, pose=None, image_age_s=0.0):
        """What was measured: the tool (m, m/s), its force on the object (N), and, where it was seen since, the object (m, m, rad)."""
        # it goes round, and 0 is none
        self.sequence = self.sequence % (ALL - 1) + 1
        flags = OBJECT_SEEN if pose else 0
        stamp = time.monotonic_ns()
        head = HEAD.pack(b"MMTL", 1, 4, flags, self.sequence, self.newest, stamp, self.token)
        try:
            self.socket.send(head + NUMBERS.pack(*tool, *velocity, *force, *(pose or (0.0, 0.0, 0.0)), image_age_s))
        except OSError:
            pass  # nobody is there (any more): the silence shows it

    def command(self, wait_s):
        """The newest command, with the periods of 1 ms that have passed since the one before: 0 where only late ones came. None if
        none comes."""
        newest, until = None, time.monotonic() + wait_s
        while True:
            # the first is waited for; then those that wait already
            self.socket.settimeout(0.0 if newest else max(until - time.monotonic(), 0.0))
            try:
                packet = self.socket.recv(256)
            except ConnectionRefusedError:
                continue  # nobody is there (any more): whoever comes is waited for
            except OSError:
                return newest
            command = self.read(packet)
            if command and newest:
                command = command._replace(periods=command.periods + newest.periods)
            newest = command or newest

    def read(self, packet):
        """A packet's command; None if it is none."""
        if len(packet) != HEAD.size + NUMBERS.size:
            return None
        magic, version, kind, flags, sequence, _, _, token = HEAD.unpack_from(packet)
        if (magic, version, kind, token) != (b"MMTL", 1, 3, self.token) or not flags & SESSION:
            return None
        periods = (sequence - self.newest) % ALL if self.newest else 1
        self.received += 1
        if not 0 < periods < HALF:
            # sent again, or late: answer, but do not compute it twice
            return self.last._replace(periods=0)
        self.lost += periods - 1
        self.newest = sequence
        x, y, v_x, v_y, stiffness, damping, force_max, *_ = NUMBERS.unpack_from(packet, HEAD.size)
        begins, held = bool(flags & BEGINS), bool(flags & HELD)
        self.last = Command((x, y), (v_x, v_y), stiffness, damping, force_max, begins, held, periods)
        return self.last


class Block:
    """A square block that does not turn, on a table with friction; the tool is a point behind a spring of mmt's stiffness."""

    def __init__(self, mass=0.7, side=0.36, friction=0.3, damping=3.0):
        self.mass, self.half, self.damping = mass, side / 2, damping
        self.coulomb = friction * mass * 9.81
        self.at, self.speed, self.force = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.tip, self.tip_speed = (-0.45, 0.0), (0.0, 0.0)
        self.tool, self.tool_speed = (-0.45, 0.0), (0.0, 0.0)

    def step(self, command):
        self.tool, self.tool_speed = command.tool, command.velocity
        self.force, tip, speed = [0.0, 0.0], list(self.tool), list(self.tool_speed)
        inside = [self.half - abs(t - o) for t, o in zip(self.tool, self.at)]
        if min(inside) > 0.0:
            axis = inside.index(min(inside))
            side = math.copysign(1.0, self.at[axis] - self.tool[axis])
            closing = (self.tool_speed[axis] - self.speed[axis]) * side
            force = command.stiffness * inside[axis] + command.damping * closing
            self.force[axis] = side * min(max(force, 0.0), command.force_max)
            tip[axis] -= side * inside[axis]
            speed[axis] = self.speed[axis]
        self.tip, self.tip_speed = tuple(tip), tuple(speed)
        for axis in (0, 1):
            speed = self.speed[axis] + PERIOD_S * (self.force[axis] - self.damping * self.speed[axis]) / self.mass
            # what friction can take away of the speed in a period
            most = PERIOD_S * self.coulomb / self.mass
            self.speed[axis] = math.copysign(max(abs(speed) - most, 0.0), speed)
            self.at[axis] += PERIOD_S * self.speed[axis]

    def tool_state(self):
        """The tip of a tool that gives stands at the surface."""
        return self.tip, self.tip_speed, self.force

    def pose(self):
        return (self.at[0], self.at[1], 0.0)


def serve(plug, world, seconds=math.inf, image_hz=30):
    """Answers commands with what a world does; it has step(command), tool_state() and pose(). 0 images a second: there is no camera."""
    period = 0
    last = begin = time.monotonic()
    while time.monotonic() - begin < seconds:
        command = plug.command(0.010)
        if command:
            last = time.monotonic()
            for _ in range(min(command.periods, 20)):
                world.step(command)
                period += 1
        elif time.monotonic() - last < 0.010:
            continue
        # an image; and the object's place without a session, that a new one begins with it
        seen = not command or (image_hz and command.periods and period % max(1, 1000 // image_hz) == 0)
        plug.answer(*world.tool_state(), world.pose() if seen else None)


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
    arguments.add_argument("address", nargs="?", default="-", help="as mmt printed it after “plant: ”; `-`, the default, asks for it or reads it from standard input")
    arguments.add_argument("--seconds", type=float, default=math.inf, help="how long")
    options = arguments.parse_args()
    serve(Plant(asked(options.address, "plant")), Block(), options.seconds)


if __name__ == "__main__":
    main()
