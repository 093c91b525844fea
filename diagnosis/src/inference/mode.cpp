// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/likelihood.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

bool linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve, std::size_t r,
               LinearRecording& out) {
  Residuals& residuals = out.residuals;
  if (!likelihood.evaluate(fit.layout, r, fit.shared, fit.local[r], true, residuals, curve, fit.curve_values))
    return false;
  out.Z = residuals.by_shared;
  if (curve) {
    out.Z.conservativeResize(Eigen::NoChange, out.Z.cols() + curve.columns[r].cols());
    out.Z.rightCols(curve.columns[r].cols()) = curve.columns[r];
  }
  const auto free = free_locals(fit.layout);
  out.L = residuals.by_local(Eigen::all, free);
  // What did not happen has no derivative by when it did.
  for (std::size_t i = 0; i < free.size(); ++i)
    if (fit.layout.is_instant(static_cast<std::size_t>(free[i])) && fit.local[r][free[i]] == 0)
      out.L.col(static_cast<Index>(i)).setZero();
  out.block = make_block(out.L, out.Z, residuals.white);
  out.block.precision = local_precision_of(fit.layout, fit.scales);
  out.block.centre = nuisance_centre(fit.layout, fit.local[r]);
  if (fit.own_volume) out.block.slope = fit.own_volume->slope[r];
  return true;
}

namespace {

// kept: with the columns that they are made of; null: without.
bool make_blocks(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                 std::vector<ArrowBlock>& blocks, std::vector<LinearRecording>* kept = nullptr) {
  blocks.resize(likelihood.recordings());
  if (kept) kept->resize(likelihood.recordings());
  std::atomic<bool> valid = true;
  parallel_for(likelihood.recordings(), [&](std::size_t r) {
    LinearRecording recording;
    if (!valid) return;
    if (!linearise(likelihood, fit, curve, r, recording)) {
      valid = false;
      return;
    }
    blocks[r] = std::move(recording.block);
    if (kept) (*kept)[r] = std::move(recording);
  });
  return valid;
}

// Squared residuals and the priors' pulls.
double cost_of(const Pulls& pulls, const std::vector<ArrowBlock>& blocks) {
  double cost = pulls.centre.dot(pulls.precision * pulls.centre);
  for (const ArrowBlock& block : blocks)
    cost += block.ww + block.centre.dot(block.precision.cwiseProduct(block.centre));
  return cost;
}

// What presses against a bound stays there, as what is fixed does; a step that goes across one ends on it, the other
// unknowns following, unless it is only asked what the linear model says.
enum class Bounds { end_steps, do_not_end_steps };

ArrowSolution solve_within(const Fit& now, const std::vector<ArrowBlock>& blocks, const Pulls& pulls, ArrowRules& how,
                           Bounds bounds, const std::vector<Index>& fixed = {}) {
  how.held = fixed;
  how.held_at.assign(fixed.size(), 0);
  ArrowSolution step = solve(blocks, pulls.precision, pulls.centre, how);
  for (int pass = 0; step.valid && pass < 3; ++pass) {
    const auto before = how.held.size();
    for (Index i = 0; i < now.shared.size(); ++i) {
      const Parameter& p = *now.layout.shared()[static_cast<std::size_t>(i)].parameter;
      if (p.periodic || step.shared[i] == 0 || std::ranges::count(how.held, i) > 0) continue;
      const double room = step.shared[i] < 0 ? p.lower - now.shared[i] : p.upper - now.shared[i];
      const bool presses = room == 0 || (room > 0) != (step.shared[i] > 0);
      if (presses || (bounds == Bounds::end_steps && std::abs(step.shared[i]) > std::abs(room))) {
        how.held.push_back(i);
        how.held_at.push_back(presses ? 0 : room);
      }
    }
    if (how.held.size() == before) break;
    step = solve(blocks, pulls.precision, pulls.centre, how);
  }
  return step;
}

}  // namespace

ArrowSolution solve_about(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                          std::optional<std::vector<Index>> covariance_of) {
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance);
  ArrowRules how{.covariance_of = std::move(covariance_of)};
  return solve_within(fit, blocks, pulls, how, Bounds::do_not_end_steps);
}

ArrowSolution solve_at(const VectorXd& nuisance_sd, const Fit& fit, std::vector<ArrowBlock>& blocks,
                       const CurveColumns& curve, std::optional<std::vector<Index>> covariance_of) {
  const VectorXd precision = local_precision_of(fit.layout, {.nuisance_sd = nuisance_sd, .curves = {}});
  for (ArrowBlock& block : blocks) block.precision = precision;
  return solve_about(fit, blocks, curve, std::move(covariance_of));
}

