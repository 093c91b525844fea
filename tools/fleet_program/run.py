# SPDX-License-Identifier: MIT
"""tools/fleet from its command line to its page."""
import argparse
import fcntl
import importlib.util
import json
import os
import pathlib
import shlex
import shutil
import signal
import sys

from . import cases, engines, one_case, progress
from .command_line import Parser

OK, FAILED, DAMAGED, INTERRUPTED = 0, 1, 3, 130
SLURM_JOBS = 100


def number(low, high):
    def check(text):
        if not text.isdecimal() or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"is '{text}'; allowed: {low} to {high}")
        return int(text)

    return check


def options_of(arguments, root):
    passed_on = []
    if "--" in arguments:
        cut = arguments.index("--")
        arguments, passed_on = arguments[:cut], arguments[cut + 1:]
    parser = Parser(prog="fleet", add_help=False, allow_abbrev=False)
    parser.add_argument("fleet", nargs="?", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--engine", choices=("snakemake", "dask"), default="snakemake")
    parser.add_argument("--jobs", type=number(1, 100000))
    parser.add_argument("--threads", type=number(1, 64), default=1)
    parser.add_argument("--slurm", action="store_true")
    parser.add_argument("--scheduler", default="")
    parser.add_argument("--program", type=pathlib.Path, default=root / "build/bin/bevel-diagnose")
    parser.add_argument("--dry-run", action="store_true")
    parser.add_argument("-q", "--quiet", action="store_true")
    options = parser.parse_args(arguments)
    options.passed_on = passed_on
    if options.fleet is None:
        parser.error("FLEET is required: a table of cases, or a folder of case folders")
    if options.out is None:
        parser.error("--out is required: the folder for results, table and page")
    if options.engine == "dask" and (options.slurm or passed_on):
        parser.error("--slurm and options after -- are for --engine snakemake")
    if options.engine != "dask" and options.scheduler:
        parser.error("--scheduler is for --engine dask")
    cores = len(os.sched_getaffinity(0))
    options.jobs = options.jobs or (SLURM_JOBS if options.slurm else max(1, cores // options.threads))
    return options


def main(arguments, root):
    options = options_of(arguments, root)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends in order, as Ctrl-C does
    try:
        return work(options, root)
    except cases.Fault as fault:
        print("\n".join(f"fleet: {line}" for line in str(fault).splitlines()), file=sys.stderr)
    except OSError as reason:
        print(f"fleet: {reason}", file=sys.stderr)
    except KeyboardInterrupt:
        print("\nfleet: interrupted; the same command goes on where this one stopped", file=sys.stderr)
        return INTERRUPTED
    return FAILED


def need_packages(root, engine):
    sys.path.append(str(root / ".deps/fleet"))
    for name in ("pyarrow", "distributed" if engine == "dask" else "snakemake"):
        if importlib.util.find_spec(name) is None:
            raise cases.Fault(f"needs the Python package {name}; tools/setup --fleet gets it")


def plan(options):
    """The cases, each with its key, and what is to be done for each key."""
    found = cases.read_fleet(options.fleet)
    if not os.access(options.program, os.X_OK) or options.program.is_dir():
        raise cases.Fault(f"{options.program}: is no program; build it (cmake --build build --target bevel-diagnose), or "
                          "name another by --program")
    program, program_sha256 = options.program.resolve(), cases.sha256_of(options.program)
    specifications = {}
    for case in found:
        spec = cases.specification(case, program, program_sha256, ["-q", "--threads", str(options.threads)])
        case.key = spec["key"]
        specifications.setdefault(case.key, spec)
    return found, specifications


def work(options, root):
    if not options.dry_run:
        need_packages(root, options.engine)
    found, specifications = plan(options)
    out = options.out.resolve()
    pending = [key for key in specifications if not (out / "results" / key).exists()]
    if options.dry_run:
        print(f"{len(found)} cases, {len(pending)} of them to be done; by")
        print(shlex.join(engines.command_line(out / "work/run-0", options)))
        return OK
    for name in ("results", "work", "cases", "refused"):
        (out / name).mkdir(parents=True, exist_ok=True)
    with open(out / "work" / "lock", "w", encoding="utf-8") as held:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise cases.Fault(f"{out}: another tools/fleet is at work there") from None
        sweep(out, specifications)
        unfinished = do(root, out, pending, specifications, options) if pending else ""
        return conclude(out, found, options, unfinished)


def sweep(out, specifications):
    """What runs that were killed left, and what was said of this fleet's cases before."""
    for folder in (out / "work").glob("run-*"):
        shutil.rmtree(folder, ignore_errors=True)
    for file in [*out.glob(".unfinished-*"), *out.glob("*/.unfinished-*")]:
        file.unlink(missing_ok=True)
    for key in specifications:
        (out / "refused" / f"{key}.json").unlink(missing_ok=True)


def do(root, out, pending, specifications, options):
    """Runs the engine; why it did not finish, "" if it did."""
    for key in pending:
        one_case.write_whole(out / "cases" / f"{key}.json", json.dumps(specifications[key]))
    line = progress.Line(len(pending), options.jobs)

    def show(last=False):
        if not options.quiet:
            line.show(sum((out / "results" / key).exists() for key in pending), last)

    if not options.quiet:
        print(f"fleet: {len(pending)} cases to be done", file=sys.stderr)
    try:
        status, words = engines.run(root, out, pending, options, show)
    finally:
        show(last=True)
    if status == 0:
        return ""
    how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
    return f"{words}\nfleet: {options.engine} {how}; the same command goes on with what is not done"


def conclude(out, found, options, unfinished):
    from . import page, rollup

    rows = rollup.rows(out, found)
    rollup.write_parquet(out / "fleet.parquet", rows)
    one_case.write_whole(out / "index.html", page.html(rows, options.fleet.name))
    if unfinished:
        print(unfinished, file=sys.stderr)
    missing = [row for row in rows if row["verdict"] is None]
    for row in missing:
        if row["fault"] != rollup.NOT_DONE:
            print(f"fleet: {row['case']}: {row['fault']}", file=sys.stderr)
    damaged = sum(row["exit_status"] == DAMAGED for row in rows)
    print(f"{len(rows)} cases of {len({row['rig'] for row in rows})} rigs: {len(rows) - len(missing)} diagnosed"
          + (f", {damaged} of them from damaged recordings" if damaged else "")
          + (f", {len(missing)} not" if missing else "") + f"\nwritten: {options.out}/index.html, fleet.parquet")
    return FAILED if missing or unfinished else DAMAGED if damaged else OK
