#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks the first steps of a reader who has nothing but the sources, README.md and examples/README.md.

The commands are taken from the two pages in their order. The build folder of this test starts empty. A command that
builds adds the programs that it names, so that a page that names a program before its build fails here. The programs
themselves are links into BUILD_DIR. The commands of the example run as they stand, and the figures in
examples/README.md and examples/stick_slip are compared with their results.

Usage: first_steps_test.py BUILD_DIR [unittest OPTION...]
"""
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

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/documents"))
import commands  # noqa: E402

BUILD = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else "build").resolve()
TARGETS = re.compile(r"cmake --build \S+ --target ([\w -]+)")
AGAIN = "BEVEL_UPDATE_EXAMPLE=1 python3 tests/examples/first_steps_test.py BUILD_DIR writes page and report anew"
USES = re.compile(r'^[^#\n]*"\$(?:root/)?build/bin/([\w-]+)"', re.M)


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def pages_in_order():
    """Commands of README.md; those of examples/README.md follow the README's last command that runs a program."""
    first, then = ([command for command in commands.in_blocks(page, read(page)) if not command.program.endswith("/")]
                   for page in ("README.md", "examples/README.md"))
    at = max(i for i, command in enumerate(first) if command.program.startswith("build/bin/"))
    return first[:at + 1] + then + first[at + 1:]


@functools.cache
def known_targets():
    listed = subprocess.run(["cmake", "--build", BUILD, "--target", "help"], capture_output=True, text=True, check=True)
    return {re.split(r"[\s:]", line)[0] for line in listed.stdout.splitlines()}


def targets_of(command):
    """Programs that a command builds in build/; None: all of them."""
    if command.program == "cmake" and command.words[1:3] == ("--build", "build"):
        return set(command.words[4:]) if "--target" in command.words else None
    if command.program.startswith("tools/"):
        # A script may build more with some options; each target counts.
        return {name for found in TARGETS.findall(read(command.program)) for name in found.split()}
    return set()  # tools/test and .ci/run build all, but a reader may leave them out


def needs_of(command):
    """Programs of build/bin without which a command fails; None: all of them."""
    if command.program.startswith("build/bin/"):
        return {command.program.removeprefix("build/bin/")}
    if command.program == "ctest":
        return None
    if command.program.startswith("tools/"):
        return set(USES.findall(read(command.program)))
    return set()


class FirstSteps(unittest.TestCase):
    def test_every_program_is_built_before_it_is_used(self):
        built, checked = set(), 0
        for command in pages_in_order():
            with self.subTest(f"{command.page}:{command.line}: {command.text}"):
                targets, needs = targets_of(command), needs_of(command)
                if targets is None or built is None:
                    built = None
                    continue
                self.assertLessEqual(targets, known_targets(), "no such target")
                built |= targets
                self.assertIsNotNone(needs, "needs a whole build before it")
                self.assertLessEqual(needs, built, "is not built by the commands before it")
                checked += len(needs)
        self.assertGreaterEqual(checked, 3)  # a diagnosis and two replays
        self.assertIsNone(built, "README.md has no command that builds all")


