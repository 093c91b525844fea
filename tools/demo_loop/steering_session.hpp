// SPDX-License-Identifier: MIT
#pragma once
// The operator program of one insertion: records everything on LCM to a log, arms and starts as soon as the processes
// are ready, prints progress and recognises the end. One loop does all of it, the operator's heartbeat included: when
// the log cannot be written or blocks, the heartbeat ends and bevel-controller stops the needle.
#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>

#include <bevel/io/log_writer.hpp>
#include <bevel/nodes/operator_heartbeat.hpp>
#include <bevel/nodes/operator_words.hpp>
#include <bevel/nodes/runtime.hpp>

namespace bevel::tools {

/// Returns whether the reason of bevel-controller's status (process_status_t.reason) reports an arrival, or a miss.
bool reports_arrival(const std::string& reason);
bool reports_miss(const std::string& reason);

class SteeringSession {
 public:
  /// @param tolerance_mm largest miss that counts as an arrival, mm; 0: the controller's configured one.
  /// @param retract_to_mm inserted depth, mm, to which the needle is retracted after the outcome is reported.
  SteeringSession(lcm::LCM& lcm, const std::string& log_path, const Eigen::Vector3d& target_mm, double tolerance_mm,
                  std::optional<double> retract_to_mm = {});
  ~SteeringSession();

  /// at_depth: the controller has reported an outcome, an arrival or a miss, and a retraction is complete.
  enum class Progress { going_on, at_depth, stopped };
  // Call about every 10 ms.
  Progress step(const nodes::Now& now);
  // The operator's stop, sent also when the session ends early.
  void stop();
  /// Outcome that the controller reports at the depth of the target, with the miss, its uncertainty and the tolerance;
  /// empty before.
  const std::string& outcome() const { return outcome_; }
  // Why the log cannot be written any more; "" while it can. The needle is stopped then: what is not recorded is lost.
  const std::string& log_failure() const { return log_failure_; }
  // Why the needle was stopped, or what is still waited for.
  std::string reason() const;
  void close_log();  // throws what is wrong with it
  void tell_time(const nodes::Now& now) { port_.tell_time(now); }

 private:
  void on_any(const lcm::ReceiveBuffer* buffer, const std::string& channel);
  void say(nodes::Word word);
  void say(nodes::Word word, const Eigen::Vector3d& position_mm);
  Progress draw_back(const nodes::Now& now);
  void print_progress(const nodes::Now& now);
  /// Returns the newest state of \p process; nothing before its first status.
  std::optional<io::ProcessState> state_of(const std::string& process) const;
  std::string state_text(const std::string& process) const;
  std::int64_t session_of(const std::string& process) const;

  lcm::LCM& lcm_;
  nodes::LcmPort port_;
  nodes::OperatorHeartbeat heartbeat_;
  io::LogWriter log_;
  lcm::Subscription* everything_;
  Eigen::Vector3d target_mm_;
  double tolerance_mm_;
  std::optional<double> retract_to_mm_;
  std::string outcome_;
  bool retracting_seen_ = false;
  std::map<std::string, process_status_t> processes_;
  std::optional<needle_state_t> estimate_;
  std::optional<needle_state_t> truth_;
  std::optional<double> inserted_mm_;
  std::int64_t start_ns_ = 0;
  std::int64_t next_word_ns_ = 0;
  std::int64_t next_print_ns_ = 0;
  std::int64_t at_depth_ns_ = 0;
  std::int64_t seq_ = 0;
  bool steering_seen_ = false;
  std::string log_failure_;
};

}  // namespace bevel::tools
