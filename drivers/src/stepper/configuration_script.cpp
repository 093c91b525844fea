// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/configuration_script.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

namespace bevel::stepper {
namespace {

using cia301::ObjectAddress;
using Kind = SdoJob::Kind;
using Optional = SdoJob::Optional;
using Quantity = SdoJob::Quantity;

constexpr std::uint32_t kPdoOff = 0x80000000;
constexpr std::uint32_t kNoRtr = 0x40000000;      // bit 30 of a TPDO's COB-ID: not requested by remote frames
constexpr std::uint32_t kCobIdMask = 0x800007FF;  // switched off, and the identifier
constexpr std::uint32_t kEverySync = 1;
constexpr std::uint32_t kOnReception = 255;
constexpr std::uint32_t kMilliseconds = 0xFD;  // of 0x60C2:2: ten to the power of -3

struct Mapped {
  std::uint16_t index;
  std::uint8_t bits;
};

std::uint32_t mask_of(std::uint8_t size_bytes) { return size_bytes == 4 ? 0xFFFFFFFFU : (1U << (8 * size_bytes)) - 1; }

SdoJob write_job(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value) {
  SdoJob job;
  job.object = object;
  job.size_bytes = size_bytes;
  job.value = value & mask_of(size_bytes);
  job.mask = mask_of(size_bytes);
  return job;
}

SdoJob monitored_job(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value,
                     Optional optional = Optional::no) {
  SdoJob job = write_job(object, size_bytes, value);
  job.optional = optional;
  job.monitored = true;
  return job;
}

class Script {
 public:
  SdoJob& add(const SdoJob& job) {
    jobs_.push_back(job);
    return jobs_.back();
  }
  void write(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value, Optional optional = Optional::no) {
    add(write_job(object, size_bytes, value)).optional = optional;
  }
  SdoJob& set(ObjectAddress object, std::uint8_t size_bytes, std::uint32_t value, Optional optional = Optional::no) {
    return add(monitored_job(object, size_bytes, value, optional));
  }
  void set_quantity(ObjectAddress object, Quantity quantity, double amount_counts) {
    SdoJob& job = set(object, 4, 0, Optional::may_be_fixed);
    job.quantity = quantity;
    job.amount_counts = amount_counts;
  }
  void expect(ObjectAddress object, std::uint32_t value, std::uint32_t mask, StopReason otherwise,
              Optional optional = Optional::no, Kind kind = Kind::expect) {
    SdoJob job;
    job.kind = kind;
    job.object = object;
    job.value = value;
    job.mask = mask;
    job.otherwise = otherwise;
    job.optional = optional;
    add(job);
  }
  void read(ObjectAddress object) {
    SdoJob job;
    job.kind = Kind::read;
    job.object = object;
    job.optional = Optional::any;
    job.monitored = true;
    add(job);
  }

  // The COB-ID of a TPDO is tried with bit 30, which some drives demand, then without.
  void map_pdo(std::uint16_t communication, std::uint16_t mapping, std::uint32_t cob_id, std::uint32_t type,
               std::initializer_list<Mapped> objects) {
    const bool transmits = communication >= 0x1800;
    const auto set_cob_id = [&](std::uint32_t value, bool monitored) {
      SdoJob& job = add(write_job({communication, 1}, 4, transmits ? value | kNoRtr : value));
      if (transmits) job.fallback = value;
      job.mask = kCobIdMask;
      job.monitored = monitored;
    };
    set_cob_id(cob_id | kPdoOff, false);
    write({mapping, 0}, 1, 0);
    std::uint8_t n = 0;
    for (const auto& object : objects)
      set({mapping, ++n}, 4, static_cast<std::uint32_t>(object.index) << 16 | object.bits);
    set({mapping, 0}, 1, n);
    set({communication, 2}, 1, type);
    set_cob_id(cob_id, true);
  }

  std::vector<SdoJob> take() { return std::move(jobs_); }

