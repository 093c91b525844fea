# SPDX-License-Identifier: MIT
"""Simulated insertions, and a closed loop in Python."""

import numpy as np
import pytest

import bevel


def test_rig_follows_the_model(flipping):
    needle = bevel.Needle(0.0047, 0.3, 0.13)
    rig = bevel.Rig(needle)
    rig.follow(flipping, camera_hz=0)
    np.testing.assert_allclose(rig.tip_mm, bevel.predict(needle, flipping).position_mm[-1], atol=1e-3)
    np.testing.assert_allclose(rig.shaft_mm[-1], rig.tip_mm, atol=1e-6)


def test_same_seed_same_insertion():
    first, second, other = (bevel.Rig(bevel.Needle(), seed=seed) for seed in (1, 1, 2))
    for rig in (first, second, other):
        rig.move(5.0, 0.1, 1.0)
    a, b, c = (rig.measure_position() for rig in (first, second, other))
    np.testing.assert_array_equal(a, b)
    assert (a != c).all()


def test_unmeasured_axis_is_nan():
    rig = bevel.Rig(bevel.Needle(), noise_mm=[np.inf, 0.2, 0.2])
    assert np.isnan(rig.measure_position()).tolist() == [True, False, False]
    assert rig.recording().positions.information_per_mm2[0, 0, 0] == 0


def test_beam_bends_toward_its_bevel():
    rig = bevel.Rig.beam(modulus_kPa=20.0, force_N=0.5)
    for _ in range(100):
        rig.move(1.0, 0.0, 0.2)
    assert rig.tip_mm[1] < -1


def test_leaving_the_domain_moves_nothing():
    rig = bevel.Rig(bevel.Needle(0.02, 0.3, 0.13, front_wheel="nonslip"))
    with pytest.raises(bevel.DomainError):
        for _ in range(200):
            rig.move(1.0, 0.0, 0.2)
    inserted = rig.insertion_mm
    with pytest.raises(bevel.DomainError):
        rig.move(1.0, 0.0, 0.2)
    assert rig.insertion_mm == inserted


def test_closed_loop_in_python():
    """A bang-bang law on the estimate steers to a target on the other side of the natural bend."""
    model = bevel.Needle(0.0047, 0.3, 0.13)
    rig, estimator = bevel.Rig(model, seed=7), bevel.Estimator(model)
    target = np.array([0.0, 5.0, 90.0])
    estimator.add_motion(0.0, 0.0)
    for step in range(2000):
        estimate = estimator.estimate()
        ahead = estimate.rotation.T @ (target - estimate.position_mm)
        if ahead[2] <= 0:
            break
        turn = np.arctan2(ahead[0], -ahead[1])  # the bevel bends toward body -y
        rotation = np.clip(turn, -0.2, 0.2) if np.hypot(ahead[0], ahead[1]) > 0.3 else 0.0
        rig.move(0.25 if abs(turn) < 0.5 or not rotation else 0.0, rotation, 0.05)
        estimator.add_motion(rig.time_s, rig.insertion_mm, rig.rotation_rad)
        if step % 2 == 0:
            estimator.add_position(rig.time_s, rig.measure_position(), 0.2)
    assert np.linalg.norm(rig.tip_mm - target) < 2.0
