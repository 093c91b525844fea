// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Configuration of a drive as a sequence of SDO transfers.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/drivers/stepper/reason.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::stepper {

/// One step of a drive's configuration: an SDO transfer, or the decision on the drive's units.
struct SdoJob {
  /// Kind of the step.
  enum class Kind : std::uint8_t {
    write,              ///< writes the object
    read,               ///< a unit object (StatedUnits)
    expect,             ///< read; (value & mask) must be `value`
    expect_eventually,  ///< as expect; 0 passes too, another value is read again until transition_timeout_ns
    decide_units,       ///< no transfer: calls scales_of() on the values read; later jobs use the scales
  };
  /// Which aborts are accepted.
  enum class Optional : std::uint8_t {
    no,            ///< none
    may_lack,      ///< the drive does not have the object
    may_be_fixed,  ///< the object may be missing, or read-only with the value `value`
    any,           ///< all: the drive may ignore the object
  };
  /// Unit of `amount`. raw: `value` is written as it is.
  enum class Quantity : std::uint8_t { raw, velocity, acceleration };

  Kind kind = Kind::write;         ///< kind of the step
  cia301::ObjectAddress object{};  ///< object to read or write
  std::uint8_t size_bytes = 4;     ///< writes only
  /// Value to write or expected value; `amount_counts` replaces it for a quantity that is not raw.
  std::uint32_t value = 0;
  std::uint32_t mask = 0xFFFFFFFF;                          ///< bits of the value that are compared
  StopReason otherwise = StopReason::configuration_failed;  ///< stop reason if the value differs
  Optional optional = Optional::no;                         ///< aborts that are accepted
  bool monitored = false;                                   ///< read back after writing, and cyclically from then on
  std::optional<std::uint32_t> fallback{};                  ///< written if the drive rejects `value`
  Quantity quantity = Quantity::raw;                        ///< unit of `amount_counts`
  double amount_counts = 0.0;                               ///< counts/s or counts/s^2, for a quantity that is not raw

  /// Returns whether an abort is accepted.
  /// @param abort_code SDO abort code that the drive sent
  /// @return true if `optional` accepts the code
  bool accepts_abort(std::uint32_t abort_code) const;
};

/// Number of jobs that limit_jobs() returns.
inline constexpr std::size_t kLimitJobs = 3;
/// Returns the jobs that set the drive's software limits (0x607D), in its position units.
///
/// In whichever direction the limits move, the lower one stays below the upper one, as drives require. A limit that is
/// configured for the drive must exist and read back as written. A limit that only follows from the workspace is
/// optional, because the driver brakes for the workspace by itself.
/// @param axis        settings of the axis
/// @param limits      limits, mm or rad from the entry point; infinite: none
/// @param zero_counts position of the entry point, counts
/// @return jobs in the order in which they must run
std::array<SdoJob, kLimitJobs> limit_jobs(const AxisConfig& axis, const DriveLimits& limits, std::int64_t zero_counts);

/// Returns all jobs of one drive: identity, units, supervision, PDO mapping, ramps, mode. The mapping is in the order
/// of CiA 301 section 7.5.2.36: switched off, emptied, filled, counted, typed, switched on.
/// @param config settings of the driver
/// @param axis   kInsertion or kRotation
/// @return jobs in the order in which they must run
std::vector<SdoJob> configuration_script(const StepperConfig& config, std::size_t axis);

}  // namespace bevel::stepper
