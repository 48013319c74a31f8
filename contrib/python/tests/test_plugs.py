"""What `mmt.Device` and `mmt.Plant` promise: at the programs, beside the clients of `contrib` that use bare sockets."""

import json
import pathlib
import re
import socket
import struct
import subprocess
import sys
import threading
import time

import pytest

import mmt

CONTRIB = pathlib.Path(__file__).parents[2]
DOCUMENT = CONTRIB.parent / "docs" / "python.md"
HEAD = struct.Struct("<4sBBHIIQ16s")
TOKEN = "5a" * 16


@pytest.fixture
def contrib(monkeypatch):
    """The modules of `contrib`."""
    monkeypatch.syspath_prepend(str(CONTRIB))
    import hand
    import plant

    return hand, plant


class Program:
    """A running `mmt`, whose lines are read until some begin with what is waited for."""

    def __init__(self, *command):
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdout=pipe, stderr=subprocess.STDOUT, text=True, stdin=subprocess.DEVNULL)
        self.lines = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()

    def line(self, words):
        for line in self.process.stdout:
            self.lines.append(line)
            if line.startswith(words):
                return line.removeprefix(words).strip() if words.endswith(" ") else line.strip()
        pytest.fail(f"no line begins with {words}: {self.lines}")

    def document(self):
        """The JSON at the end of what it prints."""
        text = "".join(self.lines) + self.process.communicate(timeout=120)[0]
        assert self.process.returncode == 0, text
        return json.loads(text[text.index("\n{\n") :])


def in_the_background(call, *arguments):
    threading.Thread(target=call, args=arguments, daemon=True).start()


def test_a_plant_of_the_package_gives_the_bits_of_the_bare_socket(program, contrib):
    _, plant = contrib
    found = []
    for client in (plant.Plant, mmt.Plant):
        with Program(program, "bench", "plant", "--plant", "link", "--duration", "6s", "--json") as bench:
            plugged = client(bench.line("plant: "))
            in_the_background(plant.serve, plugged, plant.Block(), 60.0)
            found.append(bench.document())
            assert plugged.received >= 6000
    assert found[0] == found[1]
    assert found[0]["contact_s"] > 0.5


def test_a_hand_of_the_package_pushes_the_box(program, contrib, tmp_path, monkeypatch, capsys):
    hand, _ = contrib
    monkeypatch.setattr(hand, "Device", mmt.Device)
    identity = str(tmp_path / "identity")
    # it is real time: a machine that stands still for a second ends the session
    for _ in range(5):
        with Program(program, "slave", "--listen", "127.0.0.1:0", "--once", "--identity", identity) as slave:
            pairing = slave.line("mmt://")
            with Program(program, "master", pairing, "--device", "link") as master:
                address = master.line("device: ")
                monkeypatch.setattr(sys, "argv", ["hand.py", address, "--way", "0.4"])
                hand.main()
                pushed = json.loads(capsys.readouterr().out)
        if pushed["contact_s"] > 0.3:
            break
    assert pushed["contact_s"] > 0.3, pushed
    assert 0.5 < pushed["force_peak_n"] <= 8.0, pushed
    assert pushed["received"] > 1000 and pushed["hip_to_m"][0] - pushed["hip_from_m"][0] > 0.25, pushed


def test_the_wall_and_the_hand_of_the_document_meet(program, tmp_path, capsys):
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT.read_text(), re.DOTALL | re.MULTILINE)
    names: dict[str, object] = {"mmt": mmt}
    exec(next(example for example in examples if "def wall" in example), names)
    identity = str(tmp_path / "identity")
    for _ in range(5):
        with Program(program, "slave", "--listen", "127.0.0.1:0", "--once", "--plant", "link", "--identity", identity) as slave:
            in_the_background(names["wall"], slave.line("plant: "))
            with Program(program, "master", slave.line("mmt://"), "--device", "link") as master:
                names["hand"](master.line("device: "))
        force = eval(capsys.readouterr().out)
        if force[0] < -1.0:
            break
    # it pushes the hand back
    assert -8.0 <= force[0] < -1.0 and abs(force[1]) < 1.0, force


@pytest.fixture
def bound():
    """A socket in the place of mmt, and its address."""
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", 0))
    end.settimeout(10.0)
    yield end, f"udp://127.0.0.1:{end.getsockname()[1]}?token={TOKEN}"
    end.close()


def force(sequence, *, kind=2, token=TOKEN, x=1.5, length=64):
    head = HEAD.pack(b"MMTL", 1, kind, 3, sequence, 7, 0, bytes.fromhex(token))
    return (head + struct.pack("<6f", x, 0.25, 0.0, -0.5, 0.125, 2.0))[:length]