Fit carried_to(Layout layout, const Fit& from) {
  Fit out(std::move(layout));
  out.scales = from.scales;
  out.shared = out.layout.shared_from(from.layout, from.shared);
  for (const VectorXd& local : from.local) out.local.push_back(out.layout.local_from(from.layout, local));
  out.curve_values = from.curve_values;
  out.tangent = from.tangent;
  out.likelihood = from.likelihood;
  out.valid = from.valid;
  return out;
}

std::vector<VectorXd> inputs_about(const Fit& fit) {
  std::vector<VectorXd> out;
  const Likelihood& likelihood = *fit.likelihood;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    out.push_back(likelihood.system().by_inputs(fit.layout.set(), r, fit.shared, fit.local[r]));
    if (out.back().size() == 0) return {};
  }
  return out;
}

std::shared_ptr<const Likelihood> without_inputs(const Likelihood& likelihood) {
  return std::make_shared<const Likelihood>(likelihood, likelihood.noise());
}

std::shared_ptr<const Likelihood> with_inputs_of(const Fit& fit, const std::shared_ptr<const Likelihood>& likelihood) {
  const auto inputs = inputs_about(fit);
  return inputs.empty() ? likelihood : std::make_shared<const Likelihood>(*likelihood, likelihood->noise(), inputs);
}

std::vector<ArrowBlock> linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                                  std::vector<LinearRecording>* recordings) {
  std::vector<ArrowBlock> blocks;
  if (!make_blocks(likelihood, fit, curve, blocks, recordings)) blocks.clear();
  return blocks;
}

double cost_at(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve) {
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance);
  const VectorXd precision = local_precision_of(fit.layout, fit.scales);
  std::vector<double> squares(likelihood.recordings());
  parallel_for(likelihood.recordings(), [&](std::size_t r) {
    Residuals residuals;
    squares[r] = likelihood.evaluate(fit.layout, r, fit.shared, fit.local[r], false, residuals, curve, fit.curve_values)
                     ? residuals.white.squaredNorm()
                     : std::numeric_limits<double>::infinity();
  });
  double cost = pulls.centre.dot(pulls.precision * pulls.centre);
  for (std::size_t r = 0; r < squares.size(); ++r) {
    const VectorXd centre = nuisance_centre(fit.layout, fit.local[r]);
    cost += squares[r] + centre.dot(precision.cwiseProduct(centre));
  }
  return cost;
}

Fit fit(const Likelihood& likelihood, const Layout& layout, const VectorXd& shared, const std::vector<VectorXd>& local,
        const Scales& scales, const CurveColumns& curve, const FitRules& rules) {
  Fit begin(layout);
  begin.scales = scales;
  begin.shared = shared;
  begin.local = local;
  begin.own_volume = rules.own_volume;
  if (curve) begin.curve_values = curve.tangent ? curve.tangent->values : VectorXd::Zero(curve.covariance.rows());
  return fit_from(likelihood, std::move(begin), everywhere(curve), rules);
}

CurveAt everywhere(const CurveColumns& curve) {
  const std::shared_ptr<const CurveColumns> same(std::shared_ptr<const void>(), &curve);
  return [same](const Fit&, bool) { return same; };
}

