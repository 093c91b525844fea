// PROCESS_STATUS says how the process's loop keeps its time.
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "nodes/lcm_port.hpp"
#include "nodes/runtime.hpp"

namespace bevel::nodes {
namespace {

TEST(ProcessStatus, TellsTheLongestStepTheLatestStartAndTheOverrunsOfTheLoop) {
  using namespace std::chrono_literals;
  constexpr double kPeriod_s = 0.1;
  lcm::LCM lcm("memq://");
  LcmPort port(lcm);
  std::vector<process_status_t> said;
  port.subscribe<process_status_t>(io::channel::kProcessStatus,
                                   [&said](const process_status_t& m) { said.push_back(m); });
  StatusReporter status(port, "bevel-test", kPeriod_s);
  const std::int64_t utime = now().utime;
  int steps = 0;
  run_periodic(lcm, kPeriod_s, [&](const Now&, double) {
    if (++steps == 1) std::this_thread::sleep_for(150ms);  // so that the next starts at least 50 ms late
    if (steps == 2) status.report(utime, "running", "");
    return steps < 2;
  });
  status.report(utime, "stopped", "");
  status.report(utime, "gone", "");
  pump(lcm);
  ASSERT_EQ(said.size(), 3U);
  EXPECT_GE(said[0].loop_run_max_s, 0.15);
  // After a longer stall the missed periods are skipped.
  if (said[0].loop_run_max_s < 2 * kPeriod_s) {
    EXPECT_GE(said[0].loop_late_max_s, 0.05);
  }
  EXPECT_EQ(said[0].overruns, 1);
  EXPECT_GT(said[1].loop_run_max_s, 0) << "the second step";
  EXPECT_EQ(said[1].loop_late_max_s, 0) << "already told";
  EXPECT_EQ(said[2].loop_run_max_s, 0);
  EXPECT_GE(said[2].overruns, 1) << "since the start";
}

TEST(ProcessStatus, TellsTheLongestRunOfAProcessThatItsInputDrives) {
  lcm::LCM lcm("memq://");
  LcmPort port(lcm);
  std::vector<process_status_t> said;
  port.subscribe<process_status_t>(io::channel::kProcessStatus,
                                   [&said](const process_status_t& m) { said.push_back(m); });
  std::thread([&] {  // a thread of its own, on which no loop has run
    StatusReporter status(port, "bevel-test", 0);
    status.note_run(0.02);
    status.note_run(0.01);
    status.report(1, "running", "");
    status.report(2, "stopped", "");
  })
      .join();
  pump(lcm);
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0].loop_run_max_s, 0.02);
  EXPECT_EQ(said[0].overruns, 0);
  EXPECT_EQ(said[1].loop_run_max_s, 0);
}

}  // namespace
}  // namespace bevel::nodes
