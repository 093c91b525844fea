// SPDX-License-Identifier: MIT
// A discrepancy that is too large for the linear model about none.
#include <bevel/diagnosis/inference/curved_fit.hpp>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/nuisance_grid.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// y = level + exp(c(x)) - 1 + white noise, c linear between its values at x = 0 and x = 1, where it comes once or goes
// to and fro; the model cannot follow where |c| is larger than a limit.
class Exponential final : public testing::HeldSystem {
 public:
  static constexpr Index kReadings = 40;
  static constexpr double kSigma = 0.1, kLevel_sd = 1;
  struct Course {
    double rise;
    bool to_and_fro = false;
    double limit = 10;
  };
  double x(Index i) const {
    const double share = static_cast<double>(i) / (kReadings - 1);
    return course_.to_and_fro ? 0.5 - 0.5 * std::cos(20 * share) : share;
  }

  explicit Exponential(const Course& course) : course_(course) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 1;
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    std::vector<double> measured;
    for (Index i = 0; i < kReadings; ++i)
      measured.push_back(0.3 + std::expm1(course.rise * x(i)) + kSigma * normal(random));
    add_recording(measured, data_.frame_s);
    base_ = {{.name = "level", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, kLevel_sd)}};
    nuisances_ = {{"tilt", 0}};
    groups_ = {{"tilt", "1", {0, 0.1}}};
    curves_ = {{.component = "exponent", .unit = "1", .covariate = "x", .at = {0, 1}}};
  }
  MatrixXd weights() const {
    MatrixXd out(kReadings, 2);
    for (Index i = 0; i < kReadings; ++i) out.row(i) << 1 - x(i), x(i);
    return out;
  }
  bool predict(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    return predict_with(set, r, shared, local, {}, derivatives, out, nullptr);
  }
  bool is_linear_in_curves() const override { return false; }
  bool predict_with(const ModelSet&, std::size_t, const VectorXd& shared, const VectorXd& local,
                    std::span<const CurveValues> curves, bool derivatives, Prediction& out,
                    MatrixXd* by_values) const override {
    VectorXd exponent = VectorXd::Zero(kReadings);
    for (const CurveValues& one : curves) exponent += weights() * one.values;
    if (exponent.cwiseAbs().maxCoeff() > course_.limit) return false;
    const VectorXd grown = exponent.array().exp();
    const VectorXd along = weights().col(1);
    out.reading = grown.array() - 1 + shared[0] + (local[0] * along).array();
    if (derivatives) out.by_shared = MatrixXd::Ones(kReadings, 1), out.by_local = along;
    if (by_values) {
      by_values->resize(kReadings, 2 * static_cast<Index>(curves.size()));
      for (std::size_t k = 0; k < curves.size(); ++k)
        by_values->middleCols<2>(2 * static_cast<Index>(k)) = grown.asDiagonal() * weights();
    }
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return weights(); }

 private:
  Course course_;
};

struct Case {
  explicit Case(const Exponential::Course& course)
      : system(course), likelihood(system, Readings(1), noise()), layout(system, {}) {
    base = fit(likelihood, layout, layout.shared_start(), {layout.local_start()}, {.nuisance_sd = none, .curves = {}});
    discrepancy.emplace(likelihood, base);
  }
  static Noise noise() {
    Noise out;
    out.sigma = {Exponential::kSigma};
    out.frame_s = 1;
    return out;
  }
  Fit with_curve(const CurvePrior& prior) const {
    return fit_beside_curves(likelihood, *discrepancy, layout, base.shared, base.local,
                             {.nuisance_sd = none, .curves = {prior}}, nullptr);
  }
  VectorXd none = VectorXd::Zero(1);
  Exponential system;
  Likelihood likelihood;
  Layout layout;
  Fit base{layout};
  std::optional<Discrepancy> discrepancy;
};

// Squares and priors, without the engine; at[0] is the level.
double cost_of(const Case& made, const MatrixXd& covariance, const Eigen::Vector3d& at) {
  const VectorXd values = at.tail<2>();
  double cost =
      at[0] * at[0] / (Exponential::kLevel_sd * Exponential::kLevel_sd) + values.dot(covariance.ldlt().solve(values));
  const auto& measured = made.system.data().recordings[0].series[0].measured;
  for (Index i = 0; i < Exponential::kReadings; ++i) {
    const double c = (1 - made.system.x(i)) * values[0] + made.system.x(i) * values[1];
    const double off = (measured[static_cast<std::size_t>(i)] - at[0] - std::expm1(c)) / Exponential::kSigma;
    cost += off * off;
  }
  return cost;
}

