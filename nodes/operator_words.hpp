#pragma once
// The operator's word, STEERING_TARGET, as every node that obeys it hears it: fresh, newer than the last, meant for
// this run since its last stop. A stop or a hold is obeyed from anybody at any time.
#include <functional>
#include <string>

#include "nodes/status_reporter.hpp"

namespace bevel::nodes {

enum class Word : std::int32_t {
  stop = 0,
  arm = 1,
  start = 2,
  hold = 3,
  entry = 4,
  confirm = 5,
  follow = 6,
  way_point = 7,
  retract = 8,
  arm_to_retract = 9
};
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
