// SPDX-License-Identifier: MIT
#pragma once
// Publishes the state of a node on PROCESS_STATUS, twice a second and at each change, and keeps the node's session: the
// number that an operator's request must carry, and that changes at each latched stop.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include <bevel/io/process_state.hpp>
#include <bevel/nodes/lcm_port.hpp>

namespace bevel::nodes {

class StatusReporter {
 public:
  StatusReporter(LcmPort& port, std::string process, double period_s);

  std::int64_t session() const { return message_.session; }
  // Words of before are worthless from here on: to be called at each latched stop.
  void renew_session() { ++message_.session; }
  /// Returns whether another run of the same process sends on this network: its newest status arrived at most 1.5 s
  /// ago, three periods of PROCESS_STATUS. The condition clears by itself when the other run is silent for longer; a
  /// stop that the node latched for it is cleared by request 1 (arm) after that.
  bool name_taken() const;

  // For a process whose steps its input drives; those of run_periodic() are measured there.
  void note_run(double run_s) { run_max_s_ = std::max(run_max_s_, run_s); }
  void note_overrun() { ++overruns_; }  // of a bound of the process's own, beside those of its loop
  /// Publishes when a period has passed or when state, reason or session changed.
  void report(io::ProcessState state, const std::string& reason);

 private:
  LcmPort& port_;
  process_status_t message_{};
  std::int64_t run_ = 0;  // the part of session that tells runs apart
  std::int64_t last_ns_ = 0;
  std::int64_t last_session_ = 0;
  double run_max_s_ = 0;
  std::int64_t overruns_ = 0;
  // Steady time of the newest status of another run.
  std::shared_ptr<std::optional<std::int64_t>> other_ns_ = std::make_shared<std::optional<std::int64_t>>();
};

}  // namespace bevel::nodes
