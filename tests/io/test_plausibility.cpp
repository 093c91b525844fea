// SPDX-License-Identifier: MIT
// What is told of samples, what is left out, and above all what is neither: the ordinary faults of cameras and benches.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include <bevel/io/recording.hpp>
#include <bevel/io/second_insertion.hpp>
#include "tests/support/shared_recordings.hpp"

namespace bevel::io {
namespace {

namespace fs = std::filesystem;
using model::ActuatorState;
using model::TipMeasurement;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kStart = 1'700'000'000'000'000;

// 4 s at 50 Hz: in at 10 mm/s, a turn back and forth, a stop.
std::vector<ActuatorState> steady() {
  std::vector<ActuatorState> all(200);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double t = 0.02 * static_cast<double>(i);
    all[i].utime = kStart + 20'000 * static_cast<std::int64_t>(i);
    all[i].seq = 40 + static_cast<std::int64_t>(i);
    all[i].insertion_mm = 10 * std::min(t, 3.0);
    all[i].rotation_rad = 6 * (t < 1 ? 0 : t < 2 ? t - 1 : std::max(0.0, 3 - t));
  }
  return all;
}

std::vector<TipMeasurement> readings() {
  std::vector<TipMeasurement> all(120);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].utime = kStart + 33'333 * static_cast<std::int64_t>(i);
    all[i].seq = static_cast<std::int64_t>(i);
    all[i].position_mm.z() = 10 * std::min(0.033333 * static_cast<double>(i), 3.0);
    all[i].information_per_mm2.diagonal().setConstant(44);
  }
  return all;
}

template <class... Samples>
std::string said(const Samples&... samples) {
  return describe(judge(samples...).oddities, "X", kStart);
}
std::vector<std::size_t> left_out(const Judgement& judgement) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < judgement.left_out.size(); ++i)
    if (judgement.left_out[i]) all.push_back(i);
  return all;
}

TEST(Plausibility, NothingIsSaidOfSoundSamples) {
  EXPECT_EQ(said(steady()), "");
  EXPECT_EQ(said(readings(), steady()), "");
  EXPECT_EQ(said(std::vector<ActuatorState>()), "");
  EXPECT_EQ(said(std::vector<TipMeasurement>(), steady()), "");
  EXPECT_EQ(said(readings(), std::vector<ActuatorState>()), "");
}

TEST(Plausibility, OneSampleOfAnAxisBetweenTwoThatAgreeIsLeftOut) {
  for (const std::size_t at : {std::size_t{0}, std::size_t{1}, std::size_t{100}, std::size_t{198}, std::size_t{199}})
    for (const double jump : {812.0, -20.0, 1e5}) {
      auto axes = steady();
      axes[at].insertion_mm += jump;
      EXPECT_THAT(left_out(judge(axes)), testing::ElementsAre(at)) << at << " by " << jump;
      axes = steady();
      axes[at].rotation_rad += jump;
      EXPECT_THAT(left_out(judge(axes)), testing::ElementsAre(at)) << at << " by " << jump;
    }
  auto axes = steady();
  axes[100].insertion_mm += 812;
  EXPECT_EQ(said(axes), "1 X at 2 s: insertion jumps by 812.2 mm in 0.02 s; allowed 5.5 mm; left out\n");
}

// A move that the bound on the rate allows, but nothing around it.
TEST(Plausibility, OutAndBackBetweenTwoSamplesIsToldFromTheMotionAroundIt) {
  auto axes = steady();
  axes[60].insertion_mm += 2;
  EXPECT_THAT(said(axes), HasSubstr("1 X at 1.2 s: insertion goes out by 2 mm and back within 0.04 s; allowed 0.7 mm"));
  axes = steady();
  axes[60].rotation_rad -= 1;
  EXPECT_THAT(said(axes), HasSubstr("rotation goes out by"));
  for (auto& a : axes) a.rotation_rate_rad_s = 60;  // an axis that says it turns so fast may be there and back
  EXPECT_EQ(said(axes), "");
}

