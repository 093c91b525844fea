# SPDX-License-Identifier: MIT
"""bevel.Estimator against the pure NumPy oracle, and its use."""

import numpy as np
import pytest
from oracle import Parameters, State, predict_state, update_state

import bevel


def variances(config, insertion, rotation):
    """Process variances of nine error states for one step."""
    per_mm = [config.process_position_mm**2] * 3 + [config.process_tilt_rad**2] * 2
    per_mm += [config.process_roll_rad**2, config.process_curvature_per_mm**2]
    per_mm += [config.process_lambda1_per_rad**2, config.process_lambda2**2]
    added = np.array(per_mm) * abs(insertion)
    added[5] += config.process_roll_per_sqrt_rad**2 * abs(rotation)
    return added


def assert_same_covariance(actual, expected, share):
    """Compares each element with the standard deviations of its row and column."""
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(actual / np.outer(sd, sd), expected / np.outer(sd, sd), atol=share)


def test_filter_step_equals_the_oracle():
    config = bevel.EstimatorConfig()
    config.relinearised_steps = 0
    config.midpoint_derivatives = False
    config.gap_s = 0
    needle = bevel.Needle(0.0047, 0.3, 0.13)
    estimator = bevel.Estimator(needle, config)
    prior = [config.position_sd_mm] * 3 + [config.tilt_sd_rad] * 2 + [config.roll_sd_rad]
    prior += [config.curvature_sd_per_mm, config.lambda1_sd_per_rad, config.lambda2_sd]
    state = State(np.zeros(3), np.eye(3), Parameters(0.0047, 0.3, 0.13), np.diag(np.square(prior)))

    estimator.add_motion(0.0, 0.0, 0.0)
    insertion, rotation = 1.5, 0.2
    estimator.add_motion(0.5, insertion, rotation)
    predicted = predict_state(state, insertion, rotation, variances(config, insertion, rotation))
    estimate = estimator.estimate()
    np.testing.assert_allclose(estimate.position_mm, predicted.position, atol=1e-6)
    np.testing.assert_allclose(estimate.rotation, predicted.R, atol=1e-6)
    assert_same_covariance(estimate.covariance, predicted.covariance, 1e-6)

    measured = np.array([0.12, -0.05, 1.45])
    estimator.add_position(0.5, measured, 0.2)
    updated = update_state(predicted, measured, 0.04 * np.eye(3))
    estimate = estimator.estimate()
    assert estimate.accepted
    np.testing.assert_allclose(estimate.position_mm, updated.position, atol=1e-6)
    np.testing.assert_allclose(estimate.rotation, updated.R, atol=1e-6)
    values = [estimate.curvature_per_mm, estimate.lambda1_per_rad, estimate.lambda2]
    np.testing.assert_allclose(values, [updated.p.k, updated.p.lambda1, updated.p.lambda2], rtol=1e-5)
    assert_same_covariance(estimate.covariance, updated.covariance, 1e-5)


def test_late_measurements_give_the_same_state():
    rig = bevel.Rig(bevel.Needle(0.0047, 0.3, 0.13), seed=3)
    samples = []
    for step in range(60):
        rig.move(0.1, 0.01, 0.02)
        samples.append(
            (rig.time_s, rig.insertion_mm, rig.rotation_rad, rig.measure_position() if step % 3 == 0 else None)
        )
    in_order, late = (bevel.Estimator(bevel.Needle(0.0047, 0.3, 0.13)) for _ in range(2))
    waiting = []
    for time_s, insertion, rotation, measured in samples:
        for estimator in (in_order, late):
            estimator.add_motion(time_s, insertion, rotation)
        for arrived in waiting:
            late.add_position(*arrived, 0.2)
        waiting = [] if measured is None else [(time_s, measured)]
        if measured is not None:
            in_order.add_position(time_s, measured, 0.2)
    for arrived in waiting:
        late.add_position(*arrived, 0.2)
    np.testing.assert_array_equal(in_order.estimate().position_mm, late.estimate().position_mm)
    np.testing.assert_array_equal(in_order.estimate().covariance, late.estimate().covariance)


def test_health_is_reported_by_name():
    estimator = bevel.Estimator(bevel.Needle())
    assert not estimator.estimate().valid
    estimator.add_motion(0.0, 0.0)
    assert "no_measurement" in estimator.estimate().health_flags
    assert not estimator.estimate().usable


def test_replay_follows_the_recording(recordings, model):
    replay = bevel.replay(recordings[0], model)
    assert len(replay) == len(recordings[0].axes)
    assert replay.position_mm.shape == (len(replay), 3)
    assert replay.innovation_mm.shape == (len(recordings[0].positions), 3)
    assert replay.accepted.mean() > 0.95
    assert replay.health[-1] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, [0, 0, np.nan], 0.2), "not finite"),
        ((0.0, [0, 0, 0], -0.2), "above 0"),
        ((-1.0, [0, 0, 0], 0.2), "0 to 1e10"),
    ],
)
def test_estimator_rejects(arguments, message):
    with pytest.raises(ValueError, match=message):
        bevel.Estimator(bevel.Needle()).add_position(*arguments)


def test_config_file_faults_are_configuration_errors(tmp_path):
    path = tmp_path / "estimator.toml"
    path.write_text("nonsense = 1\n")
    with pytest.raises(bevel.ConfigurationError, match="nonsense"):
        bevel.EstimatorConfig.load(path)
