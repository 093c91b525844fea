#!/usr/bin/env python3
"""Checks the first steps of a reader who has nothing but the sources, README.md and examples/README.md.

The commands are taken from the two pages in their order. The build folder of this test starts empty. A command that
builds adds the programs that it names, so that a page that names a program before its build fails here. The programs
themselves are links into BUILD_DIR. The commands of the example run as they stand, and the figures in
examples/README.md and examples/stick_slip are compared with their results.

Usage: first_steps_test.py BUILD_DIR [unittest OPTION...]
"""
import functools
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/documents"))
import commands  # noqa: E402

BUILD = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else "build").resolve()
TARGETS = re.compile(r"cmake --build \S+ --target ([\w -]+)")
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
        # What a script builds with all its options given or left out.
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

    def test_finds_the_concealed_effect(self):
        self.assertEqual([effect["name"] for effect in self.effects], ["stick_slip"])
        concealed_mm = float(re.search(r"([\d.]+) mm was\s+concealed", read("examples/README.md"))[1])
        low, high = self.effects[0]["parameters"]["jump_mm"]["ci95"]
        self.assertTrue(low - 5e-5 <= concealed_mm <= high + 5e-5, (low, concealed_mm, high))  # the page has four digits
        # By a jump at most.
        self.assertTrue(0 < self.effects[0]["moved_at_depth_mm"] <= 0.88, self.effects)

    def test_predicts_better(self):
        before, after = (self.verdict["fit"][which]["chi2_per_dof"] for which in ("before", "after"))
        self.assertEqual((f"{before:.1f}", f"{after:.1f}"), ("2.2", "1.0"))

    def test_steers_to_targets(self):
        for model in ("as_it_stands", "found"):
            figures = self.verdict["steered"][model]
            self.assertEqual(figures["arrived"], 8)
            self.assertTrue(0 < figures["median_mm"] <= figures["worst_mm"] < 1, figures)


if __name__ == "__main__":
    unittest.main(verbosity=2)
