"""The evidence by Laplace's method, of diagnosis/inference, against nested sampling (dynesty) on small cases.

    PYTHONPATH=.deps/python tests/peers/sampled_evidence.py build/bin/sampled_evidence_cases

Both compute one integral, of a set of effects given, the noise held at what the engine found for that set:

    sum over the grid of the nuisances' standard deviations: its probability
      x integral over the shared unknowns, within their bounds: their priors
      x integral over each recording's nuisances: normal with those standard deviations
      x sum over "it happened in this recording" or not: Beta(1, 3)-binomial; integral over the instant, uniform
      x density of the readings, the constant of 2 pi left out

The engine takes it about one mode: by the linear model in shared unknowns and nuisances, with each prior that is not
normal at its density there, about the instants that the mode has. The sampler draws all of it from the priors and asks
the engine only for the density of the readings. Where the system is the pendulum, these densities and the priors are
checked against pendulum.py, which shares no code with the engine; priors in all cases.
"""
import argparse
import importlib.util
import json
import subprocess
import sys

import numpy as np
from scipy import special

import pendulum

LIMIT = 1.0  # of the difference in log evidence, beyond twice the sampler's standard error
DRAWS = 64  # of the posterior, that are looked at
VALLEY = 0.5  # of log density on the straight way to the mode: there is another mode
SEVERAL = 0.1  # of the posterior, beyond a valley or with other instants: it is not unimodal
SAME = 1e-6  # of two log densities
NEVER = -1e100  # outside the model's domain; dynesty wants a number
SKIPPED = 77


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
        low, high = unknown["lower"], unknown["upper"]
        if prior["form"] == "flat":
            low, high = max(low, prior["lower"]), min(high, prior["upper"])
        near = prior["scale"] * np.geomspace(1e-4, 30, 1500)
        edges = np.concatenate((np.linspace(low, high, 400), prior["middle"] - near, prior["middle"] + near))
        self.edges = np.unique(np.clip(edges, low, high))
        mass = np.exp(pendulum.log_prior(prior, 0.5 * (self.edges[1:] + self.edges[:-1]))) * np.diff(self.edges)
        mass += 1e-12 * mass.sum()  # where the middle of a step has no density, an end may have some
        self.log_steps = np.log(mass / mass.sum() / np.diff(self.edges))
        self.below = np.concatenate(([0], np.cumsum(mass) / mass.sum()))

    def __call__(self, u):
        at = min(np.searchsorted(self.below, u, "right") - 1, len(self.log_steps) - 1)
        share = (u - self.below[at]) / (self.below[at + 1] - self.below[at])
        value = self.edges[at] + share * (self.edges[at + 1] - self.edges[at])
        return value, float(pendulum.log_prior(self.prior, value)) - self.log_steps[at]


class Integral:
    """Over a unit cube: shared unknowns, the place in each group's grid, how often an instant happens at all, and each
    recording's own."""

    def __init__(self, case):
        self.case = case
        self.shared = [Drawn(s) for s in case["shared"]]
        self.grids = [np.array(g) for g in case["groups"]]
        self.instants = [i for i, one in enumerate(case["local"]) if "group" not in one]
        self.recordings = len(case["recordings"])
        self.own = len(case["local"])
        self.dimensions = (len(self.shared) + len(self.grids) + len(self.instants) + self.recordings * self.own)

    def point(self, u):
        """The engine's unknowns, their standard deviations, and the log of what the steps of `shared` leave."""
        out = np.empty(len(self.shared) + self.recordings * self.own)
        log_ratio = 0.0
        for i, drawn in enumerate(self.shared):
            out[i], log = drawn(u[i])
            log_ratio += log
        rest = u[len(self.shared) :]
        # The first of a grid has one half, the others share the rest.
        sd = np.array([g[0] if x < 0.5 else g[1 + int((x - 0.5) * 2 * (len(g) - 1))] for g, x in zip(self.grids, rest)])
        rest = rest[len(self.grids) :]
        # The share of recordings in which it happens, of Beta(1, b).
        often = 1 - (1 - rest[: len(self.instants)]) ** (1 / self.case["happens"][1])
        own = rest[len(self.instants) :].reshape(self.recordings, self.own)
        for r in range(self.recordings):
            for i, one in enumerate(self.case["local"]):
                at = len(self.shared) + r * self.own + i
                if "group" in one:
                    out[at] = sd[one["group"]] * special.ndtri(own[r, i])
                else:
                    share = own[r, i] / often[self.instants.index(i)]
                    out[at] = self.case["recordings"][r]["upper"][i] * share if share < 1 else 0.0
        return out, sd, log_ratio