constexpr CurvePrior kPrior{.curve = 0, .scale = 8, .length = 1};

TEST(CurvedFit, FindsTheModeOfTheNonlinearModel) {
  const Case made({.rise = 1.6});
  const CurveColumns linear = made.discrepancy->columns(made.likelihood, std::span(&kPrior, 1));
  const Fit about_none = fit(made.likelihood, made.layout, made.base.shared, made.base.local,
                             {.nuisance_sd = made.none, .curves = {kPrior}}, linear);
  const Fit found = made.with_curve(kPrior);
  ASSERT_TRUE(found.valid);
  ASSERT_TRUE(found.tangent);
  EXPECT_NEAR(found.curve_values[1] - found.curve_values[0], 1.6, 0.1) << found.curve_values.transpose();
  EXPECT_GT(about_none.curve_values[1] - about_none.curve_values[0], 2.5) << "the linear model is enough here";
  const Eigen::Vector3d mode(found.shared[0], found.curve_values[0], found.curve_values[1]);
  const double least = cost_of(made, linear.covariance, mode);
  EXPECT_NEAR(found.cost, least, 1e-6);
  for (Index i = 0; i < 3; ++i)
    for (const double step : {-0.02, 0.02})
      EXPECT_GT(cost_of(made, linear.covariance, mode + step * Eigen::Vector3d::Unit(i)), least) << i;
}

TEST(CurvedFit, EvidenceAboutItIsThatOfAGrid) {
  const Case made({.rise = 1.6});
  const Fit found = made.with_curve(kPrior);
  const CurveColumns curve = made.discrepancy->columns(made.likelihood, found);
  const ArrowSolution solution = solve_about(found, linearise(made.likelihood, found, curve), curve);
  // Midpoints over seven standard deviations each way; in units of the priors' normal densities.
  constexpr int kSteps = 60;
  constexpr double kFar = 7;
  const Eigen::LLT<MatrixXd> root(solution.covariance);
  const Eigen::Vector3d mode(found.shared[0], found.curve_values[0], found.curve_values[1]);
  double sum = 0;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    Eigen::Vector3d u(i % kSteps, i / kSteps % kSteps, i / kSteps / kSteps);
    u = ((u.array() + 0.5) / kSteps * 2 - 1) * kFar;
    const Eigen::Vector3d at = mode + root.matrixL() * u;
    sum += std::exp(-0.5 * (cost_of(made, curve.covariance, at) - found.cost));
  }
  const double cell = std::pow(2 * kFar / kSteps / std::sqrt(2 * 3.14159265358979), 3);
  const double log_ratio = 0.5 * std::log(solution.covariance.determinant()) -
                           0.5 * std::log(curve.covariance.determinant() * Exponential::kLevel_sd);
  const double by_grid = std::log(sum * cell) + log_ratio;
  EXPECT_NEAR(-0.5 * solution.log_volume_ratio, by_grid, 0.1);
}

TEST(CurvedFit, ASmallCurveIsLeftToTheLinearModel) {
  const Case made({.rise = 0.02});
  const Fit found = made.with_curve({.curve = 0, .scale = 0.25, .length = 1});
  ASSERT_TRUE(found.valid);
  EXPECT_FALSE(found.tangent);
}

