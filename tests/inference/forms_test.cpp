// SPDX-License-Identifier: MIT
// Equations for a discrepancy, against dense normal densities of a linear system.
#include <bevel/diagnosis/inference/forms.hpp>

#include <gtest/gtest.h>

#include <bevel/diagnosis/inference/log_sum.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::LinearSystem;
using testing::log_normal;
using testing::white;

struct Made {
  double nuisance_sd;
  LinearSystem system;
  Likelihood likelihood;
  Fit base;
  Discrepancy discrepancy;
  Marginal marginal;

  Made(double parabola, double bump, double nuisance)
      : nuisance_sd(nuisance),
        system(4, 3, parabola, nuisance, bump),
        likelihood(system, Readings(4), white(system)),
        base(fit_base()),
        discrepancy(likelihood, base),
        marginal(likelihood, base, {}) {}
  Fit fit_base() const {
    const Layout layout(system, {});
    return fit(likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()),
               {.nuisance_sd = VectorXd::Constant(1, nuisance_sd), .curves = {}});
  }
  // Of all readings, with a part of covariance added that all recordings share.
  double log_density(const MatrixXd& added) const {
    const Index n = LinearSystem::kCount;
    const MatrixXd X = LinearSystem::design({}), L = LinearSystem::cosine();
    MatrixXd covariance(4 * n, 4 * n);
    for (Index a = 0; a < 4; ++a)
      for (Index b = 0; b < 4; ++b) {
        covariance.block(a * n, b * n, n, n) = X * X.transpose() + added;
        if (a == b) {
          covariance.block(a * n, b * n, n, n) += nuisance_sd * nuisance_sd * L * L.transpose();
          covariance.block(a * n, b * n, n, n).diagonal().array() += system.sigma * system.sigma;
        }
      }
    VectorXd y(4 * n);
    Index row = 0;
    for (const auto& recording : system.data().recordings)
      for (const double value : recording.series[0].measured) y[row++] = value;
    return log_normal(y, covariance);
  }
};

TEST(Forms, AreWeighedAsTheDensityOfAllReadingsSays) {
  const Made made(0, 0.4, 0.2);
  const Curve& curve = made.system.curves()[0];
  const MatrixXd C = made.system.by_curves(0, {});
  const double without = made.log_density(MatrixXd::Zero(LinearSystem::kCount, LinearSystem::kCount));
  std::vector<double> logs;
  for (const double exponent : {0.5, 1.5, 2.0, 3.0}) {
    VectorXd f(6);
    for (Index i = 0; i < 6; ++i)
      f[i] = value_of(Form::power, curve, exponent, 0, curve.at[static_cast<std::size_t>(i)]);
    const double visible = made.discrepancy.visible_size(0, f);
    for (const double scale : kCurveScales)
      logs.push_back(made.log_density(std::pow(scale / visible, 2) * (C * f) * (C * f).transpose()) - without);
  }
  const double expected = log_sum(logs) - std::log(static_cast<double>(logs.size()));
  for (const FormFit& one : fit_forms(made.system, made.discrepancy, made.marginal))
    if (one.form == Form::power) {
      EXPECT_NEAR(one.log_bayes_factor, expected, 0.02);
    }
}

TEST(Forms, FindTheEquationAndItsSize) {
  const Made made(
      0.3, 0, 0);  // a cosine of its own would look like it. 0.3 (t - 3)^2 / 9: offset and slope apart, 1.2 (t / 6)^2
  const auto forms = fit_forms(made.system, made.discrepancy, made.marginal);
  ASSERT_FALSE(forms.empty());
  EXPECT_EQ(forms.front().form, Form::power);
  EXPECT_LT(forms.front().shape_low, 2);
  EXPECT_GT(forms.front().shape_high, 2);
  EXPECT_LT(forms.front().shape_high - forms.front().shape_low, 1.5);
  EXPECT_NEAR(forms.front().amplitude, 1.2, 3 * forms.front().amplitude_sd);
  EXPECT_LT(forms.front().amplitude_sd, 0.2);
  for (std::size_t i = 1; i < forms.size(); ++i) EXPECT_GE(forms[i - 1].log_bayes_factor, forms[i].log_bayes_factor);
  // One number and a shape do what six values do, and are likelier for it.
  EXPECT_GT(log_bayes_factor(forms), log_bayes_factor(made.discrepancy.scan(made.marginal)) - 1);
}

TEST(Forms, WhereNothingIsMissingNoneIsLikely) {
  const Made made(0, 0, 0.2);
  EXPECT_LT(log_bayes_factor(fit_forms(made.system, made.discrepancy, made.marginal)), 0);
}

TEST(Forms, TakeTheirValues) {
  Curve curve{.component = "", .unit = "", .covariate = "", .at = {10, 20, 30}};
  EXPECT_EQ(value_of(Form::step, curve, 15, 0, 14), 0);
  EXPECT_EQ(value_of(Form::step, curve, 15, 0, 15), 1);
  EXPECT_EQ(value_of(Form::ramp, curve, 20, 0, 25), 0.25);
  EXPECT_EQ(value_of(Form::power, curve, 2, 0, 20), 0.25);
  EXPECT_EQ(value_of(Form::exponential, curve, 5, 0, 10), 1);
  EXPECT_NEAR(value_of(Form::saturation, curve, 5, 0, 15), 1 - std::exp(-1), 1e-15);
  EXPECT_NEAR(value_of(Form::sinusoid, curve, 4, 0.3, 1), std::cos(0.3), 1e-15);
  // Before the first place as there.
  EXPECT_EQ(value_of(Form::exponential, curve, 5, 0, -40), 1);
  EXPECT_EQ(value_of(Form::saturation, curve, 5, 0, -40), 0);
}

}  // namespace
}  // namespace bevel::inference
