// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/tip_tracker.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include <bevel/drivers/camera/needle_end.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

// Narrower than this, a needle is not shrunk further: where it lies is then seen worse. A wider one costs more, and
// shows nothing more but the grain of the sensor.
constexpr double kLeastNeedle_px = 5.0;

Centreline moved(Centreline line, const cv::Point& by) {
  line.last_row += by.y;
  line.coefficient[0] += by.x;
  return line;
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  for (int r = 0; r < a.rows; ++r)
    if (std::memcmp(a.ptr(r), b.ptr(r), static_cast<size_t>(a.cols)) != 0) return false;
  return true;
}

TipResult refused(TipStatus status, std::string_view reason) {
  TipResult result;
  result.status = result.heading_status = status;
  result.reason = reason;
  return result;
}

}  // namespace

std::string_view name_of(TipStatus status) {
  switch (status) {
    case TipStatus::ok:
      return "ok";
    case TipStatus::lost:
      return "lost";
    case TipStatus::too_short:
      return "too_short";
    case TipStatus::saturated:
      return "saturated";
    case TipStatus::two_candidates:
      return "two_candidates";
    case TipStatus::blurred:
      return "blurred";
    case TipStatus::frozen:
      return "frozen";
    case TipStatus::late:
      return "late";
    case TipStatus::unsure:
      return "unsure";
  }
  return "unknown";
}

TipTracker::TipTracker(const TrackerConfig& config, double px_per_mm)
    : config_(config),
      shrink_(std::max(1, static_cast<int>(config.needle_diameter_mm * px_per_mm / kLeastNeedle_px))),
      work_px_per_mm_(px_per_mm / shrink_),
      scale_(ridge_scale(config.needle_diameter_mm * px_per_mm / shrink_)) {
  check(config_);
  if (!std::isfinite(px_per_mm) || px_per_mm <= 0.0)
    throw ArgumentError("tracker px_per_mm is " + std::to_string(px_per_mm) + ", allowed: above 0");
}

void TipTracker::set_background(const cv::Mat& gray) {
  if (gray.empty() || gray.type() != CV_8UC1) throw ArgumentError("tracker background: not an 8-bit gray picture");
  background_ = gray.clone();
}

std::optional<TipResult> TipTracker::refuse_unseen(const Frame& frame, int64_t now_utime) {
  if (frame.gray.empty() || frame.gray.type() != CV_8UC1) return refused(TipStatus::lost, "not an 8-bit gray picture");
  const bool frozen = same_bytes(frame.gray, last_bytes_);
  if (!frozen) frame.gray.copyTo(last_bytes_);
  if (frozen) return refused(TipStatus::frozen, "the same bytes as the frame before");
  if (!follows(frame.capture_utime)) return refused(TipStatus::late, "not newer than the frame before");
  if (now_utime != 0 && now_utime - frame.capture_utime > config_.max_age_us)
    return refused(TipStatus::late, "older than max_age_us");
  if (config_.background == Background::first_frame && background_.empty()) {
    background_ = frame.gray.clone();
    return refused(TipStatus::lost, "taken as the background");
  }
  if (!background_.empty() && background_.size() != frame.gray.size())
    return refused(TipStatus::lost, "not of the size of the background");
  return std::nullopt;
}

bool TipTracker::follows(int64_t utime) {
  if (last_utime_ != 0 && utime <= last_utime_) {
    behind_ = utime > behind_utime_ ? behind_ + 1 : 1;
    behind_utime_ = utime;
    if (behind_ < kSetBack) return false;
    track_.reset();  // its time is of the other clock
  }
  behind_ = 0;
  last_utime_ = utime;
  return true;
}

TipResult TipTracker::track(const Frame& frame, int64_t now_utime, std::optional<cv::Point2d> predicted_tip_px) {
  if (auto refusal = refuse_unseen(frame, now_utime)) return *refusal;
  const Canonical turn(config_.entry_side, frame.gray.size(), shrink_);
  Found found;
  if (track_) {
    const auto elapsed_us = static_cast<double>(frame.capture_utime - track_->utime);
    const cv::Point2d predicted =
        predicted_tip_px ? turn.to_canonical(*predicted_tip_px) : track_->tip + elapsed_us * track_->velocity_px_us;
    found = look(frame.gray, turn, near(turn, predicted));
  }
  if (found.result.status != TipStatus::ok) found = look(frame.gray, turn, whole(turn));
  if (found.result.status != TipStatus::ok) {
    track_.reset();
    return found.result;
  }
  cv::Point2d velocity(0.0, 0.0);
  if (track_) velocity = (found.tip - track_->tip) / static_cast<double>(frame.capture_utime - track_->utime);
  track_ = Track{frame.capture_utime, found.tip, velocity, found.line};
  return found.result;
}

int TipTracker::entry_row(const Canonical& turn) const {
  if (config_.entry_px.x < 0.0 || config_.entry_px.y < 0.0) return 0;
  return std::clamp(cvRound(turn.to_canonical(config_.entry_px).y), 0, turn.size().height - 1);
}

