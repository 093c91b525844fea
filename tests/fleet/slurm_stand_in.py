#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Stands in for Slurm under the names sbatch, srun, sacct, sacctmgr, scancel: what Snakemake's executor says to them. A job
is a process of this machine; $STAND_IN_FOR_SLURM is a folder with a file a job, and calls.txt of all that was asked."""
import os
import pathlib
import shlex
import subprocess
import sys

name, words = pathlib.Path(sys.argv[0]).name, sys.argv[1:]
folder = pathlib.Path(os.environ["STAND_IN_FOR_SLURM"])
with open(folder / "calls.txt", "a", encoding="utf-8") as calls:
    calls.write(shlex.join([name, *words]) + "\n")
if name == "sbatch":
    job = len(list(folder.glob("*.job"))) + 1
    script = next(word for word in words if word.startswith("--wrap=")).removeprefix("--wrap=")
    state = folder / f"{job}.job"
    state.write_text("RUNNING", encoding="utf-8")
    told = f"({script}) && echo -n COMPLETED >{shlex.quote(str(state))} || echo -n FAILED >{shlex.quote(str(state))}"
    with open(folder / f"{job}.log", "w", encoding="utf-8") as log:
        subprocess.Popen(["sh", "-c", told], stdout=log, stderr=log, stdin=subprocess.DEVNULL, start_new_session=True,
                         env={**os.environ, "SLURM_JOB_ID": str(job)})
    print(job)
elif name == "srun":
    while words[0].startswith("-"):
        words.pop(0)
    os.execvp(words[0], words)
elif name == "sacct" and "--format=JobIdRaw,State" in words:
    for state in folder.glob("*.job"):
        print(f"{state.stem}|{state.read_text(encoding='utf-8')}")
elif name == "sacctmgr":
    print("lab")