class Example(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        (cls.folder / "build/bin").mkdir(parents=True)
        (cls.folder / "examples").symlink_to(ROOT / "examples")
        cls.commands = []
        for command in pages_in_order():
            for name in targets_of(command) or ():
                link = cls.folder / "build/bin" / name
                if (BUILD / "bin" / name).exists() and not link.is_symlink():
                    link.symlink_to(BUILD / "bin" / name)
            if not command.program.startswith("build/bin/") or command.text in cls.commands:
                continue
            cls.commands.append(command.text)
            done = subprocess.run(["bash", "-ec", command.text], cwd=cls.folder, capture_output=True, text=True, check=False,
                                  stdin=subprocess.DEVNULL)
            if done.returncode != 0:
                raise AssertionError(f"{command.page}:{command.line}: {command.text}\n{done.stdout}{done.stderr}")

        cls.verdict = json.loads((cls.folder / "out/stick_slip/verdict.json").read_text(encoding="utf-8"))
        cls.effects = cls.verdict["effects"]

    def test_commands_were_run(self):
        self.assertGreaterEqual(len(self.commands), 3, self.commands)

    def figures(self):
        """Returns the figures of the result, by the names of the rows in examples/README.md."""
        effect, fit, steered = self.effects[0], self.verdict["fit"], self.verdict["steered"]
        jump = effect["parameters"]["jump_mm"]
        return {
            "verdict": f"{self.verdict['verdict']}: {' + '.join(one['name'] for one in self.effects)}",
            "probability": effect["probability"],
            "jump": jump["value"],
            "standard error of the jump": jump["std_error"],
            "chi2 per measurement, predicted insertions, needle refitted": fit["before"]["chi2_per_dof"],
            "chi2 per measurement, predicted insertions, with the effect": fit["after"]["chi2_per_dof"],
            "chi2 per measurement, residuals of the final model": self.verdict["checks"]["chi2_per_dof"],
            "targeting error in simulation, model file as it is": steered["as_it_stands"]["median_mm"],
            "targeting error in simulation, model with the effect": steered["found"]["median_mm"],
        }

    def test_the_page_has_the_figures_of_the_result(self):
        rows, figures = table_rows(read("examples/README.md")), self.figures()
        self.assertEqual([name for name, *_ in rows], list(figures))
        for name, value, tolerance in rows:
            with self.subTest(name):
                if tolerance == "exact":
                    self.assertEqual(value, figures[name], AGAIN)
                else:
                    # The page rounds to its last digit.
                    digit = 0.5 * 10 ** -len(value.split()[0].partition(".")[2])
                    self.assertAlmostEqual(number(value), figures[name], delta=number(tolerance) + digit, msg=AGAIN)

    def test_the_shipped_report_is_that_of_the_program(self):
        shipped, made = (outline((folder / "report.html").read_text(encoding="utf-8"))
                         for folder in (ROOT / "examples/stick_slip", self.folder / "out/stick_slip"))
        self.assertEqual(shipped[0], made[0], AGAIN)
        self.assertGreater(len(made[1]), 10)
        for of_page, of_program in zip(shipped[1], made[1]):
            self.assertAlmostEqual(of_page, of_program, delta=0.1 * abs(of_program), msg=AGAIN)

    def test_the_concealed_jump_is_in_the_interval(self):
        concealed_mm = float(re.search(r"slips by ([\d.]+) mm", read("examples/README.md"))[1])
        low, high = self.effects[0]["parameters"]["jump_mm"]["ci95"]
        self.assertTrue(low - 5e-5 <= concealed_mm <= high + 5e-5, (low, concealed_mm, high))  # the page has four digits

    def test_what_is_left_is_consistent_with_the_noise(self):
        checks = self.verdict["checks"]
        self.assertTrue(checks["band99"][0] < checks["chi2_per_dof"] < checks["band99"][1], checks)
        self.assertTrue(checks["clean"], checks)

    def test_every_steered_needle_arrives(self):
        for model in ("as_it_stands", "found"):
            self.assertEqual(self.verdict["steered"][model]["arrived"], self.verdict["steered"]["targets"])


def number(text):
    return float(text.split()[0])


def table_rows(page):
    """Rows of the table of figures: name, value, tolerance."""
    rows = [[cell.strip() for cell in line.strip("|\n ").split("|")] for line in page.splitlines() if line.startswith("|")]
    return [row for row in rows[2:] if len(row) == 3]


def outline(html):
    """Headings and verdict of a report with # in place of each number, and the numbers."""
    parts = re.findall(r"<h[1-3][^>]*>(.*?)</h[1-3]>|<section class=\"verdict[^>]*>(.*?)</section>", html, re.S)
    text = [" ".join(re.sub(r"<[^>]*>", " ", "".join(part)).split()) for part in parts]
    figure = r"\d+(?:\.\d+)?"
    return [re.sub(figure, "#", one) for one in text], [float(one) for one in re.findall(figure, " ".join(text))]


def update(example):
    """Writes the example's report and the values in the table of examples/README.md anew."""
    shutil.copy(example.folder / "out/stick_slip/report.html", ROOT / "examples/stick_slip/report.html")
    page = read("examples/README.md")
    for name, value in example.figures().items():
        old = next(row for row in table_rows(page) if row[0] == name)[1]
        new = value
        if not isinstance(value, str):
            words = old.split()
            new = " ".join([f"{value:.{len(words[0].partition('.')[2])}f}", *words[1:]])
        page = page.replace(f"| {name} | {old} |", f"| {name} | {new} |")
    (ROOT / "examples/README.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    if os.environ.get("BEVEL_UPDATE_EXAMPLE"):
        Example.setUpClass()
        update(Example("test_commands_were_run"))
        Example.doClassCleanups()
        sys.exit(0)
    unittest.main(verbosity=2)
