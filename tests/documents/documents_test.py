#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every command of the documents: that its program, its options, its tests and its files are there; and those that are quick
and need nothing that is not here are run, as they stand.

Usage: documents_test.py BUILD_DIR [unittest OPTION...]
"""
import collections
import functools
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import commands

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else "build").resolve()

# Commands that are run, in this order, in a folder that has the files that they name. tests/examples runs the commands of
# README.md and examples/README.md.
RUN = [
    ("docs/diagnosis.md", "build/bin/bevel-diagnose --model model.toml --out result rec01.lcm rec02.lcm"),
    ("docs/diagnosis.md",
     "build/bin/bevel-diagnose --model model.toml --out result --baseline monday/*.lcm --changed tuesday/*.lcm"),
    ("docs/import.md", "build/bin/bevel-import --columns map.toml --out logs tip --base base"),
    ("docs/import.md", "build/bin/bevel-diagnose --model model.toml --out verdict logs"),
    ("docs/import.md", "build/bin/bevel-export --format mcap --out mcap rec01.lcm"),
    ("docs/import.md", "build/bin/bevel-import --out again mcap/rec01.mcap"),
    ("docs/fleet.md", "tools/fleet cases.csv --out fleet --dry-run"),
]
# Why the programs of the other commands are not run here: their options and files are checked.
ONLY_CHECKED = {
    "tools/demo": "steers for half a minute in real time",
    "tools/test": "runs this test", ".ci/run": "runs this test", "ctest": "runs this test", "cmake": "is building this",
    "tools/setup": "installs", "tools/fuzz": "needs another build", "tools/in-vm": "boots a machine",
    "tools/table1": "has tests of its own", "tools/practice-table": "takes minutes, on recordings from elsewhere",
    "tools/fleet": "has tests of its own", "tools/close-the-loop": "takes minutes",
    "tools/bevel-spy": "needs a display", "tests/peers/compare": "takes an hour", "tests/fleet/kills.py": "takes half an hour",
    "tests/loop/processes_test.sh": "measures, in real time",
    "tools/ci/lint": "installs from PyPI", "tools/ci/doxygen": "may install a package", "tools/ci/tidy": "needs another build",
    "tools/ci/suite": "runs this test", "tools/ci/wheel": "needs another build", "tools/ci/container": "needs Docker",
    "tools/ci/spdx": "is the test repository.spdx",
    "sudo": "changes this machine's network",
    "bevel-camera": "works until it is told to end", "bevel-estimator": "works until it is told to end",
    "bevel-controller": "works until it is told to end", "bevel-stepper": "needs drives",
    "bevel-rig": "works until it is told to end", "bevel-view": "works until it is told to end",
    "bevel-check": "needs a rig", "bevel-demo": "steers for half a minute in real time",
    "bevel-calibrate": "needs pictures", "bevel-targets": "takes minutes", "bevel-blindtrial": "takes minutes",
    "bevel-close-the-loop": "takes minutes", "bevel-identify": "recordings from elsewhere",
    "bevel-predict": "has tests of its own", "bevel-export": "has tests of its own", "bevel-import": "recordings from elsewhere",
    "bevel-replay": "recordings from elsewhere, or run by tests/examples", "bevel-diagnose": "recordings from elsewhere, or run by tests/examples",
    "bevel-table1": "has tests of its own",
    "test_": "is run by name elsewhere in this suite", "study_": "takes minutes", "bench_": "measures",
    "tip_sheet": "makes a picture to be looked at", "path_study": "needs the recordings of others",
    "tip_variations": "needs the recordings of others",
    "tip_study": "takes minutes", "ceiling_study": "takes minutes",
    "sampled_evidence_cases": "serves a test",
}
FOLDERS = {path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith((".", "build", "out"))}


def pages():
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "examples/README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in files}


@functools.cache
def all_commands():
    found = (command for page, text in pages().items() for command in commands.commands_of(page, text))
    return [command for command in found if is_command(command)]


@functools.cache
def output_of(*words):
    done = subprocess.run(words, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, cwd=ROOT, timeout=120)
    return done.stdout + done.stderr


def file_of(program):
    """The file that a document's name of a program means; None: of the system."""
    if program.startswith("build/bin/"):
        return BUILD / program.removeprefix("build/")
    if program.startswith("bevel-"):
        return next((path for path in (BUILD / "bin" / program, ROOT / "tools" / program) if path.exists()),
                    BUILD / "bin" / program)
    return ROOT / program if "/" in program else None


