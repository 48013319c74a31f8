#!/usr/bin/env python3
"""A master that pushes the box once, by what docs/protocol.md says: it shares no code with mmt.

usage: client.py PAIRING [--observe] [--alpn NAME] [--capture FILE.pcap --keys FILE]   (the host an IPv4 address)

Checks the slave's key against the pin, says hello, moves its HIP against the object's western face, pushes,
lets go, rests until only heartbeats go, says farewell. With --observe it looks on instead, until the slave
ends. Prints one JSON document of what it saw.
Exit code: 0 the session ended as it should; 3 the slave refused; 4 the key is not the pinned one;
5 no protocol in common; 1 anything else. Python 3.10 or later with aioquic (tests/protocol/requirements.txt).
"""

import argparse
import asyncio
import hashlib
import json
import pathlib
import re
import ssl
import sys
import time
from contextlib import ExitStack
from types import SimpleNamespace

from aioquic.asyncio.protocol import QuicConnectionProtocol
from aioquic.quic import events
from aioquic.quic.configuration import QuicConfiguration
from aioquic.quic.congestion.base import QuicCongestionControl, register_congestion_control
from aioquic.quic.connection import QuicConnection
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

sys.dont_write_bytecode = True  # leave nothing beside the sources
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "golden"))

import messages  # noqa: E402
from capture import Capture  # noqa: E402
from decode import Refused, decode  # noqa: E402
from push import COUPLING, START, Push  # noqa: E402

ALPN = "mmt/3"
OTHER_VERSION = 1  # code of the close
NO_APPLICATION_PROTOCOL = 0x178  # TLS alert 120 as an error of QUIC (RFC 9001, section 4.8)
DATAGRAM_MAX, STREAM_MAX = 1024, 4096
SAMPLES_PER_COMMAND, SAMPLES_MAX = 10, 32
SOFTEST = (50.0, 0.0)  # of an observer: every state that is stable for an operator is for this
SCENE_HZ = 20  # of an observer
HEARTBEAT_NS = 50_000_000
REST_NS = 400_000_000  # at the end, without commands; after 2 s of that the slave disengages
WAIT_S = 10.0  # for each answer; generous, the host may be busy
KINDS = {"command": "commands", "update": "updates", "scene": "scenes", "heartbeat": "heartbeats",
         "tool": "tools"}
# what an update may say: name -> least, most
RANGES = {"m": (0.05, 50), "b": (0, 200), "c": (0, 200), "inertia": (3e-6, 34), "e": (0, 200),
          "east": (0.01, 1), "north": (0.01, 1), "west": (0.01, 1), "south": (0.01, 1),
          "x": (-5, 5), "y": (-5, 5), "angle": (-6283, 6283), "v_x": (-10, 10), "v_y": (-10, 10),
          "omega": (-100, 100)}


class Over(Exception):
    """No session any more: exit code and what to print."""

    def __init__(self, exit_code, **document):
        super().__init__(document)
        self.exit_code, self.document = exit_code, document


class FixedWindow(QuicCongestionControl):
    """A congestion window of 64 KiB that nothing changes."""

    def __init__(self, *, max_datagram_size):
        super().__init__(max_datagram_size=max_datagram_size)
        self.congestion_window = 64 * 1024

    def _leave(self, packets):
        self.bytes_in_flight -= sum(packet.sent_bytes for packet in packets)

    def on_packet_sent(self, *, packet):
        self.bytes_in_flight += packet.sent_bytes

    def on_packet_acked(self, *, now, packet):
        self._leave([packet])

    def on_packets_expired(self, *, packets):
        self._leave(packets)

    def on_packets_lost(self, *, now, packets):
        self._leave(packets)

    def on_persistent_congestion(self):
        pass

    def on_rtt_measurement(self, *, now, rtt):
        pass


def pairing(text):
    """Host, port, pin and token. Names and IPv6 addresses, which the document allows, are left out here."""
    found = re.fullmatch(r"mmt://([0-9.]+):(\d+)\?(.*)", text)
    keys = dict(part.split("=", 1) for part in found[3].split("&")) if found else {}
    secret = re.compile(r"[0-9a-fA-F]{64}")
    if set(keys) != {"pin", "token"} or not all(map(secret.fullmatch, keys.values())):
        raise Over(1, outcome="not a pairing string with an IPv4 address")
    return found[1], int(found[2]), bytes.fromhex(keys["pin"]), bytes.fromhex(keys["token"])