TipTracker::Search TipTracker::whole(const Canonical& turn) const {
  const cv::Size size = turn.size();
  const int top = entry_row(turn);
  Search search;
  search.full = true;
  search.region = cv::Rect(0, top, size.width, size.height - top);
  search.last_col = size.width - 1;
  if (config_.entry_half_width_px >= 0.0) {
    const bool given = config_.entry_px.x >= 0.0 && config_.entry_px.y >= 0.0;
    const double col = given ? turn.to_canonical(config_.entry_px).x : 0.5 * size.width;
    search.first_col = std::max(0, cvFloor(col - config_.entry_half_width_px));
    search.last_col = std::min(size.width - 1, cvCeil(col + config_.entry_half_width_px));
  }
  return search;
}

TipTracker::Search TipTracker::near(const Canonical& turn, const cv::Point2d& predicted) const {
  const cv::Size size = turn.size();
  const double side_px = config_.roi_side_mm * work_px_per_mm_ + scale_.offset_px;
  const double back_px = config_.fit_length_mm * work_px_per_mm_ + 4.0 * scale_.core_px;
  const double first_tip_row = std::min(track_->tip.y, predicted.y);
  const double last_tip_row = std::max(track_->tip.y, predicted.y);
  const int top = std::clamp(cvFloor(first_tip_row - back_px), entry_row(turn), size.height - 1);
  const int bottom = std::clamp(cvCeil(last_tip_row + config_.roi_ahead_mm * work_px_per_mm_), top, size.height - 1);
  const double top_col = track_->line.col(top);
  const double low = std::min({top_col, track_->tip.x, predicted.x}) - side_px;
  const double high = std::max({top_col, track_->tip.x, predicted.x}) + side_px;
  const int left = std::clamp(cvFloor(low), 0, size.width - 1);
  const int right = std::clamp(cvCeil(high), left, size.width - 1);
  Search search;
  search.region = cv::Rect(left, top, right - left + 1, bottom - top + 1);
  const int start = cvRound(top_col) - left;
  search.first_col = start - scale_.offset_px;
  search.last_col = start + scale_.offset_px;
  return search;
}

cv::Mat TipTracker::working_patch(const cv::Mat& raw, const cv::Mat& gray, const Canonical& turn,
                                  const cv::Rect& region) {
  if (background_.empty()) return raw;
  const cv::Mat empty = turn.crop(background_, region);
  const double gain = cv::mean(gray)[0] / std::max(1.0, cv::mean(background_)[0]);
  // The needle is darker than the background, so most of the range is kept for what lies below zero.
  constexpr double zero_gray = 192.0;
  cv::addWeighted(raw, 1.0, empty, -gain, zero_gray, patch_);
  return patch_;
}

double TipTracker::saturated_share(const cv::Mat& raw, const cv::Rect& area) const {
  const cv::Rect inside = area & cv::Rect(0, 0, raw.cols, raw.rows);
  if (inside.empty()) return 0.0;
  int count = 0;
  for (int r = inside.y; r < inside.y + inside.height; ++r) {
    const uchar* line = raw.ptr<uchar>(r);
    for (int c = inside.x; c < inside.x + inside.width; ++c) count += line[c] == 255 || line[c] == 0 ? 1 : 0;
  }
  return static_cast<double>(count) / inside.area();
}

bool TipTracker::second_needle(const RidgePath& path, const PathQuery& query) {
  response_copy_ = ridge_.last().clone();
  erase_path(response_copy_, path, 2 * scale_.offset_px);
  const RidgePath second = finder_.find(response_copy_, query);
  // A path that crosses empty ground to reach a line elsewhere is no needle from this entry.
  constexpr double covered = 0.8;
  return second.score > config_.second_score_ratio * path.score &&
         share_of_rows_above(second, query.threshold_gray) > covered;
}