TEST(Plausibility, AJumpThatLastsIsToldAndStays) {
  auto axes = steady();
  for (std::size_t i = 100; i < axes.size(); ++i) axes[i].rotation_rad += 100;
  const Judgement judgement = judge(axes);
  EXPECT_THAT(left_out(judgement), IsEmpty());
  ASSERT_EQ(judgement.oddities.size(), 1U);
  EXPECT_EQ(judgement.oddities[0].kind, Oddity::Kind::motion);
  EXPECT_THAT(said(axes), AllOf(HasSubstr("1 X at 2 s: rotation jumps by 100.1 rad"), HasSubstr("it lasts")));
  auto far = steady();
  for (auto& a : far) a.insertion_mm += 5000;
  EXPECT_THAT(said(far), HasSubstr("insertion is 5000 mm; allowed 1000 mm either way; it lasts"));
}

TEST(Plausibility, ADamagedTimeOrNumberCostsItsOwnSample) {
  for (const std::size_t at : {std::size_t{0}, std::size_t{90}, std::size_t{199}})
    for (const std::int64_t change : {std::int64_t{1} << 40U, std::int64_t{1} << 33U, -(std::int64_t{1} << 22U)}) {
      if (at == 0 && change < 0) continue;  // a first sample may well be seconds before the second
      auto axes = steady();
      axes[at].utime += change;
      EXPECT_THAT(left_out(judge(axes)), testing::ElementsAre(at)) << "utime of " << at << " by " << change;
      auto tips = readings();
      tips[at / 2].utime += change;
      EXPECT_THAT(left_out(judge(tips, steady())), testing::ElementsAre(at / 2)) << "utime by " << change;
    }
  for (const std::int64_t seq : {std::int64_t{0}, std::int64_t{1} << 50U}) {
    auto axes = steady();
    axes[90].seq = seq;
    EXPECT_THAT(left_out(judge(axes)), testing::ElementsAre(90U));
    EXPECT_THAT(said(axes), HasSubstr("while utime goes on"));
  }
  auto axes = steady();
  axes.insert(axes.begin() + 50, axes[49]);  // twice
  EXPECT_EQ(left_out(judge(axes)).size(), 1U);
}

TEST(Plausibility, AReadingBeyondAnyOutlierThatComesBackIsLeftOut) {
  auto tips = readings();
  tips[60].position_mm.x() = 150;
  EXPECT_THAT(left_out(judge(tips, steady())), testing::ElementsAre(60U));
  EXPECT_THAT(said(tips, steady()), HasSubstr("1 X at 2 s: the tip jumps by 150 mm in 0.03333 s; allowed 100.4 mm"));
  tips = readings();
  tips[60].information_per_mm2(1, 1) = 1e9;
  EXPECT_THAT(left_out(judge(tips, steady())), testing::ElementsAre(60U));
  tips = readings();
  tips[60].camera = 1 << 24;
  EXPECT_THAT(left_out(judge(tips, steady())), testing::ElementsAre(60U));
}

TEST(Plausibility, AHeadingIsJudgedByItsStampItsCameraAndWhatItClaimsToKnow) {
  std::vector<model::TipHeading> headings(120);
  for (std::size_t i = 0; i < headings.size(); ++i) {
    headings[i].utime = kStart + 33'333 * static_cast<std::int64_t>(i);
    headings[i].seq = static_cast<std::int64_t>(i);
    headings[i].heading = Eigen::Vector3d::UnitZ();
    headings[i].information_per_rad2.diagonal() << 2500, 2500, 0;
  }
  headings[20].heading *= -1;  // a tracker's mistake, no damage
  headings[30].status = 1;
  EXPECT_THAT(left_out(judge(headings)), IsEmpty());
  EXPECT_TRUE(judge(headings).oddities.empty());
  auto damaged = headings;
  damaged[60].information_per_rad2(0, 0) = 1e9;
  EXPECT_THAT(left_out(judge(damaged)), testing::ElementsAre(60U));
  damaged = headings;
  damaged[60].camera = 7;
  EXPECT_THAT(left_out(judge(damaged)), testing::ElementsAre(60U));
  damaged = headings;
  damaged[60].utime += std::int64_t{1} << 40U;
  EXPECT_THAT(left_out(judge(damaged)), testing::ElementsAre(60U));
}

