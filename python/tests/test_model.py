# SPDX-License-Identifier: MIT
"""Needles, effects and model files."""

import pickle

import pytest

import bevel


def test_needle_rejects_what_is_outside_the_domain():
    with pytest.raises(ValueError, match="26"):
        bevel.Needle(lambda1_per_rad=0.0, lambda2=0.5)
    with pytest.raises(ValueError, match="isotropic"):
        bevel.Needle(slip="sideways")


def test_needle_replaced():
    needle = bevel.Needle(0.005, 0.3, 0.13)
    other = needle.replaced(curvature_per_mm=-0.004)
    assert (other.k, other.lambda1, needle.k) == (-0.004, 0.3, 0.005)
    assert needle == bevel.Needle(0.005, 0.3, 0.13) != other
    assert needle != 3
    assert eval(repr(needle), {"Needle": bevel.Needle}) == needle


def test_effects_are_listed_with_their_parameters():
    types = {effect.name: effect for effect in bevel.effect_types()}
    assert "stick_slip" in types
    assert all(effect.meaning for effect in types.values())
    assert [p.name for p in types["entry_point"].parameters] == ["x_mm", "y_mm"]


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [("nothing", {}, "nothing"), ("entry_point", {"z_mm": 1.0}, "z_mm"), ("entry_point", {"x_mm": 1e9}, "x_mm")],
)
def test_effect_rejects(name, parameters, message):
    with pytest.raises(ValueError, match=message):
        bevel.Effect(name, **parameters)


def test_model_file_round_trip(tmp_path):
    model = bevel.Model(
        bevel.Needle(0.005, 0.3, 0.13),
        [bevel.Effect("entry_point", x_mm=0.3)],
        variation=bevel.Variation(curvature_relative=0.05),
    )
    model.save(tmp_path / "model.toml")
    assert bevel.Model.load(tmp_path / "model.toml") == model
    assert bevel.Model.parse(model.to_toml()) == model


def test_configuration_errors_list_every_fault():
    with pytest.raises(bevel.ConfigurationError) as raised:
        bevel.Model.parse("[needle]\nlambda1_per_rad = 'x'\n")
    assert "curvature_per_mm" in str(raised.value) and "lambda1_per_rad" in str(raised.value)
    assert isinstance(raised.value, bevel.Error)


def test_errors_have_one_base():
    for error in (bevel.ConfigurationError, bevel.IoError, bevel.DomainError):
        assert issubclass(error, bevel.Error)
    assert issubclass(bevel.DomainError, ValueError)


def test_models_pickle():
    needle = bevel.Needle(0.005, 0.3, 0.13, slip="bevel-plane")
    model = bevel.Model(needle, [bevel.Effect("entry_point", x_mm=0.3)])
    assert pickle.loads(pickle.dumps(needle)) == needle
    assert pickle.loads(pickle.dumps(model)) == model
