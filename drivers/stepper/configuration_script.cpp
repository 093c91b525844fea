#include "drivers/stepper/configuration_script.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

namespace bevel::stepper {
namespace {

using cia301::ObjectAddress;
using Kind = SdoJob::Kind;

constexpr std::uint32_t kPdoOff = 0x80000000;
constexpr std::uint32_t kCobIdMask = 0x800007FF;  // switched off, and the identifier
constexpr std::uint32_t kEverySync = 1;
constexpr std::uint32_t kOnReception = 255;
constexpr std::uint32_t kMilliseconds = 0xFD;  // of 0x60C2:2: ten to the power of -3

struct Mapped {
  std::uint16_t index;
  std::uint8_t bits;
};

class Script {
 public:
  void write(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value) {
    jobs_.push_back({Kind::write, object, size_bytes, value});
  }
  void write_if_present(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value) {
    jobs_.push_back({Kind::write_if_present, object, size_bytes, value});
  }
  void expect(ObjectAddress object, std::uint32_t value, std::uint32_t mask = 0xFFFFFFFF,
              StopReason otherwise = StopReason::configuration_failed, Kind kind = Kind::expect) {
    jobs_.push_back({kind, object, 4, value, mask, otherwise});
  }
  void write_and_check(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value) {
    write(object, size_bytes, value);
    expect(object, value, size_bytes == 4 ? 0xFFFFFFFFU : (1U << (8 * size_bytes)) - 1);
  }

  void map_pdo(std::uint16_t communication, std::uint16_t mapping, std::uint32_t cob_id, std::uint32_t type,
               std::initializer_list<Mapped> objects) {
    write({communication, 1}, 4, cob_id | kPdoOff);
    write({mapping, 0}, 1, 0);
    std::uint8_t n = 0;
    for (const auto& object : objects)
      write_and_check({mapping, ++n}, 4, static_cast<std::uint32_t>(object.index) << 16 | object.bits);
    write_and_check({mapping, 0}, 1, n);
    write_and_check({communication, 2}, 1, type);
    write({communication, 1}, 4, cob_id);
    expect({communication, 1}, cob_id, kCobIdMask);
  }

  std::vector<SdoJob> take() { return std::move(jobs_); }

 private:
  std::vector<SdoJob> jobs_;
};

// Velocities travel as position units per second: drives whose maker set rpm are told, or refused. How the two terms of
// the factor act differs between makers, except where both are 1.
void set_velocity_unit(Script& script) {
  for (const std::uint8_t term : {std::uint8_t{1}, std::uint8_t{2}}) {
    script.write_if_present({0x6096, term}, 4, 1);
    script.expect({0x6096, term}, 1, 0xFFFFFFFF, StopReason::configuration_failed, Kind::expect_if_present);
  }
}

std::uint32_t counts(double units, double counts_per_unit) {
  return static_cast<std::uint32_t>(std::lround(units * std::abs(counts_per_unit)));
}

constexpr double kFirstPosition = std::numeric_limits<std::int32_t>::min();
constexpr double kLastPosition = std::numeric_limits<std::int32_t>::max();

}  // namespace

std::array<SdoJob, kLimitJobs> limit_jobs(const AxisConfig& axis, const DriveLimits& limits, std::int64_t zero_counts) {
  constexpr ObjectAddress kMin{0x607D, 1}, kMax{0x607D, 2};
  const auto position = [&](double unit) {
    const double counts = std::round(static_cast<double>(zero_counts) + unit * axis.counts_per_unit);
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::clamp(counts, kFirstPosition, kLastPosition)));
  };
  const bool turned = axis.counts_per_unit < 0.0;
  const std::uint32_t low = position(turned ? limits.max_unit : limits.min_unit);
  const std::uint32_t high = position(turned ? limits.min_unit : limits.max_unit);
  const bool asked_for = axis.drive_position_min_unit || axis.drive_position_max_unit;
  const Kind write = asked_for ? Kind::write : Kind::write_if_present;
  const Kind expect = asked_for ? Kind::expect : Kind::expect_if_present;
  return {SdoJob{Kind::write_if_present, kMax, 4, static_cast<std::uint32_t>(kLastPosition)},  // room for the lower one
          SdoJob{write, kMin, 4, low}, SdoJob{write, kMax, 4, high}, SdoJob{expect, kMin, 4, low},
          SdoJob{expect, kMax, 4, high}};
}

