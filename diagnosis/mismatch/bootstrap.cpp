#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <random>

#include "diagnosis/mismatch/dictionary.hpp"
#include "diagnosis/mismatch/parallel.hpp"

namespace bevel::diagnosis {
namespace {
constexpr double kQuantile = 0.99;
constexpr double kNothing = 1e-6;  // chi2
constexpr int kFewestGains = 20;   // to know how they are spread
constexpr double kPastAny = 1.5;   // of the largest gain, where there were too few
constexpr double kFarOut = 8;      // standard deviations, as far as is told apart

// Gains are sums of squares: their cube roots are near normal (Wilson and Hilferty 1931), so that effects of many
// starts and of few can be held to one standard. An effect that mostly gains nothing at all (an instant that is not
// worth its cost) is normal only where it gains something, and that is rarer.
class RootsOfGains {
 public:
  explicit RootsOfGains(const Eigen::RowVectorXd& gains) {
    double sum = 0, squares = 0;
    int count = 0;
    for (const double gain : gains) {
      if (gain < kNothing) continue;
      const double root = std::cbrt(gain);
      ++count, sum += root, squares += root * root;
    }
    share_ = static_cast<double>(count) / static_cast<double>(gains.size());
    if (count < kFewestGains) return;
    mean_ = sum / count;
    sd_ = std::max(std::sqrt(std::max(0.0, squares / count - mean_ * mean_)), 1e-6);
  }
  bool usual() const { return sd_ > 0; }
  // As rare as a normal value so many standard deviations up.
  double deviations(double gain) const {
    if (!usual() || gain < kNothing) return -kFarOut;
    const double chance = share_ * above((std::cbrt(gain) - mean_) / sd_);
    return chance > above(kFarOut) ? deviations_of(chance) : kFarOut;
  }
  // And the gain that is.
  double gain_at(double deviations) const {
    return std::pow(std::max(0.0, mean_ + sd_ * deviations_of(std::min(above(deviations) / share_, 0.999))), 3);
  }

 private:
  static double above(double deviations) { return cdf(complement(boost::math::normal(), deviations)); }
  static double deviations_of(double chance) { return quantile(complement(boost::math::normal(), chance)); }
  double share_ = 0, mean_ = 0, sd_ = 0;
};
}  // namespace

NullGains bootstrap_null(const std::vector<Candidate>& dictionary, const Ground& ground, int draws, std::uint64_t seed,
                         int threads) {
  NullGains out{.mean = std::vector<double>(dictionary.size(), 0),
                .threshold = std::vector<double>(dictionary.size(), 0),
                .draws = draws,
                .seed = seed};
  if (dictionary.empty()) return out;
  const auto count = static_cast<std::size_t>(draws);
  Eigen::MatrixXd gains(static_cast<Eigen::Index>(dictionary.size()), draws);
  parallel_for(count, threads, [&](std::size_t d) {
    std::mt19937_64 random(seed + 0x9E3779B97F4A7C15ULL * (d + 1));
    std::normal_distribution<double> normal;
    Eigen::VectorXd noise(ground.residual.size());
    for (double& x : noise) x = normal(random);
    noise -= ground.Q * (ground.Q.transpose() * noise).eval();
    for (std::size_t e = 0; e < dictionary.size(); ++e) {
      double best = 0;
      for (const auto& signature : dictionary[e].signatures)
        best = std::max(best, promise_of(dictionary[e], signature, ground, noise).gain);
      gains(static_cast<Eigen::Index>(e), static_cast<Eigen::Index>(d)) = best;
    }
  });
  std::vector<double> largest(count, -kFarOut);
  std::vector<RootsOfGains> roots;
  for (std::size_t e = 0; e < dictionary.size(); ++e) {
    const auto of_effect = gains.row(static_cast<Eigen::Index>(e));
    roots.emplace_back(of_effect);
    for (std::size_t d = 0; d < count; ++d)
      largest[d] = std::max(largest[d], roots[e].deviations(of_effect[static_cast<Eigen::Index>(d)]));
  }
  std::sort(largest.begin(), largest.end());
  const double limit = largest[std::min(count - 1, static_cast<std::size_t>(kQuantile * static_cast<double>(count)))];
  for (std::size_t e = 0; e < dictionary.size(); ++e) {
    const auto of_effect = gains.row(static_cast<Eigen::Index>(e));
    out.mean[e] = of_effect.mean();
    out.threshold[e] = roots[e].usual() ? roots[e].gain_at(limit) : kPastAny * of_effect.maxCoeff() + 1;
  }
  return out;
}

}  // namespace bevel::diagnosis
