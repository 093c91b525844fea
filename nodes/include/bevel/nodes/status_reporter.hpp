// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Publication of the state of a node on PROCESS_STATUS, twice a second and at each change.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include <bevel/io/process_state.hpp>
#include <bevel/nodes/lcm_port.hpp>

namespace bevel::nodes {

/// Publishes the state of a node and keeps its session: the number that an operator's request must carry, and that
/// changes at each latched stop.
class StatusReporter {
 public:
  /// Creates a reporter with a new session.
  /// @param port     port; must outlive this
  /// @param process  process name
  /// @param period_s period of the node's loop, s, as published; 0 if the node has none
  StatusReporter(LcmPort& port, std::string process, double period_s);

  /// @return present session
  std::int64_t session() const { return message_.session; }
  /// Changes the session, so that earlier operator commands are rejected. Call it at each latched stop.
  void renew_session() { ++message_.session; }
  /// Returns whether another run of the same process sends on this network: its newest status arrived at most 1.5 s
  /// ago, three periods of PROCESS_STATUS. The condition clears by itself when the other run is silent for longer; a
  /// stop that the node latched for it is cleared by request 1 (arm) after that.
  /// @return true if another run sends
  bool name_taken() const;

  /// Records the duration of a step that an input triggers; the steps of run_periodic() are measured there.
  /// @param run_s duration, s
  void note_run(double run_s) { run_max_s_ = std::max(run_max_s_, run_s); }
  /// Counts an overrun of a limit of the process, in addition to those of its loop.
  void note_overrun() { ++overruns_; }
  /// Publishes when a period has passed or when state, reason or session changed.
  /// @param state  state of the process
  /// @param reason reason of the state, or a remark; may be empty
  void report(io::ProcessState state, const std::string& reason);

 private:
  LcmPort& port_;
  process_status_t message_{};
  std::int64_t run_ = 0;  // the part of the session that identifies the run
  std::int64_t last_ns_ = 0;
  std::int64_t last_session_ = 0;
  double run_max_s_ = 0;
  std::int64_t overruns_ = 0;
  // Steady time of the newest status of another run.
  std::shared_ptr<std::optional<std::int64_t>> other_ns_ = std::make_shared<std::optional<std::int64_t>>();
};

}  // namespace bevel::nodes