def sample(served, integral, live, seed):
    """log evidence, its standard error, draws of the posterior: unknowns, standard deviations."""
    import dynesty

    def log_likelihood(u):
        point, _, log_ratio = integral.point(u)
        log = served(point)[0] + log_ratio
        return log if np.isfinite(log) else NEVER

    sampler = dynesty.NestedSampler(log_likelihood, lambda u: u, integral.dimensions, nlive=live, sample="rwalk",
                                    rstate=np.random.default_rng(seed))  # fmt: skip
    sampler.run_nested(dlogz=0.05, print_progress=False)
    result = sampler.results
    draws = result.samples_equal(np.random.default_rng(seed))
    draws = np.random.default_rng(seed).permutation(draws)[:DRAWS]
    return result.logz[-1], result.logzerr[-1], [integral.point(u)[:2] for u in draws]


def differ(served, points):
    """The largest difference between the engine's densities and pendulum.py's."""
    case = served.case
    answers = np.array([served(p) for p in points])
    prior = sum(pendulum.log_prior(s["prior"], points[:, i]) for i, s in enumerate(case["shared"]))
    worst = np.abs(prior - answers[:, 1]).max()
    if case["shared"][0]["name"] == "length_m":
        worst = max(worst, np.abs(pendulum.log_likelihood(case, points) - answers[:, 0]).max())
    return worst


def elsewhere(served, integral, draws):
    """The shares of the posterior beyond a valley, seen from the engine's mode, and with other instants."""
    case = served.case
    mode = np.concatenate([[s["mode"] for s in case["shared"]], *(r["mode"] for r in case["recordings"])])
    is_instant = np.zeros(len(mode), bool)
    group = np.full(len(mode), -1)
    for r in range(integral.recordings):
        for i, one in enumerate(case["local"]):
            at = len(case["shared"]) + r * integral.own + i
            is_instant[at] = i in integral.instants
            group[at] = one.get("group", -1)
    beyond = other = 0
    for point, sd in draws:
        if ((point > 0) != (mode > 0))[is_instant].any():
            other += 1
            continue
        own_sd = np.where(group >= 0, sd[group], 1.0)
        end = np.where((group >= 0) & (own_sd == 0), 0.0, mode)  # where recordings do not differ
        varied = (group >= 0) & (own_sd > 0)
        logs = []
        for share in np.linspace(0, 1, 21):
            at = point + share * (end - point)
            logs.append(served(at).sum() - 0.5 * ((at[varied] / own_sd[varied]) ** 2).sum())
        lower_side = np.minimum(np.maximum.accumulate(logs), np.maximum.accumulate(logs[::-1])[::-1])
        beyond += (lower_side - logs).max() > VALLEY
    return beyond / len(draws), other / len(draws)


def compare(program, name, live, seed):
    """A row of the table, and whether it is as it should be."""
    served = Served(program, name)
    integral = Integral(served.case)
    sampled, error, draws = sample(served, integral, live, seed)
    worst = differ(served, np.array([point for point, _ in draws]))
    beyond, other = elsewhere(served, integral, draws)
    served.close()
    difference = served.case["laplace"] - sampled
    one_mode = beyond + other < SEVERAL
    remarks = ["one mode" if one_mode else "several modes"]
    if beyond > 0:
        remarks.append(f"{100 * beyond:.0f} % of the posterior beyond a valley")
    if other > 0:
        remarks.append(f"{100 * other:.0f} % of it with other instants")
    right = worst < SAME and (not one_mode or abs(difference) <= LIMIT + 2 * error)
    if worst >= SAME:
        remarks.append(f"DENSITIES DIFFER by {worst:.1e}")
    elif not right:
        remarks.append("TOO FAR")
    kind, rest = ("needle", name.removeprefix("needle ")) if name.startswith("needle ") else ("pendulum", name)
    return [f"{kind}, {rest}", served.case["truth"], served.case["set"], integral.dimensions,
            f"{served.case['laplace']:.2f}", f"{sampled:.2f} ± {error:.2f}", f"{difference:+.2f}",
            "; ".join(remarks)], right  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="sampled_evidence_cases")
    parser.add_argument("--cases", help="some of them: nothing,needle layer")
    parser.add_argument("--live", type=int, default=200, help="points that the sampler keeps: more are slower, surer")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if importlib.util.find_spec("dynesty") is None:
        print("sampled_evidence: skipped, no dynesty; tools/setup installs it to .deps/python")
        return SKIPPED
    names = subprocess.run([options.program], capture_output=True, text=True, check=True).stdout.splitlines()
    if options.cases:
        unknown = set(options.cases.split(",")) - set(names)
        if unknown:
            sys.exit(f"sampled_evidence: no case {', '.join(sorted(unknown))}; there are: {', '.join(names)}")
        names = options.cases.split(",")
    header = ["case", "truth", "set", "unknowns", "Laplace", "sampled", "difference", "remark"]
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
