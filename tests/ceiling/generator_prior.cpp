// SPDX-License-Identifier: MIT
#include "tests/ceiling/generator_prior.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <numbers>

#include "proof/distribution.hpp"

namespace bevel::ceiling {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// As trial.cpp and hidden_physics.cpp have them; the tests draw from there and compare.
constexpr double kListedSigmas[] = {1.5, 25}, kUnlistedSigmas[] = {4, 60};
constexpr double kLargestFactor = 1.5;
constexpr double kHappens = 0.45;                      // an instant, in a recording
constexpr double kFromShare = 0.2, kUntilShare = 0.6;  // of its duration

// Magnitudes of a size on one side of neutral, and the density there.
struct Side {
  double low = 0, high = 0, density = 0;
};
Side side_of(const proof::ParameterRange& range, bool negative) {
  const double low = range.low - range.neutral, high = range.high - range.neutral;
  const double share = range.either_sign ? 0.5 : 1.0;
  Side out{.density = share / (high - low)};
  if (range.either_sign || !negative) {
    out.low = std::max(low, 0.0);
    out.high = std::max(high, 0.0);
  } else {
    out.low = std::max(-high, 0.0);
    out.high = std::max(-low, 0.0);
  }
  return out;
}

}  // namespace

SizePrior::SizePrior(std::vector<proof::ParameterRange> ranges, bool listed, double least_factor)
    : ranges_(std::move(ranges)),
      low_sigmas_(listed ? kListedSigmas[0] : kUnlistedSigmas[0]),
      high_sigmas_(listed ? kListedSigmas[1] : kUnlistedSigmas[1]),
      least_factor_(least_factor) {}

double SizePrior::natural(const VectorXd& s) const {
  double density = 1;
  for (Index i = 0; i < s.size(); ++i) {
    const Side side = side_of(ranges_[static_cast<std::size_t>(i)], s[i] < 0);
    density *= std::abs(s[i]) >= side.low && std::abs(s[i]) <= side.high ? side.density : 0;
  }
  return density;
}

// Scaled: s = f d, d natural, f = target / (what d shows), the target log-uniform, f within [least, 1.5]. What shows is
// taken to be in proportion to f, so the target is what s shows. At the bounds f has probability, not density.
double SizePrior::density(const VectorXd& s, double visible_sigmas) const {
  const auto n = static_cast<double>(s.size());
  double from = least_factor_, to = kLargestFactor, across = 1;
  for (Index i = 0; i < s.size(); ++i) {
    const Side side = side_of(ranges_[static_cast<std::size_t>(i)], s[i] < 0);
    if (side.high <= 0) return 0;
    from = std::max(from, std::abs(s[i]) / side.high);
    if (side.low > 0) to = std::min(to, std::abs(s[i]) / side.low);
    across *= side.density;
  }
  const double orders = std::log(high_sigmas_ / low_sigmas_);
  const double below = std::clamp(std::log(visible_sigmas / low_sigmas_) / orders, 0.0, 1.0);  // share of targets
  double scaled = 0;
  if (visible_sigmas > low_sigmas_ && visible_sigmas < high_sigmas_ && from < to)
    scaled += across / orders * (std::pow(from, -n) - std::pow(to, -n)) / n;
  scaled += (1 - below) * std::pow(kLargestFactor, -n) * natural(s / kLargestFactor);
  scaled += below * std::pow(least_factor_, -n) * natural(s / least_factor_);
  return proof::kNaturalShare * natural(s) + (1 - proof::kNaturalShare) * scaled;
}

namespace {

double log_ratio_of_sizes(const GeneratorSystem& system, const inference::Fit& fit, std::size_t member,
                          const Visible& visible, const Eigen::MatrixXd& covariance) {
  const std::size_t e = fit.layout.set()[member];
  const auto& parameters = system.effects()[e].parameters;
  std::vector<proof::ParameterRange> ranges;
  std::vector<Index> at;
  double log_ranges = 0;
  for (std::size_t p = 0; p < system.slots(e).size(); ++p) {
    if (!system.slots(e)[p].is_size) continue;
    ranges.push_back(system.slots(e)[p].range);
    at.push_back(fit.layout.find_shared(member, p));
    log_ranges += std::log(parameters[p].upper - parameters[p].lower);
  }
  if (ranges.empty()) return 0;
  const auto n = static_cast<Index>(at.size());
  VectorXd middle(n);
  for (Index i = 0; i < n; ++i)
    middle[i] = fit.shared[at[static_cast<std::size_t>(i)]] - ranges[static_cast<std::size_t>(i)].neutral;
  const Eigen::MatrixXd root = Eigen::MatrixXd(covariance(at, at)).llt().matrixL();
  double least_factor = 0.003;
  for (const proof::EffectKind& kind : proof::catalogue())
    if (kind.name == system.effects()[e].label) least_factor = kind.least_factor;
  const SizePrior prior(ranges, system.on_a_list(e), least_factor);
  // The mean over the posterior, in the middles of equally probable parts.
  constexpr int kParts = 48;
  std::vector<double> z;
  for (int k = 0; k < kParts; ++k) z.push_back(boost::math::quantile(boost::math::normal(), (k + 0.5) / kParts));
  double sum = 0;
  int count = 0;
  for (int i = 0; i < kParts; ++i)
    for (int j = 0; j < (n > 1 ? kParts : 1); ++j, ++count) {
      VectorXd unit(n);
      unit[0] = z[static_cast<std::size_t>(i)];
      if (n > 1) unit[1] = z[static_cast<std::size_t>(j)];
      const VectorXd s = middle + root * unit;
      sum += prior.density(s, s.cwiseProduct(visible.sigmas_per_unit).norm());
    }
  return std::log(sum / count) + log_ranges;
}

// The generator's chance and time of an instant over the engine's, which are Beta(1, 3) and any time.
double log_ratio_of_instants(const inference::Fit& fit) {
  double sum = 0;
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i) {
    if (!fit.layout.is_instant(i)) continue;
    int happened = 0;
    for (const VectorXd& local : fit.local) happened += local[static_cast<Index>(i)] > 0 ? 1 : 0;
    const auto recordings = static_cast<int>(fit.local.size());
    sum += happened * (std::log(kHappens) - std::log(kUntilShare - kFromShare)) +
           (recordings - happened) * std::log(1 - kHappens);
    sum -= std::log(boost::math::beta(inference::kHappens + happened, inference::kHappensNot + recordings - happened) /
                    boost::math::beta(inference::kHappens, inference::kHappensNot));
  }
  return sum;
}

}  // namespace

double log_prior_of(const GeneratorSystem& system, const inference::ModelSet& set, double log_prior_odds) {
  double sum = 0;
  for (const std::size_t e : set) {
    const auto& all = system.effects();
    const auto kinds = system.on_a_list(e) ? std::ranges::count(all, all[e].name, &inference::Effect::name) : 1;
    sum += log_prior_odds - std::log(static_cast<double>(kinds));
  }
  return sum;
}

double log_prior_ratio(const GeneratorSystem& system, const inference::Fit& fit, const std::vector<Visible>& visible) {
  const auto blocks = inference::linearise(*fit.likelihood, fit, {});
  if (blocks.empty()) return -std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd covariance = inference::solve_about(fit, blocks, {}).covariance;
  double sum = log_ratio_of_instants(fit);
  for (std::size_t m = 0; m < fit.layout.set().size(); ++m)
    sum += log_ratio_of_sizes(system, fit, m, visible[m], covariance);
  return sum;
}

}  // namespace bevel::ceiling
