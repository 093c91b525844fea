#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Executes every notebook of a folder, and fails at the first cell that raises.

Usage: run_notebooks.py FOLDER
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from traitlets.config import Config

TIMEOUT_S = 300


def write_kernel(folder):
    """Writes a kernel specification that starts this interpreter with this environment."""
    kernel = Path(folder) / "kernels" / "python3"
    kernel.mkdir(parents=True)
    command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    specification = {"argv": command, "display_name": "Python 3", "language": "python"}
    (kernel / "kernel.json").write_text(json.dumps(specification))
    os.environ["JUPYTER_PATH"] = str(folder)


def main(folder):
    notebooks = sorted(Path(folder).glob("*.ipynb"))
    if not notebooks:
        print(f"{folder}: has no notebook")
        return 1
    with tempfile.TemporaryDirectory() as kernels:
        write_kernel(kernels)
        # Socket files in place of TCP ports, to which every user of the machine could connect.
        sockets = Config({"KernelManager": {"transport": "ipc", "ip": str(Path(kernels) / "socket")}})
        for path in notebooks:
            began = time.monotonic()
            notebook = nbformat.read(path, as_version=4)
            resources = {"metadata": {"path": str(path.parent)}}
            NotebookClient(notebook, timeout=TIMEOUT_S, resources=resources, config=sockets).execute()
            print(f"{path.name}: {time.monotonic() - began:.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    sys.exit(main(sys.argv[1]))
