# SPDX-License-Identifier: MIT
"""The evidence by Laplace's method, of diagnosis/src/inference, against sampled evidence on small cases.

    PYTHONPATH=.deps/python tests/peers/sampled_evidence.py build/bin/sampled_evidence_cases

All compute one integral, of a set of effects given, the noise held at what the engine found for that set, each
nuisance's standard deviation at one of its grid, and instants in the recordings where the engine's mode has them:

    probability of those standard deviations in the grid, and of that pattern of instants (Beta(1, 3)-binomial)
      x integral over the shared unknowns, within their bounds: their priors
      x integral over each recording's nuisances: normal with those standard deviations
      x integral over each instant: uniform over the recording
      x density of the readings, the constant of 2 pi left out

The engine takes it about one mode: by the linear model in shared unknowns and nuisances, with each prior that is not
normal at its density there, each instant by itself. Two samplers ask it for nothing but the density of the readings:

  nested sampling (dynesty), at the standard deviations of the mode: from all of the prior, so that it sees what is far
  from the mode, to a few tenths;
  importance sampling from a Student's t that is fitted to the posterior in rounds, at the likeliest few of the grid: to
  some hundredths, about one mode.

The engine's sum over the grid is compared with that of the second one over the same few. Priors in all cases, and in
those of the pendulum the density of the readings, are checked against pendulum.py, which shares no code with it.
"""
import argparse
import importlib.util
import json
import subprocess
import sys

SKIPPED = 77
missing = [name for name in ("numpy", "scipy", "dynesty") if importlib.util.find_spec(name) is None]
if missing:
    print(f"sampled_evidence: skipped, no {', '.join(missing)}; tools/setup installs them to .deps/python")
    sys.exit(SKIPPED)

import numpy as np
from scipy import special, stats

import pendulum

LIMIT = 1.0  # of the difference in log evidence, beyond twice the sampler's standard error
AGREE = 3.0  # standard errors, and LIMIT / 2, that the samplers may be apart
COMBINATIONS = 6  # of standard deviations, the likeliest by the engine
DRAWS = 64  # of the posterior, that are looked at
VALLEY = 0.5  # of log density on the straight way to the mode: there is another mode
SEVERAL = 0.1  # of the posterior, beyond a valley: it is not unimodal
SAME = 1e-6  # of two log densities
NEVER = -1e100  # outside the model's domain; dynesty wants a number


