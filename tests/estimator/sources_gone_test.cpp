// SPDX-License-Identifier: MIT
// States of the estimate that a source of measurements has brought about, once that source is gone.
#include <gtest/gtest.h>

#include <bevel/estimator/health.hpp>
#include <bevel/estimator/innovation_watch.hpp>
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using testing::agar_config;

// Simulates two cameras and a heading sensor. The second camera is 5 mm off from `from_s` on, and the sensor points
// backwards; both are silent after `gone_s`.
class Vanishing {
 public:
  Vanishing() : estimator(agar_config()) {}
  NeedleEstimator estimator;

  std::int32_t run_to(double until_s, double from_s, double gone_s) {
    for (; ms <= 1000 * until_s; ++ms) {
      const std::int64_t utime = testing::kStart_utime + std::int64_t{1000} * ms;
      const double t = 1e-3 * ms;
      const Eigen::Vector3d tip(0, 0, 2 * t);
      if (ms % 33 == 7) estimator.add(testing::measure(tip, utime, ms, 0, {0, 1, 1}, 0.3, rng));
      const bool wrong = t > from_s && t < gone_s;
      const Eigen::Vector3d seen = tip + Eigen::Vector3d(wrong ? 5 : 0, 0, 0);
      if (ms % 33 == 19 && t < gone_s) estimator.add(testing::measure(seen, utime, ms, 1, {1, 0, 1}, 0.3, rng));
      if (ms % 33 == 21 && wrong && with_heading)
        estimator.add(testing::measure_heading({0, 0, -1}, utime, ms, 2, 0.02, rng));
      if (ms % 10 == 0) {
        model::ActuatorState axes;
        axes.utime = utime, axes.seq = ms, axes.insertion_mm = tip.z();
        estimator.add(axes);
      }
    }
    return estimator.estimate(testing::kStart_utime + std::int64_t{1000} * (ms - 1)).health;
  }
  bool with_heading = false;
  int ms = 0;

 private:
  std::mt19937_64 rng{5};
};

TEST(SourceGone, ACameraThatIsSilentIsRejectedNoMore) {
  Vanishing v;
  EXPECT_EQ(v.run_to(2, 2, 2.4) & kRejecting, 0);
  EXPECT_NE(v.run_to(2.4, 2, 2.4) & kRejecting, 0);
  EXPECT_NE(v.run_to(3.0, 2, 2.4) & kRejecting, 0) << "for as long as it may come again";
  EXPECT_EQ(v.run_to(3.6, 2, 2.4) & (kRejecting | kUnsure), 0);
}

TEST(SourceGone, ASensorOfHeadingsThatIsSilentIsRejectedNoMore) {
  Vanishing v;
  v.with_heading = true;
  EXPECT_NE(v.run_to(2.4, 2, 2.4) & kRejecting, 0);
  EXPECT_EQ(v.run_to(3.6, 2, 2.4) & (kRejecting | kUnsure), 0);
}

// The operator's arm command clears it at once, also when late measurements make the history run again; a source that
// is still rejected is reported again.
TEST(SourceGone, ForgettingRejectsClearsThemAndASourceThatIsStillWrongIsReportedAgain) {
  Vanishing v;
  EXPECT_NE(v.run_to(2.4, 2, 2.4) & kRejecting, 0);
  v.estimator.forget_rejects();
  EXPECT_EQ(v.run_to(2.45, 2, 2.4) & kRejecting, 0);
  std::mt19937_64 rng(9);
  const std::int64_t late = testing::kStart_utime + 2'200'000;
  v.estimator.add(testing::measure({0, 0, 4.4}, late, 77777, 0, {0, 1, 1}, 0.3, rng));
  EXPECT_EQ(v.estimator.estimate(testing::kStart_utime + 2'450'000).health & kRejecting, 0);

  Vanishing still;
  EXPECT_NE(still.run_to(2.3, 2, 9) & kRejecting, 0);
  still.estimator.forget_rejects();
  EXPECT_NE(still.run_to(2.6, 2, 9) & kRejecting, 0);
}

TEST(InnovationWatch, ForgetsACameraThatIsSilentAndTakesNothingThatIsNoNumber) {
  InnovationWatch watch(3.0);
  for (int i = 1; i <= 100; ++i) watch.see(1, 33'000 * i, 9.0, 2);
  EXPECT_TRUE(watch.channels().at(1).is_too_large());
  watch.see(1, 3'400'000, std::nan(""), 2);
  EXPECT_TRUE(std::isfinite(watch.channels().at(1).ratio()));
  watch.forget_silent(5'000'000);
  EXPECT_EQ(watch.channels().size(), 1U);
  watch.forget_silent(7'000'000);
  EXPECT_TRUE(watch.channels().empty());
}

}  // namespace
}  // namespace bevel::estimator
