# SPDX-License-Identifier: MIT
"""bevel.predict against the pure NumPy oracle."""

import numpy as np
import pytest
from oracle import Parameters, predict

import bevel


@pytest.mark.parametrize(
    ("slip", "front_wheel", "sign"),
    [("isotropic", "published", 1), ("isotropic", "nonslip", -1), ("bevel-plane", "published", 1)],
)
def test_predict_equals_runge_kutta(flipping, slip, front_wheel, sign):
    needle = bevel.Needle(0.0047, 0.3, 0.13, 20.0, slip, front_wheel)
    predicted = bevel.predict(needle, flipping)
    position, heading = predict(
        Parameters(0.0047, 0.3, 0.13, 20.0, slip == "isotropic", sign), flipping.insertion_mm, flipping.rotation_rad
    )
    np.testing.assert_allclose(predicted.position_mm, position, atol=1e-4)
    np.testing.assert_allclose(predicted.heading, heading, atol=1e-6)


def test_predict_without_slip_is_the_exact_circle():
    k = 0.005
    motion = bevel.Motion(np.linspace(0, 10, 11), np.linspace(0, 100, 11))
    predicted = bevel.predict(bevel.Needle(k), motion)
    s = motion.insertion_mm
    circle = np.column_stack([0 * s, (np.cos(k * s) - 1) / k, np.sin(k * s) / k])
    np.testing.assert_allclose(predicted.position_mm, circle, atol=1e-9)


def test_predict_at_other_times_is_linear_in_the_axes(flipping):
    needle = bevel.Needle(0.0047, 0.3, 0.13)
    whole = bevel.predict(needle, flipping)
    some = bevel.predict(needle, flipping, at_s=flipping.time_s[::7])
    np.testing.assert_allclose(some.position_mm, whole.position_mm[::7], atol=3e-4)


def test_jacobian_equals_differences(flipping):
    values = np.array([0.0047, 0.3, 0.13, 20.0])
    jacobian = bevel.predict(bevel.Needle(*values), flipping, jacobian=True).jacobian
    assert jacobian.shape == (len(flipping), 3, 4)
    for j, h in enumerate([1e-6, 1e-4, 1e-4, 1e-2]):
        step = np.eye(4)[j] * h
        ahead, back = (bevel.predict(bevel.Needle(*(values + s)), flipping).position_mm for s in (step, -step))
        np.testing.assert_allclose(jacobian[:, :, j], (ahead - back) / (2 * h), rtol=1e-4, atol=2e-4 / h * 1e-3)


def test_predict_takes_effects_by_name(flipping):
    needle = bevel.Needle(0.0047, 0.3, 0.13)
    plain = bevel.predict(bevel.Model(needle), flipping)
    np.testing.assert_array_equal(plain.position_mm, bevel.predict(needle, flipping).position_mm)
    shifted = bevel.predict(bevel.Model(needle, [bevel.Effect("entry_point", x_mm=1.0, y_mm=-2.0)]), flipping)
    np.testing.assert_allclose(shifted.position_mm - plain.position_mm, [[1, -2, 0]] * len(flipping), atol=1e-9)


def test_standard_deviations_come_with_a_variation(flipping):
    needle = bevel.Needle(0.0047, 0.3, 0.13)
    assert bevel.predict(needle, flipping).sd_mm is None
    varied = bevel.Model(needle, variation=bevel.Variation(entry_point_mm=0.5))
    np.testing.assert_allclose(bevel.predict(varied, flipping).sd_mm[:, :2], 0.5, rtol=1e-3)


def test_leaving_the_domain_is_a_domain_error():
    motion = bevel.Motion(np.array([0.0, 20.0]), np.array([0.0, 200.0]))
    with pytest.raises(bevel.DomainError, match="slip law"):
        bevel.predict(bevel.Needle(0.02, 0.3, 0.13, front_wheel="nonslip"), motion)


@pytest.mark.parametrize(
    ("time_s", "insertion_mm", "message"),
    [
        ([0.0], [0.0], "at least 2"),
        ([0.0, 1.0], [0.0, 1.0, 2.0], "same number"),
        ([0.0, 0.0], [0.0, 1.0], "later by 1 us"),
        ([0.0, 1.0], [0.0, np.nan], "not finite"),
        ([-1.0, 1.0], [0.0, 1.0], "allowed: 0 to"),
    ],
)
def test_motion_rejects(time_s, insertion_mm, message):
    with pytest.raises(ValueError, match=message):
        bevel.Motion(np.array(time_s), np.array(insertion_mm))
