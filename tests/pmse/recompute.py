#!/usr/bin/env python3
"""Recomputes the metrics of fig5.csv from the forces in samples/, with nothing but (13)-(15).

usage: recompute.py DIR

DIR is what `mmt reproduce fig5 --samples --out DIR` wrote. Every row of fig5.csv is compared with what its
samples say; the tolerance is 1e-9 of max(|value|, 1). Prints the number of rows and the largest difference;
exit code 1 if a row differs or a file is missing. Needs Python 3.8 and no package.
"""

import csv
import math
import sys
from pathlib import Path

F_MIN = 0.04  # N, section IV-B
TOLERANCE = 1e-9


def mean(values):
    return math.fsum(values) / len(values) if values else None


def metrics(rows):
    """PMSE and its kin from rows of (fs_x, fs_y, fm_x, fm_y), N."""
    logs = {"x": [], "y": [], "magnitude": []}
    error2, measured2, outside, contact = [], [], 0, 0
    for sx, sy, mx, my in rows:
        s, m = math.hypot(sx, sy), math.hypot(mx, my)
        for axis, f_s, f_m in (("x", abs(sx), abs(mx)), ("y", abs(sy), abs(my)), ("magnitude", s, m)):
            if f_s > F_MIN and f_m > F_MIN:
                logs[axis].append(math.log(f_s / f_m) ** 2)
        if s > F_MIN or m > F_MIN:
            contact += 1
            error2.append((sx - mx) ** 2 + (sy - my) ** 2)
            measured2.append(s * s)
            outside += math.sqrt(error2[-1]) > 0.07 * s
    pmse = {axis: mean(values) for axis, values in logs.items()}
    axes = [value for value in (pmse["x"], pmse["y"]) if value is not None]
    return {
        "pmse": sum(axes) if axes else None,
        "pmse_x": pmse["x"],
        "pmse_y": pmse["y"],
        "pmse_magnitude": pmse["magnitude"],
        "relative_error": math.sqrt(math.fsum(error2) / math.fsum(measured2)) if any(measured2) else None,
        "jnd7_share": outside / contact if contact else None,
    }


def number(text):
    return float(text) if text else None


def samples(path):
    """Forces of the samples whose f_m is known, the number of updates, the number of samples."""
    forces, updates, count = [], 0, 0
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            count += 1
            updates += int(row["update"])
            if row["fm_x_n"]:
                forces.append(tuple(float(row[key]) for key in ("fs_x_n", "fs_y_n", "fm_x_n", "fm_y_n")))
    return forces, updates, count


def main():
    folder = Path(sys.argv[1])
    worst, rows = 0.0, 0
    with open(folder / "fig5.csv", newline="") as file:
        for row in csv.DictReader(file):
            name = "{mode}{{}}-{scheme}-{t_update_ms}-{deadband}-{seed}.csv".format(**row)
            own = {"paper": "touch", "recommended": "vision"}[row["mode"]]
            name = name.format("" if row["sensing"] == own else "-" + row["sensing"])
            forces, updates, count = samples(folder / "samples" / name)
            found = metrics(forces)
            found["packet_rate_hz"] = updates / (count * 1e-3)
            found["duration_s"] = count * 1e-3
            for key, value in found.items():
                told = number(row[key])
                if (told is None) != (value is None):
                    sys.exit(f"{name}: {key} is {told} in fig5.csv and {value} in the samples")
                if value is None:
                    continue
                difference = abs(told - value) / max(abs(value), 1.0)
                worst = max(worst, difference)
                if difference > TOLERANCE:
                    sys.exit(f"{name}: {key} is {told} in fig5.csv and {value} in the samples")
            rows += 1
    if rows == 0:
        sys.exit("fig5.csv has no rows")
    print(f"{rows} rows, largest difference {worst:.1e}")


main()
