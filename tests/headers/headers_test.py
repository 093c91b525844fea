#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compiles public headers alone, and all of them together, by the compiler and include paths of the build.

A header whose source file includes it first is left out: the build has compiled it alone.

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


def flags_of(build, modules):
    """Returns the compiler with the include paths of all sources of the modules, without the private folders."""
    folders = tuple(f"{ROOT / module}/src/" for module in modules)
    private = [f"-I{folder[:-1]}" for folder in folders]
    commands = json.loads((build / "compile_commands.json").read_text())
    mine = [shlex.split(c["command"]) for c in commands if c["file"].startswith(folders)]
    includes = {}  # in the order of first use
    for words in mine:
        for at, word in enumerate(words):
            if word == "-isystem":
                includes[word, words[at + 1]] = None
            elif word.startswith("-I") and word not in private:
                includes[(word,)] = None
    compiler = mine[0][1] if "ccache" in mine[0][0] else mine[0][0]
    flags = [word for include in includes for word in include]
    return [compiler, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *flags]


def is_first_in_its_source(module, header):
    """Returns whether a source file of the header's name includes the header before all others."""
    sources = (ROOT / module / "src").rglob(pathlib.Path(header).stem + ".cpp")
    firsts = (next((line for line in s.read_text().splitlines() if line.startswith("#include")), "") for s in sources)
    return f"#include <{header}>" in firsts


def compiles(name, flags, headers, folder):
    source = folder / (name.replace("/", "_") + ".cpp")
    source.write_text("".join(f"#include <{header}>\n" for header in headers))
    result = subprocess.run([*flags, str(source)], capture_output=True, text=True)
    return name, result.returncode == 0, result.stderr


def main():
    build = pathlib.Path(sys.argv[1])
    failed = checked = 0
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs, everything = [], []
        modules = sys.argv[2:] or MODULES
        for module in modules:
            include = ROOT / module / "include"
            headers = sorted(str(path.relative_to(include)) for path in include.rglob("*.hpp"))
            everything += headers
            flags = flags_of(build, [module])
            jobs += [pool.submit(compiles, h, flags, [h], pathlib.Path(folder)) for h in headers
                     if not is_first_in_its_source(module, h)]
        jobs.append(pool.submit(compiles, "all headers together", flags_of(build, modules), everything,
                                pathlib.Path(folder)))
        for job in jobs:
            name, passed, errors = job.result()
            checked += 1
            if not passed:
                failed += 1
                print(f"{name}: does not compile:\n{errors[:2000]}")
    print(f"{checked - failed} of {checked} compile")
    return 1 if failed or not checked else 0


if __name__ == "__main__":
    sys.exit(main())
