// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One image of one camera, with the time of its exposure.
#include <cstdint>
#include <opencv2/core.hpp>

namespace bevel::camera {

/// One image of one camera.
struct Frame {
  int64_t capture_utime = 0;  ///< time of exposure, us since the epoch; not the time of arrival
  int64_t seq = 0;            ///< number of the frame of this camera; a gap is a lost frame
  int32_t camera = 0;         ///< camera number, as in tip_measurement_t
  cv::Mat gray;               ///< brightness, CV_8UC1, row 0 at the top
  /// No time of exposure is available: capture_utime is the time of arrival, which is delayed by an unknown time.
  bool stamped_on_arrival = false;
};

}  // namespace bevel::camera
