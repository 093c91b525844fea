#include <algorithm>
#include <cmath>
#include <random>

#include "diagnosis/mismatch/dictionary.hpp"
#include "diagnosis/mismatch/parallel.hpp"

namespace bevel::diagnosis {
namespace {
constexpr double kQuantile = 0.99;
}

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
  // Gains are sums of squares: their cube roots are near normal (Wilson and Hilferty 1931), so that effects of many
  // starts and of few can be held to one standard.
  const Eigen::MatrixXd roots = gains.array().pow(1.0 / 3).matrix();
  const Eigen::VectorXd mean = roots.rowwise().mean();
  const Eigen::VectorXd sd = ((roots.colwise() - mean).array().square().rowwise().mean()).sqrt().max(1e-6);
  std::vector<double> largest(count);
  for (std::size_t d = 0; d < count; ++d)
    largest[d] = ((roots.col(static_cast<Eigen::Index>(d)) - mean).array() / sd.array()).maxCoeff();
  std::sort(largest.begin(), largest.end());
  const double limit = largest[std::min(count - 1, static_cast<std::size_t>(kQuantile * static_cast<double>(count)))];
  for (std::size_t e = 0; e < dictionary.size(); ++e) {
    out.mean[e] = gains.row(static_cast<Eigen::Index>(e)).mean();
    out.threshold[e] = std::pow(mean[static_cast<Eigen::Index>(e)] + limit * sd[static_cast<Eigen::Index>(e)], 3);
  }
  return out;
}

}  // namespace bevel::diagnosis
