# SPDX-License-Identifier: MIT
"""Runs bevel-diagnose and its peers on the same cases and compares them; tests/peers/compare sets up what it needs.

A case is a folder with model.toml and logs. Everybody gets these and nothing else. Of the logs the peers get the
readings that are no spikes; bevel-diagnose gets them all and judges outliers itself. Each task has one thread;
seconds are of the processor, so that a busy machine does not count.
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import platform
import resource
import subprocess
import sys
import time

import numpy as np

import noise
import page
from recordings import read_case

VISIBLE_SIGMAS = 5.0
PEERS = ("model refitted", "sindy", "gp", "bic white", "bic AR(1)")


def arguments():
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(prog="compare", description=__doc__)
    parser.add_argument("folder", type=pathlib.Path, help="one folder per case in it, model.toml and logs in each")
    parser.add_argument("--out", type=pathlib.Path, default=root / "out/peers", help="for all results")
    parser.add_argument("--program", type=pathlib.Path, default=root / "build/bin/bevel-diagnose")
    parser.add_argument("--truth", type=pathlib.Path,
                        help="list of truths, or the folder sealed/ of a blind trial; default: FOLDER/truth.json")
    parser.add_argument("--cases", help="some of them: case02,case11")
    parser.add_argument("--keep", action="store_true", help="go on with what --out holds already")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--page", type=pathlib.Path, help="page to put the tables into; picture and JSON go beside it")
    return parser.parse_args()


def name_of(folder):
    """A blind trial keeps its logs in tNNNN/case."""
    return folder.parent.name if folder.name == "case" else folder.name


def clean(folder):
    """The case without outliers, and their share."""
    from trajectory_fit import Problem

    case = read_case(folder)
    problem = Problem(case, coloured=False)
    dropped = noise.outliers(problem.errors(problem.null()))
    case.recordings = [r.without(d) for r, d in zip(case.recordings, dropped)]
    return case, float(np.concatenate(dropped).mean())


def diagnose(folder, options):
    out = options.out / name_of(folder)
    timed = out / "seconds.json"
    if options.keep and timed.exists():
        return {"verdict": json.loads((out / "verdict.json").read_text()), "seconds": json.loads(timed.read_text())}
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [options.program, "--quiet", "--threads", "1", "--model", folder / "model.toml", "--out", out]
    done = subprocess.run([*command, *sorted(folder.glob("*.lcm"))], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"compare: bevel-diagnose on {folder}: {done.stderr.strip()}")
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    timed.write_text(json.dumps(seconds))
    return {"verdict": json.loads((out / "verdict.json").read_text()), "seconds": seconds}


def run_peer(folder, peer):
    """Method -> {"names", "errors", "seconds", ...}; and the stamps of the readings the errors are of."""
    import bic
    import gaussian_process
    import sindy
    from trajectory_fit import Problem

    case, outlier_share = clean(folder)
    began = time.process_time()
    if peer == "model refitted":
        problem = Problem(case, coloured=False)
        null = problem.null()
        results = {peer: {"names": [], "errors": problem.held_out(null), "outlier_share": outlier_share,
                          "noise": null.noise}}  # fmt: skip
    elif peer == "sindy":
        results = {f"sindy {rule}": result for rule, result in sindy.run(case).items()}
    elif peer == "gp":
        results = {peer: gaussian_process.run(case)}
    else:
        results = {peer: bic.run(case, coloured=peer == "bic AR(1)")}
    seconds = time.process_time() - began
    for result in results.values():
        result["seconds"] = seconds
    return results, [r.tip_s for r in case.recordings]


def warm_up(folder):
    """Numba compiles once, into its cache, before anything is timed."""
    run_peer(folder, "model refitted")


def read_truths(path):
    """Case -> truth, of a list in one file, or of bevel-blindtrial's folder of opened truths."""
    if path.is_dir():
        return {p.stem: json.loads(json.loads(p.read_text())["truth"]) for p in sorted(path.glob("*.json"))}
    return {t["case"]: t for t in json.loads(path.read_text())} if path.exists() else {}


