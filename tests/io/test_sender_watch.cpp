// SPDX-License-Identifier: MIT
// Who sends, told by seq and utime; what can be motion.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include <bevel/io/motion_bounds.hpp>
#include <bevel/io/sender_watch.hpp>
#include <bevel/model/age.hpp>

namespace bevel::io {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
constexpr std::int64_t kSmallest = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();

TEST(Age, SaturatesAtTheEndsOfTime) {
  EXPECT_EQ(model::age_us(5, 3), 2);
  EXPECT_EQ(model::age_us(3, 5), -2);
  EXPECT_EQ(model::age_us(kLargest, kSmallest), kLargest);
  EXPECT_EQ(model::age_us(kSmallest, kLargest), kSmallest);
  EXPECT_EQ(model::age_us(0, kSmallest), kLargest);
  EXPECT_EQ(model::age_us(-1, kSmallest), kLargest);
  EXPECT_EQ(model::age_us(kSmallest, 1), kSmallest);
  EXPECT_LT(model::age_s(kStart_utime, kLargest), -9e12);
  static_assert(model::difference_saturated(kLargest, -1) == kLargest);
}

// A sender of 100 Hz; everything is judged 10 ms later than it was sent.
class SenderWatchTest : public ::testing::Test {
 protected:
  Standing at(std::int64_t number, std::int64_t sent_ms, std::uint64_t digest = 1) {
    return watch.judge(number, kStart_utime + sent_ms * 1000, digest, kStart_utime + now_ms * 1000, now_ms * 1'000'000);
  }
  Standing next(std::uint64_t digest = 1) {
    now_ms += 10;
    return at(seq++, now_ms - 10, digest);
  }
  SenderLimits limits{.longest_age_us = 100'000, .fastest_hz = 200, .silence_us = 100'000};
  SenderWatch watch{limits};
  std::int64_t now_ms = 0, seq = 0;
};

TEST_F(SenderWatchTest, OneSenderIsFreshAllTheTimeAlsoWithGaps) {
  for (int i = 0; i < 100; ++i) {
    if (i % 7 == 0) ++seq;
    ASSERT_EQ(next(), Standing::fresh) << i;
  }
  EXPECT_EQ(watch.lost(), 14);  // the first was no gap
}

TEST_F(SenderWatchTest, TheSameBytesAgainAreADuplicateOtherBytesASecondSender) {
  next(7);
  EXPECT_EQ(at(seq - 1, now_ms - 10, 7), Standing::duplicate);
  EXPECT_EQ(at(seq - 1, now_ms - 10, 8), Standing::foreign);
}

TEST_F(SenderWatchTest, WhatGoesBackIsASecondSenderWhileTheFirstIsAlive) {
  for (int i = 0; i < 20; ++i) next();
  EXPECT_EQ(at(0, now_ms), Standing::foreign) << "its numbers begin at zero";
  EXPECT_EQ(at(seq - 5, now_ms - 50, 9), Standing::foreign) << "an old number with other content";
  EXPECT_EQ(at(2, 20), Standing::foreign) << "an old message sent again: of before what is remembered";
  EXPECT_EQ(at(seq + 1, now_ms - 60), Standing::foreign) << "a newer number with an older stamp";
  EXPECT_EQ(next(), Standing::fresh) << "the first is heard on";
}

TEST_F(SenderWatchTest, NoMessageLocksOutTheSender) {
  for (const std::int64_t ahead_ms : {kLargest / 1000 - kStart_utime, std::int64_t{3'600'000}, std::int64_t{31}}) {
    for (const std::int64_t number : {std::int64_t{0}, seq + 1, kLargest}) {
      next();
      EXPECT_EQ(at(number, now_ms + ahead_ms, 99), Standing::foreign);
      EXPECT_EQ(next(), Standing::fresh);
    }
  }
  EXPECT_EQ(at(kLargest, now_ms, 99), Standing::foreign) << "no sender counts so fast";
  EXPECT_EQ(next(), Standing::fresh);
}

TEST_F(SenderWatchTest, AfterSilenceASenderMayBeginAnew) {
  for (int i = 0; i < 20; ++i) next();
  now_ms += 90;
  EXPECT_EQ(at(0, now_ms), Standing::foreign);
  now_ms += 30;
  EXPECT_EQ(at(0, now_ms), Standing::fresh);
  EXPECT_EQ(watch.restarts(), 1);
}

TEST_F(SenderWatchTest, TheFirstMessageMustBeOfNow) {
  now_ms = 10'000;
  EXPECT_EQ(at(0, now_ms - 101), Standing::old);
  EXPECT_EQ(at(0, now_ms + 31), Standing::ahead);
  EXPECT_EQ(at(0, now_ms - 100), Standing::fresh);
}

// A reader that was put aside finds a queue of what is old by now: not used, and nobody's fault.
TEST_F(SenderWatchTest, AQueueThatWaitedIsOldAndNotForeign) {
  for (int i = 0; i < 5; ++i) next();
  const std::int64_t stalled_ms = now_ms;
  now_ms += 90;
  for (std::int64_t sent = stalled_ms; sent < now_ms; sent += 10) EXPECT_EQ(at(seq++, sent), Standing::fresh) << sent;
  now_ms += 5000;
  EXPECT_EQ(at(seq++, now_ms - 4000), Standing::old);
  EXPECT_EQ(at(seq++, now_ms), Standing::fresh);
}

TEST_F(SenderWatchTest, PicturesMayComeLateNowAndThen) {
  limits.reorder_us = 50'000;
  watch = SenderWatch(limits);
  for (int i = 0; i < 30; ++i) {
    now_ms += 10;
    if (i % 10 == 5) {  // two swapped
      EXPECT_EQ(at(seq + 1, now_ms), Standing::fresh);
      EXPECT_EQ(at(seq, now_ms - 10), Standing::late);
      seq += 2;
    } else {
      EXPECT_EQ(at(seq++, now_ms), Standing::fresh);
    }
    EXPECT_FALSE(watch.out_of_order());
  }
  // Another that numbers and stamps a little ahead makes all of the first's late.
  for (int i = 0; i < 3; ++i) {
    now_ms += 10;
    at(seq + 3, now_ms + 5, 5);
    at(seq++, now_ms, 6);
  }
  EXPECT_TRUE(watch.out_of_order());
}

// Whatever comes: no message of a foreign stream is used more than once before it is known, and none after.
TEST_F(SenderWatchTest, RandomStrangersAreFoundAtOnce) {
  constexpr unsigned kSeed = 5;
  std::mt19937_64 rng(kSeed);
  for (int trial = 0; trial < 2000; ++trial) {
    watch = SenderWatch(limits);
    now_ms = 1000;
    seq = static_cast<std::int64_t>(rng() % 1000);
    for (int i = 0; i < 20; ++i) next();
    std::int64_t strange_seq = static_cast<std::int64_t>(rng() % 2000);
    const auto shift_ms = static_cast<std::int64_t>(rng() % 40) - 20;
    bool found = false;
    for (int i = 0; i < 30 && !found; ++i) {
      found = at(strange_seq++, now_ms + shift_ms, 77) == Standing::foreign;
      found = next() == Standing::foreign || found;
    }
    ASSERT_TRUE(found) << "seed " << kSeed << ", trial " << trial;
  }
}

actuator_state_t axes(double insertion_mm, double rotation_rad, std::int64_t ms) {
  actuator_state_t m{};
  m.utime = kStart_utime + ms * 1000;
  m.axis_status[0] = m.axis_status[1] = 2;
  m.insertion_mm = insertion_mm;
  m.rotation_rad = rotation_rad;
  return m;
}

TEST(MotionBounds, NothingMovesFasterThanTheAxesCanDriveIt) {
  const MotionBounds bounds{20, 12};
  EXPECT_FALSE(check_motion(axes(10, 1, 0), axes(10.2, 1.12, 10), bounds));
  EXPECT_TRUE(check_motion(axes(10, 1, 0), axes(11, 1, 10), bounds));
  EXPECT_TRUE(check_motion(axes(10, 1, 0), axes(10, 1.5, 10), bounds));
  EXPECT_FALSE(check_motion(axes(10, 1, 0), axes(11, 1, 100), bounds)) << "0.1 s later";
  auto nan = axes(std::nan(""), 0, 10);
  EXPECT_TRUE(check_motion(axes(0, 0, 0), nan, bounds));
  auto fast = axes(0, 0, 10);
  fast.insertion_rate_mm_s = 31;
  EXPECT_TRUE(check_motion(axes(0, 0, 0), fast, bounds));
}

TEST(MotionBounds, ANewZeroIsTakenOnlyWhileTheAxesAreOff) {
  const MotionBounds bounds{20, 12};
  auto before = axes(61, 3, 0), after = axes(0, 0, 10);
  EXPECT_TRUE(check_motion(before, after, bounds));
  before.axis_status[0] = before.axis_status[1] = after.axis_status[0] = after.axis_status[1] = 1;
  EXPECT_FALSE(check_motion(before, after, bounds));
}

TEST(MotionBounds, AxesThatStandStillAtARateAreNotOfNow) {
  StandstillCheck check;
  auto m = axes(10, 1, 0);
  m.insertion_rate_mm_s = 5;
  int reports = 0;
  for (; reports < 10 && !check.see(m, m); ++reports) {
  }
  EXPECT_EQ(reports, 4);
  m.insertion_rate_mm_s = 0;
  EXPECT_FALSE(check.see(m, m));
}

needle_state_t needle(double x_mm, std::int64_t ms, double variance_mm2) {
  needle_state_t m{};
  m.utime = kStart_utime + ms * 1000;
  m.position_mm[0] = x_mm;
  m.orientation_wxyz[0] = 1;
  for (int i = 0; i < 6; ++i) m.covariance[10 * i] = i < 3 ? variance_mm2 : 1e-4;
  return m;
}

TEST(MotionBounds, AnEstimateMovesByWhatItsCovarianceLeavesOpenOrSaysThatItWasReset) {
  const MotionBounds bounds{20, 12};
  EXPECT_FALSE(check_motion(needle(0, 0, 0.01), needle(1, 10, 0.01), bounds));
  EXPECT_TRUE(check_motion(needle(0, 0, 0.01), needle(10, 10, 0.01), bounds));
  EXPECT_FALSE(check_motion(needle(0, 0, 9), needle(10, 10, 0.01), bounds)) << "it was that uncertain";
  auto reset = needle(10, 10, 0.01);
  reset.reset_count = 1;
  EXPECT_FALSE(check_motion(needle(0, 0, 0.01), reset, bounds));
  auto turned = needle(0, 10, 0.01);
  turned.orientation_wxyz[0] = 0;
  turned.orientation_wxyz[3] = 1;
  EXPECT_TRUE(check_motion(needle(0, 0, 0.01), turned, bounds));
}

}  // namespace
}  // namespace bevel::io
