"""mcap_speed.py SOURCE [ROWS]: how fast tools/bevel-mcap is both ways, beside cp of the same file and reading it.

CPU seconds, since other processes may have the processors; MB of the .mcap file. Seed 1.
"""
import pathlib
import random
import resource
import subprocess
import sys
import tempfile

source = pathlib.Path(sys.argv[1]).resolve()
rows = int(sys.argv[2]) if len(sys.argv) > 2 else 200000


def cpu_s(*command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    (here / "rec").mkdir()
    draw = random.Random(1)
    with open(here / "rec/tip_measurement.csv", "w", encoding="utf-8") as file:
        file.write("utime,seq,camera,status,x_mm,y_mm,z_mm,ixx_per_mm2,ixy_per_mm2,ixz_per_mm2,iyx_per_mm2,iyy_per_mm2,"
                   "iyz_per_mm2,izx_per_mm2,izy_per_mm2,izz_per_mm2,arrival\n")
        for i in range(rows):
            file.write(f"{1700000000000000 + 1000 * i},{i},0,0,{draw.gauss(0, 1)},{draw.gauss(0, 1)},{0.001 * i},"
                       f"20.021692170008325,0,0,0,20.021692170008325,0,0,0,11.847155130182438,{i}\n")
    mcap = here / "rec.mcap"
    took = {"export": cpu_s(source / "tools/bevel-mcap", "export", here / "rec", mcap),
            "import": cpu_s(source / "tools/bevel-mcap", "import", mcap, here / "back"),
            "cp": cpu_s("cp", mcap, here / "copy"), "read": cpu_s("cat", mcap)}
    assert (here / "rec/tip_measurement.csv").read_bytes() == (here / "back/tip_measurement.csv").read_bytes()
    size_mb = mcap.stat().st_size / 1e6
    print(f"{rows} messages, {size_mb:.0f} MB, CSV {(here / 'rec/tip_measurement.csv').stat().st_size / 1e6:.0f} MB")
    for what, seconds in took.items():
        print(f"  {what:18} {seconds:7.2f} s CPU  {size_mb / max(seconds, 1e-3):8.0f} MB/s  {1e6 * seconds / rows:6.2f} us/message")
