// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Tracker of the tip of a dark needle in the frames of one camera. Steps: region of interest from the estimate or the
/// last tips (the whole image after a loss), background and illumination gain, ridge response and best path
/// (ridge_path.hpp), sub-pixel centreline (centreline.hpp), the model of a bevelled end fitted to darkness and its
/// moments (end_fit.hpp). The result is tip, axis and tangent with the covariance of that fit. If any of these is in
/// doubt, the frame has a status instead of a position. docs/camera.md defines the tip and states the errors.
///
/// The tip is the point of the shaft's AXIS at the depth of the foremost point of the bevel. It is stationary when the
/// needle is rotated in place, whereas the foremost point circles the axis at half the diameter. With TipPoint::seen it
/// is the point that an observer would mark.
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

/// Status of a frame. The values are those of tip_measurement_t.status and tip_heading_t.status.
enum class TipStatus : int32_t {
  ok = 0,              ///< valid position
  lost = 1,            ///< no needle found, or its end not seen
  too_short = 2,       ///< less than min_length_mm visible
  saturated = 3,       ///< over- or underexposed at the tip
  two_candidates = 4,  ///< a second needle with similar evidence
  blurred = 5,         ///< the end is smeared over more than max_blur_mm
  frozen = 6,          ///< identical bytes as the previous frame
  late = 7,            ///< older than max_age_us, or not newer than the previous frame
  /// The end is in doubt; for a heading alone: its standard deviation is above max_heading_sd_rad.
  unsure = 8,
};
inline constexpr size_t kTipStatuses = 9;  ///< number of statuses
/// Returns the name of a status.
/// @param status status
/// @return static string
std::string_view name_of(TipStatus status);

/// Result for one frame. The members from tip_px on are valid only if the status is ok.
struct TipResult {
  TipStatus status = TipStatus::lost;          ///< status of the frame
  std::string_view reason;                     ///< reason of the status in one phrase, static storage; empty if ok
  cv::Point2d tip_px;                          ///< tip, pixel (u, v)
  cv::Vec2d direction_px;                      ///< unit vector of the shaft at the tip, forward
  cv::Matx22d covariance_px2;                  ///< covariance of tip_px, px^2
  double direction_variance_rad2 = 0.0;        ///< variance of the angle of direction_px in the image, rad^2
  TipStatus heading_status = TipStatus::lost;  ///< status of direction_px as a measurement; `status` unless that is ok
  double blur_px = 0.0;                        ///< standard deviation of the lens blur, px
  double bevel_px = 0.0;                       ///< fitted length of the cut, px
  double bevel_roll_rad = 0.0;     ///< roll of the cut as the image shows it (bevel_shape.hpp), -pi/2 to pi/2
  double contrast_gray = 0.0;      ///< darkness of the shaft relative to the surroundings, grey levels
  double visible_length_px = 0.0;  ///< visible length of the needle, px
  bool full_search = false;        ///< the whole picture was searched
};

/// Tracks the tip in the frames of one camera.
class TipTracker {
 public:
  /// Creates a tracker.
  /// @param config    settings
  /// @param px_per_mm scale of the view, px/mm
  /// @throws ArgumentError naming the key, the value and what is allowed
  TipTracker(const TrackerConfig& config, double px_per_mm);

  /// Processes a frame.
  /// @param frame            frame
  /// @param now_utime        present time for TipStatus::late, us since the epoch; 0 if age has no meaning (files)
  /// @param predicted_tip_px tip that the estimator expects, pixel (u, v); empty: constant velocity from the last two
  /// tips
  /// @return result
  TipResult track(const Frame& frame, int64_t now_utime = 0, std::optional<cv::Point2d> predicted_tip_px = {});

  /// Sets an image without a needle, which replaces the one taken from the first frame.
  /// @param gray image, CV_8UC1, of the size of the frames
  /// @throws ArgumentError if the image is empty or not CV_8UC1
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
  int shrink_;  // pixels of the image in one pixel of the working image
  double work_px_per_mm_;
  RidgeScale scale_;
  RidgeResponse ridge_;
  RidgePathFinder finder_;
  cv::Mat response_copy_;
  cv::Mat background_;
  cv::Mat patch_;
  cv::Mat last_bytes_;
  static constexpr int kSetBack = 3;
  int64_t last_utime_ = 0;  // newest
  // Time of the last frame that was not newer, and the number of such frames in a row and in order.
  int64_t behind_utime_ = 0;
  int behind_ = 0;
  std::optional<Track> track_;
};

}  // namespace bevel::camera