class Served:
    """A case behind build/bin/sampled_evidence_cases."""

    def __init__(self, program, name):
        self.process = subprocess.Popen([program, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.case = json.loads(self.process.stdout.readline())

    def __call__(self, point):
        """log likelihood, log prior of the shared unknowns"""
        self.process.stdin.write(np.ascontiguousarray(point, float).tobytes())
        self.process.stdin.flush()
        return np.frombuffer(self.process.stdout.read(16))

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Drawn:
    """One shared unknown from a unit interval: by a density of steps near its prior's, and the log of their ratio."""

    def __init__(self, unknown):
        prior = self.prior = unknown["prior"]
        self.low, self.high = unknown["lower"], unknown["upper"]
        if prior["form"] == "flat":
            self.low, self.high = max(self.low, prior["lower"]), min(self.high, prior["upper"])
        near = prior["scale"] * np.geomspace(1e-4, 30, 1500)
        edges = np.concatenate((np.linspace(self.low, self.high, 400), prior["middle"] - near, prior["middle"] + near))
        self.edges = np.unique(np.clip(edges, self.low, self.high))
        mass = np.exp(pendulum.log_prior(prior, 0.5 * (self.edges[1:] + self.edges[:-1]))) * np.diff(self.edges)
        mass += 1e-12 * mass.sum()  # where the middle of a step has no density, an end may have some
        self.log_steps = np.log(mass / mass.sum() / np.diff(self.edges))
        self.below = np.concatenate(([0], np.cumsum(mass) / mass.sum()))

    def __call__(self, u):
        at = min(np.searchsorted(self.below, u, "right") - 1, len(self.log_steps) - 1)
        share = (u - self.below[at]) / (self.below[at + 1] - self.below[at])
        value = self.edges[at] + share * (self.edges[at + 1] - self.edges[at])
        return value, self.log_prior(value) - self.log_steps[at]

    def log_prior(self, value):
        return float(pendulum.log_prior(self.prior, value)) if self.low <= value <= self.high else -np.inf


class Integral:
    """At given standard deviations. Coordinates: shared unknowns; nuisances in their standard deviations, where these
    are not zero; instants in shares of the recording, where there is one."""

    def __init__(self, served, drawn, combination):
        self.served, self.drawn, case = served, drawn, served.case
        self.shared, self.own, recordings = len(drawn), len(case["local"]), case["recordings"]
        rest = combination
        self.sd, self.log_constant = [], 0.0
        for grid in case["groups"]:
            rest, which = divmod(rest, len(grid))
            self.sd.append(grid[which])
        # None differ with one half, else each of a grid's values is as likely.
        share = 0.5 / np.prod([len(grid) for grid in case["groups"]])
        self.log_constant += np.log(share if any(self.sd) else 0.5 + share)
        self.nuisances, self.instants, self.scale, start = [], [], [], []
        for i, one in enumerate(case["local"]):
            happened = 0
            for r, recording in enumerate(recordings):
                mode, place = recording["mode"][i], self.shared + r * self.own + i
                if "group" not in one and mode > 0:
                    happened += 1
                    self.instants.append((place, recording["upper"][i], mode / recording["upper"][i]))
                elif "group" in one and self.sd[one["group"]] > 0:
                    self.nuisances.append((place, self.sd[one["group"]]))
                    start.append(np.clip(mode / self.sd[one["group"]], -3, 3))
            if "group" not in one:
                a, b = case["happens"]
                self.log_constant += special.betaln(a + happened, b + len(recordings) - happened) - special.betaln(a, b)
        self.mode = np.array([*(s["mode"] for s in case["shared"]), *start, *(share for *_, share in self.instants)])
        self.places = [p for p, _ in self.nuisances] + [p for p, *_ in self.instants]
        self.scale = np.array([s for _, s in self.nuisances] + [s for _, s, _ in self.instants])

    def point(self, x):
        out = np.zeros(self.shared + len(self.served.case["recordings"]) * self.own)
        out[: self.shared] = x[: self.shared]
        out[self.places] = x[self.shared :] * self.scale
        return out

    def log_density(self, x):
        """Of readings and unknowns together."""
        times = x[len(x) - len(self.instants) :]
        log = sum(d.log_prior(value) for d, value in zip(self.drawn, x))
        if not np.isfinite(log) or np.any((times <= 0) | (times >= 1)):
            return -np.inf
        z = x[self.shared : self.shared + len(self.nuisances)]
        return log + self.served(self.point(x))[0] - 0.5 * (z @ z + len(z) * np.log(2 * np.pi)) + self.log_constant

    def from_unit(self, u):
        x, log_ratio = np.array(u, float), 0.0
        for i, drawn in enumerate(self.drawn):
            x[i], log = drawn(u[i])
            log_ratio += log
        normal = slice(self.shared, self.shared + len(self.nuisances))
        x[normal] = special.ndtri(u[normal])
        return x, log_ratio


def nested(integral, live, seed):
    """log evidence, its standard error, draws of the posterior"""
    import dynesty

    def log_likelihood(u):
        x, log_ratio = integral.from_unit(u)
        log = integral.served(integral.point(x))[0] + log_ratio + integral.log_constant
        return log if np.isfinite(log) else NEVER

    # Slices: random walks of dynesty's default length, in nine dimensions of which one was the place in the grid, gave
    # an evidence that was off by eight of its standard errors.
    sampler = dynesty.NestedSampler(log_likelihood, lambda u: u, len(integral.mode), nlive=live, sample="rslice",
                                    rstate=np.random.default_rng(seed))  # fmt: skip
    sampler.run_nested(dlogz=0.1, print_progress=False)
    result = sampler.results
    draws = result.samples_equal(np.random.default_rng(seed))
    draws = np.random.default_rng(seed).permutation(draws)[:DRAWS]
    return result.logz[-1], result.logzerr[-1], [integral.from_unit(u)[0] for u in draws]


def widths_about(integral, centre):
    """Along each coordinate, where log density has fallen by about one half; and the centre, off its bounds by that."""
    centre, widths = centre.copy(), np.ones(len(centre))
    widths[: integral.shared] = [d.prior["scale"] for d in integral.drawn]
    here = integral.log_density(centre)
    for i in range(len(centre)):
        low, high = (integral.drawn[i].low, integral.drawn[i].high) if i < integral.shared else (-np.inf, np.inf)
        for _ in range(40):
            step = np.zeros(len(centre))
            step[i] = widths[i] if centre[i] + widths[i] < high else -widths[i]
            if here - integral.log_density(centre + step) < 0.7:
                break
            widths[i] *= 0.7
        centre[i] = np.clip(centre[i], low + widths[i], high - widths[i])
    return centre, widths


def covariance_about(integral, centre, widths):
    """Of the normal density with this curvature; where there is none, of the widths alone."""
    n = len(centre)
    H = np.empty((n, n))
    e = np.diag(widths)
    at = integral.log_density
    here, up, down = at(centre), [at(centre + s) for s in e], [at(centre - s) for s in e]
    for i in range(n):
        for j in range(i, n):
            both = at(centre + e[i] + e[j]) + at(centre - e[i] - e[j])
            H[i, j] = H[j, i] = (up[i] + down[i] + up[j] + down[j] - 2 * here - both) / 2
    np.fill_diagonal(H, [2 * here - u - d for u, d in zip(up, down)])
    values, vectors = np.linalg.eigh(H) if np.isfinite(H).all() else (np.ones(n), np.eye(n))
    return np.diag(widths) @ (vectors / np.clip(values, 0.02, None)) @ vectors.T @ np.diag(widths)


def importance(integral, seed, rounds=5, count=1000, last=3000):
    """log evidence, its standard error"""
    random = np.random.default_rng(seed)
    centre, widths = widths_about(integral, integral.mode)
    covariance = covariance_about(integral, centre, widths)
    for turn in range(rounds + 1):
        student = stats.multivariate_t(centre, covariance, df=5, allow_singular=True)
        x = student.rvs(last if turn == rounds else count, random_state=random).reshape(-1, len(centre))
        logs = np.array([integral.log_density(one) for one in x]) - student.logpdf(x)
        weights = np.exp(logs - logs.max())
        if turn == rounds:
            return np.log(weights.mean()) + logs.max(), weights.std() / weights.mean() / np.sqrt(len(weights))
        # No draw counts for more than one in fifty: what is fitted to few has no width.
        weights = np.minimum(weights, np.sort(weights)[-50])
        centre = np.average(x, axis=0, weights=weights)
        covariance = 1.1 * np.atleast_2d(np.cov(x.T, aweights=weights)) + np.diag((1e-3 * widths) ** 2)
    return None


def differ(served, points):
    """The largest difference between the engine's densities and pendulum.py's."""
    case = served.case
    answers = np.array([served(p) for p in points])
    prior = sum(pendulum.log_prior(s["prior"], points[:, i]) for i, s in enumerate(case["shared"]))
    worst = np.abs(prior - answers[:, 1]).max()
    if case["shared"][0]["name"] == "length_m":
        worst = max(worst, np.abs(pendulum.log_likelihood(case, points) - answers[:, 0]).max())
    return worst


def beyond_valleys(integral, draws):
    """The share of the posterior that is there, seen from the engine's mode."""
    beyond = 0
    for draw in draws:
        logs = [integral.log_density(draw + share * (integral.mode - draw)) for share in np.linspace(0, 1, 21)]
        lower_side = np.minimum(np.maximum.accumulate(logs), np.maximum.accumulate(logs[::-1])[::-1])
        beyond += (lower_side - logs).max() > VALLEY
    return beyond / len(draws)


def compare(program, name, live, seed):
    """A row of the table, and whether it is as it should be."""
    served = Served(program, name)
    case = served.case
    drawn = [Drawn(s) for s in case["shared"]]
    with np.errstate(divide="ignore"):
        engine = case["laplace"] + np.log(case["weights"])
    likeliest = np.argsort(-engine, kind="stable")[:COMBINATIONS]
    integrals = [Integral(served, drawn, k) for k in likeliest]
    here = next(i for i, one in enumerate(integrals) if one.sd == case["nuisance_sd"])
    sampled = [importance(one, seed) for one in integrals]
    about, error = sampled[here]
    difference = engine[likeliest[here]] - about
    logs = np.array([log for log, _ in sampled])
    over_grid = special.logsumexp(engine[likeliest]) - special.logsumexp(logs)
    grid_error = np.linalg.norm(special.softmax(logs) * [e for _, e in sampled])
    nested_log, nested_error, draws = nested(integrals[here], live, seed)
    worst = differ(served, np.array([integrals[here].point(x) for x in draws]))
    beyond = beyond_valleys(integrals[here], draws)
    served.close()
    remarks, right = ["one mode" if beyond < SEVERAL else "several modes"], True
    if beyond > 0:
        remarks.append(f"{100 * beyond:.0f} % of the posterior beyond a valley")
    if worst >= SAME:
        remarks.append(f"DENSITIES DIFFER by {worst:.1e}")
        right = False
    if abs(nested_log - about) > AGREE * np.hypot(nested_error, error) + LIMIT / 2:
        remarks.append("SAMPLERS DIFFER")
        right = False
    if beyond < SEVERAL:
        off = engine[likeliest[here]] - nested_log
        far = (abs(difference) > LIMIT + 2 * error or abs(off) > LIMIT + 2 * nested_error or
               abs(over_grid) > LIMIT + 2 * grid_error)  # fmt: skip
        if far:
            remarks.append("TOO FAR")
            right = False
    kind, rest = ("needle", name.removeprefix("needle ")) if name.startswith("needle ") else ("pendulum", name)
    return [f"{kind}, {rest}", case["truth"], case["set"], len(integrals[here].mode),
            f"{engine[likeliest[here]]:.2f}", f"{nested_log:.2f} ± {nested_error:.2f}", f"{about:.2f} ± {error:.2f}",
            f"{difference:+.2f}", f"{over_grid:+.2f} ± {grid_error:.2f}", "; ".join(remarks)], right  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="sampled_evidence_cases")
    parser.add_argument("--cases", help="some of them: nothing,needle layer")
    parser.add_argument("--live", type=int, default=100, help="points that dynesty keeps: more are slower, surer")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    names = subprocess.run([options.program], capture_output=True, text=True, check=True).stdout.splitlines()
    if options.cases:
        unknown = set(options.cases.split(",")) - set(names)
        if unknown:
            sys.exit(f"sampled_evidence: no case {', '.join(sorted(unknown))}; there are: {', '.join(names)}")
        names = options.cases.split(",")
    header = ["case", "truth", "set", "unknowns", "Laplace", "nested", "importance", "Laplace less importance",
              "the same over the grid", "remark"]  # fmt: skip
    wrong = 0
    for line in (header, ["---"] * len(header)):
        print("| " + " | ".join(line) + " |")
    for name in names:
        row, right = compare(options.program, name, options.live, options.seed)
        wrong += not right
        print("| " + " | ".join(str(cell) for cell in row) + " |", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
