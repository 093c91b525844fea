// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The operator program's heartbeat, on OPERATOR_HEARTBEAT: its sender, for operator programs, and its watch, for
/// bevel-controller.
#include <bevel/operator_heartbeat_t.hpp>
#include <string>

#include <bevel/io/sender_watch.hpp>
#include <bevel/nodes/clock_watch.hpp>

namespace bevel::nodes {

class LcmPort;

/// Sends the heartbeat of one run of an operator program. The main loop of the program calls beat(), so that the
/// heartbeat ends when that loop hangs; a separate thread would outlive the loop.
class OperatorHeartbeat {
 public:
  /// Draws the session of this run.
  /// @param port port; must outlive this
  explicit OperatorHeartbeat(LcmPort& port);

  /// Sends a heartbeat if 50 ms have passed since the last one. Call it at 20 Hz or more, after port.tell_time().
  /// @return true if a heartbeat was sent
  bool beat();

 private:
  LcmPort& port_;
  operator_heartbeat_t message_{};
  std::int64_t next_ns_ = 0;  // steady
};

/// Decides whether an operator program is alive. One program counts at a time: the first one heard, until its newest
/// heartbeat is older than the timeout and nothing moves. Heartbeats of another session are refused until then.
class OperatorWatch {
 public:
  /// Creates a watch that has received no heartbeat.
  /// @param timeout_s  largest age of the newest heartbeat, s
  explicit OperatorWatch(double timeout_s);

  /// Processes a heartbeat.
  /// @param m      message
  /// @param now    time of arrival
  /// @param moving true: the needle moves, so that the operator program cannot change
  /// @return false if the heartbeat is rejected: from a second operator program, too old, stamped in the future, or not
  /// a
  ///   continuation of its sender's stream
  bool hear(const operator_heartbeat_t& m, const Now& now, bool moving);

  /// Returns whether the newest heartbeat is younger than the timeout, by its time stamp.
  /// @param now present time
  /// @return true if an operator program counts as alive
  bool is_fresh(const Now& now) const;

  /// Describes why no operator program counts as alive, with the remedy.
  /// @param now present time
  /// @return text; "" if is_fresh(now)
  std::string problem(const Now& now) const;

  /// Describes a second operator program that was rejected within the last 5 s.
  /// @param now present time
  /// @return remark; "" if there was none
  std::string second_operator(const Now& now) const;

  /// Accepts any session next: the wall clock was set, and time stamps from before and after do not compare.
  void restart();

 private:
  std::int64_t timeout_ns_;
  io::SenderWatch stream_;
  std::int64_t session_ = 0;  // of the operator that counts; 0: none was received
  std::int64_t made_ns_ = 0;  // steady time at which its newest heartbeat was made
  // Newest heartbeat that was refused.
  io::Standing refused_as_ = io::Standing::fresh;  // fresh: none was
  double refused_age_s_ = 0;
  std::int64_t second_count_ = 0;  // heartbeats of other sessions, while one counted
  std::int64_t second_ns_ = 0;     // steady time of the newest of these
};

}  // namespace bevel::nodes
