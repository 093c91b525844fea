// What a set's freedom is worth, against the integral that it approximates.
#include "diagnosis/mismatch/freedom.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

#include "diagnosis/mismatch/local_unknowns.hpp"
#include "tests/mismatch/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

// Whatever is left of the parameters once one is held, fitted.
double least_chi2(const Evidence& evidence, const Fit& best, int unknown, double value) {
  Eigen::VectorXd start = best.values;
  start[unknown] = value;
  return fit(evidence, best.hypothesis, start, {.held = {unknown}}).penalised;
}

TEST(PriceOfFreedom, IsNothingForNoEffect) {
  const SimulatedRig rig{.recordings = 2};
  const auto recorded = record_case(rig, 1);
  EXPECT_EQ(price_of_freedom(fit_of(evidence_of(recorded, rig), {})), 0);
}

// -2 ln of the integral of exp(-chi2/2) over a size, by the trapezoid rule, with what may be expected of it: to one
// half Student's t with 4 degrees of freedom, its scale three quarters of the 0.6 rad that are reported (its peak that
// of a normal distribution of this scale), to the other any of three orders of magnitude.
void expect_integral_over_size(const char* effect, double size_rad, bool one_sided) {
  const SimulatedRig rig{.effects = {active(effect, {size_rad})}};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const Fit best = fit_of(evidence, {member(effect)});
  const double found = best.values[kBaseUnknowns];
  const double sd = std::sqrt(best.covariance()(kBaseUnknowns, kBaseUnknowns));
  constexpr double kScale = 0.45;
  double integral = 0;
  constexpr double kStep = 0.25;
  for (int i = -20; i <= 20; ++i) {
    const double value = found + i * kStep * sd;
    if (one_sided && value < 0) continue;
    const double reported =
        1 / (kScale * std::sqrt(2 * std::numbers::pi)) * std::pow(1 + value * value / (4 * kScale * kScale), -2.5);
    const double any_order = std::abs(value) < 0.6 ? 1 / (2 * std::log(1000.0) * std::abs(value)) : 0;
    const double density = (one_sided ? 2 : 1) * (reported + any_order) / 2;
    integral +=
        kStep * sd * density * std::exp(-0.5 * (least_chi2(evidence, best, kBaseUnknowns, value) - best.penalised));
  }
  EXPECT_NEAR(price_of_freedom(best), -2 * std::log(integral), 0.3) << effect << " of " << size_rad;
}

TEST(PriceOfFreedom, IsThatOfTheIntegralOverAWidth) {
  for (const double width_rad : {0.08, 0.15, 0.5, 0.8}) expect_integral_over_size("rotation_backlash", width_rad, true);
}

TEST(PriceOfFreedom, IsThatOfTheIntegralOverAnAngleWithAZero) {
  for (const double roll_rad : {0.03, 0.1, 0.4}) expect_integral_over_size("bevel_offset", roll_rad, false);
}

TEST(PriceOfFreedom, GrowsWithTheLogarithmOfTheReadings) {
  std::array<double, 2> price{};
  std::size_t i = 0;
  for (const double frame_s : {1.0 / 10, 1.0 / 30}) {
    const SimulatedRig rig{.effects = {active("torsional_windup", {0.6})}, .frame_s = frame_s};
    const auto recorded = record_case(rig, 1);
    price[i++] = price_of_freedom(fit_of(evidence_of(recorded, rig), {member("torsional_windup")}));
  }
  EXPECT_NEAR(price[1] - price[0], std::log(3.0), 0.2);  // a standard error sqrt(3) smaller
}

// What fits equally well by two is worth less than by one; by a curve, less than by a name.
TEST(PriceOfFreedom, OfMoreParametersIsMore) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const double one = price_of_freedom(fit_of(evidence, {member("drilling")}));
  const double two = price_of_freedom(fit_of(evidence, {member("drilling"), member("entry_angle")}));
  EXPECT_GT(two, one + 4);
  const CorrectionLibrary library(recorded);
  const Member nameless = curve(library, "correction of the curvature toward the bevel by turn_rate_rad_s");
  EXPECT_GT(price_of_freedom(fit_of(evidence, {nameless})), one + 2);
}

constexpr const char* kYByDepth = "correction of the reading along y by depth_mm";

// Neighbouring knots hang together by exp(-1/2).
Eigen::Matrix4d hang() {
  Eigen::Matrix4d out;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) out(a, b) = std::exp(-std::abs(a - b) / 2.0);
  return out;
}