def accepted(state, coupling):
    """Whether all numbers are in their ranges and the local model would be stable."""
    k_p, k_d = coupling
    step = 0.001
    bound = 2.5 * k_p * step**2 + 2 * (state["b"] + 2.5 * k_d) * step
    lever = max(state[face] for face in ("east", "north", "west", "south"))
    least = lever**2 * (k_p * step**2 + 2 * k_d * step)
    return state["m"] >= bound and state["inertia"] >= least and all(
        least <= state[name] <= most for name, (least, most) in RANGES.items())


class Master(QuicConnectionProtocol):
    """The connection: counts and keeps UDP datagrams, hands on what QUIC says."""

    def __init__(self, quic, capture):
        super().__init__(quic)
        self.quic, self.capture = quic, capture
        self.said = asyncio.Queue()  # handshake, stream messages, the end: in order
        self.take_datagram = None  # until the session begins they are ignored
        self.stream, self.unread = None, b""

    def connection_made(self, transport):
        own = transport.get_extra_info("sockname")

        def sendto(data, address):
            self.capture.take("sent", data, own, address)
            transport.sendto(data, address)

        super().connection_made(SimpleNamespace(sendto=sendto, close=transport.close))
        self.own = own

    def datagram_received(self, data, addr):
        self.capture.take("received", data, addr, self.own)
        super().datagram_received(data, addr)

    def quic_event_received(self, event):
        if isinstance(event, events.DatagramFrameReceived):
            if self.take_datagram:
                self.take_datagram(event.data)
        elif isinstance(event, events.StreamDataReceived):
            self.unread += event.data
            while len(self.unread) >= 4:
                length = int.from_bytes(self.unread[:4], "little")
                if not 8 <= length <= STREAM_MAX:
                    self.said.put_nowait(Over(1, outcome=f"a frame of {length} bytes"))
                    break
                if len(self.unread) < 4 + length:
                    break
                whole, self.unread = self.unread[:4 + length], self.unread[4 + length:]
                self.said.put_nowait(whole)
        elif isinstance(event, (events.HandshakeCompleted, events.ConnectionTerminated)):
            self.said.put_nowait(event)

    async def hear(self):
        """The next thing said; raises Over if it is the end."""
        said = await asyncio.wait_for(self.said.get(), WAIT_S)
        if isinstance(said, Over):
            raise said
        if isinstance(said, events.ConnectionTerminated):
            code, reason = said.error_code, said.reason_phrase
            if code in (OTHER_VERSION, NO_APPLICATION_PROTOCOL):
                raise Over(5, outcome="no protocol in common", code=code, reason=reason)
            raise Over(1, outcome="closed", code=code, reason=reason)
        return said

    async def hear_message(self):
        whole = await self.hear()
        try:
            return decode(whole, "stream", "slave")
        except Refused as error:
            raise Over(1, outcome=f"the slave's message is none: {error}") from error

    def say(self, message):
        if self.stream is None:
            self.stream = self.quic.get_next_available_stream_id()
        self.quic.send_stream_data(self.stream, messages.frame(message))
        self.transmit()

    def peer_pin(self):
        # aioquic has no public way to the certificate of the other side: this field is its own
        certificate = self.quic.tls._peer_certificate
        key = certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
        return hashlib.sha256(key).digest()


