"""The hand of tests/protocol/client.py: one push against the western face, and a poor local model.

Frame and signs of docs/protocol.md. No clock: the caller says which tick it is.
"""

START = (-0.5, 0.0)  # m, where the HIP is when the hello is said
COUPLING = (1000.0, 10.0)  # k_p in N/m, k_d in N s/m
TICK_S = 0.001
ACCELERATION = 2.0  # m/s^2
DEPTH = 0.02  # m, how far from the face the model still looks for contact
FORCE_MAX = 20.0  # N
POSITION_COUNT, FORCE_COUNT = 1e-7, 1e-4  # m, N
# speed in m/s, and for how many ticks once begun
PUSH, LET_GO = (0.15, 1500), (-0.2, 800)


class Push:
    """The HIP as a function of the tick: to the object, against it, back."""

    def __init__(self, state):
        self.state, self.at_ns = state, 0
        self.x, self.y, self.v = START[0], START[1], 0.0
        self.pushed = self.let_go = 0
        self.over = False

    def take(self, state, answers):
        """The newest update: the object at the sample stamped `answers` by our own clock."""
        self.state, self.at_ns = state, answers

    def sample(self, stamp):
        """The next sample, as counts of the wire."""
        speed = self._speed()
        step = ACCELERATION * TICK_S
        self.v += max(-step, min(step, speed - self.v))
        self.x += self.v * TICK_S
        return {"stamp": stamp, "x": round(self.x / POSITION_COUNT),
                "y": round(self.y / POSITION_COUNT),
                "force_x": round(self._force(stamp) / FORCE_COUNT), "force_y": 0}

    def _speed(self):
        if self.pushed == 0 and self.x < self.state["x"] - self.state["west"]:
            return PUSH[0]
        if self.pushed < PUSH[1]:
            self.pushed += 1
            return PUSH[0]
        self.let_go += 1
        self.over = self.let_go >= LET_GO[1]
        return LET_GO[0]

    def _force(self, stamp):
        """Force on the object, N: a spring on the face, which goes on as the last update said."""
        since = max(0, stamp - self.at_ns) * 1e-9
        face = self.state["x"] + self.state["v_x"] * since - self.state["west"]
        depth = self.x - face
        return min(COUPLING[0] * depth, FORCE_MAX) if 0 < depth < DEPTH else 0.0
