#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""tools/fleet by its parts and as a whole, with stand_in.py in place of bevel-diagnose.

Usage: fleet_test.py [unittest OPTION...]. Status 77 where Snakemake, Dask and pyarrow are not there (tools/setup --fleet).
"""
import datetime
import io
import math
import os
import pathlib
import random
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
STAND_IN = ROOT / "tests/fleet/stand_in.py"
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / ".deps/fleet")]
try:
    import distributed  # noqa: F401
    import numpy
    import pyarrow.parquet
except ModuleNotFoundError as missing:
    print(f"skipped: no Python package {missing.name}; tools/setup --fleet gets it")
    sys.exit(77)
from fleet_program import cases, drift, page, progress, rollup  # noqa: E402


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="fleet_test-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.out = self.folder / "out"

    def case(self, name, model="", logs=("one", "two")):
        case = self.folder / "cases" / name
        case.mkdir(parents=True)
        (case / "model.toml").write_text(model, encoding="utf-8")
        for i, text in enumerate(logs, 1):
            (case / f"rec{i:02}.lcm").write_text(text, encoding="utf-8")
        return case

    def table(self, text, name="fleet.csv"):
        (self.folder / name).write_text(text, encoding="utf-8")
        return self.folder / name

    def fault(self, path):
        with self.assertRaises(cases.Fault) as raised:
            cases.read_fleet(path)
        return str(raised.exception)


class Table(InFolder):
    def test_csv_and_toml_and_folder_give_the_same_cases(self):
        for name in ("A/1", "A/2"):
            self.case(name)
        csv = self.table("case,rig,date,model,logs\nA/1,A,2026-03-01,cases/A/1/model.toml,cases/A/1\n"
                         "A/2,A,2026-03-02T14:30+02:00,cases/A/2/model.toml,cases/A/2/rec01.lcm; cases/A/2/rec02.lcm\n")
        toml = self.table("".join(f'[[cases]]\ncase = "A/{i}"\nrig = "A"\ndate = {date}\nmodel = "cases/A/{i}/model.toml"\n'
                                  f'logs = ["cases/A/{i}"]\n'
                                  for i, date in ((1, "2026-03-01"), (2, "2026-03-02T12:30:00"))), "fleet.toml")
        of_csv, of_toml, of_folder = (cases.read_fleet(path) for path in (csv, toml, self.folder / "cases"))
        self.assertEqual(of_csv, of_toml)
        self.assertEqual(of_csv[1].date, datetime.datetime(2026, 3, 2, 12, 30))
        self.assertEqual([(c.name, c.rig, c.model, c.logs) for c in of_csv],
                         [(c.name, c.rig, c.model, c.logs) for c in of_folder])

    def test_tables_of_spreadsheets_are_read(self):
        self.case("a"), self.case("b", logs=("1", "2", "3"))
        header = ["case", "rig", "date", "model", "logs"]
        rows = [["a", "A", "2026-03-01", "cases/a/model.toml", "cases/a"],
                ["b", "A", "2026-03-02", "cases/b/model.toml", "cases/b/rec01.lcm; cases/b/rec02.lcm"]]

        def text(separator, end, quote):
            cells = [f'"{cell}"' if quote and ";" in cell else cell for row in [header, *rows] for cell in row]
            lines = [separator.join(cells[i:i + 5]) for i in range(0, 15, 5)]
            return end.join(lines) + end

        wanted = cases.read_fleet(self.table(text(",", "\n", False)))
        self.assertEqual([len(case.logs) for case in wanted], [2, 2])
        for what in (text(";", "\n", True), text("|", "\n", False), text("\t", "\r\n", False), text(",", "\r", False),
                     "sep=;\r\n" + text(";", "\r\n", True), "\ufeffsep=|\n" + text("|", "\n", False),
                     "# " + text(",", "\n", False), "# bench A\n\n" + text(";", "\n", True),
                     text(";", ";;\n", True) + ";;;;;;\n",
                     text(",", "\n", False).replace("\n", "\r\n", 1)):
            with open(self.folder / "fleet.csv", "w", newline="", encoding="utf-8") as file:
                file.write(what)
            self.assertEqual(cases.read_fleet(self.folder / "fleet.csv"), wanted, what)
        self.assertIn("stand in quotes", self.fault(self.table(text(";", "\n", False))))
        self.assertIn("allowed: sep=", self.fault(self.table("sep=:\n" + text(",", "\n", False))))
        (self.folder / "fleet.csv").write_bytes("case,rig,date,model,logs\nä,A,,m,l\n".encode("cp1252"))
        self.assertIn('"CSV UTF-8"', self.fault(self.folder / "fleet.csv"))

    def test_folders_have_logs_by_the_names_of_lcm_logger(self):
        case = self.case("a", logs=())
        log = struct.pack(">I", cases.LOG_SYNC)
        for name, begin in (("lcmlog-2026-03-02.00", b""), ("lcmlog-2026-03-02.01", b""), ("rec.lcm.10", b""),
                            ("rec.lcm.2", b""), ("run.00", log), ("run", log), ("notes.00", b"text"), ("Makefile", b"all"),
                            ("rec.lcm.unfinished", log), ("rec.lcm.bak", log)):
            (case / name).write_bytes(begin)
        (case / "sub.lcm").mkdir()
        for found in (cases.read_fleet(self.folder / "cases"), cases.read_fleet(self.table(
                "case,rig,date,model,logs\na,A,,cases/a/model.toml,cases/a\n"))):
            self.assertEqual([log.name for log in found[0].logs],
                             ["lcmlog-2026-03-02.00", "lcmlog-2026-03-02.01", "rec.lcm.2", "rec.lcm.10", "run", "run.00"])

    def test_a_date_that_is_not_written_is_that_of_the_first_event(self):
        when = datetime.datetime(2026, 4, 5, 6, 7, 8, 250000)
        utime = int((when - datetime.datetime(1970, 1, 1)).total_seconds() * 1e6)
        case = self.case("A/1")
        (case / "rec01.lcm").write_bytes(struct.pack(">IQQ", 0xEDA1DA01, 0, utime) + b"more")
        self.assertEqual(cases.read_fleet(self.folder / "cases")[0].date, when)

    def test_faults_name_place_thing_and_what_is_allowed(self):
        self.case("c")
        good = "cases/c/model.toml,cases/c"
        for text, words in (("case,rig,date,model\n", ("csv:1", "no column 'logs'")),
                            ("case,rig,dat,model,logs\n", ("csv:1", "'dat'", "did you mean 'date'?")),
                            (f"case,rig,date,model,logs\n1,A,yesterday,{good}\n", ("csv:2", "'yesterday'", "2026-03-31")),
                            (f"case,rig,date,model,logs\n1,A,,{good}\n1,A,,{good}\n", ("csv:3", "'1'", "csv:2")),
                            ("case,rig,date,model,logs\n1,A,,no.toml,cases/c\n", ("csv:2", "no.toml", "no file")),
                            ("case,rig,date,model,logs\n1,A,,cases/c/model.toml,none\n", ("csv:2", "none", "no file")),
                            ("case,rig,date,model,logs\n1,A\n", ("csv:2", "2 cells", "5")),
                            (f"case,rig,date,model,logs\n1,,,{good}\n", ("csv:2", "'rig' is empty")),
                            ("case,rig,date,model,logs\n", ("has no case",)), ("", ("csv:1", "no column 'case'"))):
            said = self.fault(self.table(text))
            for word in words:
                self.assertIn(word, said)
        both = self.fault(self.table("case,rig,date,model,logs\n1,A,,x.toml,c\n2,A,,y.toml,c\n"))
        self.assertEqual(len(both.splitlines()), 2)
        self.assertIn("no.csv: is not there", self.fault(self.folder / "no.csv"))
        self.assertIn("allowed: .csv, .toml", self.fault(self.table("", "fleet.txt")))
        for text, word in (("[[case]]\n", "unknown key 'case'"), ("cases = 1\n", "[[cases]]"), ("cases = [", "fleet.toml"),
                           ('[[cases]]\ncase = "1"\nrig = "A"\nmodel = "m"\nlogs = 5\n', "texts"),
                           ('[[cases]]\ncase = 1\nrig = "A"\nmodel = "m"\nlogs = "l"\n', "texts")):
            self.assertIn(word, self.fault(self.table(text, "fleet.toml")))

    def test_a_key_changes_with_what_a_result_depends_on_and_with_nothing_else(self):
        self.case("a"), self.case("b"), self.case("c", logs=("one", "three"))
        a, b, c = cases.read_fleet(self.folder / "cases")

        def key(case, program="p", options=()):
            return cases.specification(case, "/bin/p", program, list(options))["key"]

        self.assertEqual(key(a), key(b))  # the same files elsewhere
        self.assertEqual(key(a), key(a, options=["--threads", "2"]))
        self.assertEqual(len({key(a), key(c), key(a, program="q")}), 3)
        a.logs.reverse()
        self.assertNotEqual(key(a), key(b))
        b.model.write_text("k = 1", encoding="utf-8")
        self.assertNotEqual(key(b), key(cases.read_fleet(self.folder / "cases")[0]))


class Figures(unittest.TestCase):
    def test_trend_is_that_of_numpy(self):
        draw = random.Random(5)
        days = [draw.uniform(20000, 20100) for _ in range(15)]
        sds = [draw.uniform(0.5, 2) for _ in days]
        values = [3 + 0.01 * t + draw.gauss(0, s) for t, s in zip(days, sds)]
        line = drift.trend(days, values, sds)
        centred = numpy.array(days) - line.at_mean_days
        fit, covariance = numpy.polyfit(centred, values, 1, w=1 / numpy.array(sds), cov="unscaled")
        self.assertAlmostEqual(line.per_day, fit[0], 9)
        self.assertAlmostEqual(line.mean, fit[1], 9)
        self.assertAlmostEqual(line.per_day_sd, math.sqrt(covariance[0, 0] * max(1, line.chi2_per_dof)), 9)
        tight = drift.trend(days, values, [s / 10 for s in sds])  # errors said too small: scatter takes their place
        scaled = numpy.polyfit(centred, values, 1, w=1 / numpy.array(sds), cov=True)[1]
        self.assertAlmostEqual(tight.per_day_sd, math.sqrt(scaled[0, 0]), 9)

    def test_trend_is_none_where_there_is_none_to_be_had(self):
        self.assertIsNone(drift.trend([1, 2], [1, 2], [1, 1]))
        self.assertIsNone(drift.trend([5, 5, 5], [1, 2, 3], [1, 1, 1]))
        self.assertIsNone(drift.trend([1, 2, 3], [1, 2, 3], [1, None, 1]))

    def test_deviation_of_the_noise_is_what_it_scatters_by(self):
        seed, r, count = 7, 0.6, 400
        draw = numpy.random.default_rng(seed)
        sigmas = []
        for _ in range(400):
            white = draw.normal(size=count + 100)
            noise = numpy.zeros(count + 100)
            for i in range(1, count + 100):
                noise[i] = r * noise[i - 1] + math.sqrt(1 - r * r) * white[i]
            sigmas.append(numpy.sqrt(numpy.mean(noise[100:]**2)))
        _, sd = rollup.noise_of({"sigma_mm": [1.0], "units": ["mm"], "ar1": r}, count)
        # The scatter of 400 is itself known to 1 / sqrt(800), 3.5 %.
        self.assertAlmostEqual(numpy.std(sigmas) / sd, 1, delta=0.15, msg=f"seed {seed}")

    def test_noise_is_of_the_channels_in_mm(self):
        sigma, sd = rollup.noise_of({"sigma_mm": [0.3, 0.4, 0.01], "units": ["mm", "mm", "rad"], "ar1": 0.0}, 400)
        self.assertAlmostEqual(sigma, math.sqrt((0.09 + 0.16) / 2))
        self.assertAlmostEqual(sd, sigma / math.sqrt(2 * 400 * 2))
        self.assertEqual(rollup.noise_of({"sigma_mm": [None], "ar1": 0.0}, 400), (None, None))


class AsAWhole(InFolder):
    def fleet(self, *arguments, status=0, program=STAND_IN):
        done = subprocess.run([ROOT / "tools/fleet", self.folder / "cases", "--out", self.out, "--program", program,
                               *arguments], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def made(self):
        """Case -> when its result was made; a result that is there keeps it."""
        return {row["case"]: (self.out / "results" / row["key"]).stat().st_mtime_ns for row in self.rows()
                if row["verdict"] is not None}

    def rows(self):
        return pyarrow.parquet.read_table(self.out / "fleet.parquet").to_pylist()


class Whole(AsAWhole):
    def test_a_fleet_goes_on_and_does_only_what_is_new(self):
        for name, model in (("A/1", ""), ("A/2", "k = 0.005"), ("B/1", "status = 3"), ("B/2", "status = 1")):
            self.case(name, model, (name, "two"))
        first = self.fleet("--jobs", "2", status=1)
        self.assertIn("B/2: stand_in: rec01.lcm: is no recording", first.stderr)
        rows = {row["case"]: row for row in self.rows()}
        self.assertEqual([row["exit_status"] for row in rows.values()], [0, 0, 3, None])
        self.assertAlmostEqual(rows["A/2"]["curvature_per_mm"], 0.005)
        self.assertAlmostEqual(rows["A/2"]["noise_mm"], math.sqrt((0.09 + 0.16) / 2))
        self.assertEqual(rows["A/1"]["logs"][0]["sha256"], cases.sha256_of(self.folder / "cases/A/1/rec01.lcm"))
        shown = (self.out / "index.html").read_text(encoding="utf-8")
        self.assertIn("B/2", shown)
        self.assertIn("is no recording", shown)
        before = self.made()

        (self.folder / "cases/B/2/model.toml").write_text("", encoding="utf-8")  # mended
        (self.folder / "cases/A/1/rec02.lcm").write_text("three", encoding="utf-8")
        old = rows["A/1"]["key"]
        self.assertIn("2 cases to be done", self.fleet(status=3).stderr)
        after = self.made()
        self.assertEqual({name for name in before if before[name] == after[name]}, {"A/2", "B/1"})
        self.assertEqual(len(after), 4)

        (self.folder / "cases/A/1/rec02.lcm").write_text("two", encoding="utf-8")  # as it was: its result is still there
        page_before = (self.out / "index.html").read_text(encoding="utf-8")
        again = self.fleet(status=3)
        self.assertNotIn("to be done", again.stderr)
        self.assertEqual({row["case"]: row["key"] for row in self.rows()}["A/1"], old)
        self.assertNotEqual(page_before, (self.out / "index.html").read_text(encoding="utf-8"))
        self.assertEqual([path.name for path in (self.out / "work").glob("*-*")], [])

        verdicts = {row["key"]: (self.out / "results" / row["key"] / "verdict.json").read_bytes() for row in self.rows()}
        self.out = self.folder / "by dask"  # and a folder's name with a space
        self.fleet("--engine", "dask", "-q", status=3)
        self.assertEqual(verdicts, {key: (self.out / "results" / key / "verdict.json").read_bytes() for key in verdicts})

    def test_braces_and_blanks_in_paths_are_taken_as_they_are(self):
        self.folder = self.folder / "in_{run} {{1}} 'a' $HOME %s {wildcards.key}"
        self.out = self.folder / "out_{x} {"
        self.case("A/{1}"), self.case("A/2")
        program = self.folder / "stand {in}.py"
        shutil.copy2(STAND_IN, program)
        for engine in ("snakemake", "dask"):
            self.out = self.out.with_name(self.out.name + engine)
            self.fleet("--engine", engine, program=program)
            self.assertEqual([row["case"] for row in self.rows() if row["verdict"]], ["A/2", "A/{1}"])

    def test_interrupted_it_leaves_nothing_half_and_goes_on(self):
        for i in range(2):
            self.case(f"A/{i}", "seconds = 60", (str(i), "two"))
        for engine, word in (("snakemake", signal.SIGINT), ("dask", signal.SIGTERM)):
            fleet = subprocess.Popen([ROOT / "tools/fleet", self.folder / "cases", "--out", self.out, "--program", STAND_IN,
                                      "--engine", engine, "--jobs", "1"], stderr=subprocess.PIPE, text=True)
            for _ in range(600):  # until a case is at work
                time.sleep(0.1)
                if any((self.out / "work").glob("*-*/")) and self.at_work():
                    break
            self.assertTrue(self.at_work())
            if engine == "snakemake":
                self.assertIn("another tools/fleet is at work", self.fleet(status=1).stderr)
            fleet.send_signal(word)
            said = fleet.communicate(timeout=60)[1]
            self.assertEqual(fleet.returncode, 130, said)
            self.assertIn("the same command goes on", said)
            for _ in range(100):  # a process that was told to end needs a moment
                if not self.at_work():
                    break
                time.sleep(0.1)
            self.assertEqual(self.at_work(), [])
            self.assertEqual(list((self.out / "results").iterdir()), [])
            self.assertEqual([path.name for path in (self.out / "work").glob("run-*")], [])

    def at_work(self):
        found = []
        for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
            try:
                line = path.read_bytes().decode(errors="replace")
            except OSError:
                continue
            if str(self.out) in line and "stand_in.py" in line and "--model" in line and "setpriv" not in line:
                found.append(line)
        return found

    def test_bad_usage_is_named_before_anything_is_made(self):
        self.case("A/1")
        for arguments, word in ((["--jbos", "2"], "did you mean --jobs?"), (["--jobs", "0"], "allowed: 1 to 100000"),
                                (["--engine", "make"], "snakemake"), (["--engine", "dask", "--slurm"], "--engine snakemake"),
                                (["--scheduler", "tcp://h:1"], "--engine dask")):
            self.assertIn(word, self.fleet(*arguments, status=2).stderr)
        self.assertIn("no program", self.fleet(status=1, program=self.folder / "none").stderr)
        self.assertFalse(self.out.exists())
        said = subprocess.run([ROOT / "tools/fleet"], capture_output=True, text=True, check=False)
        self.assertEqual((said.returncode, "FLEET is required" in said.stderr), (2, True))

    def test_a_scheduler_that_is_not_there_is_said(self):
        self.case("A/1")
        said = self.fleet("--engine", "dask", "--scheduler", "tcp://127.0.0.1:9", status=1).stderr
        self.assertIn("127.0.0.1:9", said)
        self.assertIn("the same command goes on", said)


class Slurm(AsAWhole):
    def test_slurm_gets_a_job_a_case_and_what_else_it_was_asked_for(self):
        """Against slurm_stand_in.py: what Snakemake's executor asks of Slurm, not what a real one makes of it."""
        self.folder = self.folder / "in_{run}"
        self.out = self.folder / "out_{x}"
        self.case("A/1")
        tools = self.folder / "tools"
        tools.mkdir()
        for name in ("sbatch", "srun", "sacct", "sacctmgr", "scancel", "sinfo"):
            (tools / name).symlink_to(ROOT / "tests/fleet/slurm_stand_in.py")
        os.environ.update(STAND_IN_FOR_SLURM=str(self.folder), PATH=f"{tools}:{os.environ['PATH']}")
        arguments = ["--slurm", "--threads", "4", "--", "--default-resources", "slurm_partition=long", "slurm_account=lab",
                     "--slurm-init-seconds-before-status-checks", "1", "--seconds-between-status-checks", "1"]
        said = self.fleet("--dry-run", *arguments).stdout
        self.assertIn("--executor slurm --jobs 100 ", said)
        self.assertFalse(self.out.exists())
        self.fleet(*arguments)
        self.assertEqual([row["verdict"] is not None for row in self.rows()], [True])
        asked = (self.folder / "calls.txt").read_text(encoding="utf-8").splitlines()
        jobs = [call for call in asked if call.startswith("sbatch")]
        self.assertEqual(len(jobs), 1)
        for words in ("-p long", "-A lab", "--cpus-per-task=4"):
            self.assertIn(words, jobs[0].replace("'", ""))


