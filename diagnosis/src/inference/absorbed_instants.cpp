// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/absorbed_instants.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// As if there were none, like scanned_local().
Fit without_curves(Fit fit) {
  fit.scales.curves.clear();
  fit.curve_values.resize(0);
  fit.tangent = nullptr;
  fit.own_volume = nullptr;
  return fit;
}

// One recording with an instant where it is, about unknowns of its own: its cost, with their prior, by the linear model
// where a size of the effect is a step away and they follow.
struct InstantAt {
  double cost = 0, pull = 0, square = 0;  // cost - 2 pull step + square step^2
  VectorXd local, by_size;                // at no step, and per step
  double best_step() const { return square > 0 ? pull / square : 0; }
  double cost_at(double step) const { return cost - 2 * pull * step + square * step * step; }
};

// False outside the model's domain. What is scanned stays as it is.
bool follow_own(const Likelihood& likelihood, const Fit& at, std::size_t r, Index size, InstantAt& out) {
  LinearRecording there;
  if (!linearise(likelihood, at, {}, r, there)) return false;
  const auto own = static_cast<Index>(at.layout.system().nuisances().size());
  ArrowBlock& block = there.block;
  hold_scanned(at.layout, block.precision);
  const Eigen::LLT<MatrixXd> factor(block.own_information());
  const VectorXd to_prior = block.precision.cwiseProduct(block.centre), pull = block.lw + to_prior;
  const VectorXd step = factor.solve(pull), by_size = factor.solve(block.lz.col(size));
  out.cost = block.ww + to_prior.dot(block.centre) - pull.dot(step);
  out.pull = block.zw[size] - block.lz.col(size).dot(step);
  out.square = block.zz(size, size) - block.lz.col(size).dot(by_size);
  out.local = at.local[r];
  out.local.head(own) += step.head(own);
  out.by_size = VectorXd::Zero(out.local.size());
  out.by_size.head(own) = -by_size.head(own);
  return true;
}

// Of one recording: as it is, and with what is its own from none, where the instant is none and anywhere.
std::vector<InstantAt> instants_from_alike(const Likelihood& likelihood, const Fit& fitted, std::size_t r,
                                           std::size_t instant, Index size) {
  std::vector<InstantAt> out;
  Fit at = without_curves(fitted);
  const double upper_s = fitted.layout.upper(instant, r);
  double& at_s = at.local[r][static_cast<Index>(instant)];
  const auto append = [&] {
    InstantAt one;
    if (!follow_own(likelihood, at, r, size, one)) return;
    if (at_s > 0) one.cost += instant_cost(upper_s);
    out.push_back(std::move(one));
  };
  append();
  at.local[r].head(static_cast<Index>(fitted.layout.system().nuisances().size())).setZero();
  const int count = instants_of(upper_s);
  for (int j = 0; j <= count; ++j) {
    at_s = j == 0 ? 0 : upper_s * (j - 0.5) / count;
    append();
  }
  return out;
}

// The size that they all share, among those that one of them would have, at which all recordings together cost least,
// each with its instant where that costs least then.
Fit at_best_size(const Fit& fitted, const std::vector<std::vector<InstantAt>>& all, Index size) {
  const Parameter& p = *fitted.layout.shared()[static_cast<std::size_t>(size)].parameter;
  const auto least = [](const std::vector<InstantAt>& of_one, double step) {
    return std::ranges::min_element(of_one, {}, [&](const InstantAt& one) { return one.cost_at(step); });
  };
  double best_step = 0, best = std::numeric_limits<double>::infinity();
  const auto try_step = [&](double step) {
    step = std::clamp(fitted.shared[size] + step, p.lower, p.upper) - fitted.shared[size];
    double sum = 0;
    for (const auto& of_one : all) sum += least(of_one, step)->cost_at(step);
    if (sum < best) best = sum, best_step = step;
  };
  try_step(0);
  for (const auto& of_one : all)
    for (const InstantAt& one : of_one) try_step(one.best_step());
  Fit out = fitted;
  out.shared[size] += best_step;
  for (std::size_t r = 0; r < all.size(); ++r) {
    const InstantAt& one = *least(all[r], best_step);
    out.local[r] = one.local + best_step * one.by_size;
  }
  return out;
}

// The first size of an effect; -1: it has none.
Index first_size(const Layout& layout, int member) {
  for (std::size_t i = 0; i < layout.shared().size(); ++i)
    if (const Unknown& u = layout.shared()[i]; u.member == member && is_size(*u.parameter))
      return static_cast<Index>(i);
  return -1;
}

}  // namespace

void look_from_alike(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted) {
  const Layout& layout = fitted.layout;
  if (fitted.scales.nuisance_sd.isZero(0)) return;
  for (std::size_t i = 0; i < layout.local().size(); ++i) {
    const Index size = layout.is_instant(i) ? first_size(layout, layout.local()[i].member) : -1;
    if (size < 0) continue;
    std::vector<std::vector<InstantAt>> all(fitted.local.size());
    parallel_for(all.size(), [&](std::size_t r) { all[r] = instants_from_alike(likelihood, fitted, r, i, size); });
    if (std::ranges::any_of(all, [](const auto& of_one) { return of_one.empty(); })) continue;
    const Fit from = at_best_size(fitted, all, size);
    Fit again = fit(likelihood, layout, from.shared, from.local, fitted.scales, curve);
    if (again.valid && cost_with_instants(again) < cost_with_instants(fitted)) fitted = std::move(again);
  }
}

}  // namespace bevel::inference
