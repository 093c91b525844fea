#pragma once
// Why an estimate must not be trusted: the bits of needle_state_t.health. Zero is healthy.
#include <cstdint>
#include <string>

namespace bevel::estimator {

enum Health : std::int32_t {
  kHealthy = 0,
  kNoMeasurement = 1,     // none accepted since the start or the last reset
  kMeasurementStale = 2,  // the newest measurement is too old
  kActuatorStale = 4,     // the newest actuator state is too old, so the estimate is too
  kUncertain = 8,         // position variance above its bound
  kRejecting = 16,        // the gate refused more measurements in a row than outliers are
  kOutsideModel = 32,     // the pose left the domain of the slip law; propagation stopped
  kNotFromEntry = 64,     // began with the needle in the tissue: its path up to there is not known
  kCameraSilent = 128,    // a camera that was heard is heard no more
  kCameraFrozen = 256,    // a camera says the same to the last bit while the needle moves
  kInputRefused = 512,    // two senders, or motion that cannot be; until armed anew
  kUnsure = 1024,         // the gate refused the newest readings: outliers perhaps; slow down until they pass
};
// All but the doubt: an estimate with one of these must not be steered by.
constexpr std::int32_t lost(std::int32_t health) { return health & ~static_cast<std::int32_t>(kUnsure); }

std::string describe_health(std::int32_t health);

}  // namespace bevel::estimator