class Page(unittest.TestCase):
    def test_shows_what_drifts_and_escapes_what_it_was_given(self):
        names = rollup.schema().names
        rows = [{**dict.fromkeys(names), "case": f"<{i}>", "rig": "A&B", "key": "ff", "effects": [], "verdict": "nothing-missing",
                 "date": datetime.datetime(2026, 1, 1 + i), "curvature_per_mm": 0.004 + 1e-5 * i,
                 "curvature_sd_per_mm": 1e-6} for i in range(6)]
        shown = page.html(rows, "f")
        self.assertIn("A&amp;B: 6 cases", shown)
        self.assertIn("&lt;3&gt;", shown)
        self.assertNotIn("<3>", shown)
        self.assertIn("<tr class=drifts><td>k", shown)
        self.assertIn("1e-5 ±", shown)
        self.assertEqual(shown.count("<circle"), 6)
        still = page.html([{**row, "curvature_per_mm": 0.004} for row in rows], "f")
        self.assertNotIn("class=drifts", still)

    def test_says_verdicts_and_sizes_in_words_with_their_units(self):
        names = rollup.schema().names
        found = [{"effect": "friction", "parameter": "loss_per_mm", "value": 0.1029, "std_error": 0.01},
                 {"effect": "camera_latency", "parameter": "latency_s", "value": 0.04, "std_error": 0.002},
                 {"effect": "unknown", "parameter": None, "value": None, "std_error": None}]
        row = {**dict.fromkeys(names), "case": "c", "rig": "r", "key": "ff", "effects": found, "verdict": "effects-found",
               "date": datetime.datetime(2026, 1, 1)}
        shown = page.html([row], "f")
        self.assertIn("<span>effects found</span><b>1</b>", shown)
        self.assertIn("friction: loss 0.1029 ± 0.01 1/mm<br>camera_latency: latency 0.04 ± 0.002 s<br>unknown", shown)
        self.assertIn("prefers-color-scheme: dark", shown)
        self.assertNotRegex(shown.split("</style>")[1], r"#[0-9a-f]{3}")  # a colour that would stay as it is in the dark


