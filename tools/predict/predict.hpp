#pragma once
// bevel-predict without its command line: a model file and a log in, the path as the cameras would report it out.
#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "model/effects/open_loop.hpp"

namespace bevel::predict {

struct Prediction {
  std::int64_t utime = 0;  // of the measurement, us since the epoch
  Eigen::Vector3d position_mm;
};

// One per measurement, in their order, which need not be that of time; the order of the actuator samples is free too.
// Throws std::invalid_argument for too few of either, std::domain_error where the needle leaves the slip law's domain.
std::vector<Prediction> predict(const model::AugmentedNeedle& needle, std::span<const model::ActuatorState> actuators,
                                std::span<const model::TipMeasurement> tips);

// All of it; returns the exit status: 3 for a damaged log, whose readable part is predicted all the same.
int run(const std::string& model_path, const std::string& log_path, std::ostream& out, std::ostream& err);

}  // namespace bevel::predict
