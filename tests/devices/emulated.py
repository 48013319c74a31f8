"""What the emulated devices share: a hand that holds the tool, and the report at the end. Standard library only."""

import argparse
import json
import math


class Hand:
    """A mass in a hand that is a spring and a damper: it rests at one place, and then goes to another at a steady speed."""

    MASS, STIFFNESS, DAMPING = 0.3, 600.0, 20.0

    def __init__(self, start, goal, speed, rest):
        self.place, self.velocity = list(start), [0.0] * len(start)
        self.start, self.goal, self.speed, self.rest = start, goal, speed, rest
        self.time = 0.0

    def wanted(self):
        way = [to - of for of, to in zip(self.start, self.goal)]
        length = math.hypot(*way)
        gone = min(max(self.time - self.rest, 0.0) * self.speed, length)
        share = gone / length if length else 0.0
        return [of + share * part for of, part in zip(self.start, way)]

    def step(self, passed, force):
        """So many seconds with this force on the tool, N; velocity first."""
        self.time += passed
        steps = max(1, math.ceil(passed / 0.001))
        for _ in range(steps):
            period = passed / steps
            for axis, goal in enumerate(self.wanted()):
                pull = self.STIFFNESS * (goal - self.place[axis]) - self.DAMPING * self.velocity[axis] + force[axis]
                self.velocity[axis] += period * pull / self.MASS
                self.place[axis] += period * self.velocity[axis]


class Log:
    """What was asked of the device."""

    def __init__(self):
        self.taken, self.refused, self.peak_n, self.last, self.greeted = 0, [], 0.0, [0.0], None
        self.least, self.most = None, None
        self.answers = []

    def force(self, force):
        self.peak_n = max(self.peak_n, math.hypot(*force))
        self.last = list(force)

    def place(self, place):
        self.least = [min(pair) for pair in zip(self.least or place, place)]
        self.most = [max(pair) for pair in zip(self.most or place, place)]

    def refuse(self, why):
        if len(self.refused) < 20:
            self.refused.append(why)

    def show(self, **more):
        print(json.dumps({
            "taken": self.taken, "refused": self.refused, "force_peak_n": self.peak_n, "force_last_n": self.last,
            "greeted": self.greeted, "place_min_m": self.least, "place_max_m": self.most, **more,
        }), flush=True)


def arguments(description, start, goal):
    """The options of both emulators; places in metres along the device's axes."""
    numbers = lambda text: [float(number) for number in text.split(",")]
    options = argparse.ArgumentParser(description=description)
    options.add_argument("--start", type=numbers, default=start, help="where the hand rests at first, m, such as %(default)s")
    options.add_argument("--goal", type=numbers, default=goal, help="where it goes then, m")
    options.add_argument("--speed", type=float, default=0.05, help="how fast, m/s")
    options.add_argument("--rest", type=float, default=2.0, help="how long it rests, s")
    options.add_argument("--garbage-at", type=float, default=math.inf, help="when it sends one answer that is none, s")
    options.add_argument("--silent-at", type=float, default=math.inf, help="when it says nothing for 0.3 s, s")
    options.add_argument("--once", action="store_true", help="end when the first client has gone")
    return options