std::vector<SdoJob> configuration_script(const StepperConfig& config, std::size_t index) {
  const AxisConfig& axis = config.axes.at(index);
  const std::uint8_t node = axis.node_id;
  Script script;

  script.expect({0x1000, 0}, 402, 0xFFFF, StopReason::wrong_device);
  const std::array<std::uint32_t, 4> identity{axis.vendor_id, axis.product_code, axis.revision, axis.serial};
  for (std::size_t i = 0; i < identity.size(); ++i)
    if (identity.at(i) != 0)
      script.expect({0x1018, static_cast<std::uint8_t>(i + 1)}, identity.at(i), 0xFFFFFFFF, StopReason::wrong_device);
  const auto mode = static_cast<std::uint32_t>(config.mode);
  const bool cyclic = config.mode == VelocityMode::cyclic;
  const std::uint32_t mode_bit = 1U << (mode - 1);
  script.expect({0x6502, 0}, mode_bit, mode_bit, StopReason::wrong_device);
  set_velocity_unit(script);

  // Each side watches the other. On our silence the drive quick-stops and leaves NMT operational, so that a driver that
  // comes back has to start it anew.
  script.write_and_check({0x1017, 0}, 2, static_cast<std::uint32_t>(config.drive_heartbeat_ns / kMs));
  script.write_and_check({0x1016, 1}, 4,
                         static_cast<std::uint32_t>(config.master_id) << 16 |
                             static_cast<std::uint32_t>(config.master_heartbeat_timeout_ns / kMs));
  script.write_if_present({0x1029, 1}, 1, 0);
  script.write_and_check({0x6007, 0}, 2, 3);

  script.map_pdo(0x1400, 0x1600, cia301::rpdo1_id(node), cyclic ? kEverySync : kOnReception,
                 {{0x6040, 16}, {0x60FF, 32}});
  script.map_pdo(0x1800, 0x1A00, cia301::tpdo1_id(node), kEverySync, {{0x6041, 16}, {0x606C, 32}});
  script.map_pdo(0x1801, 0x1A01, cia301::tpdo2_id(node), kEverySync, {{0x6064, 32}, {0x6061, 8}});

  script.write_and_check({0x605A, 0}, 2, static_cast<std::uint16_t>(config.quick_stop_option));
  script.write_if_present({0x605E, 0}, 2, 2);  // fault: quick-stop ramp, then no torque
  if (axis.following_error_unit > 0.0) {
    script.write({0x6065, 0}, 4, counts(axis.following_error_unit, axis.counts_per_unit));
    script.write({0x6066, 0}, 2, static_cast<std::uint32_t>(config.following_error_ns / kMs));
  }
  script.write_if_present({0x607F, 0}, 4, counts(axis.rate_limit_unit_s, axis.counts_per_unit));
  script.write({0x6083, 0}, 4, counts(axis.acceleration_unit_s2, axis.counts_per_unit));
  script.write({0x6084, 0}, 4, counts(axis.acceleration_unit_s2, axis.counts_per_unit));
  script.write({0x6085, 0}, 4, counts(axis.quick_stop_unit_s2, axis.counts_per_unit));
  if (cyclic) {
    script.write_if_present({0x60C2, 1}, 1, static_cast<std::uint32_t>(config.period_ns / kMs));
    script.write_if_present({0x60C2, 2}, 1, kMilliseconds);
  }
  script.write({0x60FF, 0}, 4, 0);
  script.write({0x6060, 0}, 1, mode);
  script.expect({0x6061, 0}, mode, 0xFF, StopReason::wrong_mode, Kind::expect_eventually);
  return script.take();
}

}  // namespace bevel::stepper
