// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/posterior.hpp>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>
#include <set>

#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/parallel.hpp>
#include <bevel/error.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNegligible = 1e-3;  // share of a posterior that is not worth a computation
constexpr double kShare = 0.02;       // of a model, given the others, that a prediction takes part of
constexpr double kFarBehind = 15;     // log posterior: what no recording that is left out brings back

ArrowSolution solve_without(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                            std::size_t recording) {
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance);
  ArrowRules rules;
  rules.used.assign(blocks.size(), true);
  if (recording < blocks.size()) rules.used[recording] = false;
  rules.held = fit.held;
  return solve(blocks, pulls.precision, pulls.centre, rules);
}

// A fit's curve values, their covariance, and the form in them whose square root is their visible size.
struct VisibleCurve {
  VectorXd values;
  MatrixXd covariance, square;
};
std::optional<VisibleCurve> visible_curve(const Search& search, const Fit& fit) {
  const CurveColumns curve = curve_of(search, fit);
  const auto blocks = linearise(*fit.likelihood, fit, curve);
  if (blocks.empty()) return {};
  const Index shared = fit.shared.size(), values = fit.curve_values.size();
  std::vector<Index> of_curve(static_cast<std::size_t>(values));
  std::iota(of_curve.begin(), of_curve.end(), shared);
  const ArrowSolution solution = solve_about(fit, blocks, curve, of_curve);
  if (!solution.valid) return {};
  const MatrixXd& information = solution.information;
  const MatrixXd across = information.topRightCorner(shared, values);
  return VisibleCurve{.values = fit.curve_values,
                      .covariance = solution.covariance.bottomRightCorner(values, values),
                      .square = information.bottomRightCorner(values, values) - curve.covariance.inverse() -
                                across.transpose() * information.topLeftCorner(shared, shared).ldlt().solve(across)};
}

}  // namespace

double visible_sigmas_of_curve(const Search& search, const Fit& fit) {
  const auto curve = visible_curve(search, fit);
  return curve ? std::sqrt(std::max(0.0, curve->values.dot(curve->square * curve->values))) : 0;
}

double probability_visible(const Search& search, const Evaluated& at, double sigmas) {
  if (at.fit_with_curve) {
    const auto curve = visible_curve(search, *at.fit_with_curve);
    return curve ? SquaredSize(curve->values, curve->covariance, curve->square).above(sigmas * sigmas) : 0;
  }
  double sum = 0, all = 0;
  for (const CurveFactor& one : at.curves) {
    const double share = std::exp(one.log_bayes_factor - at.curves.front().log_bayes_factor);
    if (share < kNegligible) break;  // the likeliest first
    all += share;
    sum += share * one.visible.above(sigmas * sigmas);
  }
  return all > 0 ? sum / all : 0;
}

