#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""predicted.py VERDICT...: of each verdict.json the RMSE (mm) in the bend's plane / across it, the share of all readings within
their 95 % intervals and the log density (natural, per reading, headings too), as a new insertion (all readings) and continued from
its first third (beyond it); last line: all.

    predicted.py [--plane tip.y] [--across tip.x] out/*/verdict.json
"""
import argparse
import json
import pathlib

arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
arguments.add_argument("--plane", default="tip.y", help="channel in the bend's plane")
arguments.add_argument("--across", default="tip.x", help="channel across it")
arguments.add_argument("verdicts", nargs="+", type=pathlib.Path)
given = arguments.parse_args()

counts = {}  # (model, way) -> [within, readings]
print("verdict                  model   new insertion                continued")
for path in given.verdicts:
    for model, ways in json.loads(path.read_text())["fit"]["predicted"].items():
        cells = []
        for way, figures in (("new", ways["new_insertion"]), ("continued", ways["beyond_first_third"]["continued"])):
            plane, across = (figures["channels"][channel]["rmse"] for channel in (given.plane, given.across))
            cells.append(f"{plane:.2f} / {across:.2f} ({100 * figures['share_in_95']:.0f} %) {figures['log_density']:6.2f}")
            within = counts.setdefault((model, way), [0.0, 0])
            within[0] += figures["share_in_95"] * figures["readings"]
            within[1] += figures["readings"]
        print(f"{str(path.parent):24s} {model:7s} {cells[0]:28s} {cells[1]}")
for (model, way), (within, readings) in counts.items():
    print(f"all, {model}, {way}: {100 * within / readings:.1f} % of {readings}")
