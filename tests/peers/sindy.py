# SPDX-License-Identifier: MIT
"""PySINDy on the velocity residual: d/dt (measured - predicted tip), as a sparse sum of terms in what the log tells.

As its users run it: SmoothedFiniteDifference (Savitzky-Golay) over readings put on an even grid, sequentially
thresholded least squares, library and threshold by leave-one-recording-out error of the residual velocity: by the least
error, and by the one-standard-error rule, which is the sparser. Libraries: polynomials of degree 1 and 2 in depth,
speed, turn rate, sin and cos of the roll, and products that a bent path makes likely; no term at all is among the
choices. The prediction is the model's path plus the integral of the terms.

Two settings are kinder than PySINDy's own, found on the first cases: a window of 31 readings for 11 (noise in the
velocity falls to a seventh of its variance), and no polynomial of degree 3 (each recording moves in its own way, and
its 56 terms predicted no recording that they were not fitted on).
"""
import warnings

import numpy as np
import pysindy as ps

from noise import Noise
from recordings import CHANNELS, FRAME_S
from trajectory_fit import Problem

THRESHOLDS_MM_S = np.concatenate((np.geomspace(0.02, 2.0, 8), [1e6]))  # the last leaves no term
WINDOW = {"window_length": 31, "polyorder": 3}
PLAIN = ("depth/50", "speed/10", "turn/3", "sin(roll)", "cos(roll)")
PRODUCTS = ("speed", "speed sin", "speed cos", "speed depth", "speed depth sin", "speed depth cos", "speed^2",
            "speed depth^2", "|turn|", "turn sin", "turn cos", "|turn| depth")  # fmt: skip


def covariates(recording, t):
    def at(values):
        return np.interp(t, recording.base_s, values)

    roll = at(recording.rotation_rad)
    return np.column_stack((at(recording.insertion_mm) / 50, at(recording.insertion_rate_mm_s) / 10,
                            at(recording.rotation_rate_rad_s) / 3, np.sin(roll), np.cos(roll)))  # fmt: skip


def products(recording, t):
    depth, v, w, sin, cos = covariates(recording, t).T
    return np.column_stack((v, v * sin, v * cos, v * depth, v * depth * sin, v * depth * cos, v * v, v * depth * depth,
                            np.abs(w), w * sin, w * cos, np.abs(w) * depth))  # fmt: skip


# Library -> inputs, their names, degree.
LIBRARIES = {
    "degree 1": (covariates, PLAIN, 1),
    "degree 2": (covariates, PLAIN, 2),
    "products": (products, PRODUCTS, 1),
}


class Track:
    """A recording on an even grid: velocity residual, and the inputs of each library."""

    def __init__(self, recording, error):
        self.t = np.arange(recording.tip_s[0], recording.tip_s[-1], FRAME_S)
        even = np.column_stack([np.interp(self.t, recording.tip_s, error[:, c]) for c in range(3)])
        self.rate_mm_s = np.asarray(ps.SmoothedFiniteDifference(smoother_kws=WINDOW)._differentiate(even, self.t))
        self.u = {name: inputs(recording, self.t) for name, (inputs, _, _) in LIBRARIES.items()}


def fit(tracks, library, threshold):
    _, names, degree = LIBRARIES[library]
    terms = ps.GeneralizedLibrary([ps.PolynomialLibrary(degree=degree)],
                                  inputs_per_library=[list(range(3, 3 + len(names)))])  # fmt: skip
    model = ps.SINDy(optimizer=ps.STLSQ(threshold=threshold), feature_library=terms)
    zeros = [np.zeros_like(track.rate_mm_s) for track in tracks]
    model.fit(zeros, t=FRAME_S, x_dot=[track.rate_mm_s for track in tracks], u=[track.u[library] for track in tracks],
              feature_names=[f"e{c}" for c in CHANNELS] + list(names))  # fmt: skip
    return model


def choose(tracks):
    """Rule -> (library, threshold): of the least error, and the sparsest within a standard error of it."""
    choices, losses, counts = [], [], []
    for library, (_, _, degree) in LIBRARIES.items():
        terms = [np.asarray(ps.PolynomialLibrary(degree=degree).fit_transform(track.u[library])) for track in tracks]
        for threshold in THRESHOLDS_MM_S:
            loss, count = [], 0
            for r, track in enumerate(tracks):
                X = np.concatenate([t for i, t in enumerate(terms) if i != r])
                y = np.concatenate([t.rate_mm_s for i, t in enumerate(tracks) if i != r])
                weights = np.asarray(ps.STLSQ(threshold=threshold).fit(X, y).coef_)
                loss.append(((track.rate_mm_s - terms[r] @ weights.T) ** 2).mean())
                count += np.count_nonzero(weights)
            choices.append((library, threshold))
            losses.append(loss)
            counts.append(count)
    losses = np.array(losses)
    mean = losses.mean(axis=1)
    best = int(mean.argmin())
    # Of the differences to the best: recordings differ far more from each other than choices do.
    error = (losses - losses[best]).std(axis=1, ddof=1) / np.sqrt(len(tracks))
    near = [i for i in range(len(choices)) if mean[i] <= mean[best] + error[i]]
    return {"least": choices[best], "sparse": choices[min(near, key=lambda i: (counts[i], mean[i]))]}


def learn(recordings, errors, chosen):
    """Rule -> (library, model)."""
    tracks = [Track(recordings[i], errors[i]) for i in chosen]
    return {rule: (choice[0], fit(tracks, *choice)) for rule, choice in choose(tracks).items()}


def predict(library, model, recording):
    t = np.arange(recording.tip_s[0], recording.tip_s[-1] + FRAME_S, FRAME_S)
    rate = np.asarray(model.predict(np.zeros((len(t), 3)), LIBRARIES[library][0](recording, t)))
    drift = np.concatenate((np.zeros((1, 3)), np.cumsum(0.5 * FRAME_S * (rate[1:] + rate[:-1]), axis=0)))
    return np.column_stack([np.interp(recording.tip_s, t, drift[:, c]) for c in range(3)])


def name_terms(model):
    features = model.get_feature_names()
    weights = np.asarray(model.coefficients())
    terms = [(abs(weights[c, i]), f"d{CHANNELS[c]}/dt: {weights[c, i]:+.2g} {features[i]}")
             for c, i in zip(*np.nonzero(weights))]  # fmt: skip
    return [text for _, text in sorted(terms, reverse=True)]


def run(case):
    """Rule -> result."""
    warnings.filterwarnings("ignore", module="pysindy")
    problem = Problem(case, coloured=False)
    every = list(range(len(case.recordings)))
    null = problem.null()
    held_out = {"least": [], "sparse": []}
    for r in every:
        others = [i for i in every if i != r]
        base = problem.errors(problem.refit(null, Noise(null.noise.sigma_mm, 0.0), others))
        for rule, (library, model) in learn(case.recordings, base, others).items():
            held_out[rule].append(base[r] - predict(library, model, case.recordings[r]))
    models = learn(case.recordings, problem.errors(null), every)
    return {rule: {"names": name_terms(model), "library": library, "errors": held_out[rule]}
            for rule, (library, model) in models.items()}  # fmt: skip
