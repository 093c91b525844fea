// SPDX-License-Identifier: MIT
#include <bevel/nodes/camera_pictures.hpp>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include <bevel/error.hpp>

namespace bevel::nodes {
namespace {

constexpr int kLargest_px = 320;
constexpr int kQuality = 70;  // of 100: a shaft's edge stays, and a picture is about 10 kB

}  // namespace

camera::FrameResult KeptFrame::next(std::chrono::milliseconds timeout) {
  camera::FrameResult got = source_->next(timeout);
  if (const auto* frame = std::get_if<camera::Frame>(&got)) frame_ = *frame;  // shares the pixels
  return got;
}

camera_picture_t make_picture(const camera::Frame& frame, const camera::TipObservation& seen, std::int64_t seq) {
  const double scale = std::min(1.0, static_cast<double>(kLargest_px) / std::max(frame.gray.cols, frame.gray.rows));
  const auto reduced = [scale](int size_px) { return std::max(1, static_cast<int>(std::lround(size_px * scale))); };
  const cv::Size size(reduced(frame.gray.cols), reduced(frame.gray.rows));
  cv::Mat small;
  cv::resize(frame.gray, small, size, 0, 0, cv::INTER_AREA);
  camera_picture_t m{};
  m.utime = seen.capture_utime;
  m.seq = seq;
  m.camera = seen.camera;
  m.status = static_cast<std::int32_t>(seen.status);
  m.width_px = size.width;
  m.height_px = size.height;
  if (seen.status == camera::TipStatus::ok) {
    // Pixels are known by their middles: the edge of the first is at -0.5 in either picture.
    m.tip_px[0] = (seen.tip_px.x + 0.5) * size.width / frame.gray.cols - 0.5;
    m.tip_px[1] = (seen.tip_px.y + 0.5) * size.height / frame.gray.rows - 0.5;
  }
  cv::imencode(".jpg", small, m.jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  m.jpeg_size = static_cast<std::int32_t>(m.jpeg.size());
  return m;
}

PictureClock::PictureClock(double rate_hz) {
  if (!(rate_hz > 0 && rate_hz <= kMostPictures_hz))
    throw ArgumentError("pictures a second: " + std::to_string(rate_hz) + ", allowed: above 0, at most " +
                        std::to_string(static_cast<int>(kMostPictures_hz)));
  period_ns_ = std::llround(1e9 / rate_hz);
}

bool PictureClock::due(std::int32_t camera, std::int64_t now_ns) {
  const auto next = next_ns_.find(camera);
  if (next != next_ns_.end() && now_ns < next->second) return false;
  next_ns_[camera] = now_ns + period_ns_;
  return true;
}

}  // namespace bevel::nodes
