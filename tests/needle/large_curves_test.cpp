// SPDX-License-Identifier: MIT
// A discrepancy of the needle's that is no small thing: what it does to the readings, and whether it is found.
#include <gtest/gtest.h>

#include <bevel/diagnosis/inference/curved_fit.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::CurveValues;

std::size_t curve_of(const NeedleSystem& system, model::DiscrepancyComponent component, const char* covariate) {
  const auto meaning = model::info_of(component).meaning;
  for (std::size_t k = 0; k < system.curves().size(); ++k)
    if (system.curves()[k].component == meaning && system.curves()[k].covariate == covariate) return k;
  throw std::invalid_argument(covariate);
}

VectorXd wave(const inference::Curve& curve, double size) {
  VectorXd out(static_cast<Index>(curve.at.size()));
  for (Index i = 0; i < out.size(); ++i) out[i] = size * (1 + 0.5 * std::sin(1.3 * static_cast<double>(i)));
  return out;
}

class LargeCurves : public ::testing::Test {
 protected:
  SimulatedRig rig;
  NeedleSystem system{record_case(rig, 1), rig.needle};
  inference::ModelSet set = [this] {
    std::size_t effect = 0;
    while (system.effects()[effect].label != "layer") ++effect;
    return inference::ModelSet{effect};
  }();
  inference::Layout layout{system, set};
  VectorXd shared = layout.shared_start(), local = layout.local_start();
  std::vector<CurveValues> curves = [this] {
    const std::size_t turning = curve_of(system, model::DiscrepancyComponent::turning, "depth_mm"),
                      bending = curve_of(system, model::DiscrepancyComponent::curvature_across, "time_s");
    return std::vector<CurveValues>{{turning, wave(system.curves()[turning], 0.015)},
                                    {bending, wave(system.curves()[bending], -0.001)}};
  }();

  VectorXd reading(const VectorXd& s, const VectorXd& l, const std::vector<CurveValues>& c) const {
    inference::Prediction out;
    EXPECT_TRUE(system.predict_with(set, 1, s, l, c, false, out, nullptr));
    return out.reading;
  }
};

TEST_F(LargeCurves, DerivativesAreThoseOfDifferences) {
  local.head<3>() << 0.04, 0.01, -0.008;
  inference::Prediction here;
  MatrixXd by_values;
  ASSERT_TRUE(system.predict_with(set, 1, shared, local, curves, true, here, &by_values));
  ASSERT_EQ(by_values.cols(), curves[0].values.size() + curves[1].values.size());
  const auto close = [](const VectorXd& column, const VectorXd& up, const VectorXd& down, double step) {
    const VectorXd difference = (up - down) / (2 * step);
    EXPECT_LT((column - difference).norm(), 2e-4 * difference.norm() + 1e-4);
  };
  Index column = 0;
  for (std::size_t k = 0; k < curves.size(); ++k)
    for (Index i = 0; i < curves[k].values.size(); ++i, ++column) {
      const double step = 1e-4 * curves[k].values.cwiseAbs().maxCoeff();
      auto up = curves, down = curves;
      up[k].values[i] += step, down[k].values[i] -= step;
      close(by_values.col(column), reading(shared, local, up), reading(shared, local, down), step);
    }
  for (Index i = 0; i < shared.size(); ++i) {
    const double step = 1e-5 * std::max(std::abs(shared[i]), 0.02);
    VectorXd up = shared, down = shared;
    up[i] += step, down[i] -= step;
    close(here.by_shared.col(i), reading(up, local, curves), reading(down, local, curves), step);
  }
}

TEST_F(LargeCurves, WhereTheyAreNoneTheyAreTheLinearModel) {
  for (CurveValues& one : curves) one.values.setZero();
  inference::Prediction with, plain;
  MatrixXd by_values;
  const inference::Layout nothing(system, {});
  const VectorXd base = nothing.shared_start(), own = nothing.local_start();
  ASSERT_TRUE(system.predict_with({}, 1, base, own, curves, false, with, &by_values));
  ASSERT_TRUE(system.predict({}, 1, base, own, false, plain));
  EXPECT_LT((with.reading - plain.reading).norm(), 1e-9);
  const MatrixXd all = system.by_curves(1, base);
  Index column = 0;
  for (const CurveValues& one : curves) {
    Index first = 0;
    for (std::size_t k = 0; k < one.curve; ++k) first += static_cast<Index>(system.curves()[k].at.size());
    for (Index i = 0; i < one.values.size(); ++i, ++column)
      EXPECT_LT((by_values.col(column) - all.col(first + i)).norm(), 1e-6 * all.col(first + i).norm() + 1e-9);
  }
}