Posterior posterior_of(const Search& search, double visible_sigmas) {
  Posterior out;
  std::vector<double> logs;
  for (const auto& [set, one] : search.visited()) logs.push_back(one.log_posterior());
  const double all = log_sum(logs);
  out.not_visited = search.share_not_visited();
  const auto& effects = search.system().effects();
  for (const auto& [set, one] : search.visited()) {
    SetShare share{set, std::exp(one.log_posterior() - all), std::exp(one.log_with_curve - all), 0};
    std::set<std::string> names;
    for (const std::size_t e : set) names.insert(effects[e].name);
    for (const auto& name : names) out.inclusion[name] += share.probability;
    if (share.with_discrepancy > kNegligible * kNegligible)
      share.unknown = share.with_discrepancy * probability_visible(search, *one.at, visible_sigmas);
    out.discrepancy += share.unknown;
    if (set.empty()) out.nothing += share.probability - share.unknown;
    out.sets.push_back(share);
  }
  std::stable_sort(out.sets.begin(), out.sets.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
  return out;
}

CurveColumns curve_of(const Search& search, const Fit& fit) {
  return search.discrepancy().columns(*fit.likelihood, fit);
}

const VectorXd& nuisance_weights_of(const Search& search, const Fit& fit) {
  const Evaluated& at = *search.visited().at(fit.layout.set()).at;
  return fit.scales.curves.empty() ? at.nuisance_weights : at.nuisance_weights_with_curve;
}

double Mixture::mean() const {
  double sum = 0, all = 0;
  for (const Part& part : parts) sum += part.weight * part.mean, all += part.weight;
  return sum / all;
}

double Mixture::sd() const {
  const double middle = mean();
  double sum = 0, all = 0;
  for (const Part& part : parts) {
    sum += part.weight * (part.sd * part.sd + (part.mean - middle) * (part.mean - middle));
    all += part.weight;
  }
  return std::sqrt(sum / all);
}

double Mixture::quantile(double share) const {
  const boost::math::normal normal;
  double low = std::numeric_limits<double>::infinity(), high = -low, all = 0;
  for (const Part& part : parts) {
    low = std::min(low, part.mean - 8 * part.sd);
    high = std::max(high, part.mean + 8 * part.sd);
    all += part.weight;
  }
  for (int step = 0; step < 60 && high - low > 1e-12 * std::max(std::abs(low), std::abs(high)); ++step) {
    const double middle = 0.5 * (low + high);
    double below = 0;
    for (const Part& part : parts)
      below += part.weight * (part.sd > 0 ? boost::math::cdf(normal, (middle - part.mean) / part.sd)
                                          : (part.mean <= middle ? 1.0 : 0.0));
    (below < share * all ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Unknowns::Unknowns(const Search& search) : search_(&search) {
  const double best = search.best().log_posterior();
  const NuisanceGrid grid = nuisance_grid(search.system());
  const auto add = [&](double weight, const Fit& fit, const VectorXd& over) {
    if (weight < kNegligible) return;
    const CurveColumns curve = curve_of(search, fit);
    auto blocks = linearise(*fit.likelihood, fit, curve);
    if (blocks.empty()) return;
    std::optional<Part> first;  // the likelihood is followed once for all standard deviations
    const double negligible = negligible_of(over);
    for (Index k = 0; k < over.size(); ++k) {
      if (weight * over[k] < negligible) continue;
      const VectorXd nuisance_sd = grid.standard_deviations.col(k);
      const ArrowSolution solution = solve_at(nuisance_sd, fit, blocks, curve);
      if (!solution.valid) continue;
      Part part{.weight = weight * over[k],
                .layout = &fit.layout,
                .mean = fit.shared,
                .sd = fit.shared,
                .nuisance_sd = nuisance_sd,
                .along = {}};
      const MatrixXd covariance = solution.covariance_with_tails();
      for (Index i = 0; i < fit.shared.size(); ++i) {
        part.mean[i] += solution.shared[i];
        // Where the readings say nothing about it here, it may be anywhere within its bounds.
        const Parameter& p = *fit.layout.shared()[static_cast<std::size_t>(i)].parameter;
        part.sd[i] = std::min(std::sqrt(std::max(0.0, covariance(i, i))), (p.upper - p.lower) / std::sqrt(12.0));
      }
      if (weight > kShare && !first) {
        look_along(fit, curve, solution.covariance, part);
        first = part;
      } else if (first) {
        part.along = first->along;
      }
      parts_.push_back(std::move(part));
    }
  };
  for (const auto& [set, one] : search.visited()) {
    add(std::exp(one.log_without_curve - best), one.at->fit, one.at->nuisance_weights);
    if (one.at->fit_with_curve)
      add(std::exp(one.log_with_curve - best), *one.at->fit_with_curve, one.at->nuisance_weights_with_curve);
  }
}

// Of those effects' unknowns whose density is no normal one.
void Unknowns::look_along(const Fit& fit, const CurveColumns& curve, const MatrixXd& covariance, Part& part) {
  constexpr double kOfHeld = 0.01;  // of its range: where one that presses against a bound may be
  std::optional<Profile> profile;
  for (Index i = 0; i < fit.shared.size(); ++i) {
    const Unknown& unknown = fit.layout.shared()[static_cast<std::size_t>(i)];
    if (unknown.member < 0) continue;
    const Parameter& p = *unknown.parameter;
    if (has_jump(fit.layout, unknown.member)) {
      if (!profile) profile.emplace(*fit.likelihood, curve, fit);
      if (!profile->valid()) return;
      part.along[i] = posterior_along(*profile, i, part.sd[i] > 0 ? part.sd[i] : kOfHeld * (p.upper - p.lower));
    } else if (!p.periodic) {
      const bool held = !(covariance(i, i) > 0), many = has_many_minima(p);
      double near = held ? kOfHeld * (p.upper - p.lower) : std::min(std::sqrt(covariance(i, i)), part.sd[i]);
      if (many) near = std::min(near, grid_spacing(p, fit.shared[i]));
      const VectorXd by_this = held || many ? VectorXd::Unit(fit.shared.size(), i)
                                            : VectorXd(covariance.col(i).head(fit.shared.size()) / covariance(i, i));
      if (auto along = posterior_by_refits(*fit.likelihood, curve, fit, i, by_this, near, !held && !many);
          !along.empty())
        part.along[i] = std::move(along);
    }
  }
}

Mixture Unknowns::of(int effect, std::size_t parameter) const {
  Mixture out;
  for (const Part& part : parts_) {
    std::size_t at = parameter;
    if (effect >= 0) {
      const auto& set = part.layout->set();
      const auto member = std::find(set.begin(), set.end(), static_cast<std::size_t>(effect));
      if (member == set.end()) continue;
      const int found = part.layout->find_shared(static_cast<std::size_t>(member - set.begin()), parameter);
      if (found < 0) continue;
      at = static_cast<std::size_t>(found);
    }
    const auto i = static_cast<Index>(at);
    if (const auto own = part.along.find(i); own != part.along.end()) {
      for (const ProfileStep& one : own->second)
        out.parts.push_back({part.weight * one.weight, one.middle, one.width / std::sqrt(12.0)});
    } else {
      out.parts.push_back({part.weight, part.mean[i], part.sd[i]});
    }
  }
  return out;
}

VectorXd Unknowns::of_group(std::size_t group) const {
  const auto& values = search_->system().nuisance_groups()[group].standard_deviations;
  VectorXd out = VectorXd::Zero(static_cast<Index>(values.size()));
  for (const Part& part : parts_)
    for (std::size_t i = 0; i < values.size(); ++i)
      if (part.nuisance_sd[static_cast<Index>(group)] == values[i]) out[static_cast<Index>(i)] += part.weight;
  return out / std::max(out.sum(), 1e-300);
}

std::optional<LeftOut> leave_out(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                                 std::size_t recording) {
  const ArrowSolution all = solve_without(fit, blocks, curve, blocks.size());
  const ArrowSolution rest = solve_without(fit, blocks, curve, recording);
  if (!all.valid || !rest.valid) return std::nullopt;
  LeftOut out;
  out.chi2 = all.least - rest.least;
  out.log_density =
      fit.likelihood->log_weights(recording) - 0.5 * (out.chi2 + all.log_volume_ratio - rest.log_volume_ratio);
  out.shared = fit.shared + rest.shared.head(fit.shared.size());
  out.curve_values = fit.curve_values + rest.shared.tail(fit.curve_values.size());
  std::vector<VectorXd> local = fit.local;
  fit.layout.clamp(out.shared, local);
  return out;
}

std::optional<Predictive> predictive_of(const Fit& fit, const std::vector<ArrowBlock>& blocks,
                                        const CurveColumns& curve, std::size_t recording) {
  const ArrowSolution rest = solve_without(fit, blocks, curve, recording);
  if (!rest.valid) return std::nullopt;
  const VectorXd here = VectorXd::Zero(rest.shared.size());
  ArrowRules rules;
  rules.held = fit.held;
  const ArrowSolution alone = solve({blocks[recording]}, rest.information, here, rules);
  if (!alone.valid) return std::nullopt;
  return Predictive{
      .log_density = fit.likelihood->log_weights(recording) - 0.5 * (alone.least + alone.log_volume_ratio),
      .chi2 = alone.least};
}

std::vector<LeftOutSelection> leave_out_selection(const Search& search) {
  const std::size_t recordings = search.system().data().recordings.size();
  struct Model {
    double log = 0;  // of prior times evidence
    const Fit* fit = nullptr;
    std::vector<LeftOut> parts;
  };
  std::vector<Model> models;
  const double best = search.best().log_posterior();
  for (const auto& [set, one] : search.visited()) {
    if (one.log_without_curve > best - kFarBehind) models.push_back({one.log_without_curve, &one.at->fit, {}});
    if (one.at->fit_with_curve && one.log_with_curve > best - kFarBehind)
      models.push_back({one.log_with_curve, &*one.at->fit_with_curve, {}});
  }
  parallel_for(models.size(), [&](std::size_t m) {
    const Fit& fit = *models[m].fit;
    const CurveColumns curve = curve_of(search, fit);
    const auto blocks = linearise(*fit.likelihood, fit, curve);
    for (std::size_t r = 0; r < recordings && !blocks.empty(); ++r)
      if (auto part = leave_out(fit, blocks, curve, r)) models[m].parts.push_back(std::move(*part));
  });
  std::erase_if(models, [&](const Model& model) { return model.parts.size() < recordings; });
  if (models.empty()) throw DomainError("no model can be fitted to these recordings without one of them");
  std::vector<LeftOutSelection> out;
  for (std::size_t r = 0; r < recordings; ++r) {
    std::vector<double> with, without;
    const Model* likeliest = nullptr;
    for (const Model& model : models) {
      with.push_back(model.log);
      without.push_back(model.log - model.parts[r].log_density);
      if (!likeliest || without.back() > likeliest->log - likeliest->parts[r].log_density) likeliest = &model;
    }
    const double rest = log_sum(without);
    out.push_back({.log_density = log_sum(with) - rest, .fit = likeliest->fit, .shares = {}});
    auto& shares = out.back().shares;
    for (std::size_t m = 0; m < models.size(); ++m)
      if (const double probability = std::exp(without[m] - rest); probability > kShare)
        shares.push_back({.fit = models[m].fit, .probability = probability});
    std::stable_sort(shares.begin(), shares.end(),
                     [](const auto& a, const auto& b) { return a.probability > b.probability; });
  }
  return out;
}

}  // namespace bevel::inference
