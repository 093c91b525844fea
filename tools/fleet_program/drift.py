# SPDX-License-Identifier: MIT
"""The trend of a figure with time: a straight line by weighted least squares, with its uncertainty."""
import dataclasses
import math


@dataclasses.dataclass
class Trend:
    count: int
    mean: float  # weighted, in the figure's unit
    per_day: float  # slope
    per_day_sd: float
    at_mean_days: float  # where the line takes the mean
    chi2_per_dof: float  # about the line; above 1: cases differ by more than their own errors


def trend(days, values, sds):
    """y = mean + slope (t - tbar), weights 1 / sd^2. The slope's standard deviation is sqrt(1 / sum w (t - tbar)^2), times
    sqrt(chi2 / dof) where that is above 1, so that what differs between cases counts as error. None below three points, at
    one single time, or where an error is missing."""
    points = [(t, y, s) for t, y, s in zip(days, values, sds)
              if None not in (y, s) and all(map(math.isfinite, (t, y, s))) and s > 0]
    if len(points) < 3:
        return None
    total = sum(1 / s**2 for _, _, s in points)
    t_mean = sum(t / s**2 for t, _, s in points) / total
    y_mean = sum(y / s**2 for _, y, s in points) / total
    spread = sum((t - t_mean)**2 / s**2 for t, _, s in points)
    if spread <= 1e-12 * total:
        return None
    slope = sum((t - t_mean) * (y - y_mean) / s**2 for t, y, s in points) / spread
    chi2 = sum(((y - y_mean - slope * (t - t_mean)) / s)**2 for t, y, s in points)
    per_dof = chi2 / (len(points) - 2)
    return Trend(len(points), y_mean, slope, math.sqrt(max(1.0, per_dof) / spread), t_mean, per_dof)
