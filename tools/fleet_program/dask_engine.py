# SPDX-License-Identifier: MIT
"""Runs the cases of a fleet by Dask. Usage: python3 dask_engine.py CONFIG.json

A worker runs the same command as a job of Snakemake; only the standard library is asked of it.
Exit status: 0 each command ended with 0, 1 one did not, however often it was tried.
"""
import json
import os
import pathlib
import subprocess
import sys


def main(config):
    import distributed

    if config["scheduler"]:
        client = distributed.Client(config["scheduler"], timeout=20)
    else:
        # Threads do: each waits for a process.
        client = distributed.Client(distributed.LocalCluster(
            processes=False, n_workers=1, threads_per_worker=config["processes"], dashboard_address=None))
    waiting = distributed.as_completed(
        client.submit(subprocess.run, [*config["command"], key], check=True, stdin=subprocess.DEVNULL, key=key,
                      retries=config["retries"]) for key in config["keys"])
    failed = 0
    for future in waiting:
        if future.status != "finished":
            failed += 1
            print(f"{future.key}: {future.exception()}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        status = main(json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")))
    except KeyboardInterrupt:
        status = 130
    except (OSError, ValueError) as reason:  # no scheduler there, or no address
        print(f"dask: {reason}", file=sys.stderr)
        status = 1
    sys.stderr.flush()
    os._exit(status)  # nothing to close down: what it had to do lies in files