class Session:
    """From the welcome to the farewells."""

    def __init__(self, master, welcome, coupling):
        self.master, self.welcome, self.push = master, welcome, Push(welcome["state"])
        self.coupling, self.ticks = coupling, 0
        self.began = time.monotonic_ns()  # also the epoch of all stamps
        self.number = self.newest = self.newest_sent = self.newest_at = 0
        self.seen, self.last_sent, self.sequence = set(), 0, 0
        self.sent, self.received = (dict.fromkeys(KINDS.values(), 0) for _ in range(2))
        causes = ("duplicate", "too_old", "implausible", "malformed")
        self.drops = {f"datagrams_{why}": 0 for why in causes}
        causes = ("duplicate", "stale", "implausible", "rejected", "superseded", "link_stale", "answer_too_old",
                  "hand_released", "unapplied")
        self.updates = dict.fromkeys(causes, 0)
        self.far = {"number": 0, "sequence": 0}  # the last ones that were too far ahead
        self.sequences, self.applied, self.causes, self.rtt_ns = set(), [], {}, []
        self.sent_at = {}

    def now(self):
        return time.monotonic_ns() - self.began

    def take(self, data):
        """One datagram from the slave."""
        now = self.now()
        try:
            kind, fields = decode(data, "datagram", "slave")
        except Refused:
            self.drops["datagrams_malformed"] += 1
            return
        number = fields["number"]
        if number == self.far["number"] >= self.newest + 1024 or self.is_alone("number", number, self.newest):
            self.drops["datagrams_implausible"] += 1
            return
        if number + 1024 <= self.newest or number in self.seen:
            why = "too_old" if number + 1024 <= self.newest else "duplicate"
            self.drops[f"datagrams_{why}"] += 1
            return
        self.seen.add(number)
        self.received[KINDS[kind]] += 1
        if number > self.newest:
            self.newest, self.newest_sent, self.newest_at = number, fields["sent"], now
        self.take_echo(fields["echo"], now)
        if kind == "update":
            self.take_update(fields)

    def is_alone(self, what, number, newest):
        """Whether a number is implausible: so far ahead, and no other one there before."""
        before = self.far[what]
        if number < newest + 1024 or abs(number - before) < 1024:
            return False
        self.far[what] = number
        return True

    def take_echo(self, echo, now):
        if echo is None or self.sent_at.get(echo["number"]) != echo["sent"]:
            return
        rtt = now - echo["sent"] - echo["held_ns"]
        if rtt >= 0 and echo["received"] <= echo["number"]:
            self.rtt_ns.append(rtt)

    def take_update(self, update):
        sequence = update["sequence"]
        if sequence <= self.sequence:
            self.updates["duplicate" if sequence in self.sequences else "stale"] += 1
            return
        if self.is_alone("sequence", sequence, self.sequence):
            self.updates["implausible"] += 1
            return
        self.sequences.add(sequence)
        if not accepted(update["state"], self.coupling):
            self.updates["rejected"] += 1
            return
        self.sequence = sequence
        self.causes[update["cause"]] = self.causes.get(update["cause"], 0) + 1
        self.applied.append(update)
        self.push.take(update["state"], update["answers"])

    def envelope(self):
        now = self.now()
        self.number += 1
        echo = None
        if self.newest:
            echo = {"number": self.newest, "sent": self.newest_sent,
                    "held_ns": now - self.newest_at, "received": len(self.seen)}
        self.sent_at[self.number] = self.last_sent = now
        return {"number": self.number, "sent": now, "echo": echo}

    def send(self, kind, message):
        if len(message) > DATAGRAM_MAX:
            raise ValueError("longer than a datagram may be")
        self.master.quic.send_datagram_frame(message)
        self.master.transmit()
        self.sent[kind] += 1

    async def operate(self):
        """Moves the HIP, one sample a millisecond, until the push is over; then rests."""
        ticks, unsent = 0, []
        while not self.push.over or unsent:
            await asyncio.sleep(0.005)
            due = self.now() // messages.TICK_NS
            while ticks < due and not self.push.over:
                ticks += 1
                unsent.append(self.push.sample(ticks * messages.TICK_NS))
            while len(unsent) >= SAMPLES_PER_COMMAND or (unsent and self.push.over):
                block, unsent = unsent[:SAMPLES_MAX], unsent[SAMPLES_MAX:]
                self.send("commands", messages.command(self.envelope(), self.sequence, block))
        self.ticks = ticks
        rested = self.now() + REST_NS
        await self.beat_until(lambda: self.now() >= rested)

    async def beat_until(self, over):
        """Sends heartbeats and nothing else."""
        while not over():
            await asyncio.sleep(0.001)
            if self.now() - self.last_sent >= HEARTBEAT_NS:
                self.send("heartbeats", messages.heartbeat(self.envelope()))

    def farewell(self):
        udp = self.master.capture
        session = {"sent": self.sent, "received": self.received, "drops": self.drops,
                   "timing": {"ticks": self.ticks, "skipped": 0}}
        for way in ("sent", "received"):
            session[f"wire_{way}"] = {"datagrams": udp.datagrams[way], "bytes": udp.bytes[way]}
        updates = {"applied": len(self.applied), "dropped": self.updates}
        return messages.farewell({"session": session, "updates": updates})

    def document(self, theirs):
        states = [update["state"] for update in self.applied]
        return {"outcome": "finished", "welcome": self.welcome, "sent": self.sent,
                "received": self.received, **self.drops, "updates_applied": len(self.applied),
                "updates_dropped": self.updates, "causes": self.causes,
                "touched": any(update["touched_face"] != "nothing" for update in self.applied),
                "rtt_ms": min(self.rtt_ns) / 1e6 if self.rtt_ns else None,
                "last_state": states[-1] if states else None, "slave_farewell": theirs}


