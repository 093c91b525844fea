# SPDX-License-Identifier: MIT
"""The extended bicycle model with the effects that may be left out, in their plain form: one compiled loop.

The path is integrated on the samples of ACTUATOR_STATE (half the turn, the advance by its mid-point, half the turn) and
read off at the camera's stamps. No code is shared with model/src/effects.
"""
import math

import numpy as np
from numba import njit

# Place of every parameter in the vector that predict() takes; its value when the effect is absent.
NAMES = {
    "k": 0.005, "lambda1": 0.3, "lambda2": 0.1,
    "rotation_backlash.width_rad": 0.0, "torsional_windup.lag_at_100mm_rad": 0.0, "insertion_backlash.width_mm": 0.0,
    "insertion_scale.ratio": 1.0, "lost_steps.rotation_rad": 0.0, "lost_steps.insertion_mm": 0.0,
    "rate_dependence.exponent": 0.0, "layer.depth_mm": 1e6, "layer.curvature_ratio": 1.0,
    "depth_dependence.per_100mm": 0.0, "drilling.coefficient_mm_per_rad": 0.0, "flip_transient.length_mm": 0.0,
    "relaxation.amplitude_mm": 0.0, "relaxation.tau_s": 1.0, "puncture.depth_mm": 1e6, "puncture.indentation_mm": 0.0,
    "tissue_motion.amplitude_mm": 0.0, "tissue_motion.frequency_hz": 0.3, "tissue_motion.direction_rad": 0.0,
    "lateral_bias.x_per_mm": 0.0, "lateral_bias.y_per_mm": 0.0, "bevel_offset.roll_rad": 0.0,
    "entry_angle.about_x_rad": 0.0, "entry_angle.about_y_rad": 0.0, "camera_latency.latency_s": 0.0,
    "camera_scale.ratio": 1.0, "camera_rotation.about_x_rad": 0.0, "refraction.coefficient": 0.0,
    "refraction.centre_mm": 30.0, "slip_direction.other": 0.0,
}  # fmt: skip
INDEX = {name: i for i, name in enumerate(NAMES)}
NONE = np.array(list(NAMES.values()))
(K, LAMBDA1, LAMBDA2, BACKLASH, WINDUP, INSERTION_BACKLASH, SCALE, LOST_ROTATION, LOST_INSERTION, RATE, LAYER_DEPTH,
 LAYER_RATIO, PER_DEPTH, DRILLING, FLIP, RELAX, RELAX_TAU, PUNCTURE_DEPTH, PUNCTURE, MOTION, MOTION_HZ,
 MOTION_DIRECTION, BIAS_X, BIAS_Y, ROLL, TILT_X, TILT_Y, LATENCY, CAMERA_SCALE, CAMERA_TURN, REFRACTION,
 REFRACTION_CENTRE, SLIP_OTHER) = range(len(NAMES))  # fmt: skip

RELAX_BUILD_MM = 5.0
LAYER_EDGE_MM = 0.5  # a sharper edge would leave its depth without a slope
STALL_S = 0.1  # as would a jump
CATCH_UP_MM = 0.5


@njit(cache=True, error_model="numpy")
def turn(R, wx, wy, wz):
    """R exp(hat(w)) by Rodrigues' formula, in place."""
    angle = math.sqrt(wx * wx + wy * wy + wz * wz)
    if angle < 1e-12:
        return
    a = math.sin(angle) / angle
    b = (1 - math.cos(angle)) / (angle * angle)
    for i in range(3):
        x, y, z = R[i, 0], R[i, 1], R[i, 2]
        # Row times (I + a W + b W^2), W = hat(w).
        x1, y1, z1 = y * wz - z * wy, z * wx - x * wz, x * wy - y * wx
        x2, y2, z2 = y1 * wz - z1 * wy, z1 * wx - x1 * wz, x1 * wy - y1 * wx
        R[i, 0], R[i, 1], R[i, 2] = x + a * x1 + b * x2, y + a * y1 + b * y2, z + a * z1 + b * z2


