# SPDX-License-Identifier: MIT
"""A Gaussian-process discrepancy after Kennedy and O'Hagan (2001, J. R. Statist. Soc. B 63), by scikit-learn.

Modular, as most who apply it do: k, lambda1, lambda2 are calibrated first, then each axis of measured - predicted is a
process over depth, time, speed, turn rate, sin and cos of the roll (squared exponential, one length per covariate, plus
white noise). Lengths by maximum likelihood on a random part of the readings, the prediction on a larger one: an exact
process over all readings would take minutes a fold. It names nothing; its shortest length says what matters most.
"""
import warnings

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from noise import Noise
from recordings import CHANNELS
from trajectory_fit import Problem

COVARIATES = ("depth", "time", "speed", "turn rate", "sin(roll)", "cos(roll)")
FOR_LENGTHS, FOR_PREDICTION = 200, 1000
SEED = 7
SURE_SD = 2.0  # a prediction further from zero than this many of its own standard deviations counts as a discrepancy
ALARM_SHARE = 0.05  # and this share of readings, one in twenty, is what a right process without one may show


def covariates(recording):
    roll = recording.at_tip(recording.rotation_rad)
    return np.column_stack((recording.at_tip(recording.insertion_mm), recording.tip_s,
                            recording.at_tip(recording.insertion_rate_mm_s),
                            recording.at_tip(recording.rotation_rate_rad_s), np.sin(roll), np.cos(roll)))  # fmt: skip


class Discrepancy:
    def __init__(self, X, Y):
        random = np.random.default_rng(SEED)
        self.centre, self.scale = X.mean(axis=0), np.maximum(X.std(axis=0), 1e-9)
        few = random.choice(len(X), min(FOR_LENGTHS, len(X)), replace=False)
        many = random.choice(len(X), min(FOR_PREDICTION, len(X)), replace=False)
        Z = (X - self.centre) / self.scale
        self.processes = []
        for c in range(3):
            variance = max(float(Y[:, c].var()), 1e-6)
            kernel = (ConstantKernel(variance, (1e-4 * variance, 1e2 * variance))
                      * RBF(np.ones(X.shape[1]), (0.05, 1e3))
                      + WhiteKernel(0.5 * variance, (1e-3 * variance, 2 * variance)))  # fmt: skip
            found = GaussianProcessRegressor(kernel, random_state=SEED).fit(Z[few], Y[few, c])
            self.processes.append(GaussianProcessRegressor(found.kernel_, optimizer=None).fit(Z[many], Y[many, c]))

    def __call__(self, X):
        """Mean and standard deviation of the discrepancy itself, (m, 3) each."""
        Z = (X - self.centre) / self.scale
        means, deviations = [], []
        for process in self.processes:
            mean, deviation = process.predict(Z, return_std=True)
            means.append(mean)
            noise = process.kernel_.k2.noise_level
            deviations.append(np.sqrt(np.maximum(deviation**2 - noise, 1e-12)))
        return np.column_stack(means), np.column_stack(deviations)

    def most_relevant(self):
        """"axis: covariate" of each axis, by its shortest length."""
        return [f"{CHANNELS[c]}: {COVARIATES[int(np.argmin(process.kernel_.k1.k2.length_scale))]}"
                for c, process in enumerate(self.processes)]  # fmt: skip


def run(case):
    warnings.filterwarnings("ignore", category=ConvergenceWarning)
    problem = Problem(case, coloured=False)
    every = list(range(len(case.recordings)))
    null = problem.null()
    X = [covariates(recording) for recording in case.recordings]
    held_out, sure = [], []
    for r in every:
        others = [i for i in every if i != r]
        base = problem.errors(problem.refit(null, Noise(null.noise.sigma_mm, 0.0), others))
        mean, deviation = Discrepancy(np.concatenate([X[i] for i in others]),
                                      np.concatenate([base[i] for i in others]))(X[r])  # fmt: skip
        held_out.append(base[r] - mean)
        sure.append(np.abs(mean) > SURE_SD * deviation)
    whole = Discrepancy(np.concatenate(X), np.concatenate(problem.errors(null)))
    share = float(np.concatenate(sure).mean())
    return {"names": [], "errors": held_out, "most_relevant": whole.most_relevant(), "sure_share": share,
            "alarm": share > ALARM_SHARE}  # fmt: skip
