// SPDX-License-Identifier: MIT
// The five processes for real, started one by one as a study wants each (under another clock, with less of the
// processor), an operator for them, and somebody who watches from outside: the drives' own frames on the bus, and when
// each process was last heard. For programs in a network namespace of their own (processes_test.sh).
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <bevel/nodes/operator_heartbeat.hpp>
#include <bevel/nodes/operator_words.hpp>
#include <bevel/nodes/process_group.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/loop/bus_listener.hpp"

namespace bevel::test {

inline constexpr std::array<const char*, 5> kProcesses{"bevel-rig", "bevel-stepper", "bevel-camera", "bevel-estimator",
                                                       "bevel-controller"};

// Of whom something must have been heard a moment ago while an axis moves.
enum class Source { driver, axes, camera, estimate, command };
inline constexpr std::array<const char*, 5> kSources{"driver's cycle on the bus", "ACTUATOR_STATE", "TIP_MEASUREMENT",
                                                     "NEEDLE_STATE", "MOTION_COMMAND"};

class LiveRig {
 public:
  // `prefix`: the words before a program's own, by its name; `nice -n 10` for instance.
  LiveRig(const std::string& bin, const std::string& config_path, const std::string& out,
          const std::map<std::string, std::vector<std::string>>& prefix);

  // Takes in what has arrived, judges it, and waits two milliseconds.
  void look();
  // Looks on for so long, or until the condition holds: whether it did.
  bool run(
      double seconds, const std::function<bool()>& until = [] { return false; });

  void say(nodes::Word word);
  // Arms and starts, as the operator's program does, again and again until the needle has been steered for so long:
  // a busy machine stops it for reasons of its own. False if it was not. The target is ahead of the needle, and so in
  // reach wherever it has stopped.
  bool steer(double within_s, double steered_s);
  bool arm(double within_s);  // controller armed, axes enabled

  bool at_rest() const { return listener_ && listener_->at_rest(); }
  bool moving() const { return listener_ && listener_->rate(0) > kMoving_unit_s; }
  // A stop by the controller's or the driver's own word.
  bool stop_declared() const;
  const process_status_t& said(const std::string& process) const;
  io::ProcessState state_of(const std::string& process) const;  // waiting before its first status
  std::string states() const;                                   // every process's last word
  // A process that is no longer there, or that LCM or the bus failed: not what any of these studies is about.
  std::string broken();

  std::int64_t clock_us = 0;  // by which the operator's clock differs from this process's

  // Watched since begin_watch(), all by the steady clock.
  struct Watch {
    std::int64_t begun_ns = 0;
    std::int64_t declared_ns = 0;  // first word of a stop; 0 none
    std::int64_t rest_ns = 0;      // since when both axes rest; 0 while one moves
    bool moved_again = false;      // after both had rested under a stop, without an operator's start
    std::array<std::int64_t, kSources.size()> age_while_moving_ns{};  // the largest of each source
    std::int64_t armed_with_fault_ns = 0;                  // the longest that the two contradicted each other
    std::int64_t observer_late_ns = 0, bench_late_ns = 0;  // what every time here may be too large by
    std::map<std::string, int> heard;                      // messages by channel
  };
  void begin_watch();
  const Watch& watch() const { return watch_; }
  // ms from `from_ns` to rest, since the last watch began; -1 while an axis moves.
  double ms_to_rest(std::int64_t from_ns) const;

  std::optional<needle_state_t> estimate, truth;

 private:
  void aim_ahead();
  void judge(std::int64_t now_ns);
  void heard(Source source, const char* channel);

  nodes::SystemConfig config_;
  Eigen::Vector3d target_mm_{2, -3, 100};
  lcm::LCM lcm_;
  nodes::LcmPort port_;
  nodes::OperatorHeartbeat heartbeat_;
  nodes::ProcessGroup processes_;
  std::unique_ptr<BusListener> listener_;
  std::map<std::string, process_status_t> said_;
  std::array<std::int64_t, kSources.size()> heard_ns_{};
  std::int64_t seq_ = 0;
  std::int64_t looked_ns_ = 0, contradiction_ns_ = 0;
  bool started_ = false;  // by the operator, since the watch began
  Watch watch_;
};

}  // namespace bevel::test
