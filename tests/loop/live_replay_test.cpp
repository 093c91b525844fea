// SPDX-License-Identifier: MIT
// What the estimator says live, over LCM, is what a replay of the log of the same messages says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <random>
#include <sstream>

#include <bevel/analysis/replay/batch.hpp>
#include <bevel/analysis/replay/report.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/log_reader.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/nodes/estimator_node.hpp>
#include <bevel/nodes/needle_pose.hpp>
#include <bevel/nodes/runtime.hpp>
#include "tests/estimator/insertion.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

void expect_live_is_replay(double heading_sd_rad) {
  constexpr unsigned kSeed = 17;
  std::mt19937_64 rng(kSeed);
  estimator::EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  estimator::testing::InsertionPlan plan;
  plan.cameras = 2;
  plan.lost_share = 0.1;
  plan.heading_sd_rad = heading_sd_rad;
  const auto data = estimator::testing::insert(config.prior.needle, {}, plan, rng);

  // In order of arrival; measurements and headings come 60 to 120 ms late, each on its own.
  struct Event {
    std::int64_t arrival;
    enum { actuator, measurement, heading } kind;
    std::size_t index;
  };
  std::vector<Event> events;
  for (std::size_t i = 0; i < data.actuators.size(); ++i)
    events.push_back({data.actuators[i].utime, Event::actuator, i});
  std::uniform_int_distribution<std::int64_t> late_us(60'000, 120'000);
  for (std::size_t i = 0; i < data.measurements.size(); ++i)
    events.push_back({data.measurements[i].utime + late_us(rng), Event::measurement, i});
  for (std::size_t i = 0; i < data.headings.size(); ++i)
    events.push_back({data.headings[i].utime + late_us(rng), Event::heading, i});
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.arrival < b.arrival; });

  lcm::LCM lcm("memq://");
  nodes::EstimatorNode node(lcm, config, {});
  nodes::LcmPort port(lcm);
  std::vector<needle_state_t> live;
  bool at_axes = false;
  // Between them come those of readings as they arrive, which hold at that moment.
  port.subscribe<needle_state_t>(io::channel::kNeedleState, [&](const needle_state_t& m) {
    if (at_axes) live.push_back(m);
  });
  const test::TemporaryFolder folder;
  const std::string path = (folder / "live.lcm").string();
  {
    io::LogWriter log(path);
    for (const Event& event : events) {
      node.step({event.arrival * 1000, event.arrival});
      port.tell_time({event.arrival * 1000, event.arrival});
      const auto send = [&](const char* channel, const auto& message) {
        port.publish(channel, message);
        log.write_message(event.arrival, channel, message);
      };
      at_axes = event.kind == Event::actuator;
      switch (event.kind) {
        case Event::actuator:
          send(io::channel::kActuatorState, io::to_message(data.actuators[event.index]));
          break;
        case Event::measurement:
          send(io::channel::kTipMeasurement, io::to_message(data.measurements[event.index]));
          break;
        case Event::heading:
          send(io::channel::kTipHeading, io::to_message(data.headings[event.index]));
          break;
      }
      nodes::pump(lcm);
    }
    log.close();
  }
  const io::FileBytes file(path);
  const auto replay = analysis::replay_log(file.bytes(), "live", config);

  ASSERT_EQ(live.size(), replay.states.size());
  ASSERT_GT(live.size(), 900U);
  for (std::size_t i = 0; i < live.size(); ++i) {
    const auto& row = replay.states[i];
    ASSERT_EQ(live[i].utime, row.utime);
    for (int k = 0; k < 3; ++k) ASSERT_EQ(live[i].position_mm[k], row.state.pose.p_mm[k]) << i;
    ASSERT_EQ(live[i].curvature_per_mm, row.state.curvature_per_mm);
    ASSERT_EQ(live[i].lambda2, row.state.lambda2);
    const estimator::Matrix9d covariance = row.state.unpacked().covariance;
    for (int k = 0; k < 81; ++k) ASSERT_EQ(live[i].covariance[k], covariance(k / 9, k % 9));
    ASSERT_EQ(live[i].reset_count, row.state.reset_count);
  }
  EXPECT_EQ(replay.headings.size(), data.headings.size());
  EXPECT_EQ(replay.without_headings.has_value(), heading_sd_rad > 0);
}

