// SPDX-License-Identifier: MIT
#pragma once
// One picture of one camera, with the time at which the light fell in.
#include <cstdint>
#include <opencv2/core.hpp>

namespace bevel::camera {

struct Frame {
  int64_t capture_utime = 0;        ///< microseconds since the epoch, of exposure, never of arrival
  int64_t seq = 0;                  ///< counts frames of this camera; a gap is a lost frame
  int32_t camera = 0;               ///< which camera, as in tip_measurement_t
  cv::Mat gray;                     ///< CV_8UC1, row 0 at the top
  bool stamped_on_arrival = false;  ///< nothing told when light fell in: capture_utime is late by an unknown time
};

}  // namespace bevel::camera
