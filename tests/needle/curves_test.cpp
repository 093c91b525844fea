// SPDX-License-Identifier: MIT
// Curves over what the base does: which there are, what they weigh, what they do to readings.
#include <bevel/diagnosis/needle/curves.hpp>

#include <gmock/gmock.h>

#include <numbers>

#include <bevel/diagnosis/inference/layout.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::Each;
using ::testing::Field;
using ::testing::Ne;

// Each component once, where its form is plain: a reading is off by the curve's value; an advance is the integral.
TEST(NeedleCurves, ShiftReadingsAndAdvanceTheTip) {
  const SimulatedRig rig;
  const NeedleSystem system(record_case(rig, 4), rig.needle);
  const inference::Layout layout(system, {});
  const MatrixXd C = system.by_curves(0, layout.shared_start());
  const auto& recording = system.recorded().recordings[0];
  Index first = 0;
  int checked = 0;
  for (const auto& curve : system.curves()) {
    const auto count = static_cast<Index>(curve.at.size());
    if (curve.covariate == "depth_mm" && curve.component == "reading along x") {
      std::vector<VectorXd> weights;
      for (const auto& node : recording.motion.nodes) weights.push_back(weights_at(curve, node.insertion_mm));
      Index row = 0;
      for (std::size_t c = 0; c < system.recorded().channels.size(); ++c)
        for (const std::size_t reading : recording.series[c].message) {
          const std::size_t node = recording.motion.at[reading];
          if (node > 0) {
            EXPECT_LT(
                (C.row(row).segment(first, count).transpose() - system.recorded().channels[c].axis.x() * weights[node])
                    .norm(),
                1e-9);
          }
          ++row;
        }
      ++checked;
    }
    if (curve.component == "advance of the tip" && curve.covariate == "depth_mm") {
      // All values one: the tip advances twice as fast. The last reading moves by what was inserted, along the heading.
      const VectorXd moved = C.middleCols(first, count).rowwise().sum();
      EXPECT_GT(moved.norm(), 1);
      ++checked;
    }
    first += count;
  }
  EXPECT_EQ(checked, 2);
  EXPECT_EQ(first, C.cols());
}

TEST(NeedleCurves, WeightsAddUpToOne) {
  inference::Curve line{.component = "", .unit = "", .covariate = "", .at = {0, 1, 3, 4}};
  inference::Curve circle{.component = "", .unit = "", .covariate = "", .at = {0, 1.5, 3.1, 4.7}, .periodic = true};
  for (int i = -15; i < 70; ++i) {  // before the first point to beyond the last
    const double x = 0.13 * i;
    EXPECT_NEAR(weights_at(line, x).sum(), 1, 1e-12);
    EXPECT_NEAR(weights_at(circle, x).sum(), 1, 1e-12);
    EXPECT_LT((weights_at(circle, x) - weights_at(circle, x + 2 * std::numbers::pi)).norm(), 1e-9);
  }
  EXPECT_EQ(weights_at(line, 2), (VectorXd(4) << 0, 0.5, 0.5, 0).finished());
}

// In at 10 mm/s, turned by so much on the way, from this roll on.
model::Motion turned_by(double from_rad, double turn_rad) {
  model::Motion motion;
  for (int i = 0; i <= 100; ++i) motion.nodes.push_back({0.05 * i, 0.5 * i, from_rad + turn_rad * i / 100});
  return motion;
}
bool has_curve(const std::vector<const model::Motion*>& motions, model::Covariate covariate) {
  return std::ranges::any_of(find_curves(motions, {}),
                             [&](const NeedleCurve& one) { return one.covariate == covariate; });
}

TEST(NeedleCurves, TurningIsACovariateWhereTheRollSaysLess) {
  const model::Motion half = turned_by(0, 3), back = turned_by(0, -3), twice = turned_by(0, 12),
                      other = turned_by(2, 3);
  EXPECT_FALSE(has_curve({&half, &back}, model::Covariate::turned_rad));
  EXPECT_TRUE(has_curve({&half, &twice}, model::Covariate::turned_rad));
  EXPECT_TRUE(has_curve({&half, &other}, model::Covariate::turned_rad));  // from another roll
  for (const auto& motions : {std::vector{&half, &back}, std::vector{&half, &twice}})
    EXPECT_TRUE(has_curve({motions[0], motions[1]}, model::Covariate::roll_rad));
}

TEST(NeedleCurves, DrawnBackIsACovariateWhereSomethingIs) {
  const model::Motion in = turned_by(0, 3);
  model::Motion and_back = in;
  for (int i = 1; i <= 40; ++i) and_back.nodes.push_back({5 + 0.05 * i, 50 - 0.5 * i, 3});
  EXPECT_FALSE(has_curve({&in}, model::Covariate::withdrawn_mm));
  EXPECT_TRUE(has_curve({&in, &and_back}, model::Covariate::withdrawn_mm));
}

// Over where the tip was seen, along each axis along which it was.
TEST(NeedleCurves, TheTipsPlaceIsACovariateWhereReadingsSayIt) {
  const model::Motion in = turned_by(0, 3);
  std::vector<Eigen::Vector3d> seen_mm;
  for (int i = 0; i <= 100; ++i) seen_mm.emplace_back(std::nan(""), 0.1 * i - 4, i);
  const auto curves = find_curves({&in}, seen_mm);
  for (const auto covariate : {model::Covariate::tip_x_mm, model::Covariate::tip_xy_mm, model::Covariate::tip_yx_mm})
    EXPECT_THAT(curves, Each(Field(&NeedleCurve::covariate, Ne(covariate))));
  const auto over_y = std::ranges::find(curves, model::Covariate::tip_y_mm, &NeedleCurve::covariate);
  ASSERT_NE(over_y, curves.end());
  EXPECT_NEAR(over_y->curve.at.front(), -3.9, 0.1);  // the middle 98 %
  EXPECT_NEAR(over_y->curve.at.back(), 5.9, 0.1);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
