#!/usr/bin/env python3
"""What a run costs from Python beside the same run in Rust, in CPU time, in turns: `cost.py CONTROL`. Fails above 1.1."""

import subprocess
import sys
import time
from statistics import median

import mmt

LINK = "delay 50ms 5ms loss 1%"
SECONDS = 60
TURNS = 45
MOST = 1.1


def in_rust(control: str) -> tuple[float, str]:
    spent, digest = subprocess.run([control, str(SECONDS)], check=True, capture_output=True, text=True).stdout.split()
    return float(spent), digest


def in_python() -> tuple[float, str]:
    began = time.process_time()
    # the arrays are made in it, and the metrics
    run = mmt.run({"up": LINK, "down": LINK}, duration=SECONDS)
    digest = run.metrics["digest"]
    return time.process_time() - began, digest


def main(control: str) -> None:
    turns = []
    for turn in range(TURNS + 1):
        # nobody is always the first
        first = in_python() if turn % 2 else None
        rust, expected = in_rust(control)
        python, digest = first or in_python()
        if digest != expected:
            sys.exit("these are not the same run")
        # the first warms up
        if turn > 0:
            turns.append((rust, python))
    # a machine is now fast and now slow: both runs of a turn have the same one
    rust, python = (median(of) for of in zip(*turns))
    ratio = median(python / rust for rust, python in turns)
    print(f"A run of {SECONDS} s in virtual time, CPU time, medians of {TURNS} turns")
    print(f"  Rust      {rust:6.3f} s")
    print(f"  Python    {python:6.3f} s    {ratio:.3f} of the Rust run of the same turn, at most {MOST}")
    if ratio > MOST:
        sys.exit("FAILED: a run costs too much from Python")


if __name__ == "__main__":
    main(sys.argv[1])