def right_names(truth):
    if "expected" in truth:  # bevel-blindtrial says itself what is right to name
        return sorted(truth["expected"])
    if truth.get("visible_sigmas", np.inf) < VISIBLE_SIGMAS:
        return []
    return sorted(e["name"] for e in truth["effects"])


def row_path(folder, options):
    return options.out / f"{name_of(folder)}.json"


def score_verdict(found):
    verdict = found["verdict"]
    after = verdict["fit"]["after"]
    names = sorted(e["name"] for e in verdict["effects"])
    if verdict["verdict"] == "unknown-effect":
        names = sorted([*names, "unknown"])
    return {"names": names, "seconds": found["seconds"], "rmse_mm": after["rmse_mm"], "max_mm": after["max_mm"],
            "chi2_per_reading": after["chi2_per_dof"]}  # fmt: skip


def score_case(name, verdict, peers, times, truth):
    if verdict:
        level = noise.Noise(np.array(verdict["verdict"]["noise"]["sigma_mm"]), verdict["verdict"]["noise"]["ar1"])
    else:
        level = peers["model refitted"]["noise"]
    row = {"case": name, "noise": {"sigma_mm": level.sigma_mm.tolist(), "ar1": level.ar1}, "methods": {}}
    if truth:
        row["truth"] = right_names(truth)
    for method, result in peers.items():
        kept = {k: v for k, v in result.items() if k not in ("errors", "noise")}
        kept |= noise.figures(result["errors"], times, level)
        row["methods"][method] = kept
    if verdict:
        row["methods"]["bevel-diagnose"] = score_verdict(verdict)
    for method, kept in row["methods"].items():
        if truth and method in page.NAMING:
            kept["exact"] = sorted(kept["names"]) == row["truth"]
        if truth and not row["truth"]:
            kept["false_alarm"] = bool(kept["names"]) or bool(kept.get("alarm"))
    return row


def main():
    options = arguments()
    folders = sorted(p.parent for pattern in ("*/model.toml", "*/case/model.toml") for p in options.folder.glob(pattern)
                     if any(p.parent.glob("*.lcm")))  # fmt: skip
    if options.cases:
        folders = [f for f in folders if name_of(f) in options.cases.split(",")]
    if not folders:
        sys.exit(f"compare: {options.folder} has no folder with model.toml and logs")
    truths = read_truths(options.truth or options.folder / "truth.json")
    if not options.program.exists():
        print(f"compare: no {options.program}: the peers alone, with the noise of the model refitted", file=sys.stderr)
    options.out.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    rows = []
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        pool.submit(warm_up, folders[0]).result()
        runs = {}
        for folder in folders:
            if options.keep and row_path(folder, options).exists():
                continue
            diagnosed = pool.submit(diagnose, folder, options) if options.program.exists() else None
            runs[folder] = diagnosed, [pool.submit(run_peer, folder, peer) for peer in PEERS]
        for folder in folders:
            if folder in runs:
                diagnosed, tasks = runs[folder]
                peers = {}
                for task in tasks:
                    results, times = task.result()
                    peers |= results
                row = score_case(name_of(folder), diagnosed and diagnosed.result(), peers, times,
                                 truths.get(name_of(folder)))  # fmt: skip
                row_path(folder, options).write_text(json.dumps(row, indent=1) + "\n")
                print(f"{name_of(folder)} {time.monotonic() - began:.0f} s", file=sys.stderr)
            rows.append(json.loads(row_path(folder, options).read_text()))
    result = {"machine": f"{os.cpu_count()} cores, Python {platform.python_version()}", "cases": rows}
    if options.program.exists():
        result["bevel_diagnose_sha256"] = hashlib.sha256(options.program.read_bytes()).hexdigest()
    (options.out / "peers.json").write_text(json.dumps(result, indent=1) + "\n")
    print(page.tables(result))
    if options.page:
        page.write(options.page, result)


if __name__ == "__main__":
    main()
