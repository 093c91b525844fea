// SPDX-License-Identifier: MIT
#pragma once
// The operator's word, STEERING_TARGET, as every node that obeys it hears it: fresh, newer than the last, meant for
// this run since its last stop. A stop or a hold is obeyed from anybody at any time.
#include <functional>
#include <string>

#include <bevel/controller/request.hpp>
#include <bevel/nodes/status_reporter.hpp>

namespace bevel::nodes {

using Word = controller::Request;
// Place of a receiver's session in steering_target_t.session.
enum class Receiver : std::size_t { controller = 0, stepper = 1, estimator = 2 };

class OperatorWords {
 public:
  // `obey` is called for each word that counts. The port and status must outlive this.
  OperatorWords(LcmPort& port, const StatusReporter& status, Receiver receiver,
                std::function<void(Word, const steering_target_t&)> obey);

  // Why the newest word was not obeyed; "" if it was, and some seconds after it was not.
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
