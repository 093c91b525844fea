# SPDX-License-Identifier: MIT
"""Camera noise, and the figures by which held-out predictions are judged."""
import dataclasses
import math

import numpy as np
from scipy.optimize import minimize_scalar

from recordings import FRAME_S

SPIKE_SD = 6.0
SPIKE_PASSES = 4


@dataclasses.dataclass
class Noise:
    sigma_mm: np.ndarray  # per channel, of one reading
    ar1: float  # correlation of readings one frame apart


def whiten(error, tip_s, noise):
    """Independent errors of unit variance; an AR(1) process over the gaps that dropped frames leave."""
    kept = noise.ar1 ** (np.diff(tip_s) / FRAME_S) if noise.ar1 > 0 else np.zeros(len(tip_s) - 1)
    out = error / noise.sigma_mm
    out[1:] = (out[1:] - kept[:, None] * out[:-1]) / np.sqrt(1 - kept**2)[:, None]
    return out


def deviance(errors, times, ar1):
    """Minus twice the log-likelihood with each channel's sigma at its best, and those sigmas."""
    unit = Noise(np.ones(3), ar1)
    squares = sum((whiten(e, t, unit) ** 2).sum(axis=0) for e, t in zip(errors, times))
    count = sum(len(t) for t in times)
    log_terms = 0.0
    if ar1 > 0:
        log_terms = 3 * sum(np.log1p(-(ar1 ** (2 * np.diff(t) / FRAME_S))).sum() for t in times)
    return count * np.log(squares / count).sum() + log_terms, np.sqrt(squares / count)


def most_likely(errors, times, coloured):
    """(deviance, Noise) of errors of a model; white or AR(1)."""
    ar1 = 0.0
    if coloured:
        ar1 = minimize_scalar(lambda r: deviance(errors, times, r)[0], bounds=(0.0, 0.99), method="bounded",
                              options={"xatol": 1e-3}).x  # fmt: skip
    value, sigma = deviance(errors, times, ar1)
    return value, Noise(sigma, ar1)


def spikes(error):
    """How far each reading is from the middle of its neighbours; at the ends from its one neighbour, to the same sd."""
    out = np.empty_like(error)
    out[1:-1] = error[1:-1] - 0.5 * (error[:-2] + error[2:])
    out[0], out[-1] = math.sqrt(0.75) * (error[0] - error[1]), math.sqrt(0.75) * (error[-1] - error[-2])
    return np.abs(out)


def outliers(errors):
    """Per recording, messages that stand out of their neighbours further than noise does (median of all recordings).

    Of the errors of the model refitted, and of neighbours only: what the model lacks is smooth and stays in.
    """
    dropped = [np.zeros(len(e), bool) for e in errors]
    for _ in range(SPIKE_PASSES):
        all_spikes = [spikes(e[~d]) for e, d in zip(errors, dropped)]
        sd = 1.4826 * np.median(np.concatenate(all_spikes), axis=0)
        found = 0
        for s, d in zip(all_spikes, dropped):
            height = (s / sd).max(axis=1)
            around = np.pad(height, 1)
            # An outlier makes its neighbours look bad too: only the worst goes, the others are looked at again.
            worst = (height > SPIKE_SD) & (height >= around[:-2]) & (height >= around[2:])
            d[np.flatnonzero(~d)[worst]] = True
            found += worst.sum()
        if not found:
            break
    return dropped


def figures(errors, times, noise):
    """Of all held-out readings: RMSE and largest error in mm, whitened chi2 per reading."""
    every = np.concatenate(errors)
    white = np.concatenate([whiten(e, t, noise) for e, t in zip(errors, times)])
    if not np.isfinite(every).all():
        return {"rmse_mm": math.inf, "max_mm": math.inf, "chi2_per_reading": math.inf}
    return {"rmse_mm": float(np.sqrt((every**2).mean())), "max_mm": float(np.abs(every).max()),
            "chi2_per_reading": float((white**2).mean())}  # fmt: skip
