"""PySINDy on the velocity residual: d/dt (measured - predicted tip), as a sparse sum of terms in what the log tells.

As its users run it: SmoothedFiniteDifference (Savitzky-Golay) over readings put on an even grid, a polynomial library of
degree 3 in depth, speed, turn rate, sin and cos of the roll, sequentially thresholded least squares. The threshold is
chosen by leave-one-recording-out error of the residual velocity, among them one that leaves no term: by the least error,
and by the one-standard-error rule, which is the sparser. The prediction is the model's path plus the integral of the
terms.
"""
import warnings

import numpy as np
import pysindy as ps

from noise import Noise
from recordings import CHANNELS, FRAME_S
from trajectory_fit import Problem

DEGREE = 3
THRESHOLDS_MM_S = np.concatenate((np.geomspace(0.02, 4.0, 10), [1e6]))  # the last leaves no term
COVARIATES = ("depth/50", "speed/10", "turn/3", "sin(roll)", "cos(roll)")


def covariates(recording, t):
    def at(values):
        return np.interp(t, recording.base_s, values)

    roll = at(recording.rotation_rad)
    return np.column_stack((at(recording.insertion_mm) / 50, at(recording.insertion_rate_mm_s) / 10,
                            at(recording.rotation_rate_rad_s) / 3, np.sin(roll), np.cos(roll)))  # fmt: skip


class Track:
    """A recording on an even grid: library of terms and velocity residual."""

    def __init__(self, recording, error):
        self.t = np.arange(recording.tip_s[0], recording.tip_s[-1], FRAME_S)
        even = np.column_stack([np.interp(self.t, recording.tip_s, error[:, c]) for c in range(3)])
        self.rate_mm_s = np.asarray(ps.SmoothedFiniteDifference()._differentiate(even, self.t))
        self.u = covariates(recording, self.t)


def fit(tracks, threshold):
    library = ps.GeneralizedLibrary([ps.PolynomialLibrary(degree=DEGREE)], inputs_per_library=[[3, 4, 5, 6, 7]])
    model = ps.SINDy(optimizer=ps.STLSQ(threshold=threshold), feature_library=library)
    zeros = [np.zeros_like(track.rate_mm_s) for track in tracks]
    model.fit(zeros, t=FRAME_S, x_dot=[track.rate_mm_s for track in tracks], u=[track.u for track in tracks],
              feature_names=[f"e{c}" for c in CHANNELS] + list(COVARIATES))  # fmt: skip
    return model


def terms_of(track):
    return np.asarray(ps.PolynomialLibrary(degree=DEGREE).fit_transform(track.u))


def choose_thresholds(tracks, terms):
    """Leave one recording out: the threshold of the least error, and the largest within a standard error of it."""
    losses = np.empty((len(THRESHOLDS_MM_S), len(tracks)))
    for r in range(len(tracks)):
        others = [i for i in range(len(tracks)) if i != r]
        X, y = np.concatenate([terms[i] for i in others]), np.concatenate([tracks[i].rate_mm_s for i in others])
        for i, threshold in enumerate(THRESHOLDS_MM_S):
            coefficients = ps.STLSQ(threshold=threshold).fit(X, y).coef_
            losses[i, r] = ((tracks[r].rate_mm_s - terms[r] @ np.asarray(coefficients).T) ** 2).mean()
    mean = losses.mean(axis=1)
    best = int(mean.argmin())
    # Of the differences to the best: recordings differ far more from each other than thresholds do.
    error = (losses - losses[best]).std(axis=1, ddof=1) / np.sqrt(len(tracks))
    sparse = max(t for t, m, e in zip(THRESHOLDS_MM_S, mean, error) if m <= mean[best] + e)
    return {"least": THRESHOLDS_MM_S[best], "sparse": sparse}


def learn(recordings, errors, chosen):
    """Rule -> model."""
    tracks = [Track(recordings[i], errors[i]) for i in chosen]
    thresholds = choose_thresholds(tracks, [terms_of(track) for track in tracks])
    return {rule: fit(tracks, threshold) for rule, threshold in thresholds.items()}


def foretell(model, recording):
    t = np.arange(recording.tip_s[0], recording.tip_s[-1] + FRAME_S, FRAME_S)
    u = covariates(recording, t)
    rate = np.asarray(model.predict(np.zeros((len(t), 3)), u))
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
        for rule, model in learn(case.recordings, base, others).items():
            held_out[rule].append(base[r] - foretell(model, case.recordings[r]))
    models = learn(case.recordings, problem.errors(null), every)
    return {rule: {"names": name_terms(models[rule]), "errors": held_out[rule]} for rule in models}
