#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The trajectory fit of bench_identification by SciPy: the same model, data, start, tolerances and loss.

    tests/peers/scipy_trajectory_fit.py build/bin/bench_identification

Runs the C++ fit (Google Benchmark, one thread, median of 9) and scipy.optimize.least_squares (Levenberg-Marquardt and
trust region, vectorised NumPy over the recordings, RK4 with one step a measurement, finite-difference Jacobian) in one
go, checks that both find the same parameters, and prints the ratio of their times.
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy.optimize import least_squares

WHEELBASE_MM = 20.0
SIGMA_MM = 0.2
START = np.array([0.0035, 0.144, 0.032])  # k, lambda1, lambda2, as in the C++ bench
TOLERANCE = 1e-8


def rates(theta, k, lambda1, lambda2):
    """(13), (15), (16) per mm of insertion; theta >= 0 is the tilt toward -y."""
    b = 1 - lambda2
    gamma = 2 * theta / (b + np.sqrt(b * b + 4 * lambda1 * theta))  # closed form of gamma(theta)
    alpha = lambda2 * gamma - lambda1 * gamma * gamma
    return k - np.tan(alpha) * -1.0 / WHEELBASE_MM, -np.sin(gamma) / np.cos(alpha), np.cos(gamma) / np.cos(alpha)


def make_residual(insertion, y, z):
    step = np.diff(insertion, axis=1, prepend=0.0)

    def residual(q):
        theta = np.zeros(len(insertion))
        ys, zs = np.empty_like(y), np.empty_like(z)
        at_y, at_z = np.zeros_like(theta), np.zeros_like(theta)
        for i in range(insertion.shape[1]):
            h = step[:, i]
            t1, y1, z1 = rates(theta, *q)
            t2, y2, z2 = rates(theta + h / 2 * t1, *q)
            t3, y3, z3 = rates(theta + h / 2 * t2, *q)
            t4, y4, z4 = rates(theta + h * t3, *q)
            theta = theta + h / 6 * (t1 + 2 * t2 + 2 * t3 + t4)
            at_y = at_y + h / 6 * (y1 + 2 * y2 + 2 * y3 + y4)
            at_z = at_z + h / 6 * (z1 + 2 * z2 + 2 * z3 + z4)
            ys[:, i], zs[:, i] = at_y, at_z
        return np.concatenate(((ys - y).ravel(), (zs - z).ravel())) / SIGMA_MM

    return residual


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    bench = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "data.csv")
        said = subprocess.run([bench, "--export", path], check=True, capture_output=True, text=True).stdout
        data = np.loadtxt(path, delimiter=",")
    cpp = np.array([float(v) for v in said.split("\n")[0].split()[1:]])
    recordings = int(data[:, 0].max()) + 1
    insertion, y, z = (data[:, c].reshape(recordings, -1) for c in (1, 2, 3))
    residual = make_residual(insertion, y, z)

    times = {}
    for method in ("lm", "trf"):
        runs = []
        for _ in range(3):
            begin = time.perf_counter()
            fit = least_squares(residual, START, method=method, x_scale="jac" if method == "trf" else np.abs(START),
                                ftol=TOLERANCE, xtol=TOLERANCE, gtol=TOLERANCE)
            runs.append(1e3 * (time.perf_counter() - begin))
        times[method] = statistics.median(runs)
        off = np.max(np.abs(fit.x - cpp) / np.abs(cpp))
        print(f"scipy {method:3}: {times[method]:9.1f} ms  {fit.nfev} evaluations  k {fit.x[0]:.6f}  lambda1 {fit.x[1]:.5f}"
              f"  lambda2 {fit.x[2]:.5f}  largest relative difference from bevel {off:.1e}")
        if off > 1e-3:
            sys.exit("the two fits disagree: they do not solve the same problem")

    result = json.loads(subprocess.run(
        [bench, "--benchmark_filter=square_loss/1/", "--benchmark_repetitions=9", "--benchmark_min_time=0.1",
         "--benchmark_format=json"], check=True, capture_output=True, text=True).stdout)
    bevel = [b for b in result["benchmarks"] if b["name"].endswith("_median")][0]["real_time"]
    ratio = min(times.values()) / bevel
    print(f"bevel    : {bevel:9.1f} ms  one thread, median of 9")
    print(f"ratio    : {ratio:9.1f}  (the faster of SciPy's two over bevel; wanted >= 50)")
    return 0 if ratio >= 50 else 1


if __name__ == "__main__":
    sys.exit(main())
