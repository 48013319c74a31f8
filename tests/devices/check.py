#!/usr/bin/env python3
"""Holds the emulated devices against clients that know nothing of mmt: the vendor's Python client and the vendor's crate.

    check.py --mmt PROGRAM --haply PROGRAM       # `.ci/devices` makes both, and a Python with HaplyHAPI

One line for each device and client: where the client sees the tool, and what its force comes to there.
"""

import argparse
import contextlib
import importlib.metadata
import json
import math
import pathlib
import signal
import subprocess
import sys
import time

from HaplyHAPI import Board, Device, Pantograph

HERE = pathlib.Path(__file__).resolve().parent
CLOCKWISE, COUNTER = 0, 1
# motors and encoders 1 and 2 as the vendor's example has them: sense, port; sense, offset, counts, port
SET_UPS = {
    2: (((COUNTER, 2), (CLOCKWISE, 1)), ((COUNTER, 241, 10752, 2), (CLOCKWISE, -61, 10752, 1))),
    3: (((COUNTER, 2), (COUNTER, 1)), ((COUNTER, 168, 4880, 2), (COUNTER, 12, 4880, 1))),
}
STARTS = {2: (0.01, 0.1), 3: (0.03, 0.08)}
FORCE = (0.75, -1.0)


class Wrong(Exception):
    """A client and an emulator disagree."""


@contextlib.contextmanager
def emulator(name, *options):
    """An emulator, where it is, and what it says at its end."""
    command = [sys.executable, "-B", str(HERE / name), "--rest", "600", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    seen = {}
    try:
        yield process.stdout.readline().split(": ")[1].strip(), seen
    finally:
        process.send_signal(signal.SIGINT)
        last = process.communicate(timeout=30)[0].strip()
        seen.update(json.loads(last))


def hold(true, what, *numbers):
    if not true:
        raise Wrong(f"{what}: {numbers}")


def said(device, client, version, place_mm, peak_n, more):
    asked = math.hypot(*FORCE)
    hold(abs(peak_n - asked) < 0.01, f"{device}, {client}: force", peak_n)
    client = f"{client} {version}"
    print(f"  {device:16}{client:17} place within {place_mm:.2f} mm, {asked:.2f} N asked for and {peak_n:.2f} N at the tool{more}")


def by_the_vendors_python(geometry):
    """The vendor's example, with a place that is known; returns the set-up as its client wrote it."""
    start = STARTS[geometry]
    options = ["--geometry", str(geometry), "--start", f"{start[0]},{start[1]}", "--goal", f"{start[0]},{start[1]}"]
    with emulator("two_diy.py", *options) as (port, seen):
        # its constructor has no use for the rate; 0 would hang up a pseudo terminal
        board = Board("check", port, 115200)
        device, arms = Device(5, board), Pantograph(geometry)
        device.set_mechanism(arms)
        motors, encoders = SET_UPS[geometry]
        for number, (sense, at) in enumerate(motors, 1):
            device.add_actuator(number, sense, at)
        for number, (sense, offset, counts, at) in enumerate(encoders, 1):
            device.add_encoder(number, sense, offset, counts, at)
        device.device_set_parameters()

        def exchange(force):
            device.set_device_torques(force)
            device.device_write_torques()
            device.device_read_data()
            return device.get_device_position(device.get_device_angles())

        place = [exchange((0.0, 0.0)) for _ in range(50)][-1]
        for _ in range(300):
            exchange(FORCE)
            time.sleep(0.001)
        exchange((0.0, 0.0))
    apart_mm = 1e3 * math.dist(place, start)
    hold(apart_mm < 0.2, "place", place, start)
    hold(not seen["refused"], "refused", seen["refused"])
    version = importlib.metadata.version("HaplyHAPI")
    said(f"2diy version {geometry}", "HaplyHAPI", version, apart_mm, seen["force_peak_n"], "")
    return seen["set_up"]


def by_mmt(mmt, geometry, set_up):
    """mmt at the same board: the same set-up, byte for byte."""
    start = STARTS[geometry]
    file = pathlib.Path(f"target/devices/device-{geometry}.toml")
    file.write_text(f'version = "{geometry}"\n')
    options = ["--geometry", str(geometry), "--start", f"{start[0]},{start[1]}", "--goal", f"{start[0]},{start[1]}"]
    with emulator("two_diy.py", *options) as (port, seen):
        document = test(mmt, "2diy", port, "--device-config", str(file))
    hold(seen["set_up"] == set_up, "set-up", seen["set_up"], set_up)
    hold(not seen["refused"], "refused", seen["refused"])
    apart_mm = 1e3 * math.dist(document["place_min_m"][:2], start)
    hold(apart_mm < 2.0, "place", document["place_min_m"], start)
    print(f"  2diy version {geometry}  mmt               set-up of {len(set_up) // 2} bytes equal to that of HaplyHAPI")


def test(mmt, device, at, *options):
    command = [mmt, "device", "test", "--device", device, "--device-at", at, "--duration", "2s", "--json", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    hold(done.returncode in (0, 1) and done.stdout, "mmt", done.stderr)
    return json.loads(done.stdout)


def by_the_vendors_crate(haply, mmt):
    start = [0.01, -0.11, 0.14]
    place = ",".join(map(str, start))
    with emulator("inverse3.py", f"--start={place}", f"--goal={place}") as (at, seen):
        done = subprocess.run([haply, at], capture_output=True, text=True, timeout=120)
        hold(done.returncode == 0, "the crate's client", done.stderr[-500:])
        found = json.loads(done.stdout.splitlines()[-1])
    hold(found["version"] == "3.5.0.0" and found["listed"] == 2, "what it found", found)
    hold(not seen["refused"], "refused", seen["refused"])
    hold(seen["force_last_n"] == [0.0, 0.0, 0.0], "last", seen["force_last_n"])
    apart_mm = 1e3 * math.dist(found["place"], start)
    hold(apart_mm < 0.2, "place", found["place"], start)
    said("inverse3", "haply", "1.3.1", apart_mm, seen["force_peak_n"], "")
    with emulator("inverse3.py", f"--start={place}", f"--goal={place}") as (at, seen):
        document = test(mmt, "inverse3", at)
    hold(math.dist(document["place_min_m"], found["place"]) < 2e-4, "places", document["place_min_m"], found["place"])
    hold(not seen["refused"], "refused", seen["refused"])
    print("  inverse3        mmt               sees the place that haply sees, within 0.2 mm")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--mmt", required=True)
    arguments.add_argument("--haply", required=True)
    arguments.add_argument("--geometry", type=int, help="only the 2DIY of this version: a process of the vendor's client has one device")
    options = arguments.parse_args()
    if options.geometry:
        by_mmt(options.mmt, options.geometry, by_the_vendors_python(options.geometry))
        return
    print("Clients of the vendor at the emulated devices", flush=True)
    by_the_vendors_crate(options.haply, options.mmt)
    for geometry in SET_UPS:
        again = [sys.executable, "-B", __file__, "--mmt", options.mmt, "--haply", options.haply, "--geometry", str(geometry)]
        sys.stdout.flush()
        subprocess.run(again, check=True)


if __name__ == "__main__":
    main()
