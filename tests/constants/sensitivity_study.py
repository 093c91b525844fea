#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Which verdicts hang on the constants that nothing fixes: all of them halved or doubled at random, at once.

Of a copy of the tree a program is built that takes from the environment what docs/diagnosis.md calls a judgement or set
in view of a trial. Each drawn program has every one of these halved or doubled, every second the other way round than
the one before it; shares above one half have their odds halved or doubled. All run on the same cases, and so does the
program as it is. Where a verdict differs, the fewest constants that by themselves change it are sought by leaving out
parts of them (Zeller and Hildebrandt 2002, IEEE Trans. Softw. Eng. 28).

FOLDER: cases with truth.json (as tools/practice-table takes), or what bevel-blindtrial wrote.
"""
import argparse
import concurrent.futures
import hashlib
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys

import constants_table

ROOT = constants_table.ROOT


def script(path):
    """A script of ours as a module, though its name has no ending."""
    loader = importlib.machinery.SourceFileLoader(path.name.replace("-", "_"), str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


practice_table = script(ROOT / "tools/practice-table")
VARIABLE = "BEVEL_CONSTANTS"  # of the built program: "file:name=value;..."
HEADER = """#pragma once
#include <cstdlib>
#include <cstring>
template <typename T>
T constant_for_study(const char* key, T value) {
  const char* all = std::getenv("%s");
  const std::size_t length = std::strlen(key);
  for (const char* at = all; at && *at; at = std::strchr(at, ';') ? std::strchr(at, ';') + 1 : nullptr)
    if (!std::strncmp(at, key, length) && at[length] == '=') return static_cast<T>(std::atof(at + length + 1));
  return value;
}
""" % VARIABLE
FIXED = {"kSpeedChanges", "kSpeedChange_s"}  # an array's length, and its step: known when compiled


def studied():
    """Constants with one number each that are a judgement or set in view of trials: key to value."""
    found = {}
    for constant in constants_table.constants():
        if not re.search("judgement|trial", constant.set_by) or constant.set_by.startswith("calibrated"):
            continue
        path = ROOT / constant.file
        match = constant.definition(path.read_text()) if path.is_file() else None
        if match and constant.name not in FIXED and constants_table.number(match["value"]):
            found[constant.key] = (constant, match["value"])
    return found


def instrument(copy, constants):
    for constant, _ in constants.values():
        path = copy / constant.file
        text = path.read_text()
        match = constant.definition(text)
        value = match["value"].replace("'", "")
        start = text.rfind("\n", 0, match.start()) + 1
        end = text.find("\n", match.end("value"))
        head, tail = text[start:match.start("value")], text[match.end("value"):end]
        if "constexpr" in head:
            kind = "static inline const" if re.search(r"static\s+constexpr", head) else (
                "inline const" if re.search(r"inline\s+constexpr", head) else "static const")
            head = re.sub(r"(static\s+|inline\s+)?constexpr", kind, head)
        path.write_text(f'{text[:start]}{head}constant_for_study("{constant.key}", {value}){tail}{text[end:]}')


def build(folder, constants, jobs):
    program = folder / "build/bin/bevel-diagnose"
    if program.exists():
        print(f"as built before: {program}; what was said by it is kept beside it", file=sys.stderr)
        return program
    folder.mkdir(parents=True, exist_ok=True)
    copy = folder / "source"
    files = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", "-co", "--exclude-standard"], capture_output=True,
                           text=True, check=True).stdout
    for name in filter(None, files.split("\0")):
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, copy / name)
    (copy / ".deps").symlink_to(ROOT / ".deps")  # what tools/setup brought
    instrument(copy, constants)
    header = folder / "constant_for_study.hpp"
    header.write_text(HEADER)
    subprocess.run(["cmake", "-S", copy, "-B", folder / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                    f"-DCMAKE_CXX_FLAGS=-include {header} -w -Wno-error"], stdout=subprocess.DEVNULL, check=True)
    subprocess.run(["cmake", "--build", folder / "build", "--target", "bevel-diagnose", "-j", str(jobs)],
                   stdout=sys.stderr, check=True)
    return program


def changed(value, times, whole):
    """So many times as much; of a share from one half on, so many times its odds."""
    if 0.5 <= value < 1:
        odds = value / (1 - value) * times
        return odds / (1 + odds)
    return max(1, round(value * times)) if whole else value * times


def programs_of(constants, count, seed, factor=2):
    """Each a map from key to value; every second the mirror of the one before."""
    draw = random.Random(seed)
    out = []
    while len(out) < count:
        up = {key: draw.random() < 0.5 for key in constants}
        for mirrored in (False, True)[:count - len(out)]:
            out.append({key: changed(constants_table.number(value), factor if up[key] != mirrored else 1 / factor,
                                     not re.search(r"[.e/]", value))
                        for key, (_, value) in constants.items()})
    return out


def cases_of(folder, most):
    """(name, folder, names that have to be said, names that may be) of each case."""
    if (folder / "results.json").exists():
        trials = json.loads((folder / "results.json").read_text())["trials"]
        for trial in trials[:most]:
            number, allowed = trial["trial"], {c["name"] for c in trial["found"]}
            yield (f"{folder.name}/{number}", folder / f"trials/t{number:04d}/case", set(trial["expected"]),
                   allowed | set(trial["expected"]))
        return
    if not (folder / "truth.json").exists():
        sys.exit(f"sensitivity_study: {folder}: has neither truth.json nor results.json")
    for truth in json.loads((folder / "truth.json").read_text())[:most]:
        names = practice_table.truth_names(truth)
        yield (f"{folder.name}/{truth['case']}", folder / truth["case"], names,
               names | {e["name"] for e in truth["effects"]})


class Runner:
    """Runs the program on a case, with these constants; what was run before is taken from its folder."""

    def __init__(self, program, out):
        self.program, self.out = program, out

    def said(self, case, values):
        text = ";".join(f"{key}={value:.17g}" for key, value in sorted(values.items()))
        out = self.out / hashlib.sha256(text.encode()).hexdigest()[:12] / case[0]
        if not (out / "said.json").exists():
            out.mkdir(parents=True, exist_ok=True)
            logs = sorted(case[1].glob("*.lcm"))
            done = subprocess.run([self.program, "--quiet", "--threads", "1", "--targets", "0", "--model",
                                   case[1] / "model.toml", "--out", out, *logs], capture_output=True, text=True,
                                  env={**os.environ, VARIABLE: text}, check=False)
            if done.returncode not in (0, 3):
                sys.exit(f"{case[0]}: {done.stderr.strip()} with {VARIABLE}={text!r}")
            verdict = json.loads((out / "verdict.json").read_text())
            for left in out.iterdir():
                left.unlink()
            (out / "said.json").write_text(json.dumps(sorted(practice_table.named(verdict))))
        return set(json.loads((out / "said.json").read_text()))


def right(case, said):
    return case[2] <= said <= case[3]


def fewest(differs, keys):
    """The fewest of these that still make a difference: none of them can be left out (ddmin)."""
    parts = 2
    while len(keys) > 1:
        size = -(-len(keys) // parts)
        chunks = [keys[i:i + size] for i in range(0, len(keys), size)]
        for tried in chunks + ([[k for k in keys if k not in c] for c in chunks] if parts > 2 else []):
            if differs(tried):
                keys, parts = tried, max(2, parts - 1 if tried not in chunks else 2)
                break
        else:
            if parts >= len(keys):
                return keys
            parts = min(len(keys), 2 * parts)
    return keys


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=pathlib.Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="the copy, its build, and what was said")
    parser.add_argument("--programs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--factor", type=float, default=2, help="instead of half or twice")
    parser.add_argument("--most", type=int, help="cases of each folder")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--explain", type=int, default=20, help="of how many changed verdicts the constants are sought")
    return parser.parse_args()


def main():
    options = arguments()
    constants = studied()
    out = options.out.resolve()
    cases = [case for folder in options.folders for case in cases_of(folder.absolute(), options.most)]
    program = build(out, constants, options.jobs)
    drawn = programs_of(constants, options.programs, options.seed, options.factor)
    runner = Runner(program, out / "said")
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        said = list(pool.map(lambda job: runner.said(*job), [(c, values) for values in [{}, *drawn] for c in cases]))
    said = [said[i:i + len(cases)] for i in range(0, len(said), len(cases))]
    print(f"{len(constants)} constants, {len(cases)} cases, {len(drawn)} programs, factor {options.factor:g}, seed "
          f"{options.seed}")
    print(f"as it is: right {sum(map(right, cases, said[0]))}")
    different = []
    for number, names in enumerate(said[1:], 1):
        other = [i for i in range(len(cases)) if names[i] != said[0][i]]
        different += [(number, i) for i in other]
        print(f"program {number}: right {sum(map(right, cases, names))}, otherwise said {len(other)}")

    def explained(job):
        number, i = job
        values = drawn[number - 1]
        return fewest(lambda keys: runner.said(cases[i], {k: values[k] for k in keys}) != said[0][i], sorted(values))

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        causes = list(pool.map(explained, different[:options.explain]))
    for (number, i), keys in zip(different, causes):
        was, now = ("+".join(sorted(s)) or "nothing" for s in (said[0][i], said[number][i]))
        print(f"{cases[i][0]}, program {number}: {was} ({'right' if right(cases[i], said[0][i]) else 'wrong'}) -> {now} "
              f"({'right' if right(cases[i], said[number][i]) else 'wrong'}): "
              + ", ".join(f"{k} {constants[k][1]} -> {drawn[number - 1][k]:.3g}" for k in keys))


if __name__ == "__main__":
    main()
