// SPDX-License-Identifier: MIT
// Noise with heavy tails: found where it is, and the likelihood, the evidence and the errors of Student's t.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <random>

#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::LinearSystem;

constexpr double kDegrees = 4;

// Deviations of Student's t over its scale.
double heavy(std::mt19937_64& random) { return std::student_t_distribution<double>(kDegrees)(random); }

std::vector<double> squares_of(bool tails, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> out;
  double sum = 0;
  for (int i = 0; i < 3000; ++i) out.push_back(std::pow(tails ? heavy(random) : normal(random), 2)), sum += out.back();
  for (double& square : out) square *= static_cast<double>(out.size()) / sum;
  return out;
}

TEST(HeavyTails, AreFoundWhereTheyAre) {
  int of_normal = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const Tails found = likeliest_tails(squares_of(true, seed));
    EXPECT_GE(found.degrees, 3) << "seed " << seed;
    EXPECT_LE(found.degrees, 6) << "seed " << seed;
    EXPECT_NEAR(found.scale, 0.5, 0.15) << "seed " << seed;  // (4 - 2) / 4, by the deviation of a sample
    of_normal += likeliest_tails(squares_of(false, seed)).degrees > 0 ? 1 : 0;
  }
  EXPECT_LE(of_normal, 1);
  EXPECT_EQ(likeliest_tails({}).degrees, 0);
}

TEST(HeavyTails, TheWeighedDensityIsThatOfT) {
  const Tails tails{.degrees = 5, .scale = 0.55};
  const double scale = std::sqrt(tails.scale), information = information_of(tails);
  const boost::math::students_t t(tails.degrees);
  for (const double x : {0.0, 0.3, 1.0, 2.5, 6.0, 20.0}) {
    const double exact = std::log(boost::math::pdf(t, x / scale) / scale);
    const double p = precision_of(x * x, tails);
    // What is left out in the mean of all squares, of this one.
    const double left_out = 0.5 * (1 - information) * (1 - p * x * x / information);
    EXPECT_NEAR(
        log_density_beyond(p, tails) + 0.5 * std::log(p) - 0.5 * p * x * x + left_out - 0.5 * std::log(2 * M_PI), exact,
        1e-12)
        << x;
  }
}

// The same recordings with innovations of Student's t, and nothing that differs between them.
class HeavySystem final : public LinearSystem {
 public:
  HeavySystem(std::uint64_t seed, double parabola) : LinearSystem(kRecordings, seed, parabola, 0, 0) {
    std::mt19937_64 random(seed + 1000);
    const MatrixXd X = design({0});
    const VectorXd path = X * Eigen::Vector3d(0.3, 0.2, parabola);
    for (auto& recording : data_.recordings)
      for (std::size_t i = 0; i < recording.series[0].measured.size(); ++i)
        recording.series[0].measured[i] = path[static_cast<Index>(i)] + kScale * heavy(random);
    groups_ = {{"cosine", "mm", {0.0}}};
  }
  static constexpr std::size_t kRecordings = 12;
  static constexpr double kScale = 0.07;
};

Evaluated evaluate_set(const HeavySystem& system, const ModelSet& set, bool tails) {
  Noise noise = white(system);
  if (tails) noise.tails = {.degrees = 5, .scale = 0.6}, noise.tails_are_open = true;
  const Likelihood likelihood(system, Readings(HeavySystem::kRecordings), noise);
  const Layout layout(system, set);
  return evaluate(likelihood, layout, layout.shared_start(),
                  std::vector<VectorXd>(HeavySystem::kRecordings, layout.local_start()), VectorXd::Zero(1));
}

// log of prior and likelihood at these unknowns, constants of 2 pi of the readings left out as the engine does.
double log_joint(const HeavySystem& system, const ModelSet& set, const Noise& noise, const VectorXd& unknowns) {
  const boost::math::students_t t(noise.tails.degrees);
  const double scale = noise.sigma[0] * std::sqrt(noise.tails.scale), left = std::sqrt(1 - noise.ar1 * noise.ar1);
  const VectorXd path = LinearSystem::design(set) * unknowns;
  double sum = 0;
  for (Index i = 0; i < unknowns.size(); ++i)
    sum += std::log(boost::math::pdf(boost::math::normal(0, i < 2 ? 1 : 0.5), unknowns[i]));
  for (const auto& recording : system.data().recordings) {
    double last = 0;
    for (Index i = 0; i < path.size(); ++i) {
      const double e = recording.series[0].measured[static_cast<std::size_t>(i)] - path[i];
      const double unit = i == 0 ? scale : scale * left, innovation = i == 0 ? e : e - noise.ar1 * last;
      sum += std::log(boost::math::pdf(t, innovation / unit) / unit) + 0.5 * std::log(2 * M_PI);
      last = e;
    }
  }
  return sum;
}

// By 400 draws about the mode, twice as wide as the posterior (importance sampling).
double sampled_log_evidence(const HeavySystem& system, const Evaluated& at, std::uint64_t seed) {
  const ModelSet set = at.fit.layout.set();
  const auto blocks = linearise(*at.fit.likelihood, at.fit, {});
  const MatrixXd covariance = 4 * solve_about(at.fit, blocks, {}).covariance;
  const Eigen::LLT<MatrixXd> root(covariance);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> logs;
  for (int draw = 0; draw < 400; ++draw) {
    VectorXd u(covariance.rows());
    for (double& x : u) x = normal(random);
    const VectorXd at_u = at.fit.shared + root.matrixL() * u;
    logs.push_back(log_joint(system, set, at.fit.likelihood->noise(), at_u) + 0.5 * u.squaredNorm() +
                   root.matrixLLT().diagonal().array().log().sum() +
                   0.5 * static_cast<double>(u.size()) * std::log(2 * M_PI));
  }
  return log_sum(logs) - std::log(static_cast<double>(logs.size()));
}

TEST(HeavyTails, TheEvidenceIsThatOfT) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const ModelSet& set : {ModelSet{}, ModelSet{0}, ModelSet{0, 1}}) {
      const HeavySystem system(seed, 0.05);
      const Evaluated at = evaluate_set(system, set, true);
      ASSERT_TRUE(at.valid);
      ASSERT_GT(at.fit.likelihood->noise().tails.degrees, 0);
      EXPECT_NEAR(at.log_evidence, sampled_log_evidence(system, at, seed), 0.3)
          << "seed " << seed << ", " << set.size();
    }
}

// Its errors are as large as it says, and smaller than by normal noise.
TEST(HeavyTails, AParameterIsKnownAsWellAsItSays) {
  constexpr int kDraws = 300;
  constexpr double kParabola = 0.1;
  double by_t = 0, by_normal = 0, in_deviations = 0;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const HeavySystem system(seed, kParabola);
    for (const bool tails : {true, false}) {
      const Evaluated at = evaluate_set(system, {0}, tails);
      ASSERT_TRUE(at.valid);
      const double error = at.fit.shared[2] - kParabola;
      (tails ? by_t : by_normal) += error * error;
      if (!tails) continue;
      const auto solution = solve_about(at.fit, linearise(*at.fit.likelihood, at.fit, {}), {});
      in_deviations += error * error / solution.covariance(2, 2);
    }
  }
  EXPECT_NEAR(in_deviations / kDraws, 1, 0.25);  // three standard deviations of such a mean
  EXPECT_LT(by_t, 0.85 * by_normal);             // (nu + 1)/(nu + 3) of nu/(nu - 2): 0.7 of it is expected
}

}  // namespace
}  // namespace bevel::inference
