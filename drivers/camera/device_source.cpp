// Frames from a Video4Linux device.
#include <cmath>
#include <ctime>
#include <opencv2/imgproc.hpp>

#include "drivers/camera/frame_sources.hpp"

namespace bevel::camera {
namespace {

int64_t clock_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000;
}

/// The driver stamps buffers on the monotonic clock; the project's stamps count from the epoch.
int64_t capture_utime(double driver_ms) {
  constexpr int64_t plausible_age_us = 2'000'000;
  const int64_t realtime_us = clock_us(CLOCK_REALTIME);
  const int64_t age_us = clock_us(CLOCK_MONOTONIC) - std::llround(driver_ms * 1000.0);
  // A driver that stamps on another clock, or not at all, leaves the time of arrival as the best there is.
  const bool trusted = std::isfinite(driver_ms) && driver_ms > 0.0 && age_us >= 0 && age_us < plausible_age_us;
  return trusted ? realtime_us - age_us : realtime_us;
}

}  // namespace

DeviceSource::DeviceSource(const SourceConfig& config) : config_(config), capture_(1) {
  cv::VideoCapture& device = capture_.front();
  if (!device.open(config.path, cv::CAP_V4L2))
    throw SourceError("source path '" + config.path + "': not a Video4Linux device, or it is in use");
  const std::string& c = config.fourcc;
  device.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc(c[0], c[1], c[2], c[3]));
  device.set(cv::CAP_PROP_FRAME_WIDTH, config.width_px);
  device.set(cv::CAP_PROP_FRAME_HEIGHT, config.height_px);
  device.set(cv::CAP_PROP_FPS, config.rate_hz);
  device.set(cv::CAP_PROP_BUFFERSIZE, 1);
  const int width_px = static_cast<int>(device.get(cv::CAP_PROP_FRAME_WIDTH));
  const int height_px = static_cast<int>(device.get(cv::CAP_PROP_FRAME_HEIGHT));
  // A calibration belongs to one picture size, so a driver that chose another is not accepted in silence.
  if (width_px != config.width_px || height_px != config.height_px)
    throw SourceError("source size " + std::to_string(config.width_px) + "x" + std::to_string(config.height_px) +
                      ": '" + config.path + "' offers " + std::to_string(width_px) + "x" + std::to_string(height_px));
  const double rate_hz = device.get(cv::CAP_PROP_FPS);
  period_us_ = std::llround(1e6 / (rate_hz > 0.1 ? rate_hz : config.rate_hz));
}

int64_t DeviceSource::count_lost(int64_t stamp_utime) {
  if (last_utime_ == 0) return 0;
  const int64_t periods = (stamp_utime - last_utime_ + period_us_ / 2) / period_us_;
  return periods > 1 ? periods - 1 : 0;
}

FrameResult DeviceSource::next(std::chrono::milliseconds timeout) {
  cv::VideoCapture& device = capture_.front();
  try {
    std::vector<int> ready;
    if (!cv::VideoCapture::waitAny(capture_, ready, std::chrono::nanoseconds(timeout).count())) return FrameTimeout{};
    cv::Mat picture;
    if (!device.grab() || !device.retrieve(picture) || picture.empty())
      return SourceFailure{"'" + config_.path + "': the device gave no frame (unplugged?)"};
    Frame frame;
    frame.capture_utime = capture_utime(device.get(cv::CAP_PROP_POS_MSEC));
    if (picture.channels() == 1)
      frame.gray = picture.clone();
    else
      cv::cvtColor(picture, frame.gray, cv::COLOR_BGR2GRAY);
    seq_ += count_lost(frame.capture_utime);  // OpenCV hides the driver's counter; the stamps show the gaps
    frame.seq = seq_++;
    frame.camera = config_.camera;
    last_utime_ = frame.capture_utime;
    return frame;
  } catch (const cv::Exception& error) {
    return SourceFailure{"'" + config_.path + "': " + error.what()};
  }
}

}  // namespace bevel::camera