// By the linear model about none a large curve has another size than it has.
TEST(CurvedFit, ScaleAndLengthAreThoseOfTheModeThatIsFound) {
  const Case made({.rise = 1.6});
  const Fit found = made.with_curve({.curve = 0, .scale = 0.25, .length = 0.2});
  const CurveColumns curve = made.discrepancy->columns(made.likelihood, found);
  Fit at = found;
  at.likelihood = std::make_shared<const Likelihood>(made.likelihood);
  const VectorXd over = log_over_priors(*made.discrepancy, at, curve, 0);
  const auto likeliest = likeliest_priors(*made.discrepancy, at, curve, 0.2);
  ASSERT_EQ(likeliest.size(), 1U);
  EXPECT_GT(likeliest[0].scale, 0.25);
  // The linear model is that of this mode: the evidence with each prior by the normal density of all readings.
  const auto log_normal_with = [&](const CurvePrior& prior) {
    const MatrixXd K = made.discrepancy->columns(made.likelihood, std::span(&prior, 1)).covariance;
    const MatrixXd& C = curve.columns[0];
    Residuals residuals;
    EXPECT_TRUE(made.likelihood.evaluate(made.layout, 0, found.shared, found.local[0], true, residuals, curve,
                                         VectorXd::Zero(2)));
    const VectorXd y = residuals.white + residuals.by_shared * found.shared;
    const MatrixXd covariance = MatrixXd::Identity(y.size(), y.size()) + C * K * C.transpose() +
                                residuals.by_shared * residuals.by_shared.transpose();
    const Eigen::LLT<MatrixXd> llt(covariance);
    return -0.5 * y.dot(llt.solve(y)) - llt.matrixLLT().diagonal().array().log().sum();
  };
  const double here = log_normal_with(found.scales.curves[0]);
  Index i = 0;
  for (const double scale : kCurveScales)
    for (const double length : kCurveLengths)
      EXPECT_NEAR(over[i++], log_normal_with({0, scale, length}) - here, 1e-3) << scale << " " << length;
}

// The factor of a discrepancy is that of the nonlinear model, whatever the linear one promises.
TEST(CurvedFit, TheDiscrepancysEvidenceIsThatOfTheNonlinearModel) {
  const Case made({.rise = 1.6});
  Evaluated at = evaluate(made.likelihood, made.layout, made.base.shared, made.base.local, made.none);
  add_discrepancy(made.likelihood, *made.discrepancy, {.log_prior_odds = -2, .log_prior_odds_more = -5}, at);
  ASSERT_TRUE(at.fit_with_curve);
  ASSERT_TRUE(at.fit_with_curve->tangent);
  const double rise = at.fit_with_curve->curve_values[1] - at.fit_with_curve->curve_values[0];
  EXPECT_NEAR(rise, 1.6, 0.1);
  EXPECT_NEAR(at.fit_with_curve->likelihood->noise().sigma[0], Exponential::kSigma, 0.03);
  EXPECT_GT(at.log_bayes_factor_curve, 20);
}

// A curve beside a base that begins with a small one.
Evaluated with_small_curve(const Case& made) {
  const Fit small = made.with_curve({.curve = 0, .scale = 0.25, .length = 1});
  Evaluated out = evaluate(made.likelihood, made.layout, made.base.shared, made.base.local, made.none);
  add_discrepancy(made.likelihood, *made.discrepancy, {.log_prior_odds = -2, .log_prior_odds_more = -5}, out,
                  {.large_curve = &small});
  return out;
}

TEST(CurvedFit, TheModeIsWhereTheModelCanFollow) {
  const Case made({.rise = 0.8, .limit = 0.05});
  const Evaluated at = with_small_curve(made);
  ASSERT_TRUE(at.fit_with_curve);
  const Fit& with = *at.fit_with_curve;
  ASSERT_TRUE(with.tangent);
  EXPECT_LT(with.curve_values.cwiseAbs().maxCoeff(), 0.051);
}

// An integral over a prior is no more than the likelihood's maximum. Where the model cannot go on, a larger scale's
// promise is not kept, and does not count.
TEST(CurvedFit, TheDiscrepancysEvidenceIsNoMoreThanTheLikelihoodAtItsMode) {
  const Case made({.rise = 0.8, .to_and_fro = true, .limit = 0.05});
  const Evaluated at = with_small_curve(made);
  ASSERT_TRUE(at.fit_with_curve);
  const Fit& with = *at.fit_with_curve;
  ASSERT_TRUE(with.tangent);
  const VectorXd promised =
      log_over_priors(*made.discrepancy, with, made.discrepancy->columns(*with.likelihood, with), 0);
  EXPECT_GT(promised.maxCoeff(), 10) << "nothing is promised";
  EXPECT_LT(at.log_evidence + at.log_factors.front(), with.likelihood->log_weights() - 0.5 * with.cost);
}

}  // namespace
}  // namespace bevel::inference
