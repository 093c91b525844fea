// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/drive_units.hpp>

#include <cmath>
#include <numbers>

namespace bevel::stepper {
namespace {

// Notation indices of CiA 303-2. A unit object holds, from its highest byte: the exponent of ten, numerator, divisor.
constexpr std::uint8_t kDimensionless = 0x00;
constexpr std::uint8_t kMetre = 0x01;
constexpr std::uint8_t kRadian = 0x10;
constexpr std::uint8_t kDegree = 0x41;
constexpr std::uint8_t kRevolution = 0xB4;
constexpr std::uint8_t kIncrement = 0xB5;
constexpr std::uint8_t kSecond = 0x03;
constexpr std::uint8_t kMinute = 0x47;
constexpr std::uint8_t kHour = 0x48;
constexpr std::uint8_t kSecondSquared = 0x57;

constexpr double kSameScale = 1e-6;  // relative; ratios of integers are exact to rounding

struct UnitCode {
  explicit UnitCode(std::uint32_t code)
      : power(std::pow(10.0, static_cast<std::int8_t>(code >> 24))),
        numerator(static_cast<std::uint8_t>(code >> 16)),
        divisor(static_cast<std::uint8_t>(code >> 8)) {}
  double power;
  std::uint8_t numerator;
  std::uint8_t divisor;
};

std::optional<double> seconds_of(std::uint8_t divisor) {
  switch (divisor) {
    case kSecond:
      return 1.0;
    case kMinute:
      return 60.0;
    case kHour:
      return 3600.0;
    default:
      return std::nullopt;
  }
}

// Counts are the drive's position units: increments, unless 0x60A8 names another unit.
bool is_counts(std::uint8_t numerator) { return numerator == kIncrement || numerator == kDimensionless; }

std::optional<double> revolutions_of(std::uint8_t numerator, double counts_per_revolution) {
  switch (numerator) {
    case kRevolution:
      return 1.0;
    case kDegree:
      return 1.0 / 360.0;
    case kRadian:
      return 0.5 / std::numbers::pi;
    case kIncrement:
    case kDimensionless:
      if (counts_per_revolution > 0.0) return 1.0 / counts_per_revolution;
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

std::optional<double> ratio(const std::optional<std::uint32_t> (&pair)[2]) {
  if (!pair[0] || !pair[1] || *pair[0] == 0 || *pair[1] == 0) return std::nullopt;
  return static_cast<double>(*pair[0]) / static_cast<double>(*pair[1]);
}

// Position counts in one revolution of the shaft, as the drive states them.
std::optional<double> stated_counts_per_revolution(const StatedUnits& stated) {
  if (const auto feed = ratio(stated.feed)) return feed;
  const auto encoder = ratio(stated.encoder);
  if (!encoder) return std::nullopt;
  return *encoder * ratio(stated.gear).value_or(1.0);
}

class Decider {
 public:
  Decider(const StatedUnits& stated, const AxisConfig& axis)
      : stated_(stated), axis_(axis), position_(stated.position_unit.value_or(0)) {}

  UnitDecision decide() {
    const std::uint32_t stated = stated_.velocity_unit.value_or(0);
    const auto configured = static_cast<std::uint32_t>(axis_.velocity_unit);
    if (stated != 0 && configured != 0 && stated != configured)
      return refuse(StopReason::unit_contradicts, {0x60A9, 0}, stated);
    const bool is_by_factor = stated == 0 && stated_.factor[0];  // counts/s
    if (is_by_factor && configured != 0 && axis_.velocity_unit != VelocityUnit::counts_per_s)
      return refuse(StopReason::unit_contradicts, {0x6096, 1}, *stated_.factor[0]);
    if (!factor_is_one()) return refuse(StopReason::unit_unsupported, {0x6096, 1}, stated_.factor[0].value_or(0));
    const std::uint32_t velocity = stated != 0 ? stated : configured;
    if (velocity == 0 && !stated_.factor[0]) return refuse(StopReason::unit_unstated, {0x60A9, 0}, 0);
    if (velocity != 0 && !convert(velocity, {0x60A9, 0}, false, decision_.scales.velocity_per_count_s))
      return decision_;
    decision_.scales.acceleration_per_count_s2 = decision_.scales.velocity_per_count_s;
    const std::uint32_t acceleration = stated_.acceleration_unit.value_or(0);
    if (acceleration != 0) convert(acceleration, {0x60AA, 0}, true, decision_.scales.acceleration_per_count_s2);
    return decision_;
  }

 private:
  UnitDecision refuse(StopReason reason, cia301::ObjectAddress object, std::uint32_t found) {
    decision_.refusal = reason;
    decision_.object = object;
    decision_.found = found;
    return decision_;
  }

  // How the two terms of another factor act differs between makers.
  bool factor_is_one() const {
    return !stated_.factor[0] || (stated_.factor[0] == 1U && stated_.factor[1].value_or(1) == 1U);
  }

  // Sets how many of the units `code` one count per second (squared) has. False: refused.
  bool convert(std::uint32_t code, cia301::ObjectAddress object, bool squared, double& scale) {
    const UnitCode unit(code);
    const auto seconds = squared ? squared_seconds(unit.divisor) : seconds_of(unit.divisor);
    if (!seconds) return refuse(StopReason::unit_unsupported, object, code), false;
    const bool same =
        unit.numerator == position_.numerator || (is_counts(unit.numerator) && is_counts(position_.numerator));
    if (same) {
      scale = position_.power / unit.power * *seconds;
      return true;
    }
    const bool needs_counts = is_counts(unit.numerator) || is_counts(position_.numerator);
    if (unit.numerator == kMetre || position_.numerator == kMetre)
      return refuse(StopReason::unit_unsupported, object, code), false;
    if (needs_counts && axis_.counts_per_revolution == 0.0)
      return refuse(StopReason::unit_needs_revolution, object, code), false;
    const auto stated = stated_counts_per_revolution(stated_);
    if (needs_counts && stated && std::abs(*stated - axis_.counts_per_revolution) > kSameScale * *stated) {
      const bool by_feed = ratio(stated_.feed).has_value();
      const auto& term = by_feed ? stated_.feed[0] : stated_.encoder[0];
      return refuse(StopReason::unit_contradicts, {static_cast<std::uint16_t>(by_feed ? 0x6092 : 0x608F), 1}, *term),
             false;
    }
    const auto unit_revolutions = revolutions_of(unit.numerator, axis_.counts_per_revolution);
    const auto position_revolutions = revolutions_of(position_.numerator, axis_.counts_per_revolution);
    if (!unit_revolutions || !position_revolutions) return refuse(StopReason::unit_unsupported, object, code), false;
    scale = position_.power * *position_revolutions / (unit.power * *unit_revolutions) * *seconds;
    return true;
  }

  // An acceleration's divisor is a time squared, or the divisor of the velocity, whose unit it then is per second.
  static std::optional<double> squared_seconds(std::uint8_t divisor) {
    return divisor == kSecondSquared ? 1.0 : seconds_of(divisor);
  }

  const StatedUnits& stated_;
  const AxisConfig& axis_;
  UnitCode position_;
  UnitDecision decision_{};
};

}  // namespace

std::optional<std::uint32_t>* StatedUnits::find(cia301::ObjectAddress object) {
  const bool is_pair = object.sub == 1 || object.sub == 2;
  const std::size_t term = object.sub == 2 ? 1 : 0;
  switch (object.index) {
    case 0x60A8:
      return &position_unit;
    case 0x60A9:
      return &velocity_unit;
    case 0x60AA:
      return &acceleration_unit;
    case 0x6096:
      return is_pair ? &factor[term] : nullptr;
    case 0x6092:
      return is_pair ? &feed[term] : nullptr;
    case 0x6091:
      return is_pair ? &gear[term] : nullptr;
    case 0x608F:
      return is_pair ? &encoder[term] : nullptr;
    default:
      return nullptr;
  }
}

UnitDecision scales_of(const StatedUnits& stated, const AxisConfig& axis) { return Decider(stated, axis).decide(); }

}  // namespace bevel::stepper
