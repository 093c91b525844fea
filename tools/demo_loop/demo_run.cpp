// SPDX-License-Identifier: MIT
#include "tools/demo_loop/demo_run.hpp"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include <bevel/nodes/claim_name.hpp>
#include <bevel/nodes/fault_injector.hpp>
#include <bevel/nodes/open_lcm.hpp>
#include <bevel/nodes/process_group.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tools/demo_loop/loop_figures.hpp"
#include "tools/demo_loop/steering_session.hpp"

namespace bevel::tools {
namespace {

constexpr const char* kPrograms[] = {"bevel-rig", "bevel-stepper", "bevel-camera", "bevel-estimator",
                                     "bevel-controller"};

std::string tail_of(const std::string& path) {
  std::ifstream file(path);
  std::string line, text;
  while (std::getline(file, line)) text += "  | " + line + "\n";
  return text;
}

constexpr double kFarewell_s = 0.3;  // for the stop and what follows it to reach the log

enum class End { at_depth, stopped, died, timed_out, interrupted };

End steer(SteeringSession& session, nodes::ProcessGroup& processes, lcm::LCM& lcm, const DemoOptions& options) {
  End end = End::interrupted;
  const std::int64_t start_ns = nodes::now().ns;
  const auto step = [&](const nodes::Now& now, double) {
    const auto progress = session.step(now);
    if (const auto death = processes.first_death()) {
      const std::string name = death->substr(0, death->find(':'));
      std::fprintf(stderr, "bevel-demo: a process died: %s\n%s", death->c_str(),
                   tail_of(options.out + "/" + name + ".txt").c_str());
      end = End::died;
      return false;
    }
    if (progress == SteeringSession::Progress::at_depth) end = End::at_depth;
    if (progress == SteeringSession::Progress::stopped) end = End::stopped;
    const double elapsed_s = static_cast<double>(now.ns - start_ns) * 1e-9;
    if (progress == SteeringSession::Progress::going_on && elapsed_s > options.time_limit_s) {
      end = End::timed_out;
      return false;
    }
    return progress == SteeringSession::Progress::going_on;
  };
  const auto tell = [&session](const nodes::Now& now) { session.tell_time(now); };
  // The operator's stop is said however this ends, and heard of.
  nodes::run_with_end(
      lcm, {0.01, tell, step}, [&session] { session.stop(); },
      {0.01, tell, [](const nodes::Now&, double) { return true; }}, kFarewell_s);
  return end;
}

// Where each program's faults are made: drives are the rig's.
std::string program_of(const nodes::Fault& fault) {
  switch (fault.component) {
    case nodes::Component::camera:
      return "bevel-camera";
    case nodes::Component::estimator:
      return "bevel-estimator";
    case nodes::Component::controller:
      return "bevel-controller";
    case nodes::Component::stepper:
      return "bevel-stepper";
    case nodes::Component::insertion_drive:
    case nodes::Component::rotation_drive:
      break;
  }
  return "bevel-rig";
}

// Not one of the processes that the needle depends on.
void start_view(nodes::ProcessGroup& viewer, const std::string& lcm_url, const DemoOptions& options) {
  const std::string log_path = options.out + "/bevel-view.txt";
  std::vector<std::string> command{options.programs + "/bevel-view"};
  if (!lcm_url.empty()) command.insert(command.end(), {"--lcm-url", lcm_url});
  viewer.start("bevel-view", command, log_path);
  for (int waited_ms = 0; waited_ms < 2000; waited_ms += 20) {
    if (const auto death = viewer.first_death()) {
      std::fprintf(stderr, "bevel-demo: no live page: %s\n%s", death->c_str(), tail_of(log_path).c_str());
      return;
    }
    std::string address;
    std::ifstream file(log_path);
    if (std::getline(file, address) && !file.eof()) {
      std::printf("%s\n", address.c_str());
      std::fflush(stdout);
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

}  // namespace

int run_demo(const DemoOptions& options) {
  const nodes::SystemConfig config = nodes::load_system_config(options.config_path);
  if (!options.fault.empty()) (void)nodes::parse_fault(options.fault);  // before anything is started
  std::filesystem::create_directories(options.out);
  const std::string log_path = options.out + "/insertion.lcm";
  const auto opened = nodes::open_lcm(config.lcm_url);
  lcm::LCM& lcm = *opened;
  nodes::catch_signals();
  const Eigen::Vector3d target(options.target_mm[0], options.target_mm[1], options.target_mm[2]);
  nodes::claim_operator(lcm, config.lcm_url, "bevel-demo");
  SteeringSession session(lcm, log_path, target, options.tolerance_mm,
                          options.retract_to_mm >= 0 ? std::optional(options.retract_to_mm) : std::nullopt);
  nodes::LcmPort(lcm).publish_text(io::channel::kConfig, config.text);

  End end = End::interrupted;
  bool clean = false;
  {
    nodes::ProcessGroup viewer, processes;
    if (options.view) start_view(viewer, config.lcm_url, options);
    for (const char* program : kPrograms) {
      std::vector<std::string> command{options.programs + "/" + program, "--config", options.config_path};
      if (!options.fault.empty() && program_of(nodes::parse_fault(options.fault)) == program)
        command.insert(command.end(), {"--fault", options.fault});
      if (options.view && std::string_view(program) == "bevel-camera")
        command.insert(command.end(), {"--picture-hz", "4"});
      processes.start(program, command, options.out + "/" + program + ".txt");
    }
    end = steer(session, processes, lcm, options);
    clean = processes.stop_all();
  }
  if (!session.log_failure().empty())
    std::fprintf(stderr, "bevel-demo: the needle was stopped because nothing is recorded any more\n");
  session.close_log();
  if (!clean) std::fprintf(stderr, "bevel-demo: a process did not end when asked and was killed\n");
  switch (end) {
    case End::interrupted:
      std::fprintf(stderr, "bevel-demo: interrupted; everything is stopped\n");
      return 130;
    case End::died:
      return 1;
    case End::timed_out:
      std::fprintf(stderr, "bevel-demo: not there after %.0f s: %s\n", options.time_limit_s, session.reason().c_str());
      return 1;
    case End::stopped:
      std::fprintf(stderr, "bevel-demo: the needle was stopped: %s\n", session.reason().c_str());
      return 1;
    case End::at_depth:
      break;
  }
  const LoopFigures figures = loop_figures(log_path);
  const double tolerance_mm =
      options.tolerance_mm > 0 ? options.tolerance_mm : config.controller.safety.arrival_tolerance_mm;
  std::printf("\n%s\n", to_text(figures).c_str());
  write_loop_report(log_path, figures, tolerance_mm, options.out + "/report.html");
  std::printf("report %s/report.html, log %s\n", options.out.c_str(), log_path.c_str());
  std::fflush(stdout);
  const bool missed = reports_miss(session.outcome());
  if (missed) std::fprintf(stderr, "bevel-demo: %s\n", session.outcome().c_str());
  if (!(figures.targeting_error_mm <= tolerance_mm)) {
    std::fprintf(stderr, "bevel-demo: the true tip is %.2f mm from the target, tolerance %.2f mm%s\n",
                 figures.targeting_error_mm, tolerance_mm, missed ? "" : "; the controller reported an arrival");
    return 1;
  }
  return clean && !missed ? 0 : 1;
}

}  // namespace bevel::tools