TEST(Plausibility, OrdinaryFaultsOfCamerasAndBenchesAreNoDamage) {
  auto tips = readings();
  tips[20].position_mm.x() = 25;                                              // an outlier,
  for (std::size_t i = 50; i < 60; ++i) tips[i].position_mm.y() = 120;        // something else taken for the tip,
  tips[70].status = 1, tips[70].position_mm.setConstant(5000);                // not usable, and says so,
  for (std::size_t i = 80; i < 90; ++i) tips[i].information_per_mm2 *= 1e-4;  // unsure for a while,
  tips[95].information_per_mm2.setZero();
  tips.erase(tips.begin() + 100, tips.begin() + 110);  // frames dropped,
  std::swap(tips[30], tips[33]);                       // and late in the log
  EXPECT_EQ(said(tips, steady()), "");
  auto other = readings();  // a second camera that counts for itself
  for (auto& tip : other) tip.camera = 1, tip.seq += 5;
  tips.insert(tips.end(), other.begin(), other.end());
  EXPECT_EQ(said(tips, steady()), "");

  auto axes = steady();
  axes.erase(axes.begin() + 60, axes.begin() + 110);  // a second lost: 10 mm and a turn
  EXPECT_EQ(said(axes), "");
  for (auto& a : axes) a.seq = 0;  // a sender that does not count
  EXPECT_EQ(said(axes), "");
  axes[20].seq = 1 << 20;
  EXPECT_EQ(said(axes), "");
}

// Depth by depth, as a person pushes: 5 mm between rows half a second apart, and a pause.
TEST(Plausibility, InsertionsByStepsAreNoDamage) {
  std::vector<ActuatorState> axes(21);
  std::vector<TipMeasurement> tips(21);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i].utime = tips[i].utime = kStart + 500'000 * static_cast<std::int64_t>(i) + (i > 10 ? 600'000'000 : 0);
    axes[i].seq = tips[i].seq = static_cast<std::int64_t>(i);
    axes[i].insertion_mm = tips[i].position_mm.z() = 5 * static_cast<double>(i);
    tips[i].information_per_mm2.diagonal() << 100, 100, 0;
  }
  EXPECT_EQ(said(axes), "");
  EXPECT_EQ(said(tips, axes), "");
}

TEST(Plausibility, NoneOfThePracticeRecordingsIsCalledDamaged) {
  int logs = 0;
  for (const char* set : {"practice", "varied"}) {
    const fs::path folder = test::shared_recordings() / "recordings" / set;
    BEVEL_SKIP_WITHOUT(folder);
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.path().extension() != ".lcm") continue;
      ++logs;
      EXPECT_EQ(read_recording(entry.path().string()).remarks(entry.path().string()), "");
    }
  }
  std::printf("%d recordings\n", logs);
  EXPECT_GT(logs, 100);
}

// Depths over time, 10 mm a step.
std::vector<model::ActuatorState> axes_at_depths(const std::vector<double>& depths_mm) {
  std::vector<model::ActuatorState> out;
  for (const double depth_mm : depths_mm)
    out.push_back({.utime = 1'000'000 + 1'000'000 * std::ssize(out), .seq = std::ssize(out), .insertion_mm = depth_mm});
  return out;
}

TEST(SecondInsertion, BeginsWhereTheNeedleWasOut) {
  EXPECT_EQ(second_insertion(axes_at_depths({0, 20, 60, 30, 0.5, 0, 5, 20})), 5U);
  EXPECT_EQ(second_insertion(axes_at_depths({100, 160, 100, 160})), 2U) << "an axis that does not start at 0";
  EXPECT_EQ(second_insertion(axes_at_depths({0, 69, 0, 69})), 2U) << "two logs, one behind the other";
  // The order of the log is not that of time.
  std::vector<model::ActuatorState> shuffled = axes_at_depths({0, 20, 60, 30, 0, 20});
  std::swap(shuffled[1], shuffled[4]);
  EXPECT_THAT([&] { require_one_insertion("rec.lcm", shuffled); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::AllOf(
                  ::testing::HasSubstr("rec.lcm: holds more than one insertion"), ::testing::HasSubstr("4.000 s"))));
}

TEST(SecondInsertion, IsNoneWhereTheNeedleStaysInOrOut) {
  EXPECT_FALSE(second_insertion({}));
  EXPECT_FALSE(second_insertion(axes_at_depths({0, 20, 60, 60})));
  EXPECT_FALSE(second_insertion(axes_at_depths({0, 20, 60, 30, 0, 0})));
  EXPECT_FALSE(second_insertion(axes_at_depths({0, 20, 60, 30, 2, 60}))) << "withdrawn partly";
  EXPECT_FALSE(second_insertion(axes_at_depths({0, 5, 0, 5, 0, 60}))) << "touched, and moved back";
  EXPECT_FALSE(second_insertion(axes_at_depths({0, 60, 0, 5, 0}))) << "moved outside";
}

}  // namespace
}  // namespace bevel::io
