# SPDX-License-Identifier: MIT
"""identify() and diagnose() on simulated insertions."""

import _thread
import json
import threading
import time

import numpy as np
import pytest

import bevel


def simulated(model, seeds, depth_mm=80.0):
    legs = np.array([[depth_mm / 2, 0, 8], [0, np.pi, 1], [depth_mm / 2, 0, 8]])
    motion = bevel.Motion.from_legs(legs, rate_hz=50)
    recordings = []
    for seed in seeds:
        rig = bevel.Rig(model, seed=seed)
        rig.follow(motion, camera_hz=10)
        recordings.append(rig.recording(f"rec{seed:02}.lcm"))
    return recordings


def test_identify_finds_the_needle():
    true = bevel.Needle(0.0055, 0.3, 0.13)
    found = bevel.identify(simulated(true, range(1, 5)), bevel.Needle(0.004, 0.2, 0.1))
    k = next(p for p in found.candidates[1].parameters if p.name == "curvature_per_mm")
    assert abs(k.value - true.k) < 4 * k.std_error
    assert found.after.rms_mm < found.before.rms_mm
    assert found.model.needle == found.needle


def test_identify_rejects():
    with pytest.raises(ValueError, match="at least one"):
        bevel.identify([])
    with pytest.raises(ValueError, match="trajectory"):
        bevel.identify(simulated(bevel.Needle(), [1]), method="guess")


@pytest.fixture(scope="module")
def verdict(recordings, model):
    lines = []
    return bevel.diagnose(recordings, model, progress=lines.append), lines


def test_diagnose_finds_stick_slip(verdict):
    found, lines = verdict
    assert found.verdict == "effects-found"
    assert [effect.name for effect in found.effects] == ["stick_slip"]
    jump = found.effects[0].parameters[0]
    assert jump.name == "jump_mm" and abs(jump.value - 0.8725) < 1e-3
    assert found.effects[0].probability > 0.98
    assert found.held_out.after.chi2_per_dof < found.held_out.before.chi2_per_dof
    assert lines and all(isinstance(line, str) for line in lines)


def test_verdict_is_a_file_too(verdict, tmp_path):
    found, _ = verdict
    found.save(tmp_path)
    assert json.loads((tmp_path / "verdict.json").read_text()) == found.to_dict()
    assert bevel.Model.load(tmp_path / "model.toml") == found.model
    assert found.model.effects[0].name == "stick_slip"
    assert "<html" in (tmp_path / "report.html").read_text()


def test_progress_may_stop_the_diagnosis(recordings, model):
    class Stop(Exception):
        pass

    def stop(_):
        raise Stop

    with pytest.raises(Stop):
        bevel.diagnose(recordings, model, progress=stop)


def test_ctrl_c_ends_the_diagnosis_at_once(recordings, model):
    threading.Timer(0.5, _thread.interrupt_main).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        bevel.diagnose(recordings, model)
        time.sleep(5)  # a machine on which the diagnosis is faster than the timer
    assert time.monotonic() - began < 5


def test_other_threads_run_during_the_diagnosis(recordings, model):
    count, ended = 0, threading.Event()

    def work():
        nonlocal count
        while not ended.is_set():
            count += 1
            time.sleep(0.001)

    thread = threading.Thread(target=work)
    thread.start()
    bevel.identify(recordings, model)
    ended.set()
    thread.join()
    assert count > 5


def test_diagnose_rejects(recordings, model):
    with pytest.raises(ValueError, match="rec01"):
        bevel.diagnose([recordings[0], recordings[0]], model)
    with pytest.raises(ValueError):
        bevel.diagnose(recordings[:1], model)
