#!/usr/bin/env python3
"""An emulated Haply 2DIY behind a pseudo terminal, by the vendor's hAPI: its board, its arms and a hand that holds the tool.

    python3 tests/devices/two_diy.py                  # prints: 2diy: /dev/pts/N
    mmt device test --device 2diy --device-at /dev/pts/N

The board answers torques alone, keeps those that it got last, and turns counts of its encoders into degrees with what it was set
up with. A real board counts from where its arms stand at each set-up; this one always from the vendor's start. What it was not
set up for, and what is no command, is refused: it is reported at the end. The arms' geometry is computed here by bisection and
difference quotients, unlike in mmt. Standard library only.
"""

import math
import os
import select
import struct
import time
import tty

from emulated import Hand, Log, arguments

UPPER, FORE = 0.07, 0.09
# axes of the motors m apart; offsets (degrees) and counts a turn of encoders 1 and 2 as the vendor's examples have them
VERSIONS = {2: (0.0, (241.0, -61.0), 10752.0), 3: (0.038, (168.0, 12.0), 4880.0)}
# the ports of motors and encoders 1 and 2
PORT_OF = (2, 1)


class Arms:
    def __init__(self, version):
        self.base = VERSIONS[version][0]

    def angles(self, place):
        """Angles of the motors, rad, with the elbows outwards: where a turning elbow is a forearm away, by bisection."""
        found = []
        for origin, side in ((0.0, 1.0), (self.base, -1.0)):
            x, y = place[0] - origin, place[1]
            towards = math.atan2(y, x)
            distance = lambda turn: math.hypot(x - UPPER * math.cos(towards + side * turn),
                                               y - UPPER * math.sin(towards + side * turn))
            low, high = 0.0, math.pi
            if not distance(low) <= FORE <= distance(high):
                raise ValueError(f"out of reach: {place}")
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if distance(middle) < FORE else (low, middle)
            found.append(towards + side * low)
        return found

    def force(self, place, torques):
        """The force on the tool, N, by virtual work: f · dP = τ · dθ for a small step along each axis."""
        step, force = 1e-6, []
        for axis in range(2):
            ends = []
            for way in (step, -step):
                there = list(place)
                there[axis] += way
                ends.append(self.angles(there))
            turns = [(more - less) / (2 * step) for more, less in zip(*ends)]
            force.append(sum(torque * turn for torque, turn in zip(torques, turns)))
        return force


class Board:
    def __init__(self, options, log):
        self.log, self.version = log, options.geometry
        self.arms = Arms(options.geometry)
        self.hand = Hand(options.start, options.goal, options.speed, options.rest)
        self.forget()
        self.now, self.set_up_as, self.bytes = time.monotonic(), None, b""

    def forget(self):
        self.motors, self.encoders, self.torques = [], [], [0.0, 0.0]

    def step(self):
        now = time.monotonic()
        force = self.arms.force(self.hand.place, self.torques)
        self.hand.step(min(now - self.now, 0.05), force)
        self.now = now
        self.log.place(self.hand.place)
        return force

    def feed(self, data):
        """Bytes that came; returns what the board answers."""
        self.bytes += data
        answer = b""
        while self.bytes:
            length = self.length()
            if length is None:
                break
            if length == 0:
                self.log.refuse(f"no command: {self.bytes[:8].hex()}")
                self.bytes = b""
                break
            command, self.bytes = self.bytes[:length], self.bytes[length:]
            answer += self.take(command)
        return answer

    def length(self):
        """Length of the command that the bytes begin with; none if more are needed, 0 if it is none."""
        data = self.bytes
        code = data[0]
        if code == 0:
            return 2 if len(data) >= 2 else None
        if code == 2:
            whole = 2 + 4 * len(self.motors)
            return whole if len(data) >= whole else None
        if code != 1:
            return 0
        at, encoders = 2, 0
        for part in range(4):
            if len(data) <= at:
                return None
            # motors and encoders are bits of ports, sensors and PWM pins a number
            many = bin(data[at] & 0x0F).count("1") if part < 2 else data[at]
            encoders = many if part == 1 else encoders
            at += 1 + many
        whole = at + 8 * encoders
        return whole if len(data) >= whole else None

    def take(self, command):
        code, device = command[0], command[1]
        if code == 0:
            self.forget()
            return b""
        if code == 1:
            self.set_up(command)
            return b""
        if not self.motors:
            self.log.refuse("torques before a set-up")
            return b""
        torques = struct.unpack(f"<{len(self.motors)}f", command[2:])
        if not all(map(math.isfinite, torques)):
            self.log.refuse("no finite torque")
            return b""
        by_port = dict(zip(self.motors, torques))
        self.torques = [by_port.get(port, 0.0) for port in PORT_OF]
        self.log.force(self.step())
        self.log.taken += 1
        degrees = [math.degrees(angle) for angle in self.arms.angles(self.hand.place)]
        numbers = []
        for port, (offset, counts) in self.encoders:
            true = degrees[PORT_OF.index(port)]
            numbers.append(offset + round((true - VERSIONS[self.version][1][PORT_OF.index(port)]) * counts / 360.0) * 360.0 / counts)
        return bytes([device]) + struct.pack(f"<{len(numbers)}f", *numbers)

    def set_up(self, command):
        at, ports = 2, []
        for part in range(2):
            bits = command[at]
            ports.append([port for port in (1, 2, 3, 4) if bits >> port - 1 & 1])
            at += 1 + len(ports[-1])
        if command[at:at + 2] != b"\0\0":
            self.log.refuse("sensors or PWM pins that are not there")
        numbers = struct.unpack(f"<{2 * len(ports[1])}f", command[at + 2:])
        self.motors = ports[0]
        self.encoders = list(zip(ports[1], zip(numbers[::2], numbers[1::2])))
        _, offsets, counts = VERSIONS[self.version]
        for port, (offset, found) in self.encoders:
            if port not in PORT_OF or offset != offsets[PORT_OF.index(port)] or found != counts:
                self.log.refuse(f"encoder at port {port}: {offset}°, {found} counts")
        self.set_up_as = command.hex()


def main():
    options = arguments(__doc__.split("\n")[0], [0.019, 0.09], [-0.011, 0.09])
    options.add_argument("--geometry", type=int, choices=VERSIONS, default=3, help="which 2DIY it is")
    options = options.parse_args()
    log = Log()
    board = Board(options, log)
    master, slave = os.openpty()
    tty.setraw(slave)
    print(f"2diy: {os.ttyname(slave)}", flush=True)
    os.close(slave)
    begun, garbled, silenced = None, False, False
    try:
        while True:
            # nobody has it open: the read fails until somebody has
            ready, _, _ = select.select([master], [], [], 0.2)
            if not ready:
                continue
            try:
                data = os.read(master, 4096)
            except OSError:
                if options.once and log.taken:
                    break
                time.sleep(0.01)
                continue
            begun = begun or time.monotonic()
            since = time.monotonic() - begun
            answer = board.feed(data)
            if since > options.silent_at and not silenced:
                silenced = True
                time.sleep(0.3)
            if since > options.garbage_at and not garbled and answer:
                garbled, answer = True, answer[:4]
            if answer:
                os.write(master, answer)
    except KeyboardInterrupt:
        pass
    log.show(set_up=board.set_up_as)


if __name__ == "__main__":
    main()
