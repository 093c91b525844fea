// SPDX-License-Identifier: MIT
#pragma once
// The tip of a dark needle in the frames of one camera. Steps: region of interest from the estimate or the last tips
// (whole picture when lost), background and illumination gain, ridge response and best path (ridge_path.hpp), sub-pixel
// centreline (centreline.hpp), the model of a bevelled end fitted to darkness and its moments along it (end_fit.hpp):
// tip, axis and tangent with the covariance of that fit. A frame in which any of this is in doubt gets a status instead
// of a position. docs/camera.md says what the tip is and how wrong it is.
//
// The tip is the point of the shaft's AXIS at the depth of the foremost point of the bevel: it does not move when the
// needle is rotated in place, whereas the foremost point itself circles the axis at half the diameter. On request
// (TipPoint::seen) it is what an eye marks.
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include <bevel/drivers/camera/canonical.hpp>
#include <bevel/drivers/camera/frame.hpp>
#include <bevel/drivers/camera/needle_end.hpp>
#include <bevel/drivers/camera/ridge_path.hpp>
#include <bevel/drivers/camera/tracker_config.hpp>

namespace bevel::camera {

/// Values are those of tip_measurement_t.status and tip_heading_t.status.
enum class TipStatus : int32_t {
  ok = 0,
  lost = 1,            ///< no needle found, or its end not seen
  too_short = 2,       ///< less than min_length_mm visible
  saturated = 3,       ///< over- or underexposed where the tip is
  two_candidates = 4,  ///< a second needle with similar evidence
  blurred = 5,         ///< the end is smeared over more than max_blur_mm
  frozen = 6,          ///< the same bytes as the frame before
  late = 7,            ///< older than max_age_us, or not newer than the frame before
  unsure = 8,          ///< the end is in doubt; of a heading alone: its standard deviation is above max_heading_sd_rad
};
inline constexpr size_t kTipStatuses = 9;
std::string_view name_of(TipStatus status);

struct TipResult {
  TipStatus status = TipStatus::lost;
  std::string_view reason;                     ///< one phrase, static storage; empty when ok
  cv::Point2d tip_px;                          ///< (u, v) and the rest: meaningful only when ok
  cv::Vec2d direction_px;                      ///< unit vector of the shaft at the tip, pointing forward
  cv::Matx22d covariance_px2;                  ///< of tip_px
  double direction_variance_rad2 = 0.0;        ///< of the angle of direction_px in the picture
  TipStatus heading_status = TipStatus::lost;  ///< whether direction_px is worth to be measured by; `status` unless ok
  double blur_px = 0.0;
  double bevel_px = 0.0;        ///< length of the cut, as fitted
  double bevel_roll_rad = 0.0;  ///< of the cut as the picture shows it (bevel_shape.hpp), -pi/2 to pi/2
  double contrast_gray = 0.0;
  double visible_length_px = 0.0;
  bool full_search = false;  ///< the whole picture was searched
};

class TipTracker {
 public:
  /// `px_per_mm` of the view. Throws ArgumentError (tracker_config.hpp).
  TipTracker(const TrackerConfig& config, double px_per_mm);

  /// `now_utime`: the time of the call, for `late`; 0 where age has no meaning (files).
  /// `predicted_tip_px`: where the estimator expects the tip; otherwise constant velocity from the last two tips.
  TipResult track(const Frame& frame, int64_t now_utime = 0, std::optional<cv::Point2d> predicted_tip_px = {});

  /// Picture without a needle, of the size of the frames; replaces the one taken from the first frame.
  void set_background(const cv::Mat& gray);
  /// Forgets the last tips: the next frame is searched as a whole.
  void forget() { track_.reset(); }

 private:
  struct Track {  // canonical coordinates of the whole picture
    int64_t utime = 0;
    cv::Point2d tip;
    cv::Point2d velocity_px_us;
    Centreline line;
  };
  struct Search {
    cv::Rect region;  // canonical
    int first_col = 0;
    int last_col = 0;  // where a path may enter the region, in its own columns
    bool full = false;
  };
  struct Found {
    TipResult result;
    cv::Point2d tip;     // canonical, whole picture
    Centreline line;     // the same
    double slope = 0.0;  // of the axis at the tip, columns a row
  };

  /// Whether a frame with this stamp goes on from those before. Several that are older than those, but in order among
  /// themselves, come from a clock that was set back: they are the new time, or nothing would be seen until the old
  /// time has come again.
  bool follows(int64_t utime);
  std::optional<TipResult> refuse_unseen(const Frame& frame, int64_t now_utime);
  Search whole(const Canonical& turn) const;
  Search near(const Canonical& turn, const cv::Point2d& predicted) const;
  cv::Mat working_patch(const cv::Mat& raw, const cv::Mat& gray, const Canonical& turn, const cv::Rect& region);
  Found look(const cv::Mat& gray, const Canonical& turn, const Search& search);
  void measure(const cv::Mat& patch, const RidgePath& path, int end_row, Found& found) const;
  bool second_needle(const RidgePath& path, const PathQuery& query);
  double saturated_share(const cv::Mat& raw, const cv::Rect& area) const;
  int entry_row(const Canonical& turn) const;

  TrackerConfig config_;
  int shrink_;  // pixels of the picture to one of those that are worked in
  double work_px_per_mm_;
  RidgeScale scale_;
  RidgeResponse ridge_;
  RidgePathFinder finder_;
  cv::Mat response_copy_;
  cv::Mat background_;
  cv::Mat patch_;
  cv::Mat last_bytes_;
  static constexpr int kSetBack = 3;
  int64_t last_utime_ = 0;    // newest
  int64_t behind_utime_ = 0;  // of the last frame that was not newer, and how many those were in a row and in order
  int behind_ = 0;
  std::optional<Track> track_;
};

}  // namespace bevel::camera
