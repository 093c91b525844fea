#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tests of the files around the code: workflows, versions, pinned tools, links between pages.

Usage: repository_test.py [unittest OPTION...]
Exit status: 0 passed, 1 failed, 77 passed but PyYAML is missing and tests that need it were skipped.
"""
import datetime
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

try:
    import yaml
except ImportError:
    yaml = None

ROOT = pathlib.Path(__file__).resolve().parents[2]
needs_yaml = unittest.skipIf(yaml is None, "PyYAML is missing; install the Debian package python3-yaml")


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def version():
    return re.search(r"^project\(bevel VERSION (\d+\.\d+\.\d+)", read("CMakeLists.txt"), re.M)[1]


def workflows():
    return sorted((ROOT / ".github/workflows").glob("*.yml"))


@needs_yaml
class Workflows(unittest.TestCase):
    def jobs(self):
        for path in workflows():
            for name, job in yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"].items():
                yield path.name, name, job

    def test_yaml_files_parse(self):
        for path in [*workflows(), ROOT / ".github/dependabot.yml", ROOT / ".pre-commit-config.yaml", ROOT / "CITATION.cff"]:
            with self.subTest(path.name):
                self.assertIsInstance(yaml.safe_load(path.read_text(encoding="utf-8")), dict)

    def test_each_run_step_is_one_script_of_the_repository(self):
        found = 0
        for file, name, job in self.jobs():
            for step in job["steps"]:
                if "run" not in step:
                    continue
                with self.subTest(f"{file}: {name}: {step['run']}"):
                    self.assertEqual(len(step["run"].strip().splitlines()), 1, "more than one command; write a script")
                    program, *words = shlex.split(step["run"])
                    self.assertTrue(os.access(ROOT / program, os.X_OK), f"{program} is missing or not executable")
                    if program.startswith("tools/"):
                        text = subprocess.run([ROOT / program, "--help"], capture_output=True, text=True, check=True).stdout
                        for option in (word for word in words if word.startswith("--")):
                            self.assertIn(option, text)
                    found += 1
        self.assertGreater(found, 7)

    def test_steps_of_ci_run_exist(self):
        known = re.search(r"^all=\((.*)\)$", read(".ci/run"), re.M)[1].split()
        for file, name, job in self.jobs():
            steps = job.get("strategy", {}).get("matrix", {}).get("steps", [])
            with self.subTest(f"{file}: {name}"):
                self.assertLessEqual(set(steps), set(known))

    def test_each_job_has_a_time_limit(self):
        for file, name, job in self.jobs():
            with self.subTest(f"{file}: {name}"):
                self.assertIn("timeout-minutes", job)

    def test_required_compilers_and_releases_are_covered(self):
        suite = next(job for _, name, job in self.jobs() if name == "suite")["strategy"]["matrix"]["include"]
        self.assertLessEqual({"gcc-12", "gcc-14"}, {entry["compiler"] for entry in suite})
        self.assertTrue(any(entry["compiler"].startswith("clang") for entry in suite))
        self.assertEqual({entry["image"] for entry in suite}, {"debian:12", "ubuntu:22.04", "ubuntu:24.04"})

    def test_hooks_have_the_pinned_versions(self):
        pinned = {line for line in read("tools/packages/lint.txt").splitlines() if line and not line.startswith("#")}
        repositories = yaml.safe_load(read(".pre-commit-config.yaml"))["repos"]
        hooks = [hook for repository in repositories for hook in repository["hooks"]]
        self.assertEqual({text for hook in hooks for text in hook.get("additional_dependencies", [])}, pinned)

    def test_citation_has_the_version(self):
        citation = yaml.safe_load(read("CITATION.cff"))
        self.assertEqual(citation["version"], version())
        self.assertIn(f"[{version()}] - {citation['date-released']}", read("CHANGELOG.md"))


class Versions(unittest.TestCase):
    def test_script_prints_the_version(self):
        printed = subprocess.run([ROOT / "tools/ci/version"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(printed.strip(), version())

    def test_changelog_begins_with_unreleased_and_the_version(self):
        headings = re.findall(r"^## (.*)$", read("CHANGELOG.md"), re.M)
        self.assertEqual(headings[0], "[Unreleased]")
        newest = re.fullmatch(r"\[(\d+\.\d+\.\d+)\] - (\d{4}-\d{2}-\d{2})", headings[1])
        self.assertIsNotNone(newest, headings[1])
        self.assertEqual(newest[1], version())
        datetime.date.fromisoformat(newest[2])

    def test_changelog_has_only_sections_of_keep_a_changelog(self):
        known = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
        self.assertLessEqual(set(re.findall(r"^### (.*)$", read("CHANGELOG.md"), re.M)), known)

    def test_python_package_has_the_version(self):
        if not (ROOT / "pyproject.toml").exists():
            self.skipTest("there is no pyproject.toml")
        text = read("pyproject.toml")
        fixed = re.search(r'^version\s*=\s*"([^"]+)"', text, re.M)
        if fixed:
            self.assertEqual(fixed[1], version())
        else:
            self.assertRegex(text, r"dynamic\s*=\s*\[[^\]]*\"version\"", "neither a version nor a dynamic version")

    def test_no_program_has_a_version_of_its_own(self):
        for path in ROOT.glob("*/**/CMakeLists.txt"):
            if "build" not in path.relative_to(ROOT).parts[0] and not path.relative_to(ROOT).parts[0].startswith("."):
                with self.subTest(str(path.relative_to(ROOT))):
                    self.assertNotRegex(path.read_text(encoding="utf-8"), rf'VERSION="?{re.escape(version())}')


class Containers(unittest.TestCase):
    def test_image_and_devcontainer_call_setup(self):
        self.assertRegex(read("Dockerfile"), r"(?m)^RUN tools/setup")
        self.assertEqual(json.loads(read(".devcontainer/devcontainer.json"))["postCreateCommand"], "tools/setup")


class Pages(unittest.TestCase):
    def test_links_between_pages_lead_to_files_and_headings(self):
        checked = 0
        for page in [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md")]:
            for target in re.findall(r"\]\(([^)\s]+)\)", without_code(page)):
                file, _, anchor = target.partition("#")
                if "://" in target:
                    continue
                with self.subTest(f"{page.relative_to(ROOT)}: {target}"):
                    leads_to = page.parent / file if file else page
                    self.assertTrue(leads_to.exists(), "the file is missing")
                    if anchor and leads_to.suffix == ".md":
                        self.assertIn(anchor, anchors(leads_to), "the heading is missing")
                checked += 1
        self.assertGreater(checked, 100)


def without_code(page):
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(page):
    """Names that GitHub gives to the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", without_code(page), re.M)
    plain = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower() for heading in headings)
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


