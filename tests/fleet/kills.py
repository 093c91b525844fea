#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Many cases through tools/fleet, undisturbed and with random kills: nothing lost, nothing done twice, the same verdicts.

Usage: tests/fleet/kills.py --out DIR [--cases N] [--seed S] [--engine E] [--every-s T] [--kills K] [--stand-in [--seconds T]]
Generates the cases (two insertions each, by bevel-blindtrial), has tools/fleet do them once undisturbed, and once while
it, its engine, the process of a case or bevel-diagnose is ended by SIGKILL, K times, after random pauses of T seconds in the
mean; then compares. A fifth of the pauses begin with the run, the others when it has begun a case: Snakemake needs seconds
until then on a loaded machine, and would get nowhere. --stand-in: tests/fleet/stand_in.py in place of bevel-diagnose, with
cases that it reads; it sleeps for T seconds, 0.5 if not said, so that what other work there is on the machine takes no time from it:
what is missing to all of the time at work is the fleet's own.
Exit status: 0 all held, 1 something did not, and is named, 2 usage.

Of the cores used three shares are printed: the CPU time of the cases that were kept of all time of all cores; of what other
processes left of that (from /proc/stat), since a machine may have others at work; and the time in which a case was at work
of the time of all that may be at work at once. The same without start and page is from when each place had its first result to the
last result, which is all there is of it in a long run (cases of one length are meant). Beside them the CPU time of all that is not a
case: fleet, engine, interpreters.
"""
import argparse
import collections
import ctypes
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Notes each start, and a start of what is done already or is being done by another; then is the program, by exec.
WRAPPER = """#!/bin/sh
before=
for word; do [ "$before" = --out ] && break; before=$word; done
out=${word%/work/*} key=${word##*/} && key=${key%%-*}
[ -e "$out/results/$key" ] && echo "twice $key" >>"$out/ledger"
exec 9>"$out/ledger.$key"
flock -n 9 || echo "together $key" >>"$out/ledger"
echo "start $key" >>"$out/ledger"
exec PROGRAM "$@"
"""
PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h
KINDS = {"fleet": "tools/fleet\0", "engine": "snakemake\0", "case": "one_case.py\0", "program": "--model\0"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", default="snakemake", choices=("snakemake", "dask"))
    parser.add_argument("--every-s", type=float, default=10.0)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--stand-in", action="store_true")
    parser.add_argument("--seconds", type=float, default=0.5)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build")
    return parser.parse_args()


def make_cases(options, folder):
    """Cases of two logs each; rigs of ten."""
    if options.stand_in:
        for i in range(options.cases):
            case = folder / f"rig{i // 10}" / f"case{i:03}"
            case.mkdir(parents=True)
            (case / "model.toml").write_text(f"seconds = {options.seconds}\n", encoding="utf-8")
            for j in (1, 2):
                (case / f"rec0{j}.lcm").write_text(f"{i} {j}\n", encoding="utf-8")
        return
    trials = folder.parent / "trials"
    made = 0
    number = options.cases // 4 + 1
    while made < options.cases:
        subprocess.run([options.build / "bin/bevel-blindtrial", "--trials", str(number), "--seed-file", "-",
                        "--out", trials, "--generate-only"], check=True, stdout=subprocess.DEVNULL,
                       input=str(options.seed).encode())
        shutil.rmtree(folder, ignore_errors=True)
        made = 0
        for trial in sorted(trials.glob("trials/t*/case")):
            logs = sorted(trial.glob("rec*.lcm"))
            for pair in zip(logs[0::2], logs[1::2]):
                if made == options.cases:
                    break
                case = folder / f"rig{made // 10}" / f"case{made:03}"
                case.mkdir(parents=True)
                for file in (*pair, trial / "model.toml"):
                    shutil.copy(file, case)
                made += 1
        number += (options.cases - made + 1) // 2


def machine_s():
    """CPU seconds of all processes, and seconds that the cores were idle."""
    with open("/proc/stat", encoding="ascii") as file:
        ticks = [int(word) for word in file.readline().split()[1:]]
    hz = os.sysconf("SC_CLK_TCK")
    user, nice, system, idle, iowait, irq, softirq = ticks[:7]
    return (user + nice + system + irq + softirq) / hz, (idle + iowait) / hz


class CoreUse:
    """CPU seconds of what is started within, beside what the cores had."""

    def __enter__(self):
        self.begun = (time.monotonic(), *machine_s(), self.ours())
        return self

    @staticmethod
    def ours():
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    def __exit__(self, *_):
        while reaped_one():
            pass
        wall, busy, idle, ours = (now - then for now, then in
                                  zip((time.monotonic(), *machine_s(), self.ours()), self.begun))
        self.wall, self.ours_s, self.given = wall, ours, max(os.cpu_count() * wall - (busy - ours), 1e-9)

    def shares(self, out):
        files = list((out / "results").glob("*/case.json"))
        kept = [json.loads(file.read_text(encoding="utf-8")) for file in files]
        cpu, at_work = (sum(case[name] for case in kept) for name in ("cpu_s", "seconds"))
        places = len(os.sched_getaffinity(0))
        slots = places * self.wall
        # While all places are taken: from when each had its first result, to the last one.
        ends = sorted(file.stat().st_mtime for file in files)
        steady = ""
        if len(ends) > places:
            share = at_work / len(kept) * (len(kept) - places) / (places * (ends[-1] - ends[places - 1]))
            steady = f", without start and page {100 * share:.1f} %"
        return (f"{100 * cpu / (os.cpu_count() * self.wall):.1f} % of {os.cpu_count()} cores x {self.wall:.1f} s, "
                f"{100 * cpu / self.given:.1f} % of the {self.given:.1f} s that others left; "
                f"at work {100 * at_work / slots:.1f} %{steady}; beside the cases {self.ours_s - cpu:.1f} s of CPU time, "
                f"{(self.ours_s - cpu) / len(kept):.2f} s a case")


def reaped_one():
    """What an engine that was killed left behind is our child now, and counts when it is waited for."""
    try:
        return os.waitpid(-1, os.WNOHANG)[0] != 0
    except ChildProcessError:
        return False


def processes(out, kind):
    """Ours alone: their command lines name the folder of this run."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            line = (path / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        if str(out) in line and kind in line and "setpriv" not in line.split("\0")[0]:
            found.append(int(path.name))
    return found


