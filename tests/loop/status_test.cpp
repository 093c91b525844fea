// SPDX-License-Identifier: MIT
// PROCESS_STATUS says how the process's loop keeps its time.
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include <bevel/nodes/runtime.hpp>
#include <bevel/nodes/status_reporter.hpp>

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
                       if (steps == 2) status.report(io::ProcessState::running, "");
                       return steps < 2;
                     }});
  status.report(io::ProcessState::stopped, "");
  status.report(io::ProcessState::fault, "");
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
    status.report(io::ProcessState::running, "");
    status.report(io::ProcessState::stopped, "");
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
  status.report(io::ProcessState::running, "");
  status.renew_session();  // the same run after a stop
  status.report(io::ProcessState::running, "");
  stranger.report(io::ProcessState::running, "");
  pump(lcm);
  EXPECT_FALSE(status.name_taken());
  StatusReporter second(other_port, "bevel-test", 0);
  second.report(io::ProcessState::running, "");
  pump(lcm);
  EXPECT_TRUE(status.name_taken());
}

TEST(ProcessStatus, ForgetsAnotherRunThatIsSilent) {
  lcm::LCM lcm("memq://");
  LcmPort port(lcm), other_port(lcm);
  StatusReporter status(port, "bevel-test", 0), second(other_port, "bevel-test", 0);
  Now at{1'000'000'000, 1'700'000'000'000'000};
  const auto pass_ms = [&](std::int64_t ms) {
    at.ns += ms * 1'000'000;
    at.utime += ms * 1000;
    port.tell_time(at);
    other_port.tell_time(at);
  };
  pass_ms(0);
  second.report(io::ProcessState::running, "");
  pump(lcm);
  pass_ms(1500);  // three periods
  EXPECT_TRUE(status.name_taken());
  pass_ms(1);
  EXPECT_FALSE(status.name_taken());
  second.report(io::ProcessState::running, "");  // it is back
  pump(lcm);
  EXPECT_TRUE(status.name_taken());
}

TEST(ProcessStatus, CarriesItsStateAsANumberAndAsText) {
  lcm::LCM lcm("memq://");
  LcmPort port(lcm);
  process_status_t said{};
  port.subscribe<process_status_t>(io::channel::kProcessStatus, [&said](const process_status_t& m) { said = m; });
  StatusReporter status(port, "bevel-test", 0);
  port.tell_time(now());
  for (const auto state : {io::ProcessState::waiting, io::ProcessState::enabled, io::ProcessState::fault}) {
    status.report(state, "");
    pump(lcm);
    EXPECT_EQ(said.state_code, static_cast<std::int32_t>(state));
    EXPECT_EQ(said.state, io::to_string(state));
  }
}

}  // namespace
}  // namespace bevel::nodes