class SpdxScript(unittest.TestCase):
    """tools/ci/spdx on a small temporary source tree."""

    def run_in_tree(self, files, *options):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        root = pathlib.Path(folder.name)
        (root / "tools/ci").mkdir(parents=True)
        script = root / "tools/ci/spdx"
        script.write_text(read("tools/ci/spdx"), encoding="utf-8")
        (root / "LICENSE").write_text(read("LICENSE"), encoding="utf-8")
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        environment = {**os.environ, "GIT_CEILING_DIRECTORIES": str(root.parent)}
        done = subprocess.run([sys.executable, script, *options], capture_output=True, text=True, check=False, env=environment)
        return done, lambda name: (root / name).read_text(encoding="utf-8")

    def test_missing_line_is_a_fault_with_its_file(self):
        done, _ = self.run_in_tree({"model/a.cpp": "int a;\n"})
        self.assertEqual(done.returncode, 1)
        self.assertIn("model/a.cpp:1: the SPDX line is missing; run tools/ci/spdx --add", done.stderr)

    def test_another_licence_is_a_fault(self):
        done, text = self.run_in_tree({"a.py": "# SPDX-License-Identifier: GPL-3.0-only\n"}, "--add")
        self.assertEqual(done.returncode, 1)
        self.assertIn("a.py:1: the licence is GPL-3.0-only; allowed: MIT", done.stderr)
        self.assertNotIn("MIT", text("a.py"))

    def test_added_lines_are_in_the_right_place(self):
        files = {
            "a.hpp": "#pragma once\n", "CMakeLists.txt": "project(a)\n", "b.py": "#!/usr/bin/env python3\n\"\"\"B.\"\"\"\n",
            "tools/run": "#!/usr/bin/env bash\n# Help.\nsed -n '2,/^[^#]/s/^# //p' \"$0\"\n",
        }
        done, text = self.run_in_tree(files, "--add")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(text("a.hpp"), "// SPDX-License-Identifier: MIT\n#pragma once\n")
        self.assertEqual(text("CMakeLists.txt"), "# SPDX-License-Identifier: MIT\nproject(a)\n")
        self.assertEqual(text("b.py"), "#!/usr/bin/env python3\n# SPDX-License-Identifier: MIT\n\"\"\"B.\"\"\"\n")
        self.assertIn("# SPDX-License-Identifier: MIT\n# Help.\nsed -n '3,/^[^#]/", text("tools/run"))

    def test_files_of_others_and_test_input_are_left_alone(self):
        files = {"third_party/a.js": "a", "tests/fuzz/corpus/csv/b.csv": "b", "examples/c.cpp": "c", "page/d.js": "d",
                 "tests/fuzz/corpus/can_frames/e": "#!e", "logs/f.lcm": "f"}
        done, text = self.run_in_tree(files, "--add")
        self.assertEqual(done.returncode, 0, done.stderr)
        for name, content in files.items():
            self.assertEqual(text(name), content)


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=1).result
    if not result.wasSuccessful():
        sys.exit(1)
    sys.exit(77 if yaml is None else 0)