@njit(cache=True, error_model="numpy")
def slip(R, q, bevel_plane):
    """f = tan(alpha) along the tilt, seen in the body; (25) with gamma in closed form."""
    nx, ny, nz = R[2, 0], R[2, 1], R[2, 2]
    across = math.sqrt(nx * nx + ny * ny)
    if across < 1e-14:
        return 0.0, 0.0
    theta = math.atan2(across, nz)
    b = 1 - q[LAMBDA2]
    gamma = 2 * theta / (b + math.sqrt(b * b + 4 * q[LAMBDA1] * theta))
    f = -math.tan(gamma - theta) / across
    return (0.0 if bevel_plane else f * nx), f * ny


@njit(cache=True, error_model="numpy")
def play(x, half, y):
    return min(max(y, x - half), x + half)


@njit(cache=True, error_model="numpy")
def predict(q, lost_at_s, phase_rad, ell, bevel_plane, sign, base_s, insertion_mm, rotation_rad, tip_s):
    """What the cameras read at tip_s, (m, 3). Not finite where the model leaves its domain."""
    n = len(base_s)
    path = np.zeros((n, 3))
    p = np.zeros(3)
    offset_x = offset_y = 0.0
    R = np.eye(3)
    turn(R, q[TILT_X], q[TILT_Y], 0.0)
    turn(R, 0.0, 0.0, q[ROLL])
    if q[SLIP_OTHER] > 0.5:
        bevel_plane = not bevel_plane
    roll_backlash = roll_tip = rotation_rad[0]
    s_backlash = insertion_mm[0]
    s_tip = q[SCALE] * s_backlash
    tissue_x, tissue_y = math.cos(roll_tip), math.sin(roll_tip)
    pierced, touched_mm = 0, 0.0
    for i in range(1, n):
        dt = base_s[i] - base_s[i - 1]
        # The axes: what the tip's end of the shaft does.
        d, r = insertion_mm[i], rotation_rad[i]
        if lost_at_s > 0:
            share = min(max((base_s[i] - lost_at_s) / STALL_S + 0.5, 0.0), 1.0)
            d += share * q[LOST_INSERTION]
            r += share * q[LOST_ROTATION]
        s_backlash = play(d, 0.5 * q[INSERTION_BACKLASH], s_backlash)
        s = q[SCALE] * s_backlash
        if q[PUNCTURE] > 0 and pierced < 2:
            reach_mm = p[2] + (s - s_tip) * R[2, 2]
            if pierced == 0 and reach_mm > q[PUNCTURE_DEPTH] >= p[2]:
                pierced, touched_mm = 1, s_tip + (q[PUNCTURE_DEPTH] - p[2]) / R[2, 2]
            if pierced == 1 and s > touched_mm:
                # Held back by the indentation, then let go within a part of a mm about it, so that both have slopes.
                pushed_mm = s - touched_mm
                breaks_mm = q[PUNCTURE] ** 2 / (q[PUNCTURE] + 0.5 * CATCH_UP_MM)
                if pushed_mm > breaks_mm + CATCH_UP_MM:
                    pierced = 2
                else:
                    s = touched_mm + max(pushed_mm - breaks_mm, 0.0) * (breaks_mm + CATCH_UP_MM) / CATCH_UP_MM
        roll_backlash = play(r, 0.5 * q[BACKLASH], roll_backlash)
        length = max(d - insertion_mm[0], 0.0) / 100
        roll_new = play(roll_backlash, q[WINDUP] * length * length, roll_tip)
        ds, dr = s - s_tip, roll_new - roll_tip
        # The curvature in use.
        k = q[K]
        v = abs(insertion_mm[i] - insertion_mm[i - 1]) / dt
        w = abs(rotation_rad[i] - rotation_rad[i - 1]) / dt
        if v > 0:
            k *= (max(v, 0.2) / 10) ** -q[RATE] / (1 + q[DRILLING] * w / v)
        k *= 1 + q[PER_DEPTH] * p[2] / 100
        if q[LAYER_RATIO] != 1:
            k *= 1 + (q[LAYER_RATIO] - 1) / (1 + math.exp(-(p[2] - q[LAYER_DEPTH]) / LAYER_EDGE_MM))
        kx, ky = k, 0.0
        turn(R, 0.0, 0.0, 0.5 * dr)
        if q[FLIP] > 1e-6:
            middle = roll_tip + 0.5 * dr
            c, z = math.cos(middle), math.sin(middle)
            size = k / q[K] if q[K] != 0 else 1.0  # speed, depth and drilling act on what is followed
            left = math.exp(-max(ds, 0.0) / q[FLIP])
            tissue_x, tissue_y = size * c + (tissue_x - size * c) * left, size * z + (tissue_y - size * z) * left
            kx, ky = q[K] * (c * tissue_x + z * tissue_y), q[K] * (c * tissue_y - z * tissue_x)
        # World curvature (-y, x, 0), in the body.
        bx, by = -q[BIAS_Y], q[BIAS_X]
        kx += R[0, 0] * bx + R[1, 0] * by
        ky += R[0, 1] * bx + R[1, 1] * by
        if ds != 0:
            fx, fy = slip(R, q, bevel_plane)
            turn(R, 0.5 * ds * (kx - sign * fy / ell), 0.5 * ds * (ky + sign * fx / ell), 0.0)
            fx, fy = slip(R, q, bevel_plane)
            for j in range(3):
                p[j] += ds * (fx * R[j, 0] + fy * R[j, 1] + R[j, 2])
            turn(R, 0.5 * ds * (kx - sign * fy / ell), 0.5 * ds * (ky + sign * fx / ell), 0.0)
        turn(R, 0.0, 0.0, 0.5 * dr)
        if q[RELAX] != 0:
            if v > 0.05:
                built = 1 - math.exp(-max(ds, 0.0) / RELAX_BUILD_MM)
                side = -1.0 if k > 0 else 1.0
                offset_x += (q[RELAX] * side * R[0, 1] - offset_x) * built
                offset_y += (q[RELAX] * side * R[1, 1] - offset_y) * built
            else:
                left = math.exp(-dt / q[RELAX_TAU])
                offset_x *= left
                offset_y *= left
        s_tip, roll_tip = s, roll_new
        path[i, 0], path[i, 1], path[i, 2] = p[0] + offset_x, p[1] + offset_y, p[2]
    # The cameras.
    seen = np.empty((len(tip_s), 3))
    c, z = math.cos(q[CAMERA_TURN]), math.sin(q[CAMERA_TURN])
    i = 1
    for m in range(len(tip_s)):
        at_s = min(max(tip_s[m] - q[LATENCY], base_s[0]), base_s[n - 1])
        while i > 1 and base_s[i - 1] > at_s:
            i -= 1
        while i + 1 < n and base_s[i] < at_s:
            i += 1
        share = (at_s - base_s[i - 1]) / (base_s[i] - base_s[i - 1])
        for j in range(3):
            seen[m, j] = path[i - 1, j] + share * (path[i, j] - path[i - 1, j])
        swing = q[MOTION] * math.sin(2 * math.pi * q[MOTION_HZ] * at_s + phase_rad)
        seen[m, 0] += swing * math.cos(q[MOTION_DIRECTION])
        y, depth = seen[m, 1] + swing * math.sin(q[MOTION_DIRECTION]), seen[m, 2]
        y, depth = c * y + z * depth, c * depth - z * y
        y, depth = q[CAMERA_SCALE] * y, q[CAMERA_SCALE] * depth
        grow = q[REFRACTION] * (y * y + (depth - q[REFRACTION_CENTRE]) ** 2) / 2500
        seen[m, 1] = y + y * grow
        seen[m, 2] = depth + (depth - q[REFRACTION_CENTRE]) * grow
    return seen


class Model:
    """model.toml's fixed part; what varies is the vector q of predict()."""

    def __init__(self, needle):
        self.ell = float(needle["wheelbase_mm"])
        self.bevel_plane = needle.get("slip") == "bevel-plane"
        self.sign = -1.0 if needle.get("front_wheel") == "nonslip" else 1.0
        self.belief = NONE.copy()
        self.belief[:3] = needle["curvature_per_mm"], needle["lambda1_per_rad"], needle["lambda2"]

    def predict(self, q, recording, lost_at_s=0.0, phase_rad=0.0):
        return predict(q, lost_at_s, phase_rad, self.ell, self.bevel_plane, self.sign, recording.base_s,
                       recording.insertion_mm, recording.rotation_rad, recording.tip_s)  # fmt: skip
