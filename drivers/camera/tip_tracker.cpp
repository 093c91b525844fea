#include "drivers/camera/tip_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "drivers/camera/edge_fit.hpp"

namespace bevel::camera {
namespace {

Centreline moved(Centreline line, const cv::Point& by) {
  line.last_row += by.y;
  line.tangent.last_row += by.y;
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
    : config_(config), px_per_mm_(px_per_mm), scale_(ridge_scale(config.needle_diameter_mm * px_per_mm)) {
  check(config_);
  if (!std::isfinite(px_per_mm) || px_per_mm <= 0.0)
    throw std::invalid_argument("tracker px_per_mm is " + std::to_string(px_per_mm) + ", allowed: above 0");
}

void TipTracker::set_background(const cv::Mat& gray) {
  if (gray.empty() || gray.type() != CV_8UC1)
    throw std::invalid_argument("tracker background: not an 8-bit gray picture");
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
  const Canonical turn(config_.entry_side, frame.gray.size());
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
  const double side_px = config_.roi_side_mm * px_per_mm_ + scale_.offset_px;
  const double back_px = config_.fit_length_mm * px_per_mm_ + 4.0 * scale_.core_px;
  const double first_tip_row = std::min(track_->tip.y, predicted.y);
  const double last_tip_row = std::max(track_->tip.y, predicted.y);
  const int top = std::clamp(cvFloor(first_tip_row - back_px), entry_row(turn), size.height - 1);
  const int bottom = std::clamp(cvCeil(last_tip_row + config_.roi_ahead_mm * px_per_mm_), top, size.height - 1);
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
  query.cap_gray = 3.0 * config_.min_contrast_gray;
  // Half the wanted contrast, and well above what texture gives by chance.
  query.threshold_gray = std::max(0.5 * config_.min_contrast_gray, 6.0 * cv::mean(response)[0]);
  const RidgePath path = finder_.find(response, query);
  const int above = search.region.y - entry_row(turn);
  const int window_rows = cvRound(config_.fit_length_mm * px_per_mm_);
  const int end_row = end_of_needle(path, window_rows, 0.4);
  const int trusted_rows = std::max(2 * scale_.core_px, cvRound(0.3 * config_.min_length_mm * px_per_mm_));
  if (path.score < query.threshold_gray * trusted_rows) {
    if (saturated_share(raw, cv::Rect(0, 0, raw.cols, raw.rows)) > config_.saturated_fraction)
      return finish(TipStatus::saturated, "most of the picture is at 255 or 0");
    return found;
  }
  result.visible_length_px = above + end_row;
  if (result.visible_length_px < config_.min_length_mm * px_per_mm_)
    return finish(TipStatus::too_short, "less than min_length_mm visible");
  if (search.full && second_needle(path, query))
    return finish(TipStatus::two_candidates, "a second line with similar evidence");

  measure(patch, path, end_row, found);
  if (result.status != TipStatus::ok) return found;
  const int d = scale_.offset_px;
  const cv::Rect around(cvRound(found.tip.x) - 2 * d, cvRound(found.tip.y) - 2 * d, 4 * d + 1, 4 * d + 1);
  if (saturated_share(raw, around) > config_.saturated_fraction)
    return finish(TipStatus::saturated, "pixels around the tip at 255 or 0");
  if (result.blur_px > config_.max_blur_mm * px_per_mm_)
    return finish(TipStatus::blurred, "the end is smeared over more than max_blur_mm");

  found.tip += cv::Point2d(search.region.tl());
  found.line = moved(found.line, search.region.tl());
  result.tip_px = turn.to_picture(found.tip);
  const double slope = found.line.tangent.slope(found.tip.y);
  const cv::Vec2d forward = cv::normalize(cv::Vec2d(slope, 1.0));
  result.direction_px = turn.direction_to_picture(forward);
  // Turning is a permutation with signs: the covariance turns with its two axes.
  const cv::Vec2d u = turn.direction_to_picture({1.0, 0.0});
  const cv::Vec2d v = turn.direction_to_picture({0.0, 1.0});
  const cv::Matx22d basis(u[0], v[0], u[1], v[1]);
  result.covariance_px2 = basis * result.covariance_px2 * basis.t();
  return found;
}

void TipTracker::measure(const cv::Mat& patch, const RidgePath& path, int end_row, Found& found) const {
  TipResult& result = found.result;
  result.status = result.heading_status = TipStatus::lost;
  result.reason = "no steady centreline";
  const double taper_px = config_.bevel_length_mm * px_per_mm_;
  const int last_shaft_row = end_row - cvRound(0.5 * taper_px) - scale_.core_px;
  const int first_row = std::max(0, end_row - cvRound(config_.fit_length_mm * px_per_mm_));
  std::vector<cv::Point2d> centres;
  centres.reserve(static_cast<size_t>(std::max(0, last_shaft_row - first_row + 1)));
  for (int r = first_row; r <= last_shaft_row; ++r) {
    const double col = centre_in_row(patch, r, path.cols[static_cast<size_t>(r)], scale_);
    if (std::isfinite(col)) centres.emplace_back(col, r);
  }
  found.line = fit_centreline(
      centres, {config_.correlation_px, config_.heading_correlation_px, config_.curvature_sigma_per_mm / px_per_mm_,
                config_.curvature_change_per_mm / px_per_mm_});
  if (found.line.rows_used == 0) return;

  result.reason = "the end of the needle is not seen";
  const int back_px = std::min(end_row, cvRound(1.5 * taper_px) + 6 * scale_.core_px);
  const int ahead_px = cvRound(taper_px) + 4 * scale_.core_px;
  std::vector<double> s;
  std::vector<double> profile;
  for (int i = -back_px; i <= ahead_px; ++i) {
    const cv::Point2d p = found.line.along(end_row, i);
    const bool inside = p.y >= 0.0 && p.y <= patch.rows - 1.0 && p.x >= scale_.offset_px + 1.0 &&
                        p.x <= patch.cols - scale_.offset_px - 2.0;
    if (!inside) continue;
    s.push_back(i);
    profile.push_back(darkness_across(patch, p, found.line.slope(p.y), scale_));
  }
  if (s.size() < 16 || s.back() < 0.5 * taper_px + 2.0) return;
  std::vector<double> shaft(profile.begin(), profile.begin() + static_cast<std::ptrdiff_t>(profile.size() / 4 + 1));
  const auto middle = shaft.begin() + static_cast<std::ptrdiff_t>(shaft.size() / 2);
  std::nth_element(shaft.begin(), middle, shaft.end());
  const int blur_rows = std::min(60, found.line.rows_used);
  const double lens_blur_px = blur_across_px(patch, found.line, last_shaft_row - blur_rows, last_shaft_row,
                                             config_.needle_diameter_mm * px_per_mm_);
  const EdgeGuess guess{0.4 * taper_px, *middle, taper_px, lens_blur_px};
  const EdgeFit edge = fit_edge(s, profile, guess, config_.correlation_px);
  if (!edge.converged || edge.height < 0.4 * config_.min_contrast_gray) return;

  found.tip = found.line.along(end_row, edge.tip_px);
  const double slope = found.line.slope(found.tip.y);
  const cv::Vec2d tangent = cv::normalize(cv::Vec2d(slope, 1.0));
  const cv::Vec2d normal(tangent[1], -tangent[0]);
  const double floor_along_px = config_.floor_along_mm * px_per_mm_;
  const double floor_across_px = config_.floor_across_mm * px_per_mm_;
  const double along = edge.tip_variance_px2 + floor_along_px * floor_along_px;
  const double across =
      found.line.variance_px2(found.tip.y) * tangent[1] * tangent[1] + floor_across_px * floor_across_px;
  result.covariance_px2 = along * (tangent * tangent.t()) + across * (normal * normal.t());
  result.blur_px = std::max(lens_blur_px, edge.blur_px);
  result.taper_px = edge.taper_px;
  result.contrast_gray = edge.height;
  result.status = TipStatus::ok;
  result.reason = {};
  result.direction_variance_rad2 =
      found.line.tangent.angle_variance_rad2(found.tip.y) + config_.floor_heading_rad * config_.floor_heading_rad;
  const bool sure = result.direction_variance_rad2 <= config_.max_heading_sd_rad * config_.max_heading_sd_rad;
  result.heading_status = sure ? TipStatus::ok : TipStatus::unsure;
}

}  // namespace bevel::camera
