// What the estimator says live, over LCM, is what a replay of the log of the same messages says.
#include <gtest/gtest.h>

#include <random>

#include "io/file_bytes.hpp"
#include "io/log_reader.hpp"
#include "io/log_writer.hpp"
#include "nodes/estimator_node.hpp"
#include "nodes/runtime.hpp"
#include "tests/estimator/insertion.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/replay/replay.hpp"

namespace bevel {
namespace {

TEST(LiveReplay, TheNodesStatesAreThoseOfAReplayOfItsLog) {
  constexpr unsigned kSeed = 17;
  std::mt19937_64 rng(kSeed);
  estimator::EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  estimator::testing::InsertionPlan plan;
  plan.cameras = 2;
  plan.lost_share = 0.1;
  const auto data = estimator::testing::insert(config.prior.needle, {}, plan, rng);

  // In order of arrival; measurements come 60 to 120 ms late.
  struct Event {
    std::int64_t arrival;
    std::size_t actuator, measurement;  // one of them past its end
  };
  std::vector<Event> events;
  for (std::size_t i = 0; i < data.actuators.size(); ++i) events.push_back({data.actuators[i].utime, i, SIZE_MAX});
  std::uniform_int_distribution<std::int64_t> late_us(60'000, 120'000);
  for (std::size_t i = 0; i < data.measurements.size(); ++i)
    events.push_back({data.measurements[i].utime + late_us(rng), SIZE_MAX, i});
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.arrival < b.arrival; });

  lcm::LCM lcm("memq://");
  nodes::EstimatorNode node(lcm, config, {});
  nodes::LcmPort port(lcm);
  std::vector<needle_state_t> live;
  port.subscribe<needle_state_t>(io::channel::kNeedleState, [&live](const needle_state_t& m) { live.push_back(m); });
  const test::TemporaryFolder folder;
  const std::string path = (folder / "live.lcm").string();
  {
    io::LogWriter log(path);
    for (const Event& event : events) {
      node.step({event.arrival * 1000, event.arrival});
      port.tell_time({event.arrival * 1000, event.arrival});
      if (event.actuator != SIZE_MAX) {
        const auto message = io::to_message(data.actuators[event.actuator]);
        port.publish(io::channel::kActuatorState, message);
        log.write_message(event.arrival, io::channel::kActuatorState, message);
      } else {
        const auto message = io::to_message(data.measurements[event.measurement]);
        port.publish(io::channel::kTipMeasurement, message);
        log.write_message(event.arrival, io::channel::kTipMeasurement, message);
      }
      nodes::pump(lcm);
    }
    log.close();
  }
  const io::FileBytes file(path);
  const auto replay = replay::replay_log(file.bytes(), "live", config);

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
}

}  // namespace
}  // namespace bevel
