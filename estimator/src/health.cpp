// SPDX-License-Identifier: MIT
#include <bevel/estimator/health.hpp>

namespace bevel::estimator {

std::string describe_health(std::int32_t health) {
  static constexpr std::pair<Health, const char*> kWords[] = {
      {kNoMeasurement, "no measurement yet"},
      {kMeasurementStale, "measurements stale"},
      {kActuatorStale, "actuator state stale"},
      {kUncertain, "position too uncertain"},
      {kRejecting,
       "rejecting measurements: a camera or the needle model does not match the system file; check the calibration, "
       "[needle] and [estimator.prior] bending_mm, bending_sd_mm, guide_mm (docs/steering.md)"},
      {kOutsideModel, "outside the model's domain"},
      {kNotFromEntry, "not there from the entry: retract to the entry point, or confirm"},
      {kCameraSilent, "a camera fell silent"},
      {kCameraFrozen, "a camera is frozen"},
      {kInputRefused, "input cannot be trusted"},
      {kUnsure, "unsure, newest measurements refused"},
      {kHeadingUncertain, "heading too uncertain: retract to the entry point, or measure the heading"},
      {kResetByRejects, "reset: measurements rejected one after the other"},
      {kResetByBevel, "reset: the bevel is on the other side"},
      {kResetByGap, "reset: motion of the axes was not reported for a time"},
      {kResetByRestart, "reset: begun anew"},
      {kResetByClock, "reset: the clock was set"},
  };
  std::string text;
  for (const auto& [bit, word] : kWords)
    if (health & bit) text += (text.empty() ? "" : ", ") + std::string(word);
  return text.empty() ? "healthy" : text;
}

}  // namespace bevel::estimator