def test_packets_are_those_of_the_document(bound):
    end, address = bound
    device = mmt.Device(address)
    device.send((0.5, -0.25, 0.125), (1.0, 2.0, 3.0), buttons=5, stamp_ns=77)
    packet, there = end.recvfrom(256)
    assert HEAD.unpack_from(packet) == (b"MMTL", 1, 1, 5, 1, 0, 77, bytes.fromhex(TOKEN))
    assert struct.unpack_from("<6f", packet, 40) == (0.5, -0.25, 0.125, 1.0, 2.0, 3.0) and len(packet) == 64
    plant = mmt.Plant(address)
    plant.answer((1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (7.0, 8.0, 9.0), 0.5)
    packet, plugged = end.recvfrom(256)
    assert HEAD.unpack_from(packet)[:6] == (b"MMTL", 1, 4, 1, 1, 0) and len(packet) == 120
    assert struct.unpack_from("<10d", packet, 40) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 0.5)
    # two commands at once, of which one was lost between: the newest counts, and all the periods
    for sequence in (4, 6):
        head = HEAD.pack(b"MMTL", 1, 3, 3, sequence, 1, 0, bytes.fromhex(TOKEN))
        end.sendto(head + struct.pack("<10d", sequence, 0.5, 0.1, 0.2, 700.0, 30.0, 15.0, 0, 0, 0), plugged)
    command = plant.command(1.0)
    assert (command.tool, command.velocity, command.stiffness, command.damping) == ((6.0, 0.5), (0.1, 0.2), 700.0, 30.0)
    assert (command.force_max, command.begins, command.held, command.periods) == (15.0, True, False, 3)
    assert (plant.received, plant.lost, plant.command(0.0)) == (2, 1, None)


def test_a_command_that_comes_late_or_twice_is_answered_and_takes_nothing_back(bound, contrib):
    end, address = bound
    for client in (contrib[1].Plant, mmt.Plant):
        plant = client(address)
        plant.answer((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
        _, plugged = end.recvfrom(256)
        found = []
        for sequences in ((2**32 - 2, 2**32 - 1), (2**32 - 2,), (2**32 - 1,), (1, 2**32 - 1), (2,)):
            for sequence in sequences:
                head = HEAD.pack(b"MMTL", 1, 3, 1, sequence, 1, 0, bytes.fromhex(TOKEN))
                end.sendto(head + struct.pack("<10d", sequence % 7, 0.5, 0.1, 0.2, 700.0, 30.0, 15.0, 0, 0, 0), plugged)
            threading.Event().wait(0.02)
            command = plant.command(1.0)
            found.append((command.tool[0], command.periods))
        newest = (2**32 - 1) % 7
        assert found == [(newest, 2), (newest, 0), (newest, 0), (1, 2), (2, 1)], client


def test_a_plant_waits_where_nobody_is_any_more(bound, contrib):
    end, address = bound
    for client in (contrib[1].Plant, mmt.Plant):
        plant = client(address)
        end.close()
        began = time.monotonic()
        for _ in range(3):
            plant.answer((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
            assert plant.command(0.05) is None
        assert time.monotonic() - began > 0.14, client


def test_what_no_master_sent_moves_nobody(bound):
    end, address = bound
    device = mmt.Device(address)
    assert (device.receive(), device.state) == ((0.0, 0.0, 0.0), 0)
    device.send((0.0, 0.0, 0.0))
    _, there = end.recvfrom(256)
    for packet in (b"hello", force(1, kind=3), force(1, token="00" * 16), force(1, length=63), force(1) + b"0"):
        end.sendto(packet, there)
    assert device.receive() == (0.0, 0.0, 0.0) and device.received == 0
    # the numbers go round, and one that comes late is left out
    for sequence, x in ((2**32 - 1, 1.0), (2, 2.0), (1, 3.0)):
        end.sendto(force(sequence, x=x), there)
    assert device.receive() == (2.0, 0.25, 0.0)
    assert (device.hip, device.state, device.lost_up, device.lost_down) == ((-0.5, 0.125), 3, 2, 2)
    threading.Event().wait(0.05)
    assert (device.receive(), device.state) == ((0.0, 0.0, 0.0), 0)


def test_bad_input_is_refused_in_words(bound):
    _, address = bound
    for wrong in ("", "mmt://127.0.0.1:1?token=" + TOKEN, "udp://127.0.0.1:1"):
        with pytest.raises(ValueError, match="mmt prints one") as refused:
            mmt.Device(wrong)
        assert TOKEN not in str(refused.value)
    with pytest.raises(ValueError, match="32 hexadecimal digits"):
        mmt.Plant("udp://127.0.0.1:1?token=5a")
    with pytest.raises(OSError, match="127.0.0.1:99999"):
        mmt.Plant(f"udp://127.0.0.1:99999?token={TOKEN}")
    with pytest.raises(ValueError, match="position is .*NaN.*finite"):
        mmt.Device(address).send((float("nan"), 0.0, 0.0))
    with pytest.raises(ValueError, match="force is"):
        mmt.Plant(address).answer((0.0, 0.0), (0.0, 0.0), (float("inf"), 0.0))
    with pytest.raises(ValueError, match="wait_s is -1"):
        mmt.Plant(address).command(-1.0)
    with pytest.raises(ValueError):
        mmt.Device(address).send((0.0, 0.0))
