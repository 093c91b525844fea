// SPDX-License-Identifier: MIT
// Frames from a Video4Linux device.
#include <linux/videodev2.h>

#include <thread>

#include <bevel/drivers/camera/frame_sources.hpp>

namespace bevel::camera {

DeviceSource::DeviceSource(const SourceConfig& config) : DeviceSource(config, open_video4linux(config), read_clocks) {}

DeviceSource::DeviceSource(const SourceConfig& config, std::unique_ptr<CaptureDevice> device,
                           std::function<ClockPair()> clocks)
    : config_(config), device_(std::move(device)), clocks_(std::move(clocks)) {}

// All that were filled are taken, the newest good one is looked at: a tracker that fell behind catches up at once.
std::optional<FrameResult> DeviceSource::newest() {
  std::optional<CapturedBuffer> best;
  BufferCount::Stamp stamp;
  for (;;) {
    const auto taken = device_->take();
    if (const auto* gone = std::get_if<DeviceGone>(&taken)) {
      failed_ = true;
      return SourceFailure{gone->text};
    }
    const auto* buffer = std::get_if<CapturedBuffer>(&taken);
    if (buffer == nullptr) break;
    const auto counted = count_.count(*buffer, clocks_());
    if ((buffer->flags & V4L2_BUF_FLAG_ERROR) != 0) {  // the driver knows that bytes are missing or wrong
      device_->give_back(buffer->index);
      continue;
    }
    if (best) device_->give_back(best->index);
    best = *buffer;
    stamp = counted;
  }
  if (!best) return std::nullopt;
  Frame frame;
  int orientation = 1;
  frame.gray = gray_of(device_->layout(), best->bytes, &orientation);
  if (orientation_ == 1) orientation_ = orientation;
  device_->give_back(best->index);
  if (frame.gray.empty()) return std::nullopt;  // fewer bytes than a picture has: lost, as its number shows
  frame.capture_utime = stamp.utime;
  frame.stamped_on_arrival = !stamp.driver;
  frame.seq = stamp.seq;
  frame.camera = config_.camera;
  return frame;
}

FrameResult DeviceSource::next(std::chrono::milliseconds timeout) {
  if (failed_) return EndOfFrames{};
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (!device_->wait(std::max(left, std::chrono::milliseconds(0)))) return FrameTimeout{};
    if (auto frame = newest()) return std::move(*frame);
    if (std::chrono::steady_clock::now() >= deadline) return FrameTimeout{};
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // a device in error is ready at once, with nothing
  }
}

}  // namespace bevel::camera