 private:
  std::vector<SdoJob> jobs_;
};

// A velocity factor of 1:1 makes velocities position units per second; how other terms act differs between makers.
void settle_units(Script& script) {
  for (const std::uint8_t term : {std::uint8_t{1}, std::uint8_t{2}}) script.write({0x6096, term}, 4, 1, Optional::any);
  for (const std::uint16_t index : {std::uint16_t{0x60A8}, std::uint16_t{0x60A9}, std::uint16_t{0x60AA}})
    script.read({index, 0});
  for (const std::uint16_t index :
       {std::uint16_t{0x6096}, std::uint16_t{0x6092}, std::uint16_t{0x6091}, std::uint16_t{0x608F}})
    for (const std::uint8_t term : {std::uint8_t{1}, std::uint8_t{2}}) script.read({index, term});
  SdoJob decide;
  decide.kind = Kind::decide_units;
  script.add(decide);
}

constexpr double kFirstPosition = std::numeric_limits<std::int32_t>::min();
constexpr double kLastPosition = std::numeric_limits<std::int32_t>::max();

}  // namespace

bool SdoJob::accepts_abort(std::uint32_t abort_code) const {
  const bool lacks = abort_code == cia301::kAbortNoObject || abort_code == cia301::kAbortNoSubIndex;
  switch (optional) {
    case Optional::no:
      return false;
    case Optional::may_lack:
      return lacks;
    case Optional::may_be_fixed:
      return lacks || abort_code == cia301::kAbortReadOnly;
    case Optional::any:
      return true;
  }
  return false;
}

std::array<SdoJob, kLimitJobs> limit_jobs(const AxisConfig& axis, const DriveLimits& limits, std::int64_t zero_counts) {
  constexpr ObjectAddress kMin{0x607D, 1}, kMax{0x607D, 2};
  const auto position = [&](double unit) {
    const double counts = std::round(static_cast<double>(zero_counts) + unit * axis.counts_per_unit);
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::clamp(counts, kFirstPosition, kLastPosition)));
  };
  const bool turned = axis.counts_per_unit < 0.0;
  const std::uint32_t low = position(turned ? limits.max_unit : limits.min_unit);
  const std::uint32_t high = position(turned ? limits.min_unit : limits.max_unit);
  const bool configured = axis.drive_position_min_unit || axis.drive_position_max_unit;
  const Optional optional = configured ? Optional::no : Optional::any;
  SdoJob room = write_job(kMax, 4, static_cast<std::uint32_t>(kLastPosition));  // for the lower one
  room.optional = Optional::any;
  return {room, monitored_job(kMin, 4, low, optional), monitored_job(kMax, 4, high, optional)};
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
  script.expect({0x6502, 0}, mode_bit, mode_bit, StopReason::wrong_device, Optional::may_lack);
  settle_units(script);

  // Each side monitors the other. If our heartbeat ends, the drive quick-stops and leaves NMT operational, so that a
  // driver that returns has to start it anew. A drive that cannot quick-stop on it may switch its power stage off.
  script.set({0x1017, 0}, 2, static_cast<std::uint32_t>(config.drive_heartbeat_ns / kMs));
  script.set({0x1016, 1}, 4,
             static_cast<std::uint32_t>(config.master_id) << 16 |
                 static_cast<std::uint32_t>(config.master_heartbeat_timeout_ns / kMs));
  script.set({0x1029, 1}, 1, 0, Optional::any);
  constexpr std::uint32_t kQuickStopOnLoss = 3, kDisableVoltageOnLoss = 2;
  script.set({0x6007, 0}, 2, kQuickStopOnLoss, Optional::may_lack).fallback = kDisableVoltageOnLoss;

  script.map_pdo(0x1400, 0x1600, cia301::rpdo1_id(node), cyclic ? kEverySync : kOnReception,
                 {{0x6040, 16}, {0x60FF, 32}});
  script.map_pdo(0x1800, 0x1A00, cia301::tpdo1_id(node), kEverySync, {{0x6041, 16}, {0x606C, 32}});
  script.map_pdo(0x1801, 0x1A01, cia301::tpdo2_id(node), kEverySync, {{0x6064, 32}, {0x6061, 8}});

  script.set({0x605A, 0}, 2, static_cast<std::uint16_t>(config.quick_stop_option), Optional::may_be_fixed);
  script.set({0x605E, 0}, 2, 2, Optional::any);  // fault: quick-stop ramp, then no torque
  const double counts = std::abs(axis.counts_per_unit);
  if (axis.following_error_unit > 0.0) {
    script.set({0x6065, 0}, 4, static_cast<std::uint32_t>(std::lround(axis.following_error_unit * counts)));
    script.set({0x6066, 0}, 2, static_cast<std::uint32_t>(config.following_error_ns / kMs));
  }
  script.set_quantity({0x607F, 0}, Quantity::velocity, axis.rate_limit_unit_s * counts);
  script.set_quantity({0x6083, 0}, Quantity::acceleration, axis.acceleration_unit_s2 * counts);
  script.set_quantity({0x6084, 0}, Quantity::acceleration, axis.acceleration_unit_s2 * counts);
  script.set_quantity({0x6085, 0}, Quantity::acceleration, axis.quick_stop_unit_s2 * counts);
  if (cyclic) {
    script.set({0x60C2, 1}, 1, static_cast<std::uint32_t>(config.period_ns / kMs), Optional::any);
    script.set({0x60C2, 2}, 1, kMilliseconds, Optional::any);
  }
  script.write({0x60FF, 0}, 4, 0);
  script.write({0x6060, 0}, 1, mode);
  // Some drives show their mode only while they are enabled: nothing moves before it is shown then.
  script.expect({0x6061, 0}, mode, 0xFF, StopReason::wrong_mode, Optional::no, Kind::expect_eventually);
  return script.take();
}

}  // namespace bevel::stepper
