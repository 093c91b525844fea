#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs the tests of the Python package.

Usage: run.py build-tree PACKAGE | run.py notebooks PACKAGE | run.py wheel
  build-tree  pytest on the package in the folder PACKAGE (build/python/package)
  notebooks   executes python/notebooks with that package
  wheel       builds the wheel, installs it into a fresh virtual environment, runs pytest and the notebooks there
Pinned packages come from .deps/python-package (tools/setup --python). Exit status: 77 where they are missing.
"""

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ROOT / ".deps" / "python-package"
SKIPPED = 77


def environment(*folders):
    """Returns the environment of a child that imports from these folders and from the pinned packages."""
    path = os.pathsep.join(map(str, [*folders, PACKAGES]))
    return {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "Agg"}


def run(command, env, cwd=ROOT):
    print("+", " ".join(map(str, command)), flush=True)
    subprocess.run(list(map(str, command)), env=env, cwd=cwd, check=True)


def run_pytest(python, env):
    run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs", ROOT / "python" / "tests"], env)


def run_notebooks(python, env):
    """Executes each notebook; a cell that raises fails the test."""
    run([python, Path(__file__).with_name("run_notebooks.py"), ROOT / "python" / "notebooks"], env)


def run_wheel():
    with tempfile.TemporaryDirectory(prefix="bevel-wheel-") as folder:
        wheels, fresh = Path(folder) / "wheels", Path(folder) / "venv"
        build = [sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", wheels, ROOT]
        # Compiler and flags of the preset ci: ccache then has most of the objects.
        run([*build, "--config-settings=cmake.define.BEVEL_WERROR=ON"], {**environment(), "CXX": "c++"})
        venv.create(fresh, with_pip=True)
        python = fresh / "bin" / "python"
        (wheel,) = wheels.glob("bevel-*.whl")
        run([python, "-m", "pip", "install", "--no-index", "--no-deps", wheel], environment())
        run([python, "-c", "import bevel; print(bevel.__version__, bevel.__file__)"], environment(), folder)
        run_pytest(python, environment())
        run_notebooks(python, environment())


def main(arguments):
    if not (PACKAGES / "nanobind").is_dir():
        print(f"skipped: {PACKAGES} is missing; tools/setup --python installs it")
        return SKIPPED
    try:
        if arguments[0] == "wheel":
            run_wheel()
        else:
            tests = {"build-tree": run_pytest, "notebooks": run_notebooks}
            tests[arguments[0]](sys.executable, environment(arguments[1]))
    except subprocess.CalledProcessError as failed:
        print(failed)
        return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in ("build-tree", "notebooks", "wheel"):
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    sys.exit(main(sys.argv[1:]))
