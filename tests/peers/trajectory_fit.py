# SPDX-License-Identifier: MIT
"""Maximum likelihood of the trajectory: k, lambda1, lambda2 and any effects, on several recordings at once."""
import dataclasses
import math

import numpy as np
from scipy.optimize import least_squares

from needle import INDEX, LAMBDA1, Model
from noise import Noise, most_likely, whiten

DOMAIN_LEFT = 1e3  # a residual where the model has none

NEEDLE = ("k", "lambda1", "lambda2")
BOUNDS = {
    "k": (-0.03, 0.03), "lambda1": (1e-4, 3.0), "lambda2": (-0.5, 0.9),
    "rotation_backlash.width_rad": (0, 3), "torsional_windup.lag_at_100mm_rad": (0, 4),
    "insertion_backlash.width_mm": (0, 10), "insertion_scale.ratio": (0.5, 1.5), "rate_dependence.exponent": (-1, 1),
    "layer.depth_mm": (2, 120), "layer.curvature_ratio": (0.05, 4), "depth_dependence.per_100mm": (-1, 3),
    "drilling.coefficient_mm_per_rad": (0, 50), "flip_transient.length_mm": (0, 60), "relaxation.amplitude_mm": (0, 10),
    "relaxation.tau_s": (0.1, 100), "puncture.depth_mm": (0, 120), "puncture.indentation_mm": (0, 15),
    "tissue_motion.amplitude_mm": (0, 40), "tissue_motion.frequency_hz": (0.05, 2),
    "camera_latency.latency_s": (-0.3, 0.5),
}  # fmt: skip


@dataclasses.dataclass
class Fit:
    names: tuple  # effects
    free: list  # indices into q
    q: np.ndarray
    lost_at_s: np.ndarray  # per recording; 0: not in this one
    phase_rad: np.ndarray
    deviance: float = math.inf
    bic: float = math.inf
    noise: Noise | None = None

    def locals(self, r):
        """Unknowns of recording r alone."""
        return (["lost"] if self.lost_at_s[r] > 0 else []) + (["phase"] if "tissue_motion" in self.names else [])

    def parameters(self):
        extra = sum(len(self.locals(r)) for r in range(len(self.lost_at_s)))
        return len(self.free) + extra + ("slip_direction" in self.names)


class Problem:
    def __init__(self, case, coloured):
        self.model = Model(case.needle)
        self.recordings = case.recordings
        self.coloured = coloured
        self.count = 3 * sum(len(r.tip_s) for r in case.recordings)

    def errors(self, fit, only=None):
        chosen = range(len(self.recordings)) if only is None else only
        return [self.recordings[r].tip_mm - self.model.predict(fit.q, self.recordings[r], fit.lost_at_s[r],
                                                               fit.phase_rad[r]) for r in chosen]  # fmt: skip

    def chi2(self, fit, noise, r):
        error = self.errors(fit, [r])[0]
        if not np.isfinite(error).all():
            return math.inf
        return float((whiten(error, self.recordings[r].tip_s, noise) ** 2).sum())

    def refit(self, start, noise, only=None, shared=True):
        """Least squares over the free parameters and each recording's own; finite differences."""
        fit = dataclasses.replace(start, q=start.q.copy(), lost_at_s=start.lost_at_s.copy(),
                                  phase_rad=start.phase_rad.copy())  # fmt: skip
        chosen = list(range(len(self.recordings))) if only is None else only
        own = [(r, kind) for r in chosen for kind in fit.locals(r)]
        free = fit.free if shared else []
        names = list(INDEX)
        low = [BOUNDS.get(names[i], (-math.inf, math.inf))[0] for i in free]
        high = [BOUNDS.get(names[i], (-math.inf, math.inf))[1] for i in free]
        low += [0.05 if kind == "lost" else -math.inf for _, kind in own]
        high += [self.recordings[r].base_s[-1] if kind == "lost" else math.inf for r, kind in own]
        x0 = [fit.q[i] for i in free] + [(fit.lost_at_s if kind == "lost" else fit.phase_rad)[r] for r, kind in own]
        if not x0:
            return fit
        # Step for the differences: a part of what matters, also of a parameter that stands at zero.
        step = np.array([max(abs(x), 1e-3 if i < len(free) and names[free[i]] != "k" else 1e-4) * 1e-4
                         for i, x in enumerate(x0)])  # fmt: skip

        def put(x):
            fit.q[free] = x[: len(free)]
            for (r, kind), value in zip(own, x[len(free) :]):
                (fit.lost_at_s if kind == "lost" else fit.phase_rad)[r] = value

        def residual(x):
            put(x)
            white = np.concatenate([whiten(e, self.recordings[r].tip_s, noise).ravel()
                                    for r, e in zip(chosen, self.errors(fit, chosen))])  # fmt: skip
            return np.nan_to_num(white, nan=DOMAIN_LEFT, posinf=DOMAIN_LEFT, neginf=DOMAIN_LEFT)

        def jacobian(x):
            here = residual(x)
            J = np.empty((len(here), len(x)))
            for i in range(len(x)):
                there = x.copy()
                h = step[i] if x[i] + step[i] < high[i] else -step[i]
                there[i] += h
                J[:, i] = (residual(there) - here) / h
            return J

        x0 = np.clip(x0, np.array(low) + 1e-9, np.array(high) - 1e-9)
        put(least_squares(residual, x0, jac=jacobian, bounds=(low, high), x_scale="jac", ftol=1e-4, xtol=1e-5,
                          max_nfev=25).x)  # fmt: skip
        return fit

    def judge(self, fit):
        errors = self.errors(fit)
        if not all(np.isfinite(e).all() for e in errors):
            fit.bic = math.inf
            return fit
        fit.deviance, fit.noise = most_likely(errors, [r.tip_s for r in self.recordings], self.coloured)
        fit.bic = fit.deviance + fit.parameters() * math.log(self.count)
        return fit

    def null(self):
        n = len(self.recordings)
        q = self.model.belief.copy()
        q[LAMBDA1] = max(q[LAMBDA1], 1e-3)
        start = Fit((), [INDEX[name] for name in NEEDLE], q, np.zeros(n), np.zeros(n))
        white = self.judge(self.refit(start, Noise(np.full(3, 0.2), 0.0)))
        return self.judge(self.refit(white, white.noise))

    def held_out(self, fit):
        """Each recording predicted by the selected model, fitted on the others; its own phase or instant on itself."""
        errors = []
        for r in range(len(self.recordings)):
            others = [i for i in range(len(self.recordings)) if i != r]
            without = self.refit(fit, fit.noise, others)
            if fit.locals(r):
                without = self.refit(without, fit.noise, [r], shared=False)
            errors += self.errors(without, [r])
        return errors
