#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""LARA's electromagnetic tip poses (lara-unb/NeedleSteering) as the CSV that docs/import/lara-em.toml reads: in the frame
of the first pose that was seen, z along the tip, -y where the needle bends.

    lara_poses.py [--turned-first] OUT_FOLDER Results_150824_DC11_01.csv...   (the .json of the same name lies beside it)

Half of the duty's share of a step goes in with the bevel turned over, in pieces of the length that the file has beside the
duty (minimum_insertion), and the needle is turned at rest: rows of the base alone. Whether a turned piece comes before or
after its part of the step is not in the files; here after, with --turned-first before.
"""
import argparse
import csv
import json
import math
import pathlib
import sys

# From the recorded needle_N0 to the side to which the needle bends, about the tip: mean over the recordings themselves.
BEND_FROM_N0_RAD = math.radians(-98)
FLIPS = 2  # duty_cycle_method
COLUMNS = ("x_mm", "y_mm", "z_mm", "heading_x", "heading_y", "heading_z", "insertion_mm", "rotation_rad")


def axes(q):
    """Rows: the sensor's axes in the tracker's frame (the file's quaternion is the inverse rotation)."""
    size = math.sqrt(sum(v * v for v in q))
    w, x, y, z = (v / size for v in q)
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))


def in_first(first_axes, bend, vector):
    u, v, w = (sum(a * s for a, s in zip(axis, vector)) for axis in first_axes)
    return (-u * math.sin(bend) + v * math.cos(bend), -u * math.cos(bend) - v * math.sin(bend), w)


def way(inserted_mm, step_mm, duty, piece_mm, turned_first):
    """Places of the base within a step."""
    pieces = round(duty * step_mm / 2 / piece_mm) if duty > 0 else 0
    places = []
    for i in range(pieces):
        start, end = (inserted_mm + step_mm * share / pieces for share in (i, i + 1))
        if turned_first:
            places += [(start, math.pi), (start + piece_mm, math.pi), (start + piece_mm, 0.0), (end, 0.0)]
        else:
            places += [(end - piece_mm, 0.0), (end - piece_mm, math.pi), (end, math.pi), (end, 0.0)]
    return places or [(inserted_mm + step_mm, 0.0)]


def convert(source, target, turned_first):
    about = json.loads(source.with_suffix(".json").read_text())
    methods = about.get("duty_cycle_method") or [FLIPS]
    if methods[0] != FLIPS or any(about.get("interstep_rotation") or []):
        sys.exit(f"{source}: duty_cycle_method {methods[0]}, or turns between the steps; only flips are understood")
    normal = about["needle_N0"]
    bend = math.atan2(normal[1], normal[0]) + BEND_FROM_N0_RAD
    first, rows, inserted_mm = None, [], 0.0
    for row in csv.DictReader(source.open()):
        if row["phase"] != "fw":
            continue
        position = [float(row[c]) for c in ("x_mm", "y_mm", "z_mm")]
        if any(position):
            now = axes([float(row[c]) for c in ("qw", "qx", "qy", "qz")])
            if first is None:
                first = position, now, inserted_mm
            tip = in_first(first[1], bend, [p - o for p, o in zip(position, first[0])])
            heading = in_first(first[1], bend, now[2])
            rows.append((*tip, *heading, inserted_mm - first[2], 0.0))
        step_mm = float(row["cmd_step_mm"] or 0)
        if first is not None and step_mm:
            places = way(inserted_mm, step_mm, float(row["cmd_duty"]), float(row["cmd_rot_or_min_ins"]), turned_first)
            rows += [(*6 * ("",), base_mm - first[2], turn) for base_mm, turn in places]
        inserted_mm += step_mm
    with target.open("w") as out:
        out.write(",".join(COLUMNS) + "\n")
        out.writelines(",".join(v if v == "" else f"{v:.6f}" for v in row) + "\n" for row in rows)


options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--turned-first", action="store_true")
options.add_argument("out", type=pathlib.Path)
options.add_argument("poses", type=pathlib.Path, nargs="+")
chosen = options.parse_args()
chosen.out.mkdir(parents=True, exist_ok=True)
for name in chosen.poses:
    convert(name, chosen.out / name.name, chosen.turned_first)
