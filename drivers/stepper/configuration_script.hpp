// The list of SDO transfers that makes a drive fit for service: identity checks, supervision, PDO mapping, mode,
// limits.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/stepper/cia301.hpp"
#include "drivers/stepper/reason.hpp"
#include "drivers/stepper/stepper_config.hpp"

namespace bevel::stepper {

struct SdoJob {
  enum class Kind : std::uint8_t {
    write,
    write_if_present,  // an object that drives may leave out; an abort is accepted
    expect,            // read, (value & mask) must be `value`
    expect_if_present,
    expect_eventually,  // the same, asked again until transition_timeout_ns
  };
  Kind kind = Kind::write;
  bool writes() const { return kind == Kind::write || kind == Kind::write_if_present; }
  bool may_be_absent() const { return kind == Kind::write_if_present || kind == Kind::expect_if_present; }
  cia301::ObjectAddress object{};
  std::uint8_t size_bytes = 4;  // writes only
  std::uint32_t value = 0;
  std::uint32_t mask = 0xFFFFFFFF;
  StopReason otherwise = StopReason::configuration_failed;  // of an expectation
};

constexpr std::uint32_t code_of(cia301::ObjectAddress object) {
  return static_cast<std::uint32_t>(object.index) << 8 | object.sub;
}

// The drive's software limits (0x607D) in its position units, which are those of counts_per_unit; zero_counts: where
// the entry is in them. Whichever way the limits move, the lower one stays below the upper one, as drives demand. A
// limit set for the drive must be there and read back as written; of one that follows from the workspace a drive that
// has no 0x607D is let off, as the driver keeps the workspace by itself.
inline constexpr std::size_t kLimitJobs = 5;
std::array<SdoJob, kLimitJobs> limit_jobs(const AxisConfig& axis, const DriveLimits& limits, std::int64_t zero_counts);

// In the order of CiA 301 section 7.5.2.36 for the mapping: switched off, emptied, filled, counted, typed, switched on.
std::vector<SdoJob> configuration_script(const StepperConfig& config, std::size_t axis);

}  // namespace bevel::stepper
