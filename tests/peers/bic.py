# SPDX-License-Identifier: MIT
"""Plain BIC selection: maximum likelihood through the integrator, forward steps, white or AR(1) noise.

As its users write it: every effect as a list of parameters with starts, scipy.optimize.least_squares with finite
differences, k, lambda1 and lambda2 always free, BIC = deviance + parameters * log(readings), noise at its own maximum
for each candidate. It has no answer "unknown", no bootstrap, no gate.
"""
import dataclasses
import itertools
import math

import numpy as np

from needle import INDEX
from trajectory_fit import Problem

ON = 10.0  # what a jump has to bring in a recording's chi2 to be put there
MOST_EFFECTS = 3

# Effect -> lists of starts; a parameter that is not listed stays at "none". Two entries of one name are variants.
EFFECTS = [
    ("rotation_backlash", {"width_rad": [0.2]}),
    ("torsional_windup", {"lag_at_100mm_rad": [0.4]}),
    ("insertion_backlash", {"width_mm": [1.0]}),
    ("insertion_scale", {"ratio": [0.95]}),
    ("lost_steps", {"rotation_rad": [-1.2, -0.5, 0.5, 1.2]}),
    ("lost_steps", {"insertion_mm": [-2.0, 2.0]}),
    ("rate_dependence", {"exponent": [0.1]}),
    ("layer", {"depth_mm": [15.0, 30.0, 45.0, 60.0], "curvature_ratio": [0.8]}),
    ("depth_dependence", {"per_100mm": [0.2]}),
    ("drilling", {"coefficient_mm_per_rad": [1.0]}),
    ("flip_transient", {"length_mm": [6.0]}),
    ("relaxation", {"amplitude_mm": [0.8], "tau_s": [1.5, 8.0]}),
    ("puncture", {"depth_mm": [10.0, 20.0, 30.0, 40.0, 50.0, 60.0], "indentation_mm": [2.0]}),
    ("tissue_motion", {"amplitude_mm": [0.4], "frequency_hz": list(np.arange(0.15, 0.45, 0.02)),
                       "direction_rad": [0.5]}),
    ("lateral_bias", {"x_per_mm": [1e-4], "y_per_mm": [1e-4]}),
    ("bevel_offset", {"roll_rad": [0.1]}),
    ("entry_angle", {"about_x_rad": [0.01], "about_y_rad": [0.01]}),
    ("camera_latency", {"latency_s": [0.05]}),
    ("camera_scale", {"ratio": [1.01]}),
    ("camera_rotation", {"about_x_rad": [0.01]}),
    ("refraction", {"coefficient": [0.02], "centre_mm": [20.0, 50.0]}),
    ("slip_direction", {"other": [1.0]}),
]  # fmt: skip
FIXED = {"slip_direction.other"}  # a choice, not a number; it counts as one parameter


class Selection(Problem):
    def scan_jump(self, fit, at, value, noise):
        """Where in each recording a jump of this size helps most, if it does."""
        fit.q[at] = value
        for r, recording in enumerate(self.recordings):
            fit.lost_at_s[r] = 0.0
            without = self.chi2(fit, noise, r)
            best = without - ON
            for at_s in np.arange(0.25, recording.base_s[-1], 0.25):
                trial = dataclasses.replace(fit, lost_at_s=fit.lost_at_s.copy())
                trial.lost_at_s[r] = at_s
                chi2 = self.chi2(trial, noise, r)
                if chi2 < best:
                    best, fit.lost_at_s[r] = chi2, at_s
        return fit

    def scan_swing(self, fit, base_errors, frequency):
        """Amplitude, direction and phases of a swing in the errors; what it explains."""
        gain, phasors = 0.0, []
        for e, recording in zip(base_errors, self.recordings):
            t = 2 * math.pi * frequency * recording.tip_s
            X = np.column_stack((np.sin(t), np.cos(t), np.ones_like(t)))
            c, *_ = np.linalg.lstsq(X, e[:, :2], rcond=None)
            gain += ((X[:, :2] @ c[:2]) ** 2).sum()
            phasors.append(c[:2])
        direction = np.linalg.svd(np.concatenate(phasors))[2][0]
        along = [c @ direction for c in phasors]
        fit.q[INDEX["tissue_motion.frequency_hz"]] = frequency
        fit.q[INDEX["tissue_motion.direction_rad"]] = math.atan2(direction[1], direction[0])
        fit.q[INDEX["tissue_motion.amplitude_mm"]] = max(float(np.mean([np.hypot(*a) for a in along])), 0.02)
        fit.phase_rad = np.array([math.atan2(a[1], a[0]) for a in along])
        return gain, fit

    def with_effect(self, fit, name, starts):
        """The best fit with one effect more."""
        keys = [f"{name}.{parameter}" for parameter in starts]
        added = [INDEX[key] for key in keys if key not in FIXED]
        trials = []
        for values in itertools.product(*starts.values()):
            trial = dataclasses.replace(fit, names=fit.names + (name,), free=fit.free + added, q=fit.q.copy(),
                                        lost_at_s=fit.lost_at_s.copy(), phase_rad=fit.phase_rad.copy())  # fmt: skip
            trial.q[[INDEX[key] for key in keys]] = values
            trials.append(trial)
        if name == "tissue_motion":
            at = INDEX["tissue_motion.frequency_hz"]
            errors = self.errors(fit)
            trials = [max((self.scan_swing(t, errors, t.q[at]) for t in trials), key=lambda found: found[0])[1]]
        if name == "lost_steps":
            trials = [self.scan_jump(t, added[0], t.q[added[0]], fit.noise) for t in trials]
            trials = [min(trials, key=lambda t: sum(self.chi2(t, fit.noise, r) for r in range(len(self.recordings))))]
            if not trials[0].lost_at_s.any():
                return fit
        return min((self.judge(self.refit(t, fit.noise)) for t in trials), key=lambda t: t.bic)

    def select(self):
        best = self.null()
        while len(best.names) < MOST_EFFECTS:
            trials = [self.with_effect(best, name, starts) for name, starts in EFFECTS if name not in best.names]
            found = min(trials, key=lambda t: t.bic)
            if found.bic >= best.bic:
                return best
            best = self.judge(self.refit(found, found.noise))
        return best


def run(case, coloured):
    problem = Selection(case, coloured)
    best = problem.select()
    names = list(INDEX)
    return {"names": list(best.names), "errors": problem.held_out(best),
            "parameters": {names[i]: float(best.q[i]) for i in best.free},
            "ar1": best.noise.ar1}  # fmt: skip
