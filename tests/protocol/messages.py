"""Writes mmt's messages by what docs/protocol.md says, and nothing else: it shares no code with mmt.

Reading is the business of tests/golden/decode.py, which goes by the same page.
Must never write what that decoder would refuse. Python 3.10 or later, standard library only.
"""

import json
import struct

VERSION = 3
COMMAND, HEARTBEAT, HELLO, FAREWELL = 1, 4, 16, 19
OPERATOR, OBSERVER = 0, 1
TICK_NS = 1_000_000


def u32(value):
    return varint(value, 32)


def u64(value):
    return varint(value, 64)


def varint(value, bits):
    if not 0 <= value < 1 << bits:
        raise ValueError(f"{value} does not fit u{bits}")
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def zigzag(value):
    return u64(2 * value if value >= 0 else -2 * value - 1)


def f64(*values):
    return struct.pack(f"<{len(values)}d", *values)


def text(value):
    raw = value.encode()
    return u32(len(raw)) + raw


def option(value, write):
    return b"\0" if value is None else b"\1" + write(value)


def header(kind):
    return struct.pack("<4sBBH", b"MMTP", VERSION, kind, 0)


def frame(message):
    """A message as it stands on the stream: behind its length."""
    return struct.pack("<I", len(message)) + message


def envelope(fields):
    def echo(e):
        return u32(e["number"]) + u64(e["sent"]) + u64(e["held_ns"]) + u32(e["received"])

    return u32(fields["number"]) + u64(fields["sent"]) + option(fields["echo"], echo)


def heartbeat(fields):
    return header(HEARTBEAT) + envelope(fields)


def command(fields, newest_update, samples):
    """`samples`: dicts as the decoder makes them, oldest first. The hand feels no tool, so there is no port."""
    out = header(COMMAND) + envelope(fields) + u32(newest_update) + u32(len(samples))
    keys = ("x", "y", "force_x", "force_y")
    before = None
    for sample in samples:
        if before is None:
            out += u64(sample["stamp"]) + b"".join(zigzag(sample[key]) for key in keys)
        else:
            ticks, rest = divmod(sample["stamp"] - before["stamp"], TICK_NS)
            if rest or ticks < 1:
                raise ValueError("samples off the grid of 1 ms")
            out += u32(ticks) + b"".join(zigzag(sample[key] - before[key]) for key in keys)
        before = sample
    return out + option(None, f64)


def hello(token, role, coupling, samples_per_command, scene_hz, hip, program):
    if_free, mmt = u32(0), u32(0)
    return (header(HELLO) + token + u32(role) + if_free + f64(*coupling) + bytes([samples_per_command])
            + mmt + bytes([scene_hz]) + f64(*hip) + text(program))


def farewell(report):
    """A finished session. `report`: what the document names, as a dict."""
    finished, raw = u32(0), json.dumps(report).encode()
    return header(FAREWELL) + finished + u32(len(raw)) + raw