namespace {

// A place, with the linear model about it.
struct Place {
  std::vector<LinearRecording> recordings;
  std::vector<ArrowBlock> blocks;
  Pulls pulls;
};

// Derivatives come with the cost: most steps are taken.
bool look(const Likelihood& likelihood, const CurveAt& curve_at, Fit& at, Place& place) {
  at.cost = std::numeric_limits<double>::infinity();
  const auto curve = curve_at(at, true);
  if (!curve || !make_blocks(likelihood, at, *curve, place.blocks, &place.recordings)) return false;
  at.tangent = curve->tangent;
  place.pulls = pulls_of(at.layout, at.shared, at.curve_values, curve->covariance);
  at.cost = cost_of(place.pulls, place.blocks);
  return true;
}

// A share of a step on from a fit.
Fit stepped(const Fit& from, const ArrowSolution& step, double share) {
  Fit out = from;
  const auto free = free_locals(from.layout);
  out.shared += share * step.shared.head(from.shared.size());
  out.curve_values += share * step.shared.tail(from.curve_values.size());
  for (std::size_t r = 0; r < out.local.size(); ++r)
    if (step.local[r].size() > 0)
      for (std::size_t i = 0; i < free.size(); ++i)
        out.local[r][free[i]] += share * step.local[r][static_cast<Index>(i)];
  out.layout.clamp(out.shared, out.local);
  return out;
}

// Half of the second derivative by how far a step is gone, as one more step: the way along a valley that is bent
// (Transtrum, Machta and Sethna 2011, Phys. Rev. E 83, 036701: geodesic acceleration). By one difference of
// readings. Not valid where the model cannot follow, or where it is no small thing beside the step.
ArrowSolution bend(const Likelihood& likelihood, const CurveAt& curve_at, const Fit& now, const Place& here,
                   const ArrowSolution& step, ArrowRules how) {
  constexpr double kShare = 0.1;     // of the step: where the difference is taken
  constexpr double kLargest = 0.75;  // of the bend beside the step, twice
  const Fit ahead = stepped(now, step, kShare);
  ArrowSolution out;
  const auto curve = curve_at(ahead, false);
  if (!curve) return out;
  std::vector<ArrowBlock> blocks = here.blocks;
  std::atomic<bool> valid = true;
  parallel_for(blocks.size(), [&](std::size_t r) {
    Residuals there;
    if (!valid ||
        !likelihood.evaluate(now.layout, r, ahead.shared, ahead.local[r], false, there, *curve, ahead.curve_values)) {
      valid = false;
      return;
    }
    const LinearRecording& recording = here.recordings[r];
    VectorXd second = (there.white - recording.residuals.white) / kShare + recording.Z * step.shared;
    if (step.local[r].size() > 0) second += recording.L * step.local[r];
    second *= 1 / kShare;
    ArrowBlock& block = blocks[r];
    block.lw.noalias() = recording.L.transpose() * second;
    block.zw.noalias() = recording.Z.transpose() * second;
    block.centre.setZero();
    block.slope.resize(0);
  });
  if (!valid) return out;
  how.held_at.clear();
  out = solve(blocks, here.pulls.precision, VectorXd::Zero(here.pulls.centre.size()), how);
  if (!out.valid) return out;
  const auto squared_size = [&](const ArrowSolution& one) {
    double sum = one.shared.dot(here.pulls.precision.diagonal().cwiseProduct(one.shared));
    for (std::size_t r = 0; r < blocks.size(); ++r) {
      sum += one.shared.dot(blocks[r].zz.diagonal().cwiseProduct(one.shared));
      const VectorXd own = blocks[r].ll.diagonal() + blocks[r].precision;
      sum += one.local[r].dot(own.cwiseProduct(one.local[r]));
    }
    return sum;
  };
  out.valid = 4 * squared_size(out) <= kLargest * kLargest * squared_size(step);
  return out;
}

}  // namespace

Fit fit_from(const Likelihood& likelihood, Fit now, const CurveAt& curve_at, const FitRules& rules) {
  now.layout.clamp(now.shared, now.local);
  Place here, there;
  now.valid = look(likelihood, curve_at, now, here) && std::isfinite(now.cost);
  // With what the recordings' own volume is more, or less, than where its slopes were taken.
  VectorXd slope = VectorXd::Zero(now.shared.size());
  if (now.own_volume)
    for (const VectorXd& one : now.own_volume->slope) slope += one;
  const auto with_volume = [&](const Fit& at, double cost) {
    return now.own_volume ? cost + 2 * slope.dot(at.shared - now.own_volume->about) : cost;
  };
  constexpr double kStraight = 0.75;  // of what the linear model promised: so much a step has brought
  double damping = 1e-4;
  bool bent = false;
  for (int iteration = 0; now.valid && iteration < rules.max_iterations; ++iteration) {
    now.iterations = iteration + 1;
    ArrowRules how{.damping = damping, .covariance_of = std::vector<Index>{}};
    bool moved = false, small = false;
    while (how.damping < 1e8) {
      const ArrowSolution step = solve_within(now, here.blocks, here.pulls, how, Bounds::end_steps, rules.fixed);
      if (!step.valid) {
        how.damping = std::max(how.damping * 6, 1e-6);
        continue;
      }
      // What the linear model expects to gain is too little to look for.
      const double least = with_volume(now, step.least), here_is = with_volume(now, now.cost);
      if (here_is - least < rules.tolerance && how.damping < 1e-2) {
        now.held = how.held;
        break;
      }
      Fit trial = stepped(now, step, 1);
      if (bent) {
        const ArrowSolution half = bend(likelihood, curve_at, now, here, step, how);
        if (!half.valid) {
          how.damping *= 6;
          continue;
        }
        trial = stepped(trial, half, 1);
      }
      look(likelihood, curve_at, trial, there);
      const double gained = here_is - with_volume(trial, trial.cost);
      bent = bent || !(gained > kStraight * (here_is - least));
      if (gained > 0) {
        trial.held = how.held;
        small = gained < rules.tolerance;
        now = std::move(trial);
        std::swap(here, there);
        damping = std::max(how.damping * 0.2, 1e-7);
        moved = true;
        break;
      }
      how.damping *= 6;
    }
    if (!moved || small) break;
  }
  likelihood.count_steps(now.iterations);
  return now;
}

}  // namespace bevel::inference
