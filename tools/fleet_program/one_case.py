# SPDX-License-Identifier: MIT
"""Does one case: OUT/results/KEY is there afterwards, whole, or not at all.

Usage: python3 one_case.py AT_ONCE OUT KEY; OUT/cases/KEY.json says what to do. It is what every engine runs, alone.
Where engines start one more process than cases may be at work on this machine, AT_ONCE, it gets ready and waits for its turn,
so that no core waits for an interpreter to start; 0: it is always its turn.
Exit status: 0 the case has its answer, a result or a refusal of its input (OUT/refused/KEY.json); else worth another try.

A lock a case: where an engine was killed and its case goes on by itself, the same case of the next engine waits for it
and then finds it done. The program dies with this process, and holds the lock as well until it has.
"""
import contextlib
import fcntl
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import cases  # noqa: E402

DONE = (0, 3)  # 3: the input was damaged, and the verdict stands
LOOK_S = 0.02  # from one look for a turn to the next
ENDED_BY_SIGNAL = 128  # and above, where a program or a shell says so in its status


def write_whole(path, text):
    """The file is there with all of it, or as it was before, whatever is killed or switched off."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=".unfinished-", delete=False, encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def on_disk(paths):
    for path in paths:
        handle = os.open(path, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)


@contextlib.contextmanager
def turn(out, at_once):
    """One of so many locks, held within."""
    files = []
    try:
        files = [open(out / "work" / f"turn{i}.lock", "w", encoding="utf-8") for i in range(at_once)]
        while files:
            for file in files:
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    continue
                yield [file]
                return
            time.sleep(LOOK_S)
        yield []
    finally:
        for file in files:
            file.close()


def diagnose(spec, folder, locks):
    """Runs the program into `folder`; its status, what it said and what it took. The program holds the locks as well."""
    command = [spec["program"], "--model", spec["model_path"], "--out", str(folder), *spec["options"], *spec["log_paths"]]
    started = time.monotonic()
    # setpriv: the program ends with this process even where that is killed.
    ran = subprocess.run(["setpriv", "--pdeathsig", "KILL", "--", *command], stdin=subprocess.DEVNULL, capture_output=True,
                         text=True, errors="replace", check=False, pass_fds=[lock.fileno() for lock in locks])
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {"status": ran.returncode, "said": ran.stderr.strip()[-4000:], "seconds": round(time.monotonic() - started, 3),
            "cpu_s": round(used.ru_utime + used.ru_stime, 3), "machine": os.uname().nodename}


def fault_of_result(spec, answer, folder):
    """Why what the program gave is no result; "" if it is one."""
    if answer["status"] not in DONE:
        return answer["said"] or f"{spec['program']} ended with status {answer['status']} and said nothing"
    try:
        verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
        if missing := [name for name in ("verdict", "effects", "noise", "fit") if name not in verdict]:
            raise ValueError(f"it has no '{missing[0]}'")
    except (OSError, ValueError) as reason:
        return f"{spec['program']} ended with status {answer['status']} and wrote no verdict.json of use: {reason}"
    read = cases.digests(pathlib.Path(spec["model_path"]), [pathlib.Path(log) for log in spec["log_paths"]])
    if cases.sha256_of(spec["program"]) != spec["program_sha256"]:
        return f"{spec['program']} changed while it ran; run the fleet again"
    changed = [name for (name, was), (_, now) in zip([spec["model"], *spec["logs"]], [read["model"], *read["logs"]])
               if was != now]
    return f"changed while it was read: {', '.join(changed)}; run the fleet again" if changed else ""


def run(at_once, out, key):
    result = out / "results" / key
    lock = out / "work" / f"{key}.lock"
    with open(lock, "w", encoding="utf-8") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        if result.exists():
            lock.unlink(missing_ok=True)
            return 0
        for stale in (out / "work").glob(f"{key}-*"):  # of one that was killed: we hold its lock
            shutil.rmtree(stale, ignore_errors=True)
        spec = json.loads((out / "cases" / f"{key}.json").read_text(encoding="utf-8"))
        folder = pathlib.Path(tempfile.mkdtemp(prefix=f"{key}-", dir=out / "work"))
        try:
            os.chmod(folder, 0o755)
            with turn(out, at_once) as turns:
                answer = diagnose(spec, folder, [held, *turns])
            if answer["status"] < 0 or answer["status"] >= ENDED_BY_SIGNAL:  # which says nothing of the case
                print(f"{key}: {spec['program']} was ended by a signal, status {answer['status']}", file=sys.stderr)
                return 1
            if fault := fault_of_result(spec, answer, folder):
                write_whole(out / "refused" / f"{key}.json", json.dumps({**answer, "fault": fault}))
                return 0
            (folder / "case.json").write_text(json.dumps({**spec, **answer}, indent=1) + "\n", encoding="utf-8")
            on_disk([*folder.rglob("*"), folder])
            folder.rename(result)
            on_disk([result.parent])
            lock.unlink(missing_ok=True)
            return 0
        finally:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    try:
        sys.exit(run(int(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]))
    except KeyboardInterrupt:
        sys.exit(130)
