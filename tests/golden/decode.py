#!/usr/bin/env python3
"""Decodes mmt's golden vectors, from docs/protocol.md alone: it shares no code with mmt.

Reads every *.json beside it, compares each decoded field, and makes sure that each message of
must_refuse.json is refused for its reason. Prints what it checked; exit code 1 at the first difference.
Python 3.8 or later, standard library only.
"""

import json
import math
import pathlib
import struct
import sys
import unicodedata

KINDS = {1: "command", 2: "update", 3: "scene", 4: "heartbeat", 5: "tool",
         16: "hello", 17: "welcome", 18: "refused", 19: "farewell"}
SENDERS = {"command": ["master"], "update": ["slave"], "scene": ["slave"],
           "heartbeat": ["master", "slave"], "tool": ["slave"], "hello": ["master"],
           "welcome": ["slave"], "refused": ["slave"], "farewell": ["master", "slave"]}
DATAGRAM_TYPES = ["command", "update", "scene", "heartbeat", "tool"]
VERSION = 3
STATE = ["m", "b", "c", "inertia", "e", "east", "north", "west", "south",
         "x", "y", "angle", "v_x", "v_y", "omega"]


class Refused(Exception):
    """These bytes are no message. `reason` is the name that docs/protocol.md, section 7, gives it."""

    def __init__(self, reason, why):
        super().__init__(f"{reason}: {why}")
        self.reason = reason


def demand(holds, why, reason="malformed"):
    if not holds:
        raise Refused(reason, why)


