#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compiles each public header alone, and all headers of a module together, by the compiler and flags of the build.

    headers_test.py BUILD [MODULE...]

BUILD contains compile_commands.json. Exit status: 0 all compile, 1 some do not.
"""
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODULES = ["model", "estimator", "controller", "diagnosis", "drivers", "io", "rig", "nodes"]


def flags_of(build, module):
    """Returns the compiler with the include paths of a source of the module, without the module's private folder."""
    commands = json.loads((build / "compile_commands.json").read_text())
    # The module's folder with the most dependencies: camera code also finds OpenCV.
    preferred = {"drivers": "drivers/src/camera/calibration/", "rig": "rig/src/camera/"}.get(module, f"{module}/src/")
    mine = [c for c in commands if c["file"].startswith(str(ROOT / preferred))]
    words = shlex.split(mine[-1]["command"])
    if "ccache" in words[0]:
        words = words[1:]
    flags, at = [words[0], "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror"], 1
    while at < len(words):
        if words[at] == "-isystem":
            flags += words[at:at + 2]
            at += 1
        elif words[at].startswith(("-I", "-D")) and words[at] != f"-I{ROOT / module / 'src'}":
            flags.append(words[at])
        at += 1
    return flags


def compiles(name, flags, headers, folder):
    source = folder / (name.replace("/", "_") + ".cpp")
    source.write_text("".join(f"#include <{header}>\n" for header in headers))
    result = subprocess.run([*flags, str(source)], capture_output=True, text=True)
    return name, result.returncode == 0, result.stderr


def main():
    build = pathlib.Path(sys.argv[1])
    failed = checked = 0
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = []
        for module in sys.argv[2:] or MODULES:
            include = ROOT / module / "include"
            headers = sorted(str(path.relative_to(include)) for path in include.rglob("*.hpp"))
            flags = flags_of(build, module)
            jobs.append(pool.submit(compiles, module + "/all", flags, headers, pathlib.Path(folder)))
            jobs += [pool.submit(compiles, h, flags, [h], pathlib.Path(folder)) for h in headers]
        for job in jobs:
            name, passed, errors = job.result()
            checked += 1
            if not passed:
                failed += 1
                print(f"{name} does not compile alone:\n{errors[:2000]}")
    print(f"{checked - failed} of {checked} compile")
    return 1 if failed or not checked else 0


if __name__ == "__main__":
    sys.exit(main())
