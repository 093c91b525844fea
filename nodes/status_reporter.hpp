#pragma once
// What a node says of itself on PROCESS_STATUS, about twice a second and at each change; and its session: the number
// that an operator's word must name to be meant for this run of it, as it stands since its last stop.
#include <algorithm>
#include <memory>
#include <string>

#include "nodes/lcm_port.hpp"

namespace bevel::nodes {

class StatusReporter {
 public:
  StatusReporter(LcmPort& port, std::string process, double period_s);

  std::int64_t session() const { return message_.session; }
  // Words of before are worthless from here on: to be called at each latched stop.
  void renew_session() { ++message_.session; }
  // Another run of the same process was heard on this network.
  bool name_taken() const { return *name_taken_; }

  // For a process whose steps its input drives; those of run_periodic() are measured there.
  void note_run(double run_s) { run_max_s_ = std::max(run_max_s_, run_s); }
  void note_overrun() { ++overruns_; }  // of a bound of the process's own, beside those of its loop
  // Sends when it is time or when state, reason or session changed.
  void report(const std::string& state, const std::string& reason);

 private:
  LcmPort& port_;
  process_status_t message_{};
  std::int64_t run_ = 0;  // the part of session that tells runs apart
  std::int64_t last_ns_ = 0;
  std::int64_t last_session_ = 0;
  double run_max_s_ = 0;
  std::int64_t overruns_ = 0;
  std::shared_ptr<bool> name_taken_ = std::make_shared<bool>(false);
};

}  // namespace bevel::nodes