class Progress(unittest.TestCase):
    """As tests/help/progress_line_test.cpp, by the same figures."""

    class Screen(io.StringIO):
        def isatty(self):
            return True

    def test_nothing_remains_without_evidence(self):
        for done, at_a_time, elapsed_s, left_s in ((0, 1, 5, None), (3, 1, 5, None), (7, 8, 5, None), (4, 1, 0, None),
                                                   (4, 1, 8, 192), (8, 8, 8, 92), (100, 1, 8, 0)):
            self.assertEqual(progress.remaining_s(done, 100, at_a_time, elapsed_s), left_s)

    def test_words(self):
        for seconds, words in ((-1, "0 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (185, "3 min 05 s"), (3599.7, "1 h 00 min"),
                               (90061, "25 h 01 min")):
            self.assertEqual(progress.in_words(seconds), words)
        self.assertEqual(progress.text(12, 100, 2, 185),
                         "12 of 100 cases done, 3 min 05 s so far, about 23 min left")
        self.assertEqual(progress.text(2, 100, 1, 30), "2 of 100 cases done, 30 s so far")

    def lines(self, out, pieces, each_s):
        now_s = [100.0]
        line = progress.Line(pieces, 2, out, lambda: now_s[0])
        for done in range(1, pieces + 1):
            now_s[0] += each_s
            line.show(done)
        line.show(pieces, last=True)
        return out.getvalue()

    def test_in_a_file_few_lines(self):
        self.assertEqual(self.lines(io.StringIO(), 100, 0.09), "")
        self.assertEqual(self.lines(io.StringIO(), 100, 0.35).splitlines(), [
            "fleet: 29 of 100 cases done, 10 s so far, about 25 s left",
            "fleet: 58 of 100 cases done, 20 s so far, about 15 s left",
            "fleet: 87 of 100 cases done, 30 s so far, about 5 s left",
            "fleet: 100 of 100 cases done, 35 s so far"])

    def test_on_a_terminal_one_line_that_leaves_nothing_of_the_one_before(self):
        said = self.lines(self.Screen(), 6, 10).split("\r")
        self.assertEqual(said[4], "fleet: 4 of 6 cases done, 40 s so far, about 20 s left")
        self.assertEqual(said[6].rstrip(), "fleet: 6 of 6 cases done, 1 min 00 s so far")
        self.assertEqual(len(said[6]), len(said[5]))
        self.assertTrue(said[-1].endswith("\n"))


if __name__ == "__main__":
    os.environ.pop("PYTHONPATH", None)
    unittest.main(verbosity=2)
