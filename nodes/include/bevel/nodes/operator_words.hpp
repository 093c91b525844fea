// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Operator commands on STEERING_TARGET, as received by each node that obeys them.
#include <functional>
#include <string>

#include <bevel/controller/request.hpp>
#include <bevel/nodes/status_reporter.hpp>

namespace bevel::nodes {

/// Operator command.
using Word = controller::Request;
/// Index of a receiver's session in steering_target_t.session.
enum class Receiver : std::size_t {
  controller = 0,  ///< bevel-controller
  stepper = 1,     ///< bevel-stepper
  estimator = 2    ///< bevel-estimator
};

/// Receives operator commands. A command counts if it is fresh, newer than the previous one, and meant for this run
/// since its last stop. A stop or a hold from any sender is obeyed at any time.
class OperatorWords {
 public:
  /// Subscribes to STEERING_TARGET.
  /// @param port     port; must outlive this
  /// @param status   reporter with the session of the node; must outlive this
  /// @param receiver node that receives
  /// @param obey     called for each command that counts
  OperatorWords(LcmPort& port, const StatusReporter& status, Receiver receiver,
                std::function<void(Word, const steering_target_t&)> obey);

  /// Describes why the newest command was not obeyed.
  /// @return reason; "" if it was obeyed, and some seconds after it was not
  std::string refusal() const;

 private:
  void hear(const steering_target_t& m);
  void refuse(const char* why);

  LcmPort& port_;
  const StatusReporter& status_;
  Receiver receiver_;
  std::function<void(Word, const steering_target_t&)> obey_;
  const char* refusal_ = "";
  std::int64_t refused_ns_ = 0;
};

}  // namespace bevel::nodes
