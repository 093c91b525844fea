// SPDX-License-Identifier: MIT
#pragma once
// The tracker on real frames, beside tips labelled by eye (real_tips.csv): what the test and the contact sheet share.
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <bevel/drivers/camera/frame.hpp>
#include <bevel/drivers/camera/tip_tracker.hpp>
#include "tests/camera/path_fit.hpp"

namespace bevel::test {

struct TipLabel {
  std::string set;  ///< "tuned" or "held_out"
  std::string folder, file;
  cv::Point2d tip_px;
  double across_sd_px = 1.0, along_sd_px = 2.0;  ///< the labeller's own opinion
};

/// Throws IoError naming the line that cannot be read.
std::vector<TipLabel> read_labels(const std::filesystem::path& csv);

/// What is known of these pictures and of this needle: the scale its authors state, and that labels are what an eye
/// sees.
inline constexpr double kRealPxPerMm = 5.607;
inline camera::TrackerConfig real_config() {
  camera::TrackerConfig config;
  config.tip_point = camera::TipPoint::seen;
  return config;
}

/// This needle's cut as the mean of 55 pictures of tuned folders shows it: 10 degrees at 18 gauge, and a piece of as
/// much whole shaft behind it again. For the tangent; where an eye marks the end is found better without.
inline void know_bevel(camera::TrackerConfig& config) {
  config.bevel_length_mm = 7.2;
  config.bevel_length_sd = 0.1;
  config.fit_length_mm = 20.0;
}

struct SeenFrame {
  std::string folder, file;
  cv::Mat gray;
  camera::TipResult tip;
};

/// Every folder of `root` through a tracker of its own, in natural order, one second a frame; or every frame alone,
/// through a tracker that has seen nothing else.
enum class Frames { in_sequence, alone };
std::vector<SeenFrame> track_folders(const std::filesystem::path& root, const camera::TrackerConfig& config,
                                     double px_per_mm, Frames frames = Frames::in_sequence);

/// Tips of the frames [first, last) that are ok, by the scale above; aside with the standard deviation that is claimed.
std::vector<PathTip> path_tips(const std::vector<SeenFrame>& seen, size_t first, size_t last);

/// The tangents at the tips of `axis` (tip_point "axis") against the direction from the tip before to the tip after,
/// which over 16 mm of an arc is the path's own there.
struct Headings {
  int tips = 0;
  double path_sd_rad = 0.0;                                  ///< of the path's directions about their mean
  double off_mean_rad = 0.0, off_rms_rad = 0.0;              ///< tangent less path
  double claimed_rad = 0.0;                                  ///< what the tracker says of the tangent, RMS
  double off_by_direction = 0.0, off_by_direction_sd = 0.0;  ///< slope, and its sd by leaving out each folder in turn
  double agar_by_direction = 0.0;  ///< the slope that the slip of agar, (25), would give, were the tangent e3 of {B}
};
Headings compare_headings(const std::vector<SeenFrame>& axis);

/// What a second look at some of the frames says of the labels.
struct Repeatability {
  int looks = 0;
  double across_sd_px = 0.0, along_sd_px = 0.0;            ///< of one look: of the differences, over sqrt 2
  double across_95_px = 0.0, along_95_px = 0.0;            ///< 95 % of the differences
  double across_of_opinion = 1.0, along_of_opinion = 1.0;  ///< the same over what the labeller thought
};
Repeatability repeatability(const std::vector<TipLabel>& labels, const std::vector<TipLabel>& again);

/// One labelled frame: error in the directions of the tip found, px.
struct LabelError {
  const TipLabel* label = nullptr;
  const SeenFrame* seen = nullptr;
  double across_px = 0.0, along_px = 0.0;  ///< along: positive beyond the label
  double squared = 0.0;                    ///< normalised by the covariance claimed and the label's own
};

struct LabelFigures {
  int labels = 0, ok = 0, beyond_6_px = 0;
  std::array<int, camera::kTipStatuses> by_status{};
  std::vector<LabelError> errors;  ///< of those that are ok
  double squared = 0.0;            ///< mean over both axes of the normalised squared error, 1 if honest
};
/// The labels' own error is the labeller's opinion times what the second look says of it.
LabelFigures compare(const std::vector<TipLabel>& labels, const std::vector<SeenFrame>& seen, const std::string& set,
                     const Repeatability& second_look);

/// The middle 95 % of what percentile(values, share) is, drawn again and again from `values` (bootstrap, seed fixed).
struct Interval {
  double low = 0.0, high = 0.0;
};
Interval interval_of_percentile(const std::vector<double>& values, double share);
void print(const char* name, const LabelFigures& figures);

/// Value below which the share `share` of `values` lies; NaN of none.
double percentile(std::vector<double> values, double share);

}  // namespace bevel::test