TEST(LiveReplay, TheNodesStatesAreThoseOfAReplayOfItsLog) { expect_live_is_replay(0); }

TEST(LiveReplay, AndSoTheyAreWithHeadings) { expect_live_is_replay(0.02); }

TEST(LiveReplay, AReplaySaysWhatHeadingsBring) {
  constexpr unsigned kSeed = 18;
  std::mt19937_64 rng(kSeed);
  estimator::EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  estimator::testing::InsertionPlan plan;
  plan.heading_sd_rad = 0.02;
  const auto data = estimator::testing::draw_insertion(config.prior, plan, rng).data;
  const test::TemporaryFolder folder;
  const auto write = [&](const std::string& path, bool headings) {
    io::LogWriter log(path);
    std::size_t next = 0;
    for (std::size_t i = 0; i < data.actuators.size(); ++i) {
      const auto& actuator = data.actuators[i];
      for (; next < data.measurements.size() && data.measurements[next].utime < actuator.utime; ++next) {
        log.write_message(actuator.utime, io::channel::kTipMeasurement, io::to_message(data.measurements[next]));
        if (headings) log.write_message(actuator.utime, io::channel::kTipHeading, io::to_message(data.headings[next]));
      }
      log.write_message(actuator.utime, io::channel::kActuatorState, io::to_message(actuator));
      needle_state_t truth{};
      truth.utime = actuator.utime;
      nodes::write_pose(data.poses[i], truth);
      log.write_message(actuator.utime, io::channel::kNeedleTruth, truth);
    }
    log.close();
    return io::FileBytes(path);
  };
  const auto with = analysis::replay_log(write((folder / "with.lcm").string(), true).bytes(), "with", config);
  const auto without = analysis::replay_log(write((folder / "without.lcm").string(), false).bytes(), "without", config);
  ASSERT_TRUE(with.without_headings);
  EXPECT_FALSE(without.without_headings);
  // Left out they are as if they had never been, to the last bit.
  const auto left_out = with.without_headings->state.unpacked(), never = without.states.back().state.unpacked();
  EXPECT_EQ(left_out.pose.p_mm, never.pose.p_mm);
  EXPECT_EQ(left_out.covariance, never.covariance);
  EXPECT_EQ(with.truth_without_headings.tilt_rmse_rad, without.truth.tilt_rmse_rad);
  for (int i = 3; i < 9; ++i)
    EXPECT_LT(with.states.back().state.unpacked().covariance(i, i), never.covariance(i, i)) << i;
  EXPECT_LT(with.truth.tilt_rmse_rad, without.truth.tilt_rmse_rad);

  const auto figures = analysis::innovation_figures(with);
  EXPECT_EQ(figures.headings, static_cast<std::int64_t>(data.headings.size()));
  EXPECT_TRUE(figures.heading_nis.in_band()) << figures.heading_nis.mean();
  std::ostringstream said, said_without;
  analysis::print(said, with, 20);
  analysis::print(said_without, without, 20);
  std::cout << "seed " << kSeed << "\n" << said.str();
  for (const char* words : {"headings     303: 0 not usable", "heading NIS  0.9", "with them    k 0.00",
                            "without      k 0.00", "without headings RMSE", "; pose NEES/6 "})
    EXPECT_THAT(said.str(), HasSubstr(words));
  EXPECT_THAT(said_without.str(), Not(HasSubstr("heading")));
  const auto told = analysis::replay_logs({(folder / "with.lcm").string()}, config, {.use_headings = false}).front();
  EXPECT_EQ(told.states.back().state.unpacked().covariance, never.covariance);
  EXPECT_EQ(told.counters.headings.offered, 0);
  analysis::write_files(with, (folder / "out").string(), 20);
  EXPECT_THAT(test::text_of(folder / "out/with.html"), HasSubstr("with them    k 0.00"));
  EXPECT_THAT(test::text_of(folder / "out/with.headings.csv"), HasSubstr("innovation_a_rad"));
}

}  // namespace
}  // namespace bevel
