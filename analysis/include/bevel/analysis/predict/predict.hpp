// SPDX-License-Identifier: MIT
#pragma once
// bevel-predict without its command line: a model file and a log in, the path as the cameras would report it out, with
// how far off it is to be expected where the model file says what is uncertain.
#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include <bevel/io/model_file.hpp>
#include <bevel/model/effects/open_loop.hpp>

namespace bevel::analysis {

struct Prediction {
  std::int64_t utime = 0;  // of the measurement, us since the epoch
  Eigen::Vector3d position_mm;
};

// One per measurement, in their order, which need not be that of time; the order of the actuator samples is free too.
// Throws ArgumentError for too few of either, DomainError where the needle leaves the slip law's domain.
std::vector<Prediction> predict(const model::AugmentedNeedle& needle, std::span<const model::ActuatorState> actuators,
                                std::span<const model::TipMeasurement> tips);

// Standard deviations (mm, along the axes of {A}) of those predictions, in the same order: by the file's [variation]
// and by the standard errors of its [[discrepancy]]s, linearised. Throws as predict().
std::vector<Eigen::Vector3d> standard_deviations_mm(const io::ModelFile& model, const std::string& log_path,
                                                    std::span<const model::ActuatorState> actuators,
                                                    std::span<const model::TipMeasurement> tips);

// Measured less predicted heading, x and y of the unit vectors in {A}: small angles about -y and x, in mrad.
struct HeadingResidual {
  std::int64_t utime = 0;  // of the measurement, us since the epoch
  double x_mrad = 0, y_mrad = 0;
};
// One per heading with status 0, in order of time. Throws as predict().
std::vector<HeadingResidual> heading_residuals(const model::AugmentedNeedle& needle,
                                               std::span<const model::ActuatorState> actuators,
                                               std::span<const model::TipHeading> headings);

// All of it; returns the exit status: 3 for a damaged log, whose readable part is predicted all the same.
int run(const std::string& model_path, const std::string& log_path, std::ostream& out, std::ostream& err);

}  // namespace bevel::analysis
