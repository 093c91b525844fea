# SPDX-License-Identifier: MIT
"""The engines: the command line of each, and one process of it that is started, watched, and ended in order."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
RETRIES = 2  # of a case whose process was killed or whose machine was lost; refusals of input are none
READY = 1  # processes of cases that wait for their turn
PROGRESS_S = 1.0
PATIENCE_S = 10.0  # for an engine that was told to end


def configuration(out, keys, options):
    elsewhere = options.slurm or options.scheduler  # whoever hands out the machines counts there
    # -S: it needs the standard library alone, and starts sooner without looking for more.
    command = [sys.executable, "-S", str(HERE / "one_case.py"), str(0 if elsewhere else options.jobs), str(out)]
    return {"keys": keys, "command": command, "threads": options.threads, "processes": options.jobs + READY,
            "scheduler": options.scheduler, "retries": RETRIES}


def command_line(folder, options):
    """Of the engine, for a run whose files are in `folder`."""
    if options.engine == "dask":
        return [sys.executable, str(HERE / "dask_engine.py"), str(folder / "config.json")]
    where = ["--executor", "slurm", "--jobs", str(options.jobs)] if options.slurm else [
        "--cores", str((options.jobs + READY) * options.threads)]
    return [sys.executable, "-m", "snakemake", "--snakefile", str(HERE / "Snakefile"), "--directory", str(folder),
            "--configfile", str(folder / "config.json"), "--runtime-source-cache-path", str(folder / "cache"), *where,
            "--nolock",  # the folder is of this run alone, and Snakemake takes braces in a lock's path for wildcards
            "--keep-going", "--retries", str(RETRIES), "--scheduler", "greedy", "--nocolor", *options.passed_on]


def environment(root):
    paths = [str(root / ".deps/fleet"), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def run(root, out, keys, options, progress):
    """Does the cases; the engine's exit status, and its last words if that is not 0. `progress` is called in between.
    Whatever ends this function ends the engine too."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="run-", dir=out / "work"))
    os.chmod(folder, 0o755)
    try:
        (folder / "config.json").write_text(json.dumps(configuration(out, keys, options)), encoding="utf-8")
        with open(folder / "engine.log", "w", encoding="utf-8") as log:
            # A session of its own, so that all of it can be told to end; setpriv: told also where we are killed.
            engine = subprocess.Popen(["setpriv", "--pdeathsig", "TERM", "--", *command_line(folder, options)],
                                      stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment(root),
                                      start_new_session=True)
        try:
            shown_s = 0.0
            while engine.poll() is None:
                if time.monotonic() - shown_s > PROGRESS_S:
                    progress()
                    shown_s = time.monotonic()
                time.sleep(0.1)
            progress()
        finally:
            end(engine)
        said = (folder / "engine.log").read_text(encoding="utf-8", errors="replace").strip()
        return engine.returncode, "\n".join(said.splitlines()[-15:])
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def end(engine):
    for word in (signal.SIGINT, signal.SIGKILL):
        if engine.poll() is not None:
            return
        os.killpg(engine.pid, word)
        try:
            engine.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            pass