class Reader:
    """Takes values from the front of a body."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        demand(self.at + count <= len(self.data), "ends too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def u8(self):
        return self.take(1)[0]

    def varint(self, bits):
        value = shift = 0
        while True:
            byte = self.u8()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                demand(byte != 0 or shift == 7, "over-long varint", "not_canonical")
                demand(value < 1 << bits, "varint beyond its type")
                return value
            demand(shift < bits, "varint too long")

    def u32(self):
        return self.varint(32)

    def u64(self):
        return self.varint(64)

    def zigzag(self, bits):
        value = self.varint(bits)
        return value >> 1 if value % 2 == 0 else -(value + 1 >> 1)

    def i32(self):
        return self.zigzag(32)

    def f64(self, field):
        value = struct.unpack("<d", self.take(8))[0]
        demand(math.isfinite(value), "float not finite", f"rule {field}")
        return value

    def energy(self):
        value = self.f64("in_j")
        demand(value >= 0, "energy below 0", "rule in_j")
        return value

    def floats(self, field, count):
        return [self.f64(field) for _ in range(count)]

    def boolean(self):
        value = self.u8()
        demand(value < 2, "truth value neither 0 nor 1")
        return value == 1

    def option(self, read):
        return read() if self.boolean() else None

    def choice(self, names):
        value = self.u32()
        demand(value < len(names), "unknown choice")
        return names[value]

    def text(self):
        raw = self.take(self.u32())
        demand(len(raw) <= 64, "text too long")
        try:
            text = raw.decode("utf-8")
        except UnicodeDecodeError as error:
            raise Refused("malformed", "not UTF-8") from error
        demand(all(unicodedata.category(c) != "Cc" for c in text), "control character")
        return text

    def numbered(self, field):
        value = self.u32()
        demand(value >= 1, "number 0", f"rule {field}")
        return value


def echo(r):
    return {"number": r.numbered("echoed number"), "sent": r.u64(), "held_ns": r.u64(), "received": r.u32()}


def envelope(r):
    return {"number": r.numbered("number"), "sent": r.u64(), "echo": r.option(lambda: echo(r))}


def in_i32(value):
    demand(-2**31 <= value < 2**31, "sample leaves 32 bits")
    return value


def samples(r):
    count = r.u32()
    demand(count >= 1, "no sample", "rule samples")
    demand(count <= 32, "more than 32 samples")
    sample = {"stamp": r.u64(), "x": r.i32(), "y": r.i32(), "force_x": r.i32(), "force_y": r.i32()}
    block = [sample]
    for _ in range(count - 1):
        ticks = r.u32()
        demand(ticks >= 1, "time stands still")
        stamp = sample["stamp"] + ticks * 1_000_000
        demand(stamp < 2**64, "stamp leaves 64 bits")
        fields = ("x", "y", "force_x", "force_y")
        sample = {"stamp": stamp, **{k: in_i32(sample[k] + r.zigzag(64)) for k in fields}}
        block.append(sample)
    return block


def state(r):
    groups = [("params", 5), ("footprint", 4), ("pose", 3), ("twist", 3)]
    return dict(zip(STATE, [value for group in groups for value in r.floats(*group)]))


def command(r):
    return {**envelope(r), "newest_update": r.u32(), "samples": samples(r),
            "port": r.option(lambda: {"in_j": r.energy()})}


def tool(r):
    return {**envelope(r), "answers": r.u64(), "force": {"x": r.i32(), "y": r.i32()},
            "in_contact": r.boolean(), "in_j": r.energy()}


def update(r):
    causes = ["deadband", "timer", "master_only_contact", "slave_only_contact", "contact_lost",
              "every_sample", "elsewhere"]
    faces = ["nothing", "east", "north", "west", "south"]
    return {**envelope(r), "sequence": r.numbered("sequence"), "cause": r.choice(causes),
            "answers": r.u64(), "touched_face": r.choice(faces), "state": state(r)}


def scene(r):
    return {**envelope(r), "answers": r.u64(), "object": r.floats("object", 3),
            "tool": r.floats("tool", 2), "force": r.floats("force", 2)}


def coupling(r):
    return {name: r.f64(name) for name in ("stiffness_n_per_m", "damping_ns_per_m")}


def claim(r):
    name = r.choice(["if_free", "resume", "take_over"])
    return {"claim": name, **({"resume": r.take(32).hex()} if name == "resume" else {})}


def hello(r):
    return {"token": r.take(32).hex(), "role": r.choice(["operator", "observer"]), **claim(r), **coupling(r),
            "samples_per_command": r.u8(), "architecture": r.choice(["mmt", "tdpa"]), "scene_hz": r.u8(),
            "hip": r.floats("hip", 2), "program": r.text()}


def welcome(r):
    fields = {**coupling(r), "friction": r.choice(["sign", "limit_surface"]),
              "smoothing": r.choice(["per_packet", "in_time"])}
    name = "lambda" if fields["smoothing"] == "per_packet" else "tau_s"
    fields[name] = r.f64(name)
    return {**fields, "correction": r.choice(["snap", "matched_stamps", "replay"]), "state": state(r),
            "tool": r.floats("tool", 2), "tool_force_max_n": r.f64("tool_force_max_n"),
            "resume": r.take(32).hex(), "scheme": r.text(), "program": r.text()}


def refused(r):
    return {"refusal": r.choice(["busy", "wrong_token", "bad_hello", "ending", "wrong_role"])}


def farewell(r):
    """The report is opaque: its bytes are for whoever prints it."""
    return {"ending": r.choice(["finished", "interrupted", "failed"]),
            "report": r.take(r.u32()).hex()}


BODIES = {"command": command, "update": update, "scene": scene, "heartbeat": envelope,
          "tool": tool, "hello": hello, "welcome": welcome, "refused": refused,
          "farewell": farewell}


def decode(data, channel, sender):
    """The type and the fields of one message; raises Refused if the bytes are none."""
    if channel == "stream":
        demand(len(data) >= 4, "no length prefix", "too_short")
        length = struct.unpack("<I", data[:4])[0]
        demand(length >= 8, "length prefix", "too_short")
        demand(length <= 4096, "length prefix", "too_long")
        data = data[4:]
        demand(len(data) == length, "length prefix does not match")
    demand(len(data) <= (1024 if channel == "datagram" else 4096), "too long", "too_long")
    demand(len(data) >= 8, "shorter than a header", "too_short")
    magic, version, number, flags = struct.unpack("<4sBBH", data[:8])
    demand(magic == b"MMTP", "other magic", "magic")
    demand(version == VERSION,
           f"the other side speaks version {version}, this side version {VERSION}", "version")
    demand(number in KINDS, "unknown type", "type")
    kind = KINDS[number]
    stopped, tool, energy = flags & 1, flags >> 1 & 3, flags >> 3
    slave = sender == "slave"
    known = energy <= slave and tool <= 2 * slave and (kind in DATAGRAM_TYPES or not flags)
    demand(known, "flags that the sender may not set", "flags")
    demand((kind in DATAGRAM_TYPES) == (channel == "datagram"), "wrong road", "road")
    demand(sender in SENDERS[kind], "wrong side", "side")
    reader = Reader(data[8:])
    fields = BODIES[kind](reader)
    demand(reader.at == len(reader.data), "bytes left after the body", "trailing")
    if stopped:
        fields["stopped"] = True
    if tool:
        fields["tool_state"] = ["nominal", "hold", "disengaged"][tool]
    if energy:
        fields["energy_holds"] = True
    return kind, fields


def same(a, b):
    """Equal, and alike in the sign of zero."""
    return json.dumps(a, sort_keys=True) == json.dumps(b, sort_keys=True)


def main():
    here = pathlib.Path(__file__).resolve().parent
    decoded = refusals = 0
    for kind in KINDS.values():
        book = json.loads((here / f"{kind}.json").read_text(encoding="utf-8"))
        for vector in book["vectors"]:
            name = f"{kind}/{vector['name']}"
            data = bytes.fromhex(vector["hex"])
            try:
                read = decode(data, book["channel"], vector["from"])
            except Refused as error:
                sys.exit(f"{name}: refused: {error}")
            if not same(read, (kind, vector["fields"])):
                sys.exit(f"{name}: decoded to\n{json.dumps(read[1])}\ninstead of\n"
                         f"{json.dumps(vector['fields'])}")
            decoded += 1
    for vector in json.loads((here / "must_refuse.json").read_text(encoding="utf-8")):
        try:
            read = decode(bytes.fromhex(vector["hex"]), vector["channel"], vector["from"])
        except Refused as refused_as:
            if refused_as.reason != vector["reason"]:
                sys.exit(f"must_refuse/{vector['name']}: {refused_as}, not {vector['reason']}")
            refusals += 1
        else:
            sys.exit(f"must_refuse/{vector['name']}: read as {read}: {vector['why']}")
    print(f"{decoded} messages decoded, {refusals} refused")


if __name__ == "__main__":
    main()