TipTracker::Found TipTracker::look(const cv::Mat& gray, const Canonical& turn, const Search& search) {
  Found found;
  TipResult& result = found.result;
  result = refused(TipStatus::lost, "no dark line from the entry side");
  result.full_search = search.full;
  const auto finish = [&](TipStatus status, std::string_view reason) {
    result.status = result.heading_status = status;
    result.reason = reason;
    return found;
  };
  if (search.region.height < 16 || search.region.width < 4 * scale_.offset_px) return found;
  const cv::Mat raw = turn.crop(gray, search.region);
  const cv::Mat patch = working_patch(raw, gray, turn, search.region);
  const cv::Mat& response = ridge_.compute(patch, scale_);

  PathQuery query;
  query.first_col = search.first_col;
  query.last_col = search.last_col;
  query.cap_gray = 4.0 * config_.min_contrast_gray;
  // Half the wanted contrast, and well above what texture gives by chance.
  query.threshold_gray = std::max(0.5 * config_.min_contrast_gray, 6.0 * cv::mean(response)[0]);
  const RidgePath path = finder_.find(response, query);
  const int above = search.region.y - entry_row(turn);
  const int window_rows = cvRound(config_.fit_length_mm * work_px_per_mm_);
  const int end_row = end_of_needle(path, window_rows, scale_.core_px, 0.4);
  const int trusted_rows = std::max(2 * scale_.core_px, cvRound(0.3 * config_.min_length_mm * work_px_per_mm_));
  const double least_gray = std::max(0.75 * config_.min_contrast_gray, query.threshold_gray);
  if (path.score < trusted_rows * least_gray * least_gray / query.cap_gray) {
    if (saturated_share(raw, cv::Rect(0, 0, raw.cols, raw.rows)) > config_.saturated_fraction)
      return finish(TipStatus::saturated, "most of the picture is at 255 or 0");
    return found;
  }
  result.visible_length_px = above + end_row;
  if (result.visible_length_px < config_.min_length_mm * work_px_per_mm_)
    return finish(TipStatus::too_short, "less than min_length_mm visible");
  if (search.full && second_needle(path, query))
    return finish(TipStatus::two_candidates, "a second line with similar evidence");

  measure(patch, path, end_row, found);
  if (result.status != TipStatus::ok && result.status != TipStatus::unsure) return found;
  const int d = scale_.offset_px;
  const cv::Rect around(cvRound(found.tip.x) - 2 * d, cvRound(found.tip.y) - 2 * d, 4 * d + 1, 4 * d + 1);
  if (saturated_share(raw, around) > config_.saturated_fraction)
    return finish(TipStatus::saturated, "pixels around the tip at 255 or 0");
  if (result.blur_px > config_.max_blur_mm * work_px_per_mm_)
    return finish(TipStatus::blurred, "the end is smeared over more than max_blur_mm");

  found.tip += cv::Point2d(search.region.tl());
  found.line = moved(found.line, search.region.tl());
  result.tip_px = turn.to_picture(found.tip);
  const cv::Vec2d forward = cv::normalize(cv::Vec2d(found.slope, 1.0));
  result.direction_px = turn.direction_to_picture(forward);
  // Turning is a permutation with signs: the covariance turns with its two axes.
  const cv::Vec2d u = turn.direction_to_picture({1.0, 0.0});
  const cv::Vec2d v = turn.direction_to_picture({0.0, 1.0});
  const cv::Matx22d basis(u[0], v[0], u[1], v[1]);
  const double s = shrink_;
  result.covariance_px2 = s * s * (basis * result.covariance_px2 * basis.t());
  for (double* length_px : {&result.blur_px, &result.bevel_px, &result.visible_length_px}) *length_px *= s;
  return found;
}

void TipTracker::measure(const cv::Mat& patch, const RidgePath& path, int end_row, Found& found) const {
  TipResult& result = found.result;
  result.status = result.heading_status = TipStatus::lost;
  EndSettings settings;
  settings.needle_px = config_.needle_diameter_mm * work_px_per_mm_;
  settings.bevel_px = config_.bevel_length_mm * work_px_per_mm_;
  settings.bevel_log_sd = config_.bevel_length_sd;
  settings.fit_length_px = config_.fit_length_mm * work_px_per_mm_;
  settings.curvature_sigma_per_px = config_.curvature_sigma_per_mm / work_px_per_mm_;
  settings.curvature_change_per_px = config_.curvature_change_per_mm / work_px_per_mm_;
  settings.min_contrast_gray = config_.min_contrast_gray;
  const NeedleEnd end = find_end(patch, path, end_row, scale_, settings);
  result.reason = end.reason;
  if (!end.found) return;
  found.line = end.line;
  found.slope = end.slope_col_per_row;
  const bool axis = config_.tip_point == TipPoint::axis;
  const EndPoint& point = axis ? end.fit.tip : end.fit.seen;
  found.tip = axis ? end.axis_tip : end.seen;
  const cv::Vec2d& tangent = end.tangent;
  const cv::Vec2d normal(tangent[1], -tangent[0]);
  const double floor_along_px = config_.floor_along_mm * work_px_per_mm_;
  const double floor_across_px = config_.floor_across_mm * work_px_per_mm_;
  const double along = point.s_variance_px2 + floor_along_px * floor_along_px;
  const double across = point.across_variance_px2 + floor_across_px * floor_across_px;
  result.covariance_px2 = along * (tangent * tangent.t()) + across * (normal * normal.t());
  result.blur_px = end.lens_blur_px;
  result.bevel_px = end.fit.bevel_px;
  result.bevel_roll_rad = end.fit.roll_rad;
  result.contrast_gray = end.contrast_gray;
  const double max_sd_px = config_.max_along_sd_mm * work_px_per_mm_;
  if (along > max_sd_px * max_sd_px || !end.doubt.empty()) {
    result.status = result.heading_status = TipStatus::unsure;
    result.reason = end.doubt.empty() ? "where the needle ends is in doubt" : end.doubt;
    return;
  }
  result.status = TipStatus::ok;
  result.reason = {};
  result.direction_variance_rad2 = end.fit.slope_variance + config_.floor_heading_rad * config_.floor_heading_rad;
  const bool sure = result.direction_variance_rad2 <= config_.max_heading_sd_rad * config_.max_heading_sd_rad;
  result.heading_status = sure ? TipStatus::ok : TipStatus::unsure;
}

}  // namespace bevel::camera
