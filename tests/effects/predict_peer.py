#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The tip along a log by plain Python: an independent check of bevel-predict.

    predict_peer.py MODEL.toml LOG PREDICTED.csv LARGEST_MM

Reads the log's bytes itself, integrates (10) with the slip of (25) by classical Runge-Kutta in steps of a millisecond
(gamma by bisection, base positions linear between ACTUATOR_STATEs), applies the effects it knows in their plain form,
and exits 1 if any line of PREDICTED.csv is further off than LARGEST_MM, 77 if this Python has no tomllib.
"""
import csv
import math
import os
import struct
import sys

try:
    import tomllib
except ImportError:
    sys.exit(77)

STEP_S = 1e-3
EVENT = struct.Struct(">IqqII")


def read_log(path):
    """(utime, insertion_mm, rotation_rad) of each ACTUATOR_STATE, utime of each TIP_MEASUREMENT."""
    actuators, tips = [], []
    with open(path, "rb") as file:
        data = file.read()
    at = 0
    while at < len(data):
        sync, _, _, channel_length, length = EVENT.unpack_from(data, at)
        assert sync == 0xEDA1DA01, at
        at += EVENT.size
        channel = data[at : at + channel_length].decode()
        body = data[at + channel_length : at + channel_length + length]
        at += channel_length + length
        if channel == "ACTUATOR_STATE":
            utime, _, _, _, insertion, _, rotation, _ = struct.unpack(">qqiidddd", body[8:])
            actuators.append((utime, insertion, rotation))
        elif channel == "TIP_MEASUREMENT":
            tips.append(struct.unpack_from(">q", body, 8)[0])
    return actuators, tips


def slip_angle(theta, lambda1, lambda2):
    if lambda1 == 0 and lambda2 == 0:
        return 0.0
    low, high = 0.0, 1.5
    for _ in range(50):
        gamma = 0.5 * (low + high)
        if gamma - lambda2 * gamma + lambda1 * gamma * gamma < theta:
            low = gamma
        else:
            high = gamma
    return 0.5 * (low + high) - theta


class Needle:
    def __init__(self, model):
        needle = model["needle"]
        self.k = needle["curvature_per_mm"]
        self.ell = needle["wheelbase_mm"]
        self.lambda1, self.lambda2 = needle["lambda1_per_rad"], needle["lambda2"]
        self.sign = -1.0 if needle.get("front_wheel") == "nonslip" else 1.0
        self.bevel_plane = needle.get("slip") == "bevel-plane"
        self.effects = {effect["name"]: effect for effect in model.get("effect", [])}

    def rates(self, state, u1, u2, kx, ky):
        """gdot = g hat(u1 V1 + u2 V2); the state is p and the columns of R."""
        p, x, y, z = state
        nx, ny, nz = x[2], y[2], z[2]
        across = math.hypot(nx, ny)
        fx = fy = 0.0
        if across > 1e-14:
            f = math.tan(slip_angle(math.atan2(across, nz), self.lambda1, self.lambda2))
            fx, fy = -f * nx / across, -f * ny / across
        if self.bevel_plane:
            fx = 0.0
        wx = u1 * (kx - self.sign * fy / self.ell)
        wy = u1 * (ky + self.sign * fx / self.ell)
        wz = u2
        return (
            tuple(u1 * (fx * x[i] + fy * y[i] + z[i]) for i in range(3)),
            tuple(wz * y[i] - wy * z[i] for i in range(3)),
            tuple(wx * z[i] - wz * x[i] for i in range(3)),
            tuple(wy * x[i] - wx * y[i] for i in range(3)),
        )


def moved(state, rates, h):
    return tuple(tuple(a + h * b for a, b in zip(v, r)) for v, r in zip(state, rates))


def integrate(needle, actuators, until_s):
    """The tip at each millisecond."""
    effect = needle.effects.get
    start = actuators[0]
    times = [(utime - start[0]) * 1e-6 for utime, _, _ in actuators]
    i = 0

    def base(t):
        nonlocal i
        while i + 2 < len(times) and times[i + 1] < t:
            i += 1
        share = min(max((t - times[i]) / (times[i + 1] - times[i]), 0.0), 1.0)
        return tuple(actuators[i][c] + share * (actuators[i + 1][c] - actuators[i][c]) for c in (1, 2))

    state = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    d_before, r_before = base(0.0)
    d_first, r_tip = d_before, r_before
    s_tip = d_before
    path = [state[0]]
    for step in range(1, math.ceil(until_s / STEP_S) + 1):
        d, r = base(step * STEP_S)
        s, roll = d, r
        if gap := effect("torsional_windup"):
            lag = gap["lag_at_100mm_rad"] * ((d - d_first) / 100) ** 2
            roll = min(max(r_tip, r - lag), r + lag)
        if gap := effect("insertion_backlash"):
            half = gap["width_mm"] / 2
            s = min(max(s_tip, d - half), d + half)
        u1, u2 = (s - s_tip) / STEP_S, (roll - r_tip) / STEP_S
        k = needle.k
        if (tissue := effect("layer")) and state[0][2] > tissue["depth_mm"]:
            k *= tissue["curvature_ratio"]
        if (drill := effect("drilling")) and d != d_before:
            k /= 1 + drill["coefficient_mm_per_rad"] * abs(r - r_before) / abs(d - d_before)
        pull = effect("lateral_bias") or {"x_per_mm": 0.0, "y_per_mm": 0.0}

        def rates(at):
            # World rotation (-y_per_mm, x_per_mm, 0) seen in the body.
            kx, ky = (-pull["y_per_mm"] * at[c][0] + pull["x_per_mm"] * at[c][1] for c in (1, 2))
            return needle.rates(at, u1, u2, k + kx, ky)

        k1 = rates(state)
        k2 = rates(moved(state, k1, STEP_S / 2))
        k3 = rates(moved(state, k2, STEP_S / 2))
        k4 = rates(moved(state, k3, STEP_S))
        for slope, weight in ((k1, 1), (k2, 2), (k3, 2), (k4, 1)):
            state = moved(state, slope, weight * STEP_S / 6)
        s_tip, r_tip, d_before, r_before = s, roll, d, r
        path.append(state[0])
    return path


def as_seen(needle, path, t, log_name):
    effect = needle.effects.get
    if late := effect("camera_latency"):
        t -= late["latency_s"]
    t = max(t, 0.0)
    step = min(int(t / STEP_S), len(path) - 2)
    share = t / STEP_S - step
    x, y, z = (a + share * (b - a) for a, b in zip(path[step], path[step + 1]))
    if swing := effect("tissue_motion"):
        phase = swing.get("recordings", {}).get(log_name, swing).get("phase_rad", 0.0)
        size = swing["amplitude_mm"] * math.sin(2 * math.pi * swing["frequency_hz"] * t + phase)
        x += size * math.cos(swing["direction_rad"])
        y += size * math.sin(swing["direction_rad"])
    if scale := effect("camera_scale"):
        y, z = y * scale["ratio"], z * scale["ratio"]
    return x, y, z


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as file:
        needle = Needle(tomllib.load(file))
    actuators, tips = read_log(sys.argv[2])
    with open(sys.argv[3], newline="") as file:
        lines = list(csv.DictReader(file))
    assert [int(line["utime"]) for line in lines] == tips, "a line for each TIP_MEASUREMENT, in their order"
    start = actuators[0][0]
    path = integrate(needle, actuators, (max(tips) - start) * 1e-6)
    largest = 0.0
    for line in lines:
        expected = as_seen(needle, path, (int(line["utime"]) - start) * 1e-6, os.path.basename(sys.argv[2]))
        largest = max(largest, math.dist(expected, (float(line["x_mm"]), float(line["y_mm"]), float(line["z_mm"]))))
    print(f"{len(lines)} lines, largest distance {largest:.2e} mm, allowed {float(sys.argv[4]):.2e} mm")
    sys.exit(0 if largest <= float(sys.argv[4]) else 1)


if __name__ == "__main__":
    main()
