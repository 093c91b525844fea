#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""implants.py SET OUT [--seed N]: a set of repeated insertions (csv), split in two at random: OUT/none/before and /after, and
OUT/CHANGE/after, the same second half with a change put in by arithmetic on its rows; OUT/CHANGE/before is the first half.

The depth of a row is its own z. The needle bends toward -y; "curvature" changes the parabola that the second half bends by on
average beyond a straight line (least squares of y on 1, z, z^2).
"""
import argparse
import csv
import math
import pathlib
import random

# Of a row at depth z (mm): added to x, y (mm), then to the heading's x, y (rad). k: curvature of the mean parabola (1/mm).
CHANGES = {
    "none": lambda z, k: (0, 0, 0, 0),
    "entry_angle": lambda z, k: (0.03 * z, 0, 0.03, 0),
    "heading_turned": lambda z, k: (0, 0, 0.03, 0),
    "sideways_path": lambda z, k: (0, -0.025 * z, 0, 0),
    "shift": lambda z, k: (1.2, -0.6, 0, 0),
    "lengths": None,  # all three by 4 %
    "bend_across": lambda z, k: (0.5 * 0.0004 * z * z, 0, 0.0004 * z, 0),
    "curvature_quarter": lambda z, k: (0, 0.5 * 0.25 * k * z * z, 0, 0.25 * k * z),
    "curvature_from_45mm": lambda z, k: (0, 0.5 * 0.8 * k * max(z - 45, 0) ** 2, 0, 0.8 * k * max(z - 45, 0)),
    "wave": lambda z, k: (0.6 * math.sin(2 * math.pi * z / 50), 0, 0.6 * 2 * math.pi / 50 * math.cos(2 * math.pi * z / 50), 0),
    "drift_from_50mm": lambda z, k: (0.03 * max(z - 50, 0), 0, 0, 0),
}  # fmt: skip


def read(path):
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return [{name: float(value) for name, value in row.items()} for row in rows]


def mean_curvature(recordings):
    """Twice the factor of z^2 in y."""
    sums = [0.0] * 5
    pulls = [0.0] * 3
    for row in (row for rows in recordings for row in rows):
        z, y = row["tip_z_mm"] / 100, row["tip_y_mm"]
        for power in range(5):
            sums[power] += z**power
        for power in range(3):
            pulls[power] += y * z**power
    matrix = [[sums[i + j] for j in range(3)] + [pulls[i]] for i in range(3)]
    for i in range(3):  # positive definite: no pivots needed
        for j in range(i + 1, 3):
            share = matrix[j][i] / matrix[i][i]
            matrix[j] = [b - share * a for a, b in zip(matrix[i], matrix[j])]
    return 2 * matrix[2][3] / matrix[2][2] / 100**2


def changed(row, change, curvature):
    out = dict(row)
    if change == "lengths":
        for axis in "xyz":
            out[f"tip_{axis}_mm"] *= 1.04
        return out
    x, y, about_y, about_x = CHANGES[change](row["tip_z_mm"], curvature)
    out["tip_x_mm"] += x
    out["tip_y_mm"] += y
    heading = [row["heading_x"] + about_y, row["heading_y"] + about_x, row["heading_z"]]
    size = math.sqrt(sum(h * h for h in heading))
    out.update(zip(("heading_x", "heading_y", "heading_z"), (h / size for h in heading)))
    return out


def write(path, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: f"{value:.6f}" for name, value in row.items()} for row in rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", choices=sorted(CHANGES), default=list(CHANGES))
    given = parser.parse_args()
    files = sorted(given.set.glob("*.csv"))
    random.Random(given.seed).shuffle(files)
    before, after = sorted(files[: len(files) // 2]), sorted(files[len(files) // 2 :])
    recordings = {path: read(path) for path in files}
    curvature = mean_curvature([recordings[path] for path in after])
    for change in given.only:
        for path in before:
            write(given.out / change / "before" / path.name, recordings[path])
        for path in after:
            write(given.out / change / "after" / path.name, [changed(row, change, curvature) for row in recordings[path]])


if __name__ == "__main__":
    main()
