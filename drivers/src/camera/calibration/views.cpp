// SPDX-License-Identifier: MIT
// How many different views of the board there are: repeated ones, and orientations of the board.
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include <bevel/drivers/camera/calibration/calibrate.hpp>
#include "camera/calibration/number_text.hpp"

namespace bevel::camera {
namespace {

// Root mean square displacement of the corners that both sightings have, px; nothing if those are less than half.
std::optional<double> displacement_px(const Sighting& a, const Sighting& b) {
  double squares = 0.0;
  size_t common = 0;
  for (size_t i = 0; i < a.ids.size(); ++i) {
    const auto j = static_cast<size_t>(std::ranges::find(b.ids, a.ids[i]) - b.ids.begin());
    if (j == b.ids.size()) continue;
    const cv::Point2d off = a.px[i] - b.px[j];
    squares += off.dot(off);
    ++common;
  }
  if (common == 0 || 2 * common < std::max(a.ids.size(), b.ids.size())) return std::nullopt;
  return std::sqrt(squares / static_cast<double>(common));
}

}  // namespace

Copies leave_out_copies(const CalibrationInput& input, std::vector<Shot>& shots, std::vector<LeftOut>& left_out) {
  Copies copies(input.numbers.size());
  for (size_t c = 0; c < input.numbers.size(); ++c) {
    const double allowed_px = kSameViewShare * input.sizes_px[c].width;
    for (size_t s = 0; s < shots.size(); ++s) {
      Sighting& seen = shots[s].seen[c];
      for (size_t t = 0; t < s && !seen.ids.empty(); ++t) {
        if (shots[t].immersed != shots[s].immersed) continue;
        const auto off_px = displacement_px(shots[t].seen[c], seen);
        if (!off_px || *off_px >= allowed_px) continue;
        left_out.push_back({shots[s].name + " (camera " + std::to_string(input.numbers[c]) + ")",
                            "the board is where it is in '" + shots[t].name + "': its corners differ by " +
                                number_text(std::round(100.0 * *off_px) / 100.0) + " px RMS, allowed: " +
                                number_text(allowed_px) + " px or more; move and turn the board between pictures"});
        seen = {};
        ++copies[c][shots[s].immersed ? 1 : 0];
      }
    }
  }
  return copies;
}

int distinct_tilts(const std::vector<Shot>& shots, const Rig& rig, size_t camera) {
  const double allowed = std::cos(kDistinctTilt_deg * CV_PI / 180.0);
  std::vector<cv::Vec3d> normals;
  for (size_t s = 0; s < shots.size(); ++s) {
    if (shots[s].seen[camera].ids.empty()) continue;
    const cv::Matx33d R = rig.boards[s].R();
    const cv::Vec3d normal(R(0, 2), R(1, 2), R(2, 2));
    if (std::ranges::all_of(normals, [&](const cv::Vec3d& n) { return n.dot(normal) < allowed; }))
      normals.push_back(normal);
  }
  return static_cast<int>(normals.size());
}

}  // namespace bevel::camera
