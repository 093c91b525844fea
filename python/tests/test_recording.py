# SPDX-License-Identifier: MIT
"""Logs and CSV files as arrays."""

import numpy as np
import pytest

import bevel

MAP = """
[time]
column = "t"
unit = "s"
[tip]
axes = ["x", "y", "z"]
unit = "mm"
sigma_mm = [0.2, 0.2, 0.3]
[insertion]
column = "depth"
unit = "mm"
[rotation]
column = "roll"
unit = "rad"
"""


def test_read_log_gives_views(recordings):
    recording = recordings[0]
    assert recording.name == "rec01.lcm"
    assert recording.intact
    position = recording.positions.position_mm
    assert position.shape == (len(recording.positions), 3)
    assert position.base is not None and not position.flags.writeable
    information = recording.positions.information_per_mm2
    np.testing.assert_array_equal(information, np.swapaxes(information, 1, 2))
    assert recording.axes.time_s[0] == 0
    assert recording.axes.axis_status.shape == (len(recording.axes), 2)
    assert len(recording.truths) == 0 and recording.truths.covariance.shape == (0, 9, 9)


def test_views_outlive_the_recording(example):
    position = bevel.read_log(example / "rec01.lcm").positions.position_mm
    assert np.isfinite(position).all()


def test_to_pandas(recordings):
    pandas = pytest.importorskip("pandas")
    frame = recordings[0].positions.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert {"time_s", "position_mm_x", "position_mm_y", "position_mm_z"} <= set(frame.columns)
    np.testing.assert_array_equal(frame["position_mm_y"], recordings[0].positions.position_mm[:, 1])


def test_save_and_read_back(recordings, tmp_path):
    path = tmp_path / "copy.lcm"
    recordings[0].save(path)
    copy = bevel.read_log(path)
    np.testing.assert_array_equal(copy.positions.position_mm, recordings[0].positions.position_mm)
    np.testing.assert_array_equal(copy.axes.utime, recordings[0].axes.utime)


def test_missing_log_is_an_io_error(tmp_path):
    with pytest.raises(bevel.IoError, match="nothing.lcm"):
        bevel.read_log(tmp_path / "nothing.lcm")


def test_import_csv_round_trip(tmp_path):
    needle = bevel.Needle(0.0047, 0.3, 0.13)
    rig = bevel.Rig(needle, seed=5)
    rows = ["t,x,y,z,depth,roll"]
    for _ in range(300):
        rig.move(0.2, 0.002, 0.04)
        x, y, z = rig.measure_position()
        rows.append(f"{rig.time_s:.6f},{x:.6f},{y:.6f},{z:.6f},{rig.insertion_mm:.6f},{rig.rotation_rad:.6f}")
    (tmp_path / "one.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "map.toml").write_text(MAP)
    recording = bevel.import_csv(tmp_path / "one.csv", tmp_path / "map.toml")
    assert recording.name == "one.lcm"
    assert "depth" in recording.remarks
    recorded = rig.recording().positions.position_mm
    np.testing.assert_allclose(recording.positions.position_mm, recorded, atol=1e-6)
    predicted = bevel.predict(needle, recording)
    assert np.std(predicted.position_mm - recording.positions.position_mm) < 0.3


def test_import_faults_name_the_place(tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    (tmp_path / "bad.csv").write_text("t,x,y,z,depth,roll\n0,0,0,0,0,0\n1,oops,0,1,1,0\n")
    with pytest.raises(bevel.IoError, match="bad.csv:3"):
        bevel.import_csv(tmp_path / "bad.csv", tmp_path / "map.toml")
    (tmp_path / "map.toml").write_text(MAP.replace('unit = "rad"', 'unit = "turns"'))
    with pytest.raises(bevel.ConfigurationError, match="rotation.unit"):
        bevel.import_csv(tmp_path / "bad.csv", tmp_path / "map.toml")