// -2 ln of the integral over the scale of a curve, as likely any of three orders of magnitude, and over its knots,
// which are normal at each scale: by the trapezoid rule in the logarithm of the scale.
TEST(PriceOfFreedom, IsThatOfTheIntegralOverACurve) {
  for (const double rotation_rad : {0.01, 0.05}) {
    const SimulatedRig rig{.effects = {active("camera_rotation", {rotation_rad})}};
    const auto recorded = record_case(rig, 1);
    const CorrectionLibrary library(recorded);
    const Fit best = fit_of(evidence_of(recorded, rig), {curve(library, kYByDepth)});
    const Eigen::Vector4d knots = best.values.tail<4>();
    const Eigen::Matrix4d covariance = best.covariance().bottomRightCorner<4, 4>();
    double integral = 0;
    constexpr double kStep = 0.02;
    for (int i = -600; i < 200; ++i) {
      const Eigen::Matrix4d either = covariance + std::exp(2 * i * kStep) * hang();
      integral += kStep / std::log(1000.0) * std::exp(-0.5 * knots.dot(either.inverse() * knots)) *
                  std::sqrt(covariance.determinant() / either.determinant());
    }
    EXPECT_NEAR(price_of_freedom(best), -2 * std::log(integral), 0.1) << rotation_rad;
  }
}

// The same by another way, refitted with the expectation at each scale, for a curve whose constant is the needle's own
// curvature but for what the model file says of that.
TEST(PriceOfFreedom, IsThatOfTheIntegralOverACurveThatIsHalfBelieved) {
  const SimulatedRig rig{.effects = {active("drilling", {2.0})}};
  const auto recorded = record_case(rig, 1);
  const Evidence evidence = evidence_of(recorded, rig);
  const CorrectionLibrary library(recorded);
  const Fit best =
      fit_of(evidence, {curve(library, "correction of the curvature toward the bevel by turn_rate_rad_s")});
  const Eigen::MatrixXd of_all = best.covariance().inverse();
  const double of_needle = of_all.topLeftCorner<kBaseUnknowns, kBaseUnknowns>().determinant();
  const Eigen::MatrixXd precision_found = precision_of_curves(best);
  constexpr double kStep = 0.1;
  double integral = 0;
  Eigen::VectorXd start = best.values;
  for (int i = 30; i > -70; --i) {
    const Eigen::MatrixXd precision = std::exp(-2 * i * kStep) * precision_found;
    const Fit there = fit(evidence, best.hypothesis, start, {.precision = precision});
    start = there.values;
    const double volume =
        (of_all + precision).determinant() / of_needle / precision.bottomRightCorner<4, 4>().determinant();
    integral += kStep / std::log(1000.0) * std::exp(-0.5 * (there.penalised - best.penalised)) / std::sqrt(volume);
  }
  EXPECT_NEAR(price_of_freedom(best), -2 * std::log(integral), 0.2);
}

// As many standard deviations, squared, as the curve has knots: its scale is the one that it was found to have.
TEST(PrecisionOfCurves, IsOfTheCurvesAlone) {
  const SimulatedRig rig{.effects = {active("camera_rotation", {0.03})}};
  const auto recorded = record_case(rig, 1);
  const CorrectionLibrary library(recorded);
  const Fit best = fit_of(evidence_of(recorded, rig), {member("drilling"), curve(library, kYByDepth)});
  const Eigen::MatrixXd precision = precision_of_curves(best);
  ASSERT_EQ(precision.rows(), best.hypothesis.size());
  EXPECT_TRUE(precision.topRows(4).isZero());
  EXPECT_TRUE(precision.leftCols(4).isZero());
  EXPECT_NEAR(best.values.dot(precision * best.values), 4, 1e-9);
  const Eigen::Matrix4d product = precision.bottomRightCorner<4, 4>() * hang();
  EXPECT_TRUE(product.isApprox(product(0, 0) * Eigen::Matrix4d::Identity(), 1e-9));
}

// Ten times what the field reports: dear, but not impossible.
TEST(PriceOfFreedom, OfASizeThatNobodyReportsIsMore) {
  const auto price_of = [](double x_rad) {
    const SimulatedRig rig{.effects = {active("entry_angle", {x_rad, 0.02})}, .recordings = 2};
    const auto recorded = record_case(rig, 1);
    return price_of_freedom(fit_of(evidence_of(recorded, rig), {member("entry_angle")}));
  };
  const double usual = price_of(0.03), large = price_of(0.4);
  EXPECT_GT(large, usual + 8);
  EXPECT_LT(large, usual + 30);
}

// A small size that causes bring about is no surprise; a motor that loses less than a cycle of its currents is.
TEST(PriceOfFreedom, OfASizeThatCausesDoNotBringAboutIsMore) {
  const auto price_of = [](double rotation_rad) {
    constexpr double kAt_s = 3.0;
    const SimulatedRig rig{.effects_in =
                               [rotation_rad](int) {
                                 return std::vector{active("lost_steps", {rotation_rad, 0, kAt_s})};
                               },
                           .recordings = 2};
    const auto recorded = record_case(rig, 1);
    const Evidence evidence = evidence_of(recorded, rig);
    const Hypothesis hypothesis(rig.needle, {member("lost_steps", 0b101)}, recorded);
    Eigen::VectorXd start = hypothesis.start();
    start[hypothesis.find(0, 0)] = rotation_rad;
    for (int r = 0; r < rig.recordings; ++r) start[hypothesis.find(0, 2, r)] = kAt_s;
    return price_of_freedom(fit_beside_instants(evidence, hypothesis, start));
  };
  EXPECT_GT(price_of(0.1), price_of(0.2) + 3);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
