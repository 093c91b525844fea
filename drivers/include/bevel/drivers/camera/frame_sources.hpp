// SPDX-License-Identifier: MIT
#pragma once
// The adapters behind make_frame_source(); include frame_source.hpp instead unless you are a test.
#include <filesystem>
#include <functional>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/camera/capture_device.hpp>
#include <bevel/drivers/camera/decode.hpp>
#include <bevel/drivers/camera/frame_recorder.hpp>
#include <bevel/drivers/camera/frame_source.hpp>

namespace bevel::camera {

/// Images of a folder in natural order; every readable image extension, nothing else. A folder that was recorded has a
/// frames.csv (frame_recorder.hpp): its order, stamps, numbers and cameras are those.
class FolderSource : public FrameSource {
 public:
  explicit FolderSource(const SourceConfig& config);
  FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return remark_; }
  const std::vector<std::filesystem::path>& files() const { return files_; }

 private:
  SourceConfig config_;
  std::vector<std::filesystem::path> files_;
  std::vector<RecordedFrame> recorded_;  // of the files, or empty
  size_t next_ = 0;
  int bits_ = 8;  // per sample, at least, of the files so far: one brightness scale for all of them
  std::string remark_;
};

/// Stamped by the container's own times, from its first frame on. A file that ends before the length that it states is
/// a failure after its last good frame.
class VideoSource : public FrameSource {
 public:
  explicit VideoSource(const SourceConfig& config);
  FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return remark_; }

 private:
  std::optional<std::string> missing() const;

  SourceConfig config_;
  cv::VideoCapture capture_;
  int64_t seq_ = 0;
  int64_t last_us_ = 0;  // of the last frame, in the file's time
  bool ended_ = false;
  std::string remark_;
};

/// Video4Linux: the newest frame that the driver calls whole, by its own number and capture time.
class DeviceSource : public FrameSource {
 public:
  explicit DeviceSource(const SourceConfig& config);
  DeviceSource(const SourceConfig& config, std::unique_ptr<CaptureDevice> device, std::function<ClockPair()> clocks);
  FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return orientation_remark(config_.path, orientation_); }

 private:
  std::optional<FrameResult> newest();

  SourceConfig config_;
  std::unique_ptr<CaptureDevice> device_;
  std::function<ClockPair()> clocks_;
  BufferCount count_;
  int orientation_ = 1;  // of the first MJPEG frame that carries another
  bool failed_ = false;
};

/// Raw frames of frame_stream.hpp over a Unix socket.
class StreamSource : public FrameSource {
 public:
  explicit StreamSource(const SourceConfig& config);
  ~StreamSource() override;
  FrameResult next(std::chrono::milliseconds timeout) override;

 private:
  FrameResult fail(const std::string& text);

  std::string path_;
  int socket_ = -1;
  std::vector<unsigned char> head_;  // bytes of the header received so far
  Frame frame_;                      // being filled
  size_t body_received_ = 0;
  bool failed_ = false;
};

}  // namespace bevel::camera