def run(command):
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def starts_of(out):
    ledger = out / "ledger"
    return ledger.read_text(encoding="utf-8").count("start") if ledger.exists() else 0


def run_with_kills(command, out, options, engine):
    """Until a run gets through; how often what was killed."""
    draw = random.Random(options.seed)
    kills = collections.Counter()
    runs = 0
    while True:
        begun = starts_of(out)
        fleet = run(command)
        runs += 1
        while fleet.poll() is None:
            if sum(kills.values()) == options.kills:
                fleet.wait()
                break
            if draw.random() < 0.8 and begun == starts_of(out):
                while fleet.poll() is None and begun == starts_of(out):
                    time.sleep(0.05)
            pause_s = draw.expovariate(1 / options.every_s)
            try:
                fleet.wait(pause_s)
                break
            except subprocess.TimeoutExpired:
                pass
            kind = draw.choice(list(KINDS))
            victims = processes(out, engine if kind == "engine" else KINDS[kind])
            if victims:
                try:
                    os.kill(draw.choice(victims), signal.SIGKILL)
                    kills[kind] += 1
                except ProcessLookupError:
                    pass
        if fleet.returncode == 0:
            return runs, kills
        if runs > options.kills + 3:
            sys.exit("kills: it does not get through, though nothing is killed any more")
        time.sleep(draw.uniform(0, 1))


def verdicts(out):
    """Case -> bytes of its verdict. A result's case.json says from which files it is."""
    found = {}
    for result in (out / "results").iterdir():
        made = json.loads((result / "case.json").read_text(encoding="utf-8"))
        found[made["model_path"]] = (result / "verdict.json").read_bytes()
    return found


def main():
    options = arguments()
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    work = options.out.resolve()
    if work.exists():
        sys.exit(f"kills: {work}: is there already")
    folder = work / "cases"
    folder.mkdir(parents=True)
    print(f"{options.cases} cases, seed {options.seed}, {options.engine}, {options.kills} kills, one in {options.every_s} s")
    make_cases(options, folder)
    program = ROOT / "tests/fleet/stand_in.py" if options.stand_in else options.build.resolve() / "bin/bevel-diagnose"
    wrapper = work / "program"
    wrapper.write_text(WRAPPER.replace("PROGRAM", f"'{program}'"), encoding="utf-8")
    wrapper.chmod(0o755)

    def command(out):
        return [ROOT / "tools/fleet", folder, "--out", out, "--engine", options.engine, "--program", wrapper, "-q"]

    quiet, disturbed = work / "undisturbed", work / "disturbed"
    with CoreUse() as use:
        status = run(command(quiet)).wait()
    print(f"undisturbed: status {status}, {len(verdicts(quiet))} results; CPU time in cases: "
          f"{use.shares(quiet)}")
    engine = KINDS["engine"] if options.engine == "snakemake" else "dask_engine.py\0"
    with CoreUse() as use:
        runs, kills = run_with_kills(command(disturbed), disturbed, options, engine)
    print(f"with kills: {runs} runs, killed {dict(sorted(kills.items()))}, {len(verdicts(disturbed))} results; CPU time in "
          f"cases that were kept: {use.shares(disturbed)}")
    with CoreUse() as use:
        again = run(command(disturbed)).wait()
    print(f"once more: status {again}, {use.wall:.1f} s")
    judge(options, quiet, disturbed, sum(kills.values()), status, again)


def judge(options, quiet, disturbed, kills, *statuses):
    faults = [f"status {status}" for status in statuses if status != 0]
    ledgers = {out: collections.Counter(tuple(line.split()) for line in (out / "ledger").read_text().splitlines())
               for out in (quiet, disturbed)}
    for out, ledger in ledgers.items():
        faults += [f"{out.name}: {' '.join(note)}" for note in ledger if note[0] != "start"]
    if kills < min(options.kills, 1):
        faults.append("nothing was killed")
    here, there = verdicts(quiet), verdicts(disturbed)
    if len(here) != options.cases:
        faults.append(f"undisturbed has {len(here)} results")
    faults += [f"lost: {case}" for case in here.keys() - there.keys()]
    faults += [f"differs: {case}" for case in here.keys() & there.keys() if here[case] != there[case]]
    starts = {out: sum(count for note, count in ledger.items() if note[0] == "start") for out, ledger in ledgers.items()}
    if starts[quiet] != options.cases:
        faults.append(f"undisturbed: {starts[quiet]} starts for {options.cases} cases")
    left = [path.name for path in (disturbed / "work").iterdir() if path.name != "lock" and not path.name.startswith("turn")]
    if left:
        faults.append(f"left behind: {', '.join(left)}")
    print(f"starts: {starts[quiet]} undisturbed, {starts[disturbed]} with kills; verdicts the same to the last byte: "
          f"{sum(here[case] == there.get(case) for case in here)} of {len(here)}")
    for fault in faults:
        print(f"FAILED: {fault}")
    print("failed" if faults else "ok: nothing lost, nothing done twice")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
