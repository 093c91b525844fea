# SPDX-License-Identifier: MIT
"""A case as every peer gets it: the logs of one rig and the model in use there."""
import dataclasses
import pathlib
import tomllib

import numpy as np

import lcm
from bevel import actuator_state_t, tip_measurement_t

CHANNELS = ("x", "y", "z")
FRAME_S = 1 / 30


@dataclasses.dataclass
class Recording:
    name: str
    base_s: np.ndarray  # (n,) time of each ACTUATOR_STATE, from the first
    insertion_mm: np.ndarray
    rotation_rad: np.ndarray
    insertion_rate_mm_s: np.ndarray
    rotation_rate_rad_s: np.ndarray
    tip_s: np.ndarray  # (m,) time of each TIP_MEASUREMENT
    tip_mm: np.ndarray  # (m, 3) in {A}

    def at_tip(self, of_base):
        return np.interp(self.tip_s, self.base_s, of_base)

    def without(self, dropped):
        return dataclasses.replace(self, tip_s=self.tip_s[~dropped], tip_mm=self.tip_mm[~dropped])


@dataclasses.dataclass
class Case:
    name: str
    needle: dict  # table [needle] of model.toml
    recordings: list


def read_recording(path):
    base, tip = [], []
    for event in lcm.EventLog(str(path), "r"):
        if event.channel == "ACTUATOR_STATE":
            a = actuator_state_t.decode(event.data)
            base.append((a.utime, a.insertion_mm, a.rotation_rad, a.insertion_rate_mm_s, a.rotation_rate_rad_s))
        elif event.channel == "TIP_MEASUREMENT":
            m = tip_measurement_t.decode(event.data)
            if m.status == 0:
                tip.append((m.utime, *m.position_mm))
    if len(base) < 2 or len(tip) < 30:
        raise SystemExit(f"{path}: {len(base)} ACTUATOR_STATE and {len(tip)} usable TIP_MEASUREMENT; at least 2 and 30")
    start = base[0][0]
    base, tip = (np.array([((row[0] - start) * 1e-6, *row[1:]) for row in sorted(rows)]) for rows in (base, tip))
    return Recording(path.name, *base.T.copy(), tip[:, 0].copy(), tip[:, 1:].copy())


def read_case(folder):
    folder = pathlib.Path(folder)
    with open(folder / "model.toml", "rb") as file:
        needle = tomllib.load(file)["needle"]
    return Case(folder.name, needle, [read_recording(path) for path in sorted(folder.glob("*.lcm"))])
