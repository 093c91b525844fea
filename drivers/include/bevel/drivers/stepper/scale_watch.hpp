// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Detection of a wrong scale between commanded and measured travel.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace bevel::stepper {

/// Estimates by least squares how far an axis travels for each mm or rad that it is commanded to travel.
///
/// Over blocks of kBlock cycles the measured travel is regressed on the commanded travel; the lag between them is the
/// one of kLags cycles that leaves the smallest residual. A scale counts as wrong if it differs from 1 by more than
/// kTolerated and by four standard errors. FollowWatch finds large errors at once, this one small ones that add up.
/// Pure: does not allocate.
class ScaleWatch {
 public:
  /// Starts the estimation anew.
  void begin() { *this = {}; }

  /// Adds one cycle.
  /// @param commanded_unit integral of the commanded rate, mm or rad
  /// @param position_unit  measured position, mm or rad
  void add(double commanded_unit, double position_unit) {
    commanded_.at(count_ % kRoom) = commanded_unit;
    positions_.at(count_ % kRoom) = position_unit;
    if (++count_ % kBlock != 0 || count_ < kRoom) return;
    const auto before = [this](const auto& values, std::size_t cycles) {
      return values.at((count_ - 1 - cycles) % kRoom);
    };
    const double travelled = before(positions_, 0) - before(positions_, kBlock);
    ++blocks_;
    squares_ += travelled * travelled;
    for (std::size_t lag = 0; lag < kLags; ++lag) {
      const double commanded = before(commanded_, lag) - before(commanded_, lag + kBlock);
      commanded_squares_.at(lag) += commanded * commanded;
      products_.at(lag) += commanded * travelled;
    }
    path_unit_ += std::abs(travelled);
  }

  /// Returns the estimated scale if it is wrong.
  /// @return measured travel divided by commanded travel; empty if it is not wrong, or before 20 blocks and 1 mm or rad
  std::optional<double> wrong_scale() const {
    if (blocks_ < kLeastBlocks || path_unit_ < kLeastPath_unit) return std::nullopt;
    double residual = squares_, scale = 1.0, standard_error = 0.0;
    for (std::size_t lag = 0; lag < kLags; ++lag) {
      const double commanded = commanded_squares_.at(lag);
      if (commanded <= 0.0) continue;
      const double left = std::max(squares_ - products_.at(lag) * products_.at(lag) / commanded, 0.0);
      if (left > residual) continue;
      residual = left;
      scale = products_.at(lag) / commanded;
      standard_error = std::sqrt(left / (static_cast<double>(blocks_) - 1.0) / commanded);
    }
    const bool wrong = std::abs(scale - 1.0) > kTolerated + 4.0 * standard_error;
    return wrong ? std::optional(scale) : std::nullopt;
  }

 private:
  static constexpr std::size_t kBlock = 20;  // cycles: longer than the lag, shorter than a usual rotation
  static constexpr std::size_t kLags = 12;   // cycles
  static constexpr std::size_t kRoom = kBlock + kLags;
  static constexpr std::size_t kLeastBlocks = 20;  // for a standard error
  static constexpr double kLeastPath_unit = 1.0;   // mm or rad
  static constexpr double kTolerated = 0.05;       // slip, error of a screw's pitch or of a drive's rates

  std::array<double, kRoom> commanded_{}, positions_{};
  std::size_t count_ = 0;
  std::size_t blocks_ = 0;
  std::array<double, kLags> commanded_squares_{}, products_{};
  double squares_ = 0.0;
  double path_unit_ = 0.0;
};

}  // namespace bevel::stepper
