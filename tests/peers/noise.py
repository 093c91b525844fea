"""Camera noise, and the figures by which held-out predictions are judged."""
import dataclasses
import math

import numpy as np
from scipy.optimize import minimize_scalar

from recordings import FRAME_S

HAMPEL_HALF = 3  # readings on either side
HAMPEL_SD = 6.0


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


def outliers(error):
    """Messages further from the running median of the errors than noise goes (Hampel's filter), per reading."""
    padded = np.pad(error, ((HAMPEL_HALF, HAMPEL_HALF), (0, 0)), mode="edge")
    window = np.lib.stride_tricks.sliding_window_view(padded, 2 * HAMPEL_HALF + 1, axis=0)
    off = np.abs(error - np.median(window, axis=-1))
    return (off > HAMPEL_SD * 1.4826 * np.median(off, axis=0)).any(axis=1)


def figures(errors, times, noise):
    """Of all held-out readings: RMSE and largest error in mm, whitened chi2 per reading."""
    every = np.concatenate(errors)
    white = np.concatenate([whiten(e, t, noise) for e, t in zip(errors, times)])
    if not np.isfinite(every).all():
        return {"rmse_mm": math.inf, "max_mm": math.inf, "chi2_per_reading": math.inf}
    return {"rmse_mm": float(np.sqrt((every**2).mean())), "max_mm": float(np.abs(every).max()),
            "chi2_per_reading": float((white**2).mean())}  # fmt: skip