// Three effects, two that are known, the variation and two curves are as much as a needle carries.
TEST(LargeCurve, BesideAsMuchAsThereCanBe) {
  const SimulatedRig rig;
  const KnownPhysics known{.in_recording = {},
                           .elsewhere = {active("insertion_scale", {1.02}), active("camera_latency", {0.04})}};
  const NeedleSystem system(record_case(rig, 1), rig.needle, known);
  inference::ModelSet set;
  for (const char* name : {"layer", "bevel_offset", "torsional_windup"})
    for (std::size_t e = 0; e < system.effects().size(); ++e)
      if (system.effects()[e].label == name) set = inference::with(set, e);
  ASSERT_EQ(set.size(), 3U);
  const std::size_t one = curve_of(system, model::DiscrepancyComponent::turning, "depth_mm"),
                    other = curve_of(system, model::DiscrepancyComponent::y, "time_s");
  const std::vector<CurveValues> curves = {{one, wave(system.curves()[one], 0.01)},
                                           {other, wave(system.curves()[other], 0.2)}};
  const inference::Layout layout(system, set);
  inference::Prediction prediction;
  MatrixXd by_values;
  ASSERT_TRUE(
      system.predict_with(set, 0, layout.shared_start(), layout.local_start(), curves, true, prediction, &by_values));
  EXPECT_GT(by_values.leftCols(curves[0].values.size()).norm(), 1);
  EXPECT_GT(by_values.rightCols(curves[1].values.size()).norm(), 1);
}

// A needle whose cut turns it by more than a radian on the way: no multiple of what a small turn does.
TEST(LargeCurve, ANeedleThatTurnsByItselfIsFollowed) {
  constexpr double kTurn_rad_per_mm = 0.02;
  SimulatedRig rig;
  rig.effects = {active_discrepancy(model::DiscrepancyCurve{.component = model::DiscrepancyComponent::turning,
                                                            .covariate = model::Covariate::depth_mm,
                                                            .at = {0},
                                                            .values = {kTurn_rad_per_mm},
                                                            .std_errors = {0}})};
  const NeedleSystem system(record_case(rig, 3), rig.needle);
  inference::Noise noise;
  noise.sigma = {rig.sigma_mm[0], rig.sigma_mm[1], rig.sigma_mm[2]};
  noise.frame_s = rig.frame_s;
  const inference::Likelihood likelihood(system, inference::Readings(system.data().recordings.size()), noise);
  const inference::Layout layout(system, {});
  const std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  inference::Scales scales{.nuisance_sd = VectorXd::Zero(static_cast<Index>(system.nuisance_groups().size())),
                           .curves = {}};
  const auto base = inference::fit(likelihood, layout, layout.shared_start(), local, scales);
  const inference::Discrepancy discrepancy(likelihood, base);
  scales.curves = {{curve_of(system, model::DiscrepancyComponent::turning, "time_s"), 8, 1}};
  const auto linear = inference::fit(likelihood, layout, base.shared, base.local, scales,
                                     discrepancy.columns(likelihood, scales.curves));
  const auto found = fit_beside_curves(likelihood, discrepancy, layout, base.shared, base.local, scales, nullptr);
  ASSERT_TRUE(found.valid);
  const auto readings = static_cast<double>(likelihood.data().rows());
  EXPECT_LT(found.cost, 1.1 * readings);
  EXPECT_GT(base.cost, 3 * readings);
  EXPECT_NEAR(found.curve_values.mean(), kTurn_rad_per_mm, 0.002) << found.curve_values.transpose();
  EXPECT_NEAR(found.shared[kCurvature] / rig.needle.curvature_per_mm, 1, 0.03);
  // What the linear model says of its own mode is not what is there.
  const auto curve = discrepancy.columns(likelihood, found);
  inference::CurveColumns about = discrepancy.columns(likelihood, scales.curves);
  about.tangent = make_tangent(system, {layout.set(), linear.shared, linear.local},
                               values_by_curve(discrepancy, scales.curves, linear.curve_values));
  EXPECT_GT(cost_at(likelihood, linear, about), found.cost + 50);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
