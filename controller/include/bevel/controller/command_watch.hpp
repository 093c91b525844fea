// SPDX-License-Identifier: MIT
#pragma once
// What was commanded of late, for the judgement of what the axes report: a report is judged by the commands of its own
// time, however late it arrives. Rates in mm/s and rad/s, times in microseconds of the one clock that stamps both.
#include <array>
#include <cstddef>
#include <cstdint>

#include <bevel/controller/steering_law.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::controller {

class CommandWatch {
 public:
  void restart() { count_ = 0; }
  void remember(std::int64_t utime, const Rates& commanded) { past_[count_++ % kRoom] = {utime, commanded}; }

  // By how much the reported rates lie outside all that was in force from delay_s before the report until now: an axis
  // may do any of it. Zeros where nothing was commanded yet.
  Rates excess(const model::ActuatorState& report, double delay_s) const;

  // Nothing but rest was commanded in the last for_s, and something was.
  bool told_to_rest(std::int64_t now_utime, double for_s) const;

 private:
  struct Past {
    std::int64_t utime;
    Rates commanded;
  };
  // At the shortest period, 2 ms, the delay of the axes and the age that a report may have are 100.
  static constexpr std::size_t kRoom = 256;
  std::size_t kept() const { return count_ < kRoom ? count_ : kRoom; }
  const Past& newest(std::size_t i) const { return past_[(count_ - 1 - i) % kRoom]; }

  std::array<Past, kRoom> past_{};
  std::size_t count_ = 0;
};

}  // namespace bevel::controller
