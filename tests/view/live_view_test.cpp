// SPDX-License-Identifier: MIT
#include <bevel/view/live_view.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

namespace bevel::view {
namespace {

using json = nlohmann::json;

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
Moment at(double s) { return {static_cast<std::int64_t>(s * 1e9), kStart_utime + static_cast<std::int64_t>(s * 1e6)}; }

needle_state_t needle(double s, double z_mm) {
  needle_state_t m{};
  m.utime = at(s).utime;
  m.position_mm[2] = z_mm;
  m.orientation_wxyz[0] = 1;
  m.curvature_per_mm = 0.004;
  for (std::size_t i = 0; i < 9; ++i) m.covariance[10 * i] = 0.01 * static_cast<double>(i + 1);
  return m;
}

actuator_state_t axes(double s) {
  actuator_state_t m{};
  m.utime = at(s).utime;
  m.insertion_rate_mm_s = 5;
  return m;
}

tip_measurement_t tip(double s, int camera) {
  tip_measurement_t m{};
  m.utime = at(s).utime;
  m.camera = camera;
  m.position_mm[0] = 1.5;
  m.position_mm[1] = 2.5;
  m.position_mm[2] = 3.5;
  const std::size_t across = camera == 0 ? 1 : 0;  // camera 0 sees y and z, camera 1 x and z
  m.information_per_mm2[4 * across] = 20;
  m.information_per_mm2[8] = 20;
  return m;
}

TEST(LiveView, SaysNothingOfWhatItHasNotHeard) {
  LiveView view;
  const json j = json::parse(view.snapshot(at(1)));
  EXPECT_EQ(j["insertion"], 0);
  for (const char* key : {"needle", "axes", "command", "target", "truth_mm", "row"})
    EXPECT_FALSE(j.contains(key)) << key;
  EXPECT_TRUE(j["tips"].empty());
  EXPECT_TRUE(j["processes"].empty());
}

TEST(LiveView, AgesGoOnCounting) {
  LiveView view;
  view.on(axes(1), at(1));
  EXPECT_NEAR(json::parse(view.snapshot(at(1.25)))["age_s"]["axes"], 0.25, 1e-9);
  EXPECT_NEAR(json::parse(view.snapshot(at(4)))["age_s"]["axes"], 3, 1e-9);
}

TEST(LiveView, AnAxisThatACameraDoesNotSeeIsNull) {
  LiveView view;
  view.on(tip(1, 0), at(1));
  view.on(tip(1, 1), at(1));
  const json j = json::parse(view.snapshot(at(1)));
  EXPECT_EQ(j["tips"][0]["position_mm"], json::parse("[null, 2.5, 3.5]"));
  EXPECT_EQ(j["tips"][1]["position_mm"], json::parse("[1.5, null, 3.5]"));
  tip_measurement_t lost = tip(1.1, 0);
  lost.status = 2;
  view.on(lost, at(1.1));
  EXPECT_EQ(json::parse(view.snapshot(at(1.1)))["tips"][0]["position_mm"], json::parse("[null, null, null]"));
}

TEST(LiveView, APictureIsGivenWithTheTipThatBelongsToIt) {
  LiveView view;
  EXPECT_EQ(json::parse(view.snapshot(at(0)))["pictures"], json::array());
  camera_picture_t m{};
  m.utime = at(1).utime;
  m.camera = 3;
  m.width_px = 320;
  m.height_px = 240;
  m.tip_px[0] = 12;
  m.jpeg = {1, 2, 3};
  view.on(m, at(1));
  json p = json::parse(view.snapshot(at(1.5)))["pictures"][0];
  EXPECT_EQ(p["tip_px"], json::parse("[12.0, 0.0]"));
  EXPECT_NEAR(p["age_s"], 0.5, 1e-9);
  EXPECT_EQ(view.picture(3, p["count"]), std::string("\1\2\3"));
  EXPECT_EQ(view.picture(0, p["count"]), "");
  m.status = 2;  // lost: no tip is marked
  m.jpeg = {4};
  view.on(m, at(2));
  EXPECT_EQ(view.picture(3, p["count"]), "");  // what the page knows of that one is not of this one
  p = json::parse(view.snapshot(at(2)))["pictures"][0];
  EXPECT_TRUE(p["tip_px"].is_null());
  EXPECT_EQ(view.picture(3, p["count"]), "\4");
  for (m.camera = 100; m.camera < 200; ++m.camera) view.on(m, at(3));  // a stranger's
  EXPECT_LE(json::parse(view.snapshot(at(3)))["pictures"].size(), 16U);
  EXPECT_NE(view.picture(3, p["count"]), "");
}

// The message has the covariance in the body's frame; a quarter turn about x makes y of {B} z of {A}.
TEST(LiveView, TheCovarianceIsThatOfTheFrameInWhichItIsDrawn) {
  LiveView view;
  needle_state_t m = needle(1, 10);
  m.orientation_wxyz[0] = m.orientation_wxyz[1] = std::sqrt(0.5);
  view.on(m, at(1));
  const json j = json::parse(view.snapshot(at(1)))["needle"];
  EXPECT_NEAR(j["covariance_mm2"][0], 0.01, 1e-12);
  EXPECT_NEAR(j["covariance_mm2"][4], 0.03, 1e-12);
  EXPECT_NEAR(j["covariance_mm2"][8], 0.02, 1e-12);
  EXPECT_NEAR(j["heading"][1], -1, 1e-12);
  EXPECT_NEAR(j["curvature_sd_per_mm"], std::sqrt(0.07), 1e-12);
}

TEST(LiveView, OneRowOfTheChartsForEachSnapshotThatHasNews) {
  LiveView view;
  for (int i = 0; i < 10; ++i) {
    view.on(axes(1 + 0.05 * i), at(1 + 0.05 * i));
    EXPECT_TRUE(json::parse(view.snapshot(at(1 + 0.05 * i))).contains("row"));
    EXPECT_FALSE(json::parse(view.snapshot(at(1 + 0.05 * i))).contains("row"));
  }
  const json rows = json::parse(view.history())["rows"];
  ASSERT_EQ(rows[0].size(), 10U);
  EXPECT_NEAR(rows[0][9], 0.45, 1e-9);
  EXPECT_EQ(rows[2][9], 5);
  EXPECT_TRUE(rows[1][9].is_null()) << "no command was heard";
}

TEST(LiveView, AStopDoesNotMoveTheTarget) {
  LiveView view;
  steering_target_t word{};
  word.request = 1;
  word.position_mm[2] = 90;
  view.on(word, at(1));
  word.request = 0;
  word.position_mm[2] = 0;
  view.on(word, at(2));
  EXPECT_EQ(json::parse(view.snapshot(at(2)))["target"]["position_mm"][2], 90);
}

TEST(LiveView, TestRatiosAreThoseOfTheCameraThatWasUsed) {
  LiveView view;
  view.on(tip(1.00, 0), at(1));
  view.on(tip(1.01, 1), at(1.01));
  needle_state_t m = needle(1.02, 10);
  m.measurement_utime = at(1.01).utime;
  m.test_ratio = 0.4;
  view.on(m, at(1.02));
  const json j = json::parse(view.snapshot(at(1.02)));
  EXPECT_TRUE(j["tips"][0]["test_ratio"].is_null());
  EXPECT_EQ(j["tips"][1]["test_ratio"], 0.4);
}

TEST(LiveView, ALogThatIsPlayedBackIsSaidToBe) {
  LiveView view;
  view.on(axes(1), at(1));
  EXPECT_FALSE(json::parse(view.snapshot(at(1)))["played_back"]);
  EXPECT_TRUE(json::parse(view.snapshot({at(1).ns, at(3600).utime}))["played_back"]);
}

TEST(LiveView, AnotherInsertionBeginsAnew) {
  LiveView view;
  for (int i = 0; i < 100; ++i) view.on(needle(0.05 * i, i), at(0.05 * i));
  (void)view.snapshot(at(5));
  EXPECT_EQ(json::parse(view.history())["path_mm"].size(), 100U);
  const std::int64_t first = json::parse(view.snapshot(at(5)))["insertion"];
  view.on(needle(600, 1), at(600));
  const json history = json::parse(view.history());
  EXPECT_EQ(history["insertion"], first + 1);
  EXPECT_EQ(history["path_mm"].size(), 1U);
  EXPECT_TRUE(history["rows"][0].empty());
}

// A log of two seconds, played twice: its second playback starts less than ten seconds back.
TEST(LiveView, APlaybackOfTheSameLogBeginsAnew) {
  LiveView view;
  steering_target_t target{};
  target.request = 1;
  const auto play = [&](double from_s) {
    for (int i = 0; i < 40; ++i) {
      const double s = from_s + 0.05 * i;
      view.on(axes(s), at(s));
      view.on(tip(s - 0.04, 0), at(s));
      view.on(tip(s - 0.3, 1), at(s));
      view.on(needle(s, i), at(s));
      if (i == 20) target.utime = at(s).utime, view.on(target, at(s));
      (void)view.snapshot(at(s));
    }
  };
  play(1);
  const std::int64_t first = json::parse(view.snapshot(at(3)))["insertion"];
  play(1);
  json history = json::parse(view.history());
  EXPECT_EQ(history["insertion"], first + 1);
  EXPECT_EQ(history["path_mm"].size(), 40U);
  view.on(axes(1), at(3));
  EXPECT_FALSE(json::parse(view.snapshot(at(3))).contains("target")) << "of the playback before";
}

TEST(LiveView, AConfigBeginsAnew) {
  LiveView view;
  view.on(needle(1, 1), at(1));
  const std::int64_t first = json::parse(view.snapshot(at(1)))["insertion"];
  view.on_config();
  view.on(needle(1.5, 2), at(1.5));
  view.on(needle(1.6, 3), at(1.6));
  const json history = json::parse(view.history());
  EXPECT_EQ(history["insertion"], first + 1);
  EXPECT_EQ(history["path_mm"].size(), 2U);
}

// A camera that lags, or a clock of another computer, is not another playback.
TEST(LiveView, ADelayedCameraDoesNotBeginAnew) {
  LiveView view;
  for (int i = 0; i < 100; ++i) {
    view.on(axes(5 + 0.05 * i), at(0.05 * i));
    view.on(tip(3 + 0.05 * i, 0), at(0.05 * i));
  }
  EXPECT_EQ(json::parse(view.snapshot(at(5)))["insertion"], 1);
}

// Hours of it, at the rate of the page: memory and the time of a reload stay bounded, the whole stays in sight.
TEST(LiveView, ShowsALimitedNumberOfCamerasAndProcesses) {
  LiveView view;
  for (int i = 0; i < 1000; ++i) {
    view.on(tip(3, i), at(3));
    process_status_t status{};
    status.process = "process-" + std::to_string(i);
    view.on(status, at(3));
  }
  json shown = json::parse(view.snapshot(at(3)));
  EXPECT_EQ(shown["tips"].size(), 16U);
  EXPECT_EQ(shown["processes"].size(), 32U);
  // An entry that is silent for more than a minute makes place for a new one.
  process_status_t status{};
  status.process = "bevel-controller";
  view.on(status, at(10));
  EXPECT_THAT(view.snapshot(at(10)), testing::Not(testing::HasSubstr("bevel-controller")));
  view.on(status, at(70));
  shown = json::parse(view.snapshot(at(70)));
  EXPECT_EQ(shown["processes"].size(), 32U);
  EXPECT_EQ(shown["processes"][0]["name"], "bevel-controller");
}

TEST(LiveView, ALongSessionStaysBounded) {
  LiveView view;
  constexpr int kSteps = 60'000;
  for (int i = 0; i < kSteps; ++i) {
    view.on(needle(0.05 * i, 0.25 * i), at(0.05 * i));
    (void)view.snapshot(at(0.05 * i));
  }
  const json history = json::parse(view.history());
  EXPECT_LE(history["rows"][0].size(), 12'000U);
  EXPECT_LE(history["path_mm"].size(), 4'000U);
  EXPECT_EQ(history["path_mm"][0][2], 0);
  EXPECT_GT(history["path_mm"].back()[2], 0.249 * kSteps);
  EXPECT_LT(history["rows"][0][0], 1);
  EXPECT_NEAR(history["rows"][0].back(), 0.05 * (kSteps - 1), 0.1);
}

}  // namespace
}  // namespace bevel::view