def is_command(command):
    """Not a folder or a file of the sources that stands where a command might, nor what a program says ("bevel-rig: ...").
    Told by its name: a program that may not be executed is a fault of the document or the program."""
    file = file_of(command.program.rstrip("/"))
    return not (file and file.is_dir()) and (
        not re.search(r"[*<{]|\.(hpp|cpp|md|toml|py|csv|txt)$|[/:]$", command.program) or
        command.program.endswith("kills.py"))


class Documents(unittest.TestCase):
    def each(self, check):
        """How many of the commands `check` had something to say of; each failure has the place of its command."""
        checked = 0
        for command in all_commands():
            with self.subTest(f"{command.page}:{command.line}: {command.text}"):
                checked += check(command) is not False
        return checked

    def test_there_are_commands(self):
        found = collections.Counter(command.page for command in all_commands())
        for page, least in (("README.md", 15), ("docs/estimator.md", 8), ("docs/import.md", 4)):
            self.assertGreaterEqual(found[page], least)
        print(f"{sum(found.values())} commands in {len(found)} pages")

    def test_programs_are_there(self):
        def check(command):
            file = file_of(command.program)
            self.assertTrue(file is None or os.access(file, os.X_OK), f"no program {file}")

        self.each(check)

    def test_options_are_known(self):
        def check(command):
            file = file_of(command.program)
            if file is None or not command.options or file.name.startswith(("test_", "bench_", "study_")):
                return False
            known = output_of(str(file), "--help")
            for option in command.options:
                self.assertRegex(known, rf"(?<![\w-]){re.escape(option)}(?![\w-])", f"no option {option}")
            return True

        self.assertGreater(self.each(check), 40)

    def test_names_of_tests_are_of_some(self):
        def check(command):
            name = command.program.rpartition("/")[2]
            if name.startswith("test_"):
                words = [word for word in command.words[1:] if word.startswith("--gtest_filter")]
                self.assertIn("  ", output_of(str(file_of(command.program)), "--gtest_list_tests", *words))
            elif name == "ctest" and not re.search(r"-[RL] [A-Z]+\b", command.text):  # NAME: the reader's
                listed = output_of("ctest", "--test-dir", str(BUILD), "-N",
                                   *(word for word in command.words[1:] if word not in ("--test-dir", "build")))
                self.assertRegex(listed, r"Total Tests: [1-9]", listed[-300:])
            elif name == "cmake" and "--preset" in command.words:
                presets = json.loads((ROOT / "CMakePresets.json").read_text(encoding="utf-8"))["configurePresets"]
                self.assertIn(command.words[command.words.index("--preset") + 1], [preset["name"] for preset in presets])
            else:
                return False
            return True

        self.assertGreater(self.each(check), 10)

    def test_files_of_the_sources_are_there(self):
        def check(command):
            named = [word.partition("=")[2] or word for word in command.words[1:]]
            named = [path for path in named if "/" in path and path.split("/")[0] in FOLDERS and not re.search(r"[*$A-Z]", path)]
            for path in named:
                self.assertTrue((ROOT / path).exists(), f"no {path}")
            return bool(named)

        self.assertGreater(self.each(check), 8)

    def test_each_is_run_or_has_a_reason(self):
        texts = {(command.page, command.text) for command in all_commands()}
        for page, text in RUN:
            self.assertIn((page, text), texts, "is run here and stands there no more")
        reasons = collections.Counter()

        def check(command):
            if (command.page, command.text) in RUN:
                return
            name = command.program.removeprefix("build/bin/")
            reason = next((key for key in ONLY_CHECKED if key in (name, f"tools/{name}") or
                           (key.endswith("_") and name.startswith(key))), None)
            self.assertIsNotNone(reason, "is neither run by this test nor named in it with a reason why not")
            reasons[reason] += 1

        self.each(check)
        for name, count in sorted(reasons.items()):
            print(f"only options checked: {name} ({count}): {ONLY_CHECKED[name]}")

    def test_what_is_quick_runs_as_it_stands(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            furnish(folder)
            for page, text in RUN:
                if text.startswith("tools/fleet") and sys.version_info < (3, 11):
                    continue
                with self.subTest(f"{page}: {text}"):
                    done = subprocess.run(["bash", "-ec", text], cwd=folder, capture_output=True, text=True, check=False,
                                          timeout=240, stdin=subprocess.DEVNULL)
                    self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


def furnish(folder):
    """What the commands of the documents name: this build and tools, a model, recordings of two days, CSV files."""
    (folder / "build").mkdir()
    (folder / "build/bin").symlink_to(BUILD / "bin")
    (folder / "tools").symlink_to(ROOT / "tools")
    subprocess.run([BUILD / "bin/bevel-blindtrial", "--trials", "1", "--seed-file", "-", "--out", folder / "trials",
                    "--generate-only"], check=True, stdout=subprocess.DEVNULL, input=b"8")
    case = next((folder / "trials/trials").glob("t*/case"))
    logs = sorted(case.glob("rec*.lcm"))
    shutil.copy(case / "model.toml", folder)
    for where, which in ((".", logs[:2]), ("monday", logs[:2]), ("tuesday", logs[2:4])):
        (folder / where).mkdir(exist_ok=True)
        for log in which:
            shutil.copy(log, folder / where)
    (folder / "cases.csv").write_text("case,rig,date,model,logs\nmonday,bench,2026-03-30,model.toml,monday\n", encoding="utf-8")
    two_instruments(folder, logs[:2])


def two_instruments(folder, logs):
    """The files of docs/import.md, of real recordings: the tip in metres with decimal commas, the base in ms and degrees."""
    page = pages()["docs/import.md"]
    (folder / "map.toml").write_text(re.search(r"```toml\n(\[time\].*?)```", page, re.S)[1], encoding="utf-8")
    subprocess.run([BUILD / "bin/bevel-export", "--out", folder / "csv", *logs], check=True, stdout=subprocess.DEVNULL)
    for kind in ("tip", "base"):
        (folder / kind).mkdir()
    for log in logs:
        def rows(name, log=log):
            header, *lines = (folder / "csv" / log.stem / f"{name}.csv").read_text(encoding="utf-8").splitlines()
            return [dict(zip(header.split(","), line.split(","))) for line in lines]

        tips, base = rows("tip_measurement"), rows("actuator_state")
        tips = list({int(row["utime"]): row for row in sorted(tips, key=lambda row: int(row["utime"]))}.values())
        start = int(base[0]["utime"])
        with open(folder / "tip" / f"{log.stem}.csv", "w", encoding="utf-8") as file:
            file.write("t;x;y;z\n")
            for row in tips:
                cells = [f"{(int(row['utime']) - start) / 1e6:.6f}"]
                cells += [f"{float(row[f'{axis}_mm']) / 1000:.9f}" if row[f"{axis}_mm"] else "" for axis in "xyz"]
                file.write(";".join(cells).replace(".", ",") + "\n")
        with open(folder / "base" / f"{log.stem}.csv", "w", encoding="utf-8") as file:
            file.write("time_ms,depth_mm,roll_deg\n")
            for row in base:
                file.write(f"{(int(row['utime']) - start) / 1000},{row['insertion_mm']},"
                           f"{float(row['rotation_rad']) * 57.29577951308232}\n")


if __name__ == "__main__":
    unittest.main(verbosity=2)
