# SPDX-License-Identifier: MIT
"""Shared inputs of the tests."""

from pathlib import Path

import numpy as np
import pytest

import bevel

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def example():
    """Folder of the five simulated insertions with stick-slip."""
    return ROOT / "examples" / "stick_slip"


@pytest.fixture(scope="session")
def recordings(example):
    return [bevel.read_log(path) for path in sorted(example.glob("*.lcm"))]


@pytest.fixture(scope="session")
def model(example):
    return bevel.Model.load(example / "model.toml")


@pytest.fixture
def flipping():
    """100 mm with half a turn at 40 mm, and 1 rad while inserting."""
    return bevel.Motion.from_legs(np.array([[40, 0, 8], [0, np.pi, 1], [30, 1.0, 6], [30, 0, 6.0]]), rate_hz=20)
