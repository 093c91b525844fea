// SPDX-License-Identifier: MIT
#include <bevel/controller/command_watch.hpp>

#include <algorithm>

#include <bevel/model/age.hpp>

namespace bevel::controller {

Rates CommandWatch::excess(const model::ActuatorState& report, double delay_s) const {
  if (count_ == 0) return {};
  Rates low = newest(0).commanded, high = low;
  for (std::size_t i = 0; i < kept(); ++i) {
    const Rates& r = newest(i).commanded;
    low = {std::min(low.insertion_mm_s, r.insertion_mm_s), std::min(low.rotation_rad_s, r.rotation_rad_s)};
    high = {std::max(high.insertion_mm_s, r.insertion_mm_s), std::max(high.rotation_rad_s, r.rotation_rad_s)};
    if (model::age_s(report.utime, newest(i).utime) >= delay_s) break;  // it was in force at the beginning
  }
  const auto outside = [](double value, double from, double to) { return std::max({from - value, value - to, 0.0}); };
  return {outside(report.insertion_rate_mm_s, low.insertion_mm_s, high.insertion_mm_s),
          outside(report.rotation_rate_rad_s, low.rotation_rad_s, high.rotation_rad_s)};
}

bool CommandWatch::told_to_rest(std::int64_t now_utime, double for_s) const {
  for (std::size_t i = 0; i < kept(); ++i) {
    const Rates& r = newest(i).commanded;
    if (r.insertion_mm_s != 0 || r.rotation_rad_s != 0) return false;
    if (model::age_s(now_utime, newest(i).utime) >= for_s) return true;
  }
  return false;
}

}  // namespace bevel::controller
