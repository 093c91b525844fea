#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs bevel-diagnose over every case there is and checks the invariants of its verdicts in verdict.json.

Usage: check_verdicts.py BIN SOURCE SHARED [CASE ...]
  BIN     folder of the executables
  SOURCE  the project's source tree
  SHARED  folder with recordings/practice, recordings/varied and real/lisa/sealed; what is missing is skipped, and said
  CASE    names of cases to run, as printed ("practice/case04"); default: all
Exit status: 0 all invariants hold, 1 one is broken, 77 no case was found.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

LEAST_LOG_BAYES_FACTOR = -8  # per size: what its prior costs if the standard error is a thousandth of its scale
STRAIGHT = """[needle]
curvature_per_mm = 0.001
wheelbase_mm = 20
lambda1_per_rad = 0.49
lambda2 = 0.22
slip = "isotropic"
front_wheel = "published"
"""


def violations(verdict):
    """One sentence for each invariant that the verdict breaks."""
    out = []
    named = verdict["effects"] + verdict.get("changes", [])
    inconclusive = verdict["verdict"] == "inconclusive"
    if inconclusive and named:
        out.append("inconclusive, and an effect is named")
    if inconclusive and not verdict["reasons"]:
        out.append("inconclusive without a reason")
    if not inconclusive and verdict["posterior"]["not_fitted"] > 0.1:
        out.append(f"{verdict['posterior']['not_fitted']:.2f} of the probability is in models that were not fitted")
    for effect in named:
        name = effect["name"]
        joint = effect["joint_probability"] if effect["ambiguous_with"] else effect["probability"]
        if joint < 0.5:
            out.append(f"{name} has a probability of {joint:.2g}")
        if effect["log_bayes_factor"] is not None and effect["log_bayes_factor"] <= 0:
            out.append(f"{name} has a log Bayes factor of {effect['log_bayes_factor']:.1f}")
        sizes = [p for p in effect["parameters"].values() if p["none"] is not None]
        if sizes and not any(None not in p["ci95"] and (p["ci95"][0] > p["none"] or p["ci95"][1] < p["none"])
                             for p in sizes):
            out.append(f"the interval of the size of {name} includes no effect")
    for one in verdict["tried"] + verdict["tried_beside"]:
        factor, sizes = one["log_bayes_factor"], max(1, len(one["parameters"]))
        if one["fitted"] and factor is not None and factor < LEAST_LOG_BAYES_FACTOR * sizes:
            out.append(f"{one['name']} in addition to {one['beside'] or 'nothing'} has a log Bayes factor of {factor:.1f}")
    if not inconclusive and verdict["probability"] >= 0.99 and verdict["next_experiment"] != "none needed":
        out.append("a next experiment at a probability of 99 %")
    gains = [r["predicted"]["after"]["new_insertion"]["log_density"] -
             r["predicted"]["before"]["new_insertion"]["log_density"] for r in verdict["fit"]["recordings"].values()
             if None not in (r["predicted"]["after"]["new_insertion"]["log_density"],
                             r["predicted"]["before"]["new_insertion"]["log_density"])]
    if named and len(gains) > 1:
        mean = sum(gains) / len(gains)
        error = (sum((g - mean) ** 2 for g in gains) / (len(gains) - 1) / len(gains)) ** 0.5
        if mean < -error:
            out.append(f"left-out recordings are predicted worse by {-mean:.3f} (standard error {error:.3f})")
    return out


def cases(binaries, source, shared, scratch):
    """Names of cases, each with the arguments of bevel-diagnose."""
    for folder in ("recordings/practice", "recordings/varied"):
        for model in sorted((shared / folder).glob("*/model.toml")):
            yield f"{folder.split('/')[1]}/{model.parent.name}", ["-m", model, *sorted(model.parent.glob("*.lcm"))]
    for model in sorted((source / "examples").glob("*/model.toml")):
        yield f"examples/{model.parent.name}", ["-m", model, *sorted(model.parent.glob("*.lcm"))]
    straight = scratch / "straight.toml"
    straight.write_text(STRAIGHT)
    for case in sorted((shared / "real/lisa/sealed").glob("case*")):
        groups = []
        for group, option in (("before", "--baseline"), ("after", "--changed")):
            out = scratch / case.name / group
            subprocess.run([binaries / "bevel-import", "-c", source / "docs/import/lisa.toml", "-o", out,
                            *sorted((case / group).iterdir())], check=True, capture_output=True)
            groups += [option, *sorted(out.glob("*.lcm"))]
        yield f"lisa/{case.name}", ["-m", straight, *groups]


def main():
    binaries, source, shared = (pathlib.Path(p).resolve() for p in sys.argv[1:4])
    wanted, count, broken = sys.argv[4:], 0, 0
    for folder in ("recordings/practice", "recordings/varied", "real/lisa/sealed"):
        if not (shared / folder).exists():
            print(f"skipped: {shared / folder} does not exist")
    with tempfile.TemporaryDirectory() as scratch:
        for name, arguments in cases(binaries, source, shared, pathlib.Path(scratch)):
            if wanted and name not in wanted:
                continue
            out = pathlib.Path(scratch) / "verdict"
            done = subprocess.run([binaries / "bevel-diagnose", "-q", "--targets", "0", "-o", out, *arguments],
                                  capture_output=True, text=True, check=False)
            count += 1
            if done.returncode not in (0, 3):
                faults, kind = [done.stderr.strip() or f"exit status {done.returncode}"], "failed"
            else:
                verdict = json.loads((out / "verdict.json").read_text())
                faults, kind = violations(verdict), verdict["verdict"]
            broken += bool(faults)
            print(f"{name}: {kind}" + "".join(f"\n  {fault}" for fault in faults), flush=True)
    print(f"{count} cases, {broken} with a broken invariant")
    sys.exit(77 if count == 0 else int(broken > 0))


main()