async def session(master, token, pin, observes):
    await master.hear()  # the handshake
    offered = master.peer_pin()
    if offered != pin:
        # before the hello: the token is for the pinned slave only
        raise Over(4, outcome="wrong_pin", offered=offered.hex())
    role, coupling, scene_hz = ((messages.OBSERVER, SOFTEST, SCENE_HZ) if observes
                                else (messages.OPERATOR, COUPLING, 0))
    master.say(messages.hello(token, role, coupling, SAMPLES_PER_COMMAND, scene_hz, START, "independent client"))
    kind, fields = await master.hear_message()
    if kind == "refused":
        raise Over(3, outcome="refused", **fields)
    asked = fields["stiffness_n_per_m"], fields["damping_ns_per_m"]
    if kind != "welcome" or asked != coupling or not accepted(fields["state"], coupling):
        raise Over(1, outcome="a welcome that must be refused", kind=kind, fields=fields)
    running = Session(master, fields, coupling)
    master.take_datagram = running.take
    if observes:
        # the slave's farewell, or the end of the connection
        await running.beat_until(lambda: not master.said.empty())
    else:
        await running.operate()
    master.say(running.farewell())
    kind, theirs = await master.hear_message()
    if kind != "farewell":
        raise Over(1, outcome=f"{kind} instead of a farewell")
    theirs["report"] = json.loads(bytes.fromhex(theirs["report"]))
    return running.document(theirs)


async def run(arguments, files):
    host, port, pin, token = pairing(arguments.pairing)
    register_congestion_control("fixed", FixedWindow)
    offers = arguments.alpn or [ALPN]
    configuration = QuicConfiguration(
        is_client=True, alpn_protocols=offers, max_datagram_frame_size=65535,
        idle_timeout=15.0, congestion_control_algorithm="fixed",
        # no chain, names or dates to check: the pin decides. The handshake's signature is verified all the same
        verify_mode=ssl.CERT_NONE,
        secrets_log_file=files.enter_context(open(arguments.keys, "w")) if arguments.keys else None)
    file = files.enter_context(open(arguments.capture, "wb")) if arguments.capture else None
    master = Master(QuicConnection(configuration=configuration), Capture(file))
    loop = asyncio.get_running_loop()
    await loop.create_datagram_endpoint(lambda: master, local_addr=("0.0.0.0", 0))
    try:
        master.connect((host, port))
        return await session(master, token, pin, arguments.observe)
    finally:
        master.close(error_code=0, reason_phrase="the session is over")
        await asyncio.wait_for(master.wait_closed(), WAIT_S)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("pairing")
    parser.add_argument("--observe", action="store_true", help="look on, until the slave ends")
    parser.add_argument("--alpn", action="append", help="offer this protocol instead; repeatable")
    parser.add_argument("--capture", help="keep the UDP datagrams here (pcap)")
    parser.add_argument("--keys", help="keep the secrets of TLS here (SSLKEYLOGFILE)")
    arguments = parser.parse_args()
    with ExitStack() as files:
        try:
            code, document = 0, asyncio.run(run(arguments, files))
        except Over as over:
            code, document = over.exit_code, over.document
        except asyncio.TimeoutError:
            code, document = 1, {"outcome": f"no answer within {WAIT_S} s"}
    print(json.dumps(document, indent=2))
    sys.exit(code)


if __name__ == "__main__":
    main()
