"""mcap_round_trip.py SOURCE BUILD: a log to CSV, MCAP, CSV, log, CSV: the same bytes; and what others read in the MCAP.

Exit status: 77 where the Python package mcap is not there.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

source, build = map(pathlib.Path, sys.argv[1:])
sys.path[:0] = [str(source / ".deps/python")]
try:
    from mcap.reader import make_reader
except ModuleNotFoundError:
    print("skipped: no Python package mcap (tools/setup gets it)")
    sys.exit(77)

tool = [sys.executable, source / "tools/bevel-mcap"]


def run(*command, status=0):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == status, f"{command}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stderr


def files(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    first = here / "rec"
    first.mkdir()
    (first / "tip_measurement.csv").write_text(
        "utime,seq,camera,status,x_mm,y_mm,z_mm,ixx_per_mm2,ixy_per_mm2,ixz_per_mm2,iyx_per_mm2,iyy_per_mm2,"
        "iyz_per_mm2,izx_per_mm2,izy_per_mm2,izz_per_mm2,arrival\n"
        "1700000000000001,0,0,0,,-0,5e-324,0,0,0,0,44.00000000000001,0,0,0,44,1\n"
        "1700000000033000,1,0,2,0.1,,1e-05,44,0,0,0,0,0,0,0,44,2\n")
    (first / "actuator_state.csv").write_text(
        "utime,seq,insertion_status,rotation_status,insertion_mm,insertion_rate_mm_s,rotation_rad,rotation_rate_rad_s,"
        "arrival\n1700000000000000,7,2,2,0.1,0,-0,0.30000000000000004,0\n1700000000040000,8,2,2,0.2,0,0,1e-300,3\n")
    (first / "config.toml").write_text("[recording]\nclock = \"none\"\n")
    run(*tool, "export", first, here / "rec.mcap")
    run(*tool, "import", here / "rec.mcap", here / "back/rec")
    assert files(first) == files(here / "back/rec"), "CSV, MCAP, CSV"
    run(build / "bin/bevel-import", "-o", here / "logs", here / "back/rec")
    run(build / "bin/bevel-export", "-o", here / "again", here / "logs/rec.lcm")
    assert files(first) == files(here / "again/rec"), "CSV, MCAP, CSV, log, CSV"

    with open(here / "rec.mcap", "rb") as file:
        messages = [(c.topic, m.log_time, json.loads(m.data)) for _, c, m in make_reader(file).iter_messages()]
    assert len(messages) == 4
    topic, time_ns, tip = next(m for m in messages if m[0] == "TIP_MEASUREMENT")
    assert time_ns == 1700000000000001000 and tip["x_mm"] is None and tip["z_mm"] == 5e-324, tip

    (here / "bad.mcap").write_bytes(b"no such format")
    assert "bad.mcap" in run(*tool, "import", here / "bad.mcap", here / "bad", status=1)
    assert not (here / "bad").exists()
    (first / "motion_command.csv").write_text("utime,seq,mode,insertion_rate_mm_s,rotation_rate_rad_s\n1,0,1,nan,0\n")
    assert "motion_command.csv:2" in run(*tool, "export", first, here / "nan.mcap", status=1)
    assert not (here / "nan.mcap").exists()
    for row, word in (("1,0,1,1", "4 cells"), (",0,1,1,1", "utime is ''"), ("1,0,x,1,1", "no number"),
                      ("1,0,01,1,1", "no number")):
        (first / "motion_command.csv").write_text(f"utime,seq,mode,insertion_rate_mm_s,rotation_rate_rad_s\n1,0,1,1,1\n{row}\n")
        said = run(*tool, "export", first, here / "bad.mcap", status=1)
        assert "motion_command.csv:3" in said and word in said, said
print("ok")
