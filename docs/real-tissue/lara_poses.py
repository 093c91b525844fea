#!/usr/bin/env python3
"""LARA's electromagnetic tip poses (lara-unb/NeedleSteering) as the CSV that docs/import/lara-em.toml reads: in the frame
of the first pose that was seen, z along the tip, -y where the needle bends; insertion = sum of the commanded steps.

    lara_poses.py OUT_FOLDER Results_150824_DC11_01.csv...      (the .json of the same name lies beside it)
"""
import csv
import json
import math
import pathlib
import sys

# From the recorded needle_N0 to the side to which the needle bends, about the tip: mean over the recordings themselves.
BEND_FROM_N0_RAD = math.radians(-98)


def axes(q):
    """Columns: the sensor's axes in the tracker's frame (the file's quaternion is the inverse rotation)."""
    size = math.sqrt(sum(v * v for v in q))
    w, x, y, z = (v / size for v in q)
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))


def convert(source, target):
    normal = json.loads(source.with_suffix(".json").read_text())["needle_N0"]
    bend = math.atan2(normal[1], normal[0]) + BEND_FROM_N0_RAD
    inserted_mm, first, rows = 0.0, None, []
    for row in csv.DictReader(source.open()):
        if row["phase"] != "fw":
            continue
        position = [float(row[c]) for c in ("x_mm", "y_mm", "z_mm")]
        if any(position):
            if first is None:
                first = position, axes([float(row[c]) for c in ("qw", "qx", "qy", "qz")]), inserted_mm
            step = [p - o for p, o in zip(position, first[0])]
            u, v, w = (sum(a * s for a, s in zip(axis, step)) for axis in first[1])
            rows.append((-u * math.sin(bend) + v * math.cos(bend), -u * math.cos(bend) - v * math.sin(bend), w,
                         inserted_mm - first[2]))
        inserted_mm += float(row["cmd_step_mm"] or 0)
    with target.open("w") as out:
        out.write("x_mm,y_mm,z_mm,insertion_mm\n")
        out.writelines(",".join(f"{v:.4f}" for v in row) + "\n" for row in rows)


if len(sys.argv) < 3:
    sys.exit(__doc__)
folder = pathlib.Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
for name in map(pathlib.Path, sys.argv[2:]):
    convert(name, folder / name.name)
