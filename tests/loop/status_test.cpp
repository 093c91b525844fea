// PROCESS_STATUS says how the process's loop keeps its time.
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "nodes/runtime.hpp"
#include "nodes/status_reporter.hpp"

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
  port.tell_time(now());
  int steps = 0;
  run_periodic(lcm, {kPeriod_s, {}, [&](const Now&, double) {
                       if (++steps == 1) std::this_thread::sleep_for(150ms);  // so that the next starts 50 ms late
                       if (steps == 2) status.report("running", "");
                       return steps < 2;
                     }});
  status.report("stopped", "");
  status.report("gone", "");
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
    port.tell_time({1'000, 1});
    status.report("running", "");
    status.report("stopped", "");
  })
      .join();
  pump(lcm);
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0].loop_run_max_s, 0.02);
  EXPECT_EQ(said[0].overruns, 0);
  EXPECT_EQ(said[1].loop_run_max_s, 0);
}

TEST(ProcessStatus, KnowsAnotherRunOfItsOwnProcess) {
  lcm::LCM lcm("memq://");
  LcmPort port(lcm), other_port(lcm);
  StatusReporter status(port, "bevel-test", 0), stranger(other_port, "bevel-other", 0);
  port.tell_time(now());
  other_port.tell_time(now());
  status.report("running", "");
  status.renew_session();  // the same run after a stop
  status.report("running", "");
  stranger.report("running", "");
  pump(lcm);
  EXPECT_FALSE(status.name_taken());
  StatusReporter second(other_port, "bevel-test", 0);
  second.report("running", "");
  pump(lcm);
  EXPECT_TRUE(status.name_taken());
}

}  // namespace
}  // namespace bevel::nodes
