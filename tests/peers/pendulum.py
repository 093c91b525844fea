# SPDX-License-Identifier: MIT
"""The pendulum of tests/inference/pendulum.hpp and the densities of its readings and unknowns, written anew from their
equations: a second opinion on what the engine integrates. Many points at a time.
"""
import numpy as np
from scipy import linalg, stats

FRAME_S, STEPS, GRAVITY, START_RAD = 0.05, 4, 9.81, 0.6
EFFECTS = {"dry_friction": "friction", "sensor_scale": "scale", "knock": "knock"}


def readings(count, recording, length, damping, start, friction=0.0, scale=1.0, knock=0.0, knock_s=0.0):
    """Angles at each frame, (count, points). A knock is spread over one step, and there is none at 0 s."""
    h = FRAME_S / STEPS
    drive = 2.0 + 0.7 * (recording % 4)

    def acceleration(angle, rate, t):
        return (-GRAVITY / length * np.sin(angle) - damping * rate - friction * np.tanh(rate / 0.05)
                + 2.0 * np.cos(drive * t))  # fmt: skip

    angle, rate = START_RAD + start, np.zeros_like(start)
    out = []
    for step in range(count * STEPS):
        if step % STEPS == 0:
            out.append(scale * angle)
        t = step * h
        share = np.clip((t + h - knock_s) / h, 0, 1) - np.clip((t - knock_s) / h, 0, 1)
        rate = rate + np.where(np.asarray(knock_s) > 0, knock * share, 0.0)
        a1 = acceleration(angle, rate, t)
        v2 = rate + h / 2 * a1
        a2 = acceleration(angle + h / 2 * rate, v2, t + h / 2)
        v3 = rate + h / 2 * a2
        a3 = acceleration(angle + h / 2 * v2, v3, t + h / 2)
        v4 = rate + h * a3
        a4 = acceleration(angle + h * v3, v4, t + h)
        angle, rate = angle + h / 6 * (rate + 2 * v2 + 2 * v3 + v4), rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return np.array(out)


def log_likelihood(case, points):
    """Of (points, unknowns), with the noise that the case states: a dense covariance, the constant of 2 pi left out."""
    names = [s["name"] for s in case["shared"]]
    effects = [] if case["set"] == "nothing" else [EFFECTS[e] for e in case["set"].split(" + ")]
    shared = dict(zip(["length", "damping", *effects], points.T))
    own = len(case["local"])
    total = np.zeros(len(points))
    for r, recording in enumerate(case["recordings"]):
        local = points[:, len(names) + r * own :][:, :own]
        series = recording["series"][0]
        time_s = np.array(series["time_s"])
        knock_s = {"knock_s": local[:, 1]} if own > 1 else {}
        error = np.array(series["measured"])[:, None] - readings(len(time_s), r, start=local[:, 0], **shared, **knock_s)
        apart = np.abs(time_s[:, None] - time_s) / case["frame_s"]
        correlation = case["ar1"] ** apart if case["ar1"] > 0 else np.eye(len(time_s))
        root = linalg.cholesky(case["sigma"][0] ** 2 * correlation, lower=True)
        white = linalg.solve_triangular(root, error, lower=True)
        total -= 0.5 * (white**2).sum(axis=0) + np.log(np.diag(root)).sum()
    return total


def log_prior(prior, value):
    """A normal one; a flat one; or a size: half Student's t, half of any order of magnitude from 1/30 of the scale to
    all of it, folded where "nothing" is a bound; a twentieth of it where its causes do not bring it."""
    value = np.asarray(value, float)
    if prior["form"] == "normal":
        return stats.norm.logpdf(value, prior["middle"], prior["scale"])
    if prior["form"] == "flat":
        inside = (value >= prior["lower"]) & (value <= prior["upper"])
        return np.where(inside, -np.log(prior["upper"] - prior["lower"]), -np.inf)
    x = (value - prior["middle"]) / prior["scale"]
    far = np.abs(x)
    with np.errstate(divide="ignore"):
        any_order = np.where((far >= 1 / 30) & (far < 1), 0.5 / (np.log(30) * far), 0.0)
    density = (0.5 * stats.t.pdf(x, 4) + 0.5 * any_order) / prior["scale"]
    if prior["middle"] in (prior["lower"], prior["upper"]) or prior["largest"] <= prior["middle"]:
        density = 2 * density
    elsewhere = (value > prior["largest"]) | (np.abs(value - prior["middle"]) < prior["least_distance"])
    return np.log(density * np.where(elsewhere, 0.05, 1.0))
